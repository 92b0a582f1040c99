//! Image boxes and the camera model.

mod boxes;
mod camera_model;

pub use boxes::PixelBox;
pub use camera_model::{CameraModel, Intrinsics, LiftError};
