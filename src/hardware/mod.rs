//! Hardware: cameras and robots, and the simulated world that plays both.

pub mod file;
pub mod encodings;
pub mod calibration;
pub mod images;
mod history;
mod camera;
mod pipe;
mod recording;
mod robot;
mod sequencer;
mod setup;
mod draws;
mod fault;
mod system_fault;
mod external;
mod none;
pub mod sim;
#[cfg(test)]
mod tests;

pub use camera::{Camera, CameraError, CameraPort, DisturbDetections, NextFrame, OpenCamera};
pub use draws::is_drawn;
#[cfg(feature = "sim")]
pub(crate) use fault::ANY;
pub use fault::{FaultConfig, FaultTime};
pub use history::{GroundTruth, TrueDispatch, TrueHistory, TrueMoment};
pub use robot::{FaultsOf, OpenRobot, Robot, RobotPort};
pub use sequencer::{Arm, Sequencer, Target};
pub use setup::{EXTERNAL, HardwareInputs, SharedWorld};
pub use system_fault::{LoopShape, SystemFault};

use crate::parts::Registry;

/// Every camera by its `kind` in run files, in alphabetical order.
pub static CAMERAS: Registry<CameraPort> =
    Registry(&[external::CAMERA, images::CAMERA, recording::CAMERA, pipe::CAMERA, sim::CAMERA]);

/// Every robot by its `kind` in run files, in alphabetical order.
pub static ROBOTS: Registry<RobotPort> = Registry(&[external::ROBOT, none::ROBOT, sim::ROBOT]);
