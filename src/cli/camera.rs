//! `groundloop camera`: a camera in a process of its own.

use std::path::PathBuf;

use clap::Subcommand;

use super::{Failure, out};
use crate::actors::{Monitor, camera};
use crate::hardware::images::{ImageCamera, find_images};
use crate::messages::MAIN_CAMERA;
use crate::transport::topics::CameraTopics;
use crate::transport::wire::FrameHeader;
use crate::transport::{Bus, BusConfig};

/// Frames per second that can be asked for.
const FPS: std::ops::RangeInclusive<f64> = 0.01..=1000.0;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    source: Source,
}

#[derive(Debug, Subcommand)]
enum Source {
    /// Publish the photographs of a folder, or one file, each for a while, again and again.
    Images {
        /// The folder, or one image.
        path: PathBuf,
        /// Frames per second.
        #[arg(long, value_name = "HZ", default_value_t = 5.0)]
        fps: f64,
        /// The name of the run that looks.
        #[arg(long, value_name = "NAME")]
        run: String,
        /// The camera of the run that it is: "main", or the name of a `[cameras.NAME]`.
        #[arg(long, value_name = "NAME", default_value = MAIN_CAMERA)]
        camera: String,
        /// Frames that each photograph is shown for.
        #[arg(long, value_name = "N", default_value_t = 10)]
        repeat: u64,
        /// Stops after this many frames; without it, goes on until it is stopped.
        #[arg(long, value_name = "N")]
        frames: Option<u64>,
    },
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let Source::Images { path, fps, run, camera: name, repeat, frames } = &args.source;
    if !FPS.contains(fps) {
        let (min, max) = (FPS.start(), FPS.end());
        return Err(Failure::bad_input(format!("--fps: expected {min} to {max}, got {fps}")));
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .map_err(Failure::internal)?;
    runtime.block_on(async {
        let n_images = find_images(path).map_err(Failure::bad_input)?.len();
        let camera = ImageCamera::open(path, *fps, *repeat, *frames).map_err(Failure::bad_input)?;
        let bus = Bus::open(&BusConfig::for_run(run.clone()))?;
        out::note(&format!("publishing {n_images} images at {fps} Hz to run \"{run}\""));
        let topics = CameraTopics::of(name);
        bus.refuse_second::<FrameHeader, u8>(&topics.rgb)?;
        let serve = camera::serve((bus, topics), Box::new(camera), Monitor::default());
        tokio::select! {
            ended = serve => ended.map_err(Failure::internal)?,
            stopped = tokio::signal::ctrl_c() => stopped.map_err(Failure::internal)?,
            () = terminated() => {}
        }
        Ok(0)
    })
}

/// Ends when SIGTERM comes: the ports close cleanly.
pub(super) async fn terminated() {
    use tokio::signal::unix::{SignalKind, signal};
    match signal(SignalKind::terminate()) {
        Ok(mut terminate) => {
            terminate.recv().await;
        }
        Err(error) => {
            tracing::warn!(%error, "SIGTERM will not close the ports");
            std::future::pending::<()>().await;
        }
    }
}
