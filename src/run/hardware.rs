//! The camera and the robot of a run file, as actors of this process.

use super::{ConfigError, DomainFolder, RunConfig, environment};
use crate::actors::{ActorError, ActorSpec, Monitor, camera, robot};
use crate::hardware::{CAMERAS, CameraPort, HardwareInputs, ROBOTS, RobotPort, SharedWorld};
use crate::parts::{PartChoice, PartContext};
use crate::transport::Bus;

/// The camera and the robot that a run file chooses.
#[derive(Clone)]
#[expect(missing_debug_implementations, reason = "holds closures")]
pub struct HardwarePorts {
    /// Where frames come from.
    pub camera: CameraPort,
    /// Where commands go.
    pub robot: RobotPort,
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
            rate_hz: config.camera.rate_hz,
            seed: config.seed,
            folder: &folder.files,
            origin: &config.origin,
            domain: &folder.domain,
            sim: config.sim.as_ref(),
            faults: &config.fault,
            world: &world,
        };
        let options = config.camera.options.as_ref();
        let choice = PartChoice::new("camera.kind", &config.camera.kind);
        let choice = &choice.with_options(options, config.origin.path());
        let camera = CAMERAS.build(&PartContext { choice, inputs, environment })?;
        let choice = PartChoice::new("robot.kind", &config.robot.kind);
        let choice = &choice.with_options(config.robot.options.as_ref(), config.origin.path());
        let robot = ROBOTS.build(&PartContext { choice, inputs, environment })?;
        Ok(Self { camera: *camera, robot: *robot })
    }

    /// The actors that play them in this process: none for what another process plays.
    pub fn actors(&self, bus: &Bus, monitor: &Monitor) -> Vec<ActorSpec> {
        let camera = self.camera.open.clone().map(|open| {
            let (bus, monitor) = (bus.clone(), monitor.clone());
            ActorSpec::new("camera", move || {
                let (camera, bus, monitor) = (open(), bus.clone(), monitor.clone());
                async move {
                    let fault = |reason: String| ActorError::Part { reason };
                    camera::serve(bus, camera.map_err(|e| fault(e.to_string()))?, monitor).await
                }
            })
        });
        let robot = self.robot.open.clone().map(|open| {
            let (bus, monitor) = (bus.clone(), monitor.clone());
            ActorSpec::new("robot", move || robot::serve(bus.clone(), open(), monitor.clone()))
        });
        camera.into_iter().chain(robot).collect()
    }
}
