//! Recordings: pictures of ROS 2 and Foxglove in an MCAP file.

mod foxglove;
mod pictures;
mod ros;
mod source;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;
use tokio::time::{Instant, sleep_until};

use super::calibration::{Known, Viewpoint};
use super::encodings::YuvColours;
use super::{Camera, CameraError, CameraPort, NextFrame, OpenCamera};
use crate::clock::monotonic_ns;
use crate::geometry::CameraModel;
use crate::messages::Frame;
use crate::parts::{Part, PartContext, PartError, options_of};
use source::{Glance, RecordedFrame, Recording, Topics, info_topic};

/// `[camera.options]` of the kind "mcap".
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Options {
    /// The recording, an MCAP file.
    path: String,
    /// The topic with the pictures: `sensor_msgs/msg/Image` or `CompressedImage` of ROS 2, or
    /// `foxglove.RawImage` or `CompressedImage`.
    topic: String,
    /// The topic with depth as 16UC1 or 32FC1. Depth belongs to a picture of its size with a stamp within
    /// 16 ms. Without it there is no depth.
    depth_topic: Option<String>,
    /// The topic with the camera's calibration. Without it the neighbour `camera_info` of the pictures.
    info_topic: Option<String>,
    /// Frames per second; without it as they were recorded.
    rate_hz: Option<f64>,
    /// Whether it is played from its beginning again once it has ended.
    again: bool,
    /// What Y, U and V are, where the encoding has them.
    yuv: YuvColours,
    /// A calibration instead of the recorded one: `camera_info` of ROS, or `FileStorage` of `OpenCV`, in YAML.
    intrinsics: Option<String>,
    /// Focal lengths and principal point fx, fy, cx, cy at the size of the frames, instead of a calibration.
    intrinsics_px: Option<[f64; 4]>,
    /// Where the camera stands in the world: x, y, z in metres, and the quaternion x, y, z, w that turns
    /// camera axes (x right, y down, z forward) to world axes.
    pose: Option<[f64; 7]>,
}

/// The entry of the table of cameras.
pub(super) const CAMERA: Part<CameraPort> = Part {
    name: "mcap",
    help: "pictures of ROS 2 or Foxglove from a recording, an MCAP file",
    options: options_of::<Options>(),
    build,
};

fn build(context: &PartContext<'_, CameraPort>) -> Result<Box<CameraPort>, PartError> {
    let options: Options = context.options()?;
    let path = context.path(&options.path);
    let topics = Topics {
        depth: options.depth_topic,
        calibration: options.info_topic.unwrap_or_else(|| info_topic(&options.topic)),
        colour: options.topic,
        yuv: options.yuv,
    };
    let glance = Recording::open(&path, &topics).and_then(Recording::glance);
    let Glance { size, calibration } =
        glance.map_err(|error| PartError::Inputs { reason: error.to_string() })?;
    let known = Known {
        intrinsics: options.intrinsics.as_deref(),
        intrinsics_px: options.intrinsics_px,
        pose: options.pose,
    };
    let whence = format!("{}: {}", path.display(), topics.calibration);
    let model = Viewpoint::read(context, known)?.or_else(&whence, calibration).model(size)?;
    let playing = Playing { path, topics, size, model, is_again: options.again };
    let pace = options.rate_hz.map(|rate_hz| Duration::from_secs_f64(1.0 / rate_hz));
    let open: OpenCamera =
        Arc::new(move || Ok(Box::new(RecordedCamera::open(playing.clone(), pace)?)));
    Ok(Box::new(CameraPort { open: Some(open), image_size: Some(size), ..CameraPort::default() }))
}

/// What is played.
#[derive(Debug, Clone)]
struct Playing {
    path: PathBuf,
    topics: Topics,
    size: [u32; 2],
    model: Option<CameraModel>,
    is_again: bool,
}

/// Plays a recording.
struct RecordedCamera {
    playing: Playing,
    recording: Recording,
    /// Time between frames; `None`: as recorded.
    pace: Option<Duration>,
    /// When the first frame since the beginning was due, and what the recorder's clock said, nanoseconds.
    began: Option<(Instant, u64)>,
    /// When the last frame was due.
    due: Option<Instant>,
    n_since_beginning: u64,
    frame: Frame,
    n_shown: u64,
}

impl RecordedCamera {
    fn open(playing: Playing, pace: Option<Duration>) -> Result<Self, CameraError> {
        let recording = Recording::open(&playing.path, &playing.topics)?;
        let [width, height] = playing.size;
        let frame = Frame { width, height, model: playing.model, ..Frame::default() };
        Ok(Self {
            playing,
            recording,
            pace,
            began: None,
            due: None,
            n_since_beginning: 0,
            frame,
            n_shown: 0,
        })
    }

    /// The next frame of the size of the first; those of another one are told and passed over.
    fn read(&mut self) -> Result<Option<RecordedFrame>, CameraError> {
        loop {
            let Some(frame) = self.recording.next()? else {
                if !self.playing.is_again || self.n_since_beginning == 0 {
                    return Ok(None);
                }
                self.recording = Recording::open(&self.playing.path, &self.playing.topics)?;
                (self.began, self.n_since_beginning) = (None, 0);
                continue;
            };
            if frame.size == self.playing.size {
                self.n_since_beginning += 1;
                return Ok(Some(frame));
            }
            let [[width, height], [is_wide, is_high]] = [self.playing.size, frame.size];
            tracing::warn!(
                "picture skipped: expected {width}x{height} pixels like the first, got {is_wide}x{is_high}"
            );
        }
    }

    /// When a frame is due.
    fn due(&mut self, log_ns: u64) -> Instant {
        let now = Instant::now();
        if let Some(pace) = self.pace {
            // What comes late moves what follows.
            return self.due.map_or(now, |due| (due + pace).max(now));
        }
        let &mut (began, first_ns) = self.began.get_or_insert((now, log_ns));
        let after = Duration::from_nanos(log_ns.saturating_sub(first_ns));
        began.checked_add(after).unwrap_or(now)
    }
}

impl Camera for RecordedCamera {
    fn next(&mut self) -> NextFrame<'_> {
        Box::pin(async {
            let Some(recorded) = self.read()? else { return Ok(None) };
            let due = self.due(recorded.log_ns);
            self.due = Some(due);
            sleep_until(due).await;
            let sequence = self.n_shown;
            self.n_shown += 1;
            (self.frame.sequence, self.frame.capture_ns) = (sequence, monotonic_ns());
            (self.frame.rgb, self.frame.depth_m) = (recorded.rgb, recorded.depth_m);
            Ok(Some(&self.frame))
        })
    }
}
