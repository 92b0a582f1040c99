//! The simulated world as the parts of a run.

use std::sync::Arc;

use super::scene_types::check_types;
use super::{Oracle, SimCamera, SimConfig, SimHardware, SimSetup, read_scene};
use crate::hardware::{CameraError, CameraPort, DisturbDetections, HardwareInputs, RobotPort};
use crate::mismatch::Mismatch;
use crate::parts::{PartContext, PartError};
use crate::perception::Detection;

/// The simulated camera.
pub(super) fn camera(context: &PartContext<'_, CameraPort>) -> Result<Box<CameraPort>, PartError> {
    let world = world(&context.inputs)?;
    let HardwareInputs { folder, domain, camera: name, .. } = context.inputs;
    let Some(camera) = world.camera(name) else {
        let expected = "a table with position_m and look_at_m";
        let key = SimConfig::key_of(name);
        return Err(PartError::Inputs { reason: Mismatch::new(key, expected, "none").to_string() });
    };
    let (image_size, name) = ([camera.width, camera.height], name.to_owned());
    let oracle = Oracle::new(folder, domain, (*world).clone())?;
    let disturb = world.disturbs_detections().then(|| {
        let (world, name) = (Arc::clone(&world), name.clone());
        Arc::new(move |sequence, detections: &mut Vec<Detection>| {
            world.disturb_detections(&name, sequence, detections);
        }) as DisturbDetections
    });
    Ok(Box::new(CameraPort {
        open: Some(Arc::new(move || {
            let camera = SimCamera::new((*world).clone(), &name);
            let gone = || CameraError::Render { reason: format!("no camera {name}") };
            Ok(Box::new(camera.ok_or_else(gone)?))
        })),
        image_size: Some(image_size),
        history: oracle.map(|oracle| Arc::new(move || oracle.history()) as _),
        disturb,
    }))
}

/// The simulated gripper.
pub(super) fn robot(context: &PartContext<'_, RobotPort>) -> Result<Box<RobotPort>, PartError> {
    let world = world(&context.inputs)?;
    let told = Arc::clone(&world);
    Ok(Box::new(RobotPort {
        acts: true,
        open: Some(Arc::new(move || world.robot())),
        faults: Some(Arc::new(move || told.faults())),
    }))
}

/// The world that camera and robot of one run share.
fn world(inputs: &HardwareInputs<'_>) -> Result<Arc<SimHardware>, PartError> {
    let HardwareInputs { clock, rate_hz, seed, folder, domain, .. } = *inputs;
    let HardwareInputs { origin, sim, faults, world, .. } = *inputs;
    world.get_or_make(|| {
        let table = sim.ok_or_else(|| PartError::Inputs {
            reason: Mismatch::new("sim", "a table, for a camera or robot of kind \"sim\"", "none")
                .to_string(),
        })?;
        let sim = &SimConfig::read(Some(table), origin)?;
        let scene = folder.file(&sim.scene);
        check_types(&read_scene(&scene)?, domain, &scene)?;
        SimHardware::build(&SimSetup { sim, folder, faults, clock, rate_hz, seed })
    })
}
