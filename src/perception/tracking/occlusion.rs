//! Which part of the picture the robot itself may hide.

use nalgebra::Point3;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::geometry::{CameraModel, PixelBox};
use crate::messages::RobotState;

/// A box around the robot's tool that contains every part of it that the camera may see.
/// Lengths in metres, relative to the tool centre point, in the world's directions.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SelfFilterConfig {
    /// Beyond the open jaws, to either side along x.
    pub beyond_jaws_m: f64,
    /// To either side along y.
    pub half_depth_m: f64,
    /// Below the tool centre.
    pub below_m: f64,
    /// Above the tool centre.
    pub above_m: f64,
}

/// The image of the robot's self-filter box; `None` when all of it is behind the camera.
pub(super) fn self_filter_in_image(
    filter: &SelfFilterConfig,
    robot: &RobotState,
    model: &CameraModel,
) -> Option<PixelBox> {
    let half_width = robot.opening_m / 2.0 + filter.beyond_jaws_m;
    let p = robot.position;
    let mut bounds: Option<PixelBox> = None;
    for x in [p.x - half_width, p.x + half_width] {
        for y in [p.y - filter.half_depth_m, p.y + filter.half_depth_m] {
            for z in [p.z - filter.below_m, p.z + filter.above_m] {
                let Some(pixel) = model.project(Point3::new(x, y, z)) else { continue };
                let b = bounds.get_or_insert(PixelBox {
                    x1: pixel.x,
                    y1: pixel.y,
                    x2: pixel.x,
                    y2: pixel.y,
                });
                *b = PixelBox {
                    x1: b.x1.min(pixel.x),
                    y1: b.y1.min(pixel.y),
                    x2: b.x2.max(pixel.x),
                    y2: b.y2.max(pixel.y),
                };
            }
        }
    }
    bounds
}

/// Whether one of the occluders covers a part of the box.
pub(super) fn is_covered(pixel_box: &PixelBox, occluders: &[PixelBox]) -> bool {
    occluders.iter().any(|occluder| occluder.intersection(pixel_box).area() > 0.0)
}
