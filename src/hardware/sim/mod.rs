//! The simulated world as a camera, a robot, an oracle and a labeller.

mod robot;
mod faults;
mod camera;
mod labels;

pub use camera::{SimCamera, model_of};
pub use groundloop_sim::FaultAction;
pub use labels::{
    LabelledScene, Labeller, Look, Oracle, ScenesOf, Viewpoint, exemplar_scenes, label_scenes,
};
pub use robot::{SimConfig, SimHardware, SimSetup, read_scene};
