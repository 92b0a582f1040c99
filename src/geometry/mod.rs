//! Image boxes, volumes and the camera model.

mod boxes;
mod aabb;
mod camera_model;

pub use aabb::Aabb;
pub use boxes::{MaskRun, PixelBox};
pub use camera_model::{CameraModel, Intrinsics, LiftError};
