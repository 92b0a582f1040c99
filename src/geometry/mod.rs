//! Image boxes and the camera model.

mod boxes;
mod camera_model;

pub use boxes::{PixelBox, RowRun};
pub use camera_model::{CameraModel, Intrinsics, LiftError};
