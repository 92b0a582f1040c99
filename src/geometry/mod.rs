//! Image boxes, volumes and the camera model.

mod boxes;
mod mask;
mod aabb;
mod camera_model;

pub use aabb::Aabb;
pub use boxes::PixelBox;
pub use camera_model::{CameraModel, Intrinsics, LiftError};
pub use mask::{Mask, MaskRun};
