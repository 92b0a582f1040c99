//! Hardware: cameras and robots, and the simulated world that plays both.

pub mod file;
pub mod images;
mod camera;
mod robot;
mod sequencer;
#[cfg(feature = "sim")]
pub mod sim;
mod fault;
#[cfg(test)]
mod tests;

pub use camera::{Camera, CameraError, NextFrame};
pub use fault::FaultConfig;
pub use robot::Robot;
pub use sequencer::{Arm, Sequencer, Target};
