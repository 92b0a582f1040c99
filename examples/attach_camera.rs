//! A camera of your own: publishes a moving test picture to a run.
//!
//! ```console
//! cargo run --release --example attach_camera -- NAME
//! ```

use groundloop::transport::topics::CAMERA_RGB;
use groundloop::transport::wire::{FrameHeader, SCHEMA};
use groundloop::transport::{Bus, BusConfig, Publisher};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let run = std::env::args().nth(1).ok_or("usage: attach_camera NAME")?;
    // The same root and prefix as the run's: the defaults.
    let bus = Bus::open(&BusConfig::for_run(run))?;
    let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB)?;
    let mut ticks = tokio::time::interval(std::time::Duration::from_millis(100));
    for sequence in 0.. {
        ticks.tick().await;
        let pixels: Vec<u8> = (0..WIDTH * HEIGHT)
            .flat_map(|i| [(i % WIDTH) as u8, (i / WIDTH) as u8, sequence as u8])
            .collect();
        let header = FrameHeader {
            schema: SCHEMA,
            sequence,
            capture_ns: groundloop::clock::monotonic_ns(),
            width: WIDTH,
            height: HEIGHT,
            stride: WIDTH * 3,
            // With `has_intrinsics` and `has_pose`, and depth on `CAMERA_DEPTH`, a robot can act.
            ..FrameHeader::default()
        };
        frames.publish(header, &pixels)?;
    }
    Ok(())
}
