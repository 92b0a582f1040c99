//! The cameras and the robot of a run file, as actors of this process.

use std::time::Duration;

use super::{ConfigError, DomainFolder, RunConfig, environment};
use crate::actors::{ActorError, ActorSpec, Monitor, camera, robot};
use crate::hardware::{CAMERAS, CameraPort, HardwareInputs, ROBOTS, RobotPort, SharedWorld};
use crate::messages::MAIN_CAMERA;
use crate::parts::{PartChoice, PartContext};
use crate::transport::Bus;
use crate::transport::topics::CameraTopics;

/// The cameras and the robot that a run file chooses.
#[derive(Clone)]
#[expect(missing_debug_implementations, reason = "holds closures")]
pub struct HardwarePorts {
    /// Where frames come from.
    pub camera: CameraPort,
    /// Where the frames of other cameras come from, each with its name.
    pub others: Vec<(String, CameraPort)>,
    /// Where commands go.
    pub robot: RobotPort,
    /// How long a robot that moves may go without a command.
    pub command_age_max: Duration,
}

impl HardwarePorts {
    /// Makes the parts of a run file; they are opened when their actors start.
    ///
    /// # Errors
    /// [`ConfigError`] naming the key.
    pub fn build(config: &RunConfig, folder: &DomainFolder) -> Result<Self, ConfigError> {
        let world = SharedWorld::default();
        let inputs = HardwareInputs {
            clock: config.clock,
            camera: MAIN_CAMERA,
            rate_hz: config.camera.rate_hz,
            seed: config.seed,
            folder: &folder.files,
            origin: &config.origin,
            domain: &folder.domain,
            sim: config.sim.as_ref(),
            faults: &config.faults_at_rate(),
            world: &world,
        };
        let camera = |name: &str| -> Result<CameraPort, ConfigError> {
            let choice = &config.camera_choice(name);
            let inputs = HardwareInputs { camera: name, ..inputs };
            Ok(*CAMERAS.build(&PartContext { choice, inputs, environment })?)
        };
        let main = camera(MAIN_CAMERA)?;
        let others = config.other_cameras().map(|name| Ok((name.clone(), camera(name)?)));
        let others = others.collect::<Result<_, ConfigError>>()?;
        let choice = PartChoice::new("robot.kind", &config.robot.kind);
        let choice = &choice.with_options(config.robot.options.as_ref(), config.origin.path());
        let robot = ROBOTS.build(&PartContext { choice, inputs, environment })?;
        let command_age_max = Duration::from_millis(config.robot.command_age_ms_max);
        Ok(Self { camera: main, others, robot: *robot, command_age_max })
    }

    /// The actors that play them in this process: none for what another process plays.
    pub fn actors(&self, bus: &Bus, monitor: &Monitor) -> Vec<ActorSpec> {
        let others = self.others.iter().map(|(name, port)| (name.as_str(), port));
        let cameras = std::iter::once((MAIN_CAMERA, &self.camera)).chain(others);
        let cameras = cameras.filter_map(|(name, port)| {
            let (open, topics) = (port.open.clone()?, CameraTopics::of(name));
            let (bus, monitor) = (bus.clone(), monitor.clone());
            Some(ActorSpec::new(topics.camera, move || {
                let (camera, bus, monitor) = (open(), bus.clone(), monitor.clone());
                async move {
                    let camera = camera.map_err(|e| ActorError::Part { reason: e.to_string() })?;
                    camera::serve((bus, topics), camera, monitor).await
                }
            }))
        });
        let robot = self.robot.open.clone().map(|open| {
            let (bus, monitor) = (bus.clone(), monitor.clone());
            let age_max = self.command_age_max;
            ActorSpec::new("robot", move || {
                robot::serve(bus.clone(), open(), monitor.clone(), age_max)
            })
        });
        cameras.chain(robot).collect()
    }
}
