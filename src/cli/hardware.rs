//! `groundloop hardware`: plays the camera and the robot of a run file for a run in another process.

use std::path::PathBuf;

use super::camera::terminated;
use super::{Failure, out};
use crate::actors::Monitor;
use crate::run::{ConfigError, HardwarePorts, load_run};
use crate::transport::topics::{CAMERA_RGB, ROBOT_STATE};
use crate::transport::wire::{DeviceHeader, FrameHeader, RobotStateRecord};
use crate::transport::{Bus, BusConfig};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The run file, or the name of a shipped one: its `[camera]`, `[robot]` and `[sim]`.
    config: PathBuf,
    /// Overrides a key of the run file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// The name of the run that they serve.
    #[arg(long, value_name = "NAME")]
    run: String,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let config = load_run(&args.config, &args.sets)?;
    let folder = config.domain_folder()?;
    let ports = HardwarePorts::build(&config, &folder)?;
    let is_played = ports.others.iter().any(|(_, camera)| camera.open.is_some());
    if ports.camera.open.is_none() && ports.robot.open.is_none() && !is_played {
        return Err(Failure::from(ConfigError::Value {
            key: "camera.kind".to_owned(),
            expected: "a camera or a robot that this process can play".to_owned(),
            got: config.camera.kind.clone(),
        }));
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(Failure::internal)?;
    runtime.block_on(async {
        let bus = Bus::open(&BusConfig::for_run(args.run.clone()))?;
        if ports.robot.open.is_some() {
            bus.refuse_second::<DeviceHeader, RobotStateRecord>(&ROBOT_STATE)?;
        }
        if ports.camera.open.is_some() {
            bus.refuse_second::<FrameHeader, u8>(&CAMERA_RGB)?;
        }
        let mut playing = tokio::task::JoinSet::new();
        let names: Vec<&str> = ports
            .actors(&bus, &Monitor::default())
            .iter()
            .map(|spec| {
                playing.spawn((spec.serve)());
                spec.name
            })
            .collect();
        out::note(&format!("playing {} of run \"{}\"", names.join(" and "), args.run));
        tokio::select! {
            ended = playing.join_next() => if let Some(ended) = ended {
                ended.map_err(Failure::internal)?.map_err(Failure::internal)?;
            },
            stopped = tokio::signal::ctrl_c() => stopped.map_err(Failure::internal)?,
            () = terminated() => {}
        }
        Ok(0)
    })
}
