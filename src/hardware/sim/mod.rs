//! The simulated world as a camera, a robot, an oracle and a labeller.

#[cfg(feature = "sim")]
mod config;
#[cfg(feature = "sim")]
mod witness;
#[cfg(feature = "sim")]
mod robot;
#[cfg(feature = "sim")]
mod faults;
#[cfg(feature = "sim")]
mod camera;
#[cfg(feature = "sim")]
mod visible_share;
#[cfg(feature = "sim")]
mod scene_types;
#[cfg(feature = "sim")]
mod labels;
#[cfg(feature = "sim")]
mod ports;

#[cfg(feature = "sim")]
pub use camera::{SimCamera, model_of};
#[cfg(feature = "sim")]
pub use config::{OtherCameraSpec, SimConfig};
#[cfg(feature = "sim")]
pub use faults::{ActingFault, Disturbance, FaultAction, SensingFault, fault_mismatches};
#[cfg(feature = "sim")]
pub use groundloop_sim::WorldFault;
#[cfg(feature = "sim")]
pub use labels::{
    ChangedScene, LabelledScene, Labeller, Look, Oracle, ScenesOf, Viewpoint, exemplar_scenes,
    label_scenes,
};
#[cfg(feature = "sim")]
pub use robot::{SimHardware, SimSetup, read_scene};
#[cfg(feature = "sim")]
pub use scene_types::{check_types, unlabelled_types, unseen_by_colour};

use super::{CameraPort, RobotPort};
use crate::parts::{Part, no_options};
#[cfg(not(feature = "sim"))]
use crate::parts::{PartContext, PartError, Role};

/// The entry of the table of cameras.
pub(super) const CAMERA: Part<CameraPort> = Part {
    name: "sim",
    help: "renders the simulated world that [sim] describes",
    options: no_options,
    #[cfg(feature = "sim")]
    build: ports::camera,
    #[cfg(not(feature = "sim"))]
    build: missing,
};

/// The entry of the table of robots.
pub(super) const ROBOT: Part<RobotPort> = Part {
    name: "sim",
    help: "the simulated gripper, in the world that the camera of kind \"sim\" sees",
    options: no_options,
    #[cfg(feature = "sim")]
    build: ports::robot,
    #[cfg(not(feature = "sim"))]
    build: missing,
};

#[cfg(not(feature = "sim"))]
fn missing<T: Role>(_: &PartContext<'_, T>) -> Result<Box<T>, PartError> {
    let how = "this groundloop was built without it; build with `--features sim`";
    Err(PartError::missing("the simulator", how))
}
