//! The simulated world as the parts of a run.

use std::sync::Arc;

use super::{Oracle, SimCamera, SimConfig, SimHardware, SimSetup};
use crate::hardware::{CameraPort, HardwareInputs, RobotPort};
use crate::mismatch::Mismatch;
use crate::parts::{PartContext, PartError};

/// The simulated camera.
pub(super) fn camera(context: &PartContext<'_, CameraPort>) -> Result<Box<CameraPort>, PartError> {
    let world = world(&context.inputs)?;
    let image_size = [world.camera.width, world.camera.height];
    let HardwareInputs { folder, domain, .. } = context.inputs;
    let oracle = Oracle::new(folder, domain, (*world).clone())?;
    Ok(Box::new(CameraPort {
        open: Some(Arc::new(move || Ok(Box::new(SimCamera::new((*world).clone()))))),
        image_size: Some(image_size),
        truth: oracle.map(|oracle| Arc::new(move || oracle.truth()) as _),
    }))
}

/// The simulated gripper.
pub(super) fn robot(context: &PartContext<'_, RobotPort>) -> Result<Box<RobotPort>, PartError> {
    let world = world(&context.inputs)?;
    Ok(Box::new(RobotPort { acts: true, open: Some(Arc::new(move || world.robot())) }))
}

/// The world that camera and robot of one run share.
fn world(inputs: &HardwareInputs<'_>) -> Result<Arc<SimHardware>, PartError> {
    let HardwareInputs { clock, rate_hz, seed, folder, origin, sim, faults, world, .. } = *inputs;
    world.get_or_make(|| {
        let table = sim.ok_or_else(|| PartError::Inputs {
            reason: Mismatch::new("sim", "a table, for a camera or robot of kind \"sim\"", "none")
                .to_string(),
        })?;
        let sim = &SimConfig::read(Some(table), origin)?;
        SimHardware::build(&SimSetup { sim, folder, faults, clock, rate_hz, seed })
    })
}
