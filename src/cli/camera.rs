//! `groundloop camera`: a camera in a process of its own. Its kinds and their flags are those of the table of
//! cameras.

use std::path::{Path, PathBuf};

use clap::FromArgMatches;

use super::camera_flags::{Flags, flags_of, kinds};
use super::{Failure, exit, out};
use crate::actors::{Monitor, camera};
use crate::clock::ClockKind;
use crate::files::{FileRef, Folder};
use crate::hardware::{
    CAMERAS, Camera, CameraError, HardwareInputs, NextFrame, OpenCamera, SharedWorld,
};
use crate::messages::MAIN_CAMERA;
use crate::parts::{PartChoice, PartContext};
use crate::pddl::{SourceText, parse_domain};
use crate::run::environment;
use crate::transport::topics::CameraTopics;
use crate::transport::wire::FrameHeader;
use crate::transport::{Bus, BusConfig};

/// Frames per second that can be asked for.
const FPS: std::ops::RangeInclusive<f64> = 0.01..=1000.0;
/// Frames per second of cameras that do not say it themselves.
const FPS_DEFAULT: f64 = 5.0;
/// A domain for cameras, which have none.
const NO_DOMAIN: &str = "(define (domain none))";

/// What every kind is told.
#[derive(Debug, Clone, clap::Args)]
struct Common {
    /// The name of the run that looks.
    #[arg(long, value_name = "NAME")]
    run: String,
    /// The camera of the run that it is: "main", or the name of a `[cameras.NAME]`.
    #[arg(long, value_name = "NAME", default_value = MAIN_CAMERA)]
    camera: String,
    /// Frames per second: 5 without it, or what the camera says itself.
    #[arg(long, value_name = "HZ")]
    fps: Option<f64>,
    /// Stops after this many frames; without it, goes on until it is stopped.
    #[arg(long, value_name = "N")]
    frames: Option<u64>,
}

/// One kind of camera with its options.
#[derive(Debug)]
pub(super) struct Args {
    kind: &'static str,
    options: toml::Table,
    common: Common,
}

impl clap::Args for Args {
    fn augment_args(command: clap::Command) -> clap::Command {
        let command = command.subcommand_required(true).subcommand_value_name("KIND");
        kinds().fold(command, |command, part| {
            let kind = Common::augment_args(flags_of(part, clap::Command::new(part.name)));
            command.subcommand(kind.about(format!("Publish {}", part.help)))
        })
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Args {
    fn from_arg_matches(matches: &clap::ArgMatches) -> Result<Self, clap::Error> {
        let chosen = matches.subcommand();
        let found = chosen.and_then(|(name, own)| Some((kinds().find(|p| p.name == name)?, own)));
        let Some((part, own)) = found else {
            return Err(clap::Error::new(clap::error::ErrorKind::MissingSubcommand));
        };
        let common = Common::from_arg_matches(own)?;
        Ok(Self { kind: part.name, options: Flags::of(part).read(own)?, common })
    }

    fn update_from_arg_matches(&mut self, matches: &clap::ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let Args { kind, common: Common { run, camera: name, frames, .. }, .. } = args;
    let open = opener(args)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .map_err(Failure::internal)?;
    runtime.block_on(async {
        let camera = Counted { camera: open().map_err(failed)?, n_left: *frames };
        let bus = Bus::open(&BusConfig::for_run(run.clone()))?;
        out::note(&format!("publishing {kind} as camera {name} to run \"{run}\""));
        let topics = CameraTopics::of(name);
        bus.refuse_second::<FrameHeader, u8>(&topics.rgb)?;
        let serve = camera::serve((bus, topics), Box::new(camera), Monitor::default());
        tokio::select! {
            ended = serve => ended.map_err(failed)?,
            stopped = tokio::signal::ctrl_c() => stopped.map_err(Failure::internal)?,
            () = terminated() => {}
        }
        Ok(0)
    })
}

/// A camera has failed, or what it needs is not there.
fn failed(error: impl std::fmt::Display) -> Failure {
    Failure { message: error.to_string(), code: exit::MISSING }
}

/// What opens the camera that the flags say.
fn opener(args: &Args) -> Result<OpenCamera, Failure> {
    let Args { kind, options, common: Common { fps, camera: name, .. } } = args;
    if let Some(fps) = fps.filter(|fps| !FPS.contains(fps)) {
        let (min, max) = (FPS.start(), FPS.end());
        return Err(Failure::bad_input(format!("--fps: expected {min} to {max}, got {fps}")));
    }
    let part = CAMERAS.find("KIND", kind).map_err(Failure::bad_input)?;
    let mut options = options.clone();
    // A camera with a rate of its own goes by that.
    if let Some(fps) = fps.filter(|_| part.described().iter().any(|o| o.name == "rate_hz")) {
        options.insert("rate_hz".to_owned(), fps.into());
    }
    let choice = PartChoice::new("KIND", kind).with_options(Some(&options), "");
    let domain = parse_domain(&SourceText::new("camera", NO_DOMAIN)).map_err(Failure::internal)?;
    let inputs = HardwareInputs {
        clock: ClockKind::Realtime,
        camera: name,
        rate_hz: fps.unwrap_or(FPS_DEFAULT),
        seed: 0,
        folder: &Folder::Disk(PathBuf::new()),
        origin: &FileRef::disk(Path::new("")),
        domain: &domain.value,
        sim: None,
        faults: &[],
        world: &SharedWorld::default(),
    };
    let port = CAMERAS.build(&PartContext { choice: &choice, inputs, environment });
    let open = port.map_err(crate::run::ConfigError::from)?.open;
    open.ok_or_else(|| Failure::bad_input(format!("KIND: {kind} is played by another process")))
}

/// Stops after so many frames.
struct Counted {
    camera: Box<dyn Camera>,
    n_left: Option<u64>,
}

impl Camera for Counted {
    fn next(&mut self) -> NextFrame<'_> {
        Box::pin(async {
            match &mut self.n_left {
                Some(0) => return Ok::<_, CameraError>(None),
                Some(n_left) => *n_left -= 1,
                None => {}
            }
            self.camera.next().await
        })
    }
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
