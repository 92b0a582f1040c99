//! A camera of your own: publishes a moving test picture, a red square on grey, to a run.
//!
//! ```console
//! cargo run --release -- run configs/photo_blocksworld.toml --run demo --set 'perception.exemplar={folder="sim_640x480"}' &
//! cargo run --release --example attach_camera -- demo
//! ```
//!
//! It publishes until it is stopped (Ctrl-C); the run may come before or after it.

#![expect(clippy::print_stderr, reason = "an example says what is wrong")]

use std::process::ExitCode;
use std::time::Duration;

use groundloop::clock::monotonic_ns;
use groundloop::transport::topics::CAMERA_RGB;
use groundloop::transport::wire::{FrameHeader, SCHEMA};
use groundloop::transport::{Bus, BusConfig, Publisher, TransportError};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;
const PERIOD: Duration = Duration::from_millis(100);

/// The picture of one frame, RGB8, row by row: the square moves by one column per frame.
fn picture(sequence: u64) -> Vec<u8> {
    let left = (sequence % u64::from(WIDTH - 80)) as u32;
    let is_square = |x: u32, y: u32| (left..left + 80).contains(&x) && (200..280).contains(&y);
    (0..WIDTH * HEIGHT)
        .flat_map(|i| if is_square(i % WIDTH, i / WIDTH) { [200, 40, 40] } else { [40; 3] })
        .collect()
}

async fn publish(run: String) -> Result<(), TransportError> {
    // The same root and prefix as the run's: the defaults.
    let bus = Bus::open(&BusConfig::for_run(run))?;
    let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB)?;
    let mut ticks = tokio::time::interval(PERIOD);
    let mut sequence = 0;
    loop {
        ticks.tick().await;
        let header = FrameHeader {
            schema: SCHEMA,
            sequence,
            capture_ns: monotonic_ns(),
            width: WIDTH,
            height: HEIGHT,
            stride: WIDTH * 3,
            // With `has_intrinsics` and `has_pose`, and depth on `CAMERA_DEPTH`, a robot can act.
            ..FrameHeader::default()
        };
        frames.publish(header, &picture(sequence))?;
        sequence += 1;
    }
}

#[tokio::main]
async fn main() -> ExitCode {
    let Some(run) = std::env::args().nth(1) else {
        eprintln!("usage: attach_camera NAME");
        return ExitCode::from(2);
    };
    let Err(error) = publish(run).await else { return ExitCode::SUCCESS };
    eprintln!("error: {error}");
    ExitCode::FAILURE
}
