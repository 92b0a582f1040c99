//! Camera actor: capture, publish.

use super::{ActorError, Monitor};
use crate::hardware::Camera;
use crate::transport::convert::{depth_to_bytes, frame_header};
use crate::transport::topics::CameraTopics;
use crate::transport::wire::FrameHeader;
use crate::transport::{Bus, Publisher};

/// Publishes every frame of a camera on its topics: depth first, so that whoever has the pixels has it too.
///
/// # Errors
/// [`ActorError`] when the camera or the bus fails.
pub async fn serve(
    (bus, topics): (Bus, CameraTopics),
    mut camera: Box<dyn Camera>,
    monitor: Monitor,
) -> Result<(), ActorError> {
    let rgb: Publisher<FrameHeader, u8> = bus.publisher(&topics.rgb)?;
    let depth: Publisher<FrameHeader, u8> = bus.publisher(&topics.depth)?;
    loop {
        let frame = camera.next().await;
        let Some(frame) = frame.map_err(|e| ActorError::Part { reason: e.to_string() })? else {
            return Ok(());
        };
        monitor.message(topics.camera).await;
        if let Some(depth_m) = &frame.depth_m {
            depth.publish(frame_header(frame, true), depth_to_bytes(depth_m))?;
        }
        rgb.publish(frame_header(frame, false), &frame.rgb)?;
    }
}
