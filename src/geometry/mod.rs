//! Image boxes, volumes and the camera model.

mod boxes;
mod volume;
mod camera_model;

pub use boxes::{PixelBox, RowRun};
pub use camera_model::{CameraModel, Intrinsics, LiftError};
pub use volume::Volume;
