//! The pinhole camera: pixels to rays and back.

use nalgebra::{Isometry3, Point2, Point3};
use thiserror::Error;

use super::PixelBox;

/// Pinhole intrinsics in pixels (`OpenCV`'s convention: pixel (0, 0) is the centre of the top-left
/// pixel).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intrinsics {
    /// Focal length along columns.
    pub fx: f64,
    /// Focal length along rows.
    pub fy: f64,
    /// Principal point, column.
    pub cx: f64,
    /// Principal point, row.
    pub cy: f64,
}

impl Intrinsics {
    /// Those of the same pictures with so many times the columns and rows: corners stay corners.
    #[must_use]
    pub fn scaled(&self, [across, down]: [f64; 2]) -> Self {
        // Pixel (0, 0) is the middle of the first pixel, so that its corner is at -0.5.
        let moved = |centre: f64, scale: f64| (centre + 0.5) * scale - 0.5;
        Self {
            fx: self.fx * across,
            fy: self.fy * down,
            cx: moved(self.cx, across),
            cy: moved(self.cy, down),
        }
    }
}

/// A camera whose place in the world is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraModel {
    /// Pinhole intrinsics.
    pub intrinsics: Intrinsics,
    /// Camera axes (x right, y down, z forward) to world axes (z up), metres.
    pub world_from_camera: Isometry3<f64>,
}

/// A pixel cannot be lifted.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum LiftError {
    /// The depth is not a positive finite number.
    #[error("expected a positive finite depth, got {depth_m}")]
    BadDepth {
        /// The depth that was given.
        depth_m: f64,
    },
}

impl CameraModel {
    /// Lifts one pixel with depth to a point in the world frame.
    ///
    /// `pixel` is (column, row); `depth_m` is the distance along the optical axis in metres, not
    /// along the ray. The result is in metres.
    ///
    /// # Errors
    /// [`LiftError::BadDepth`] when `depth_m` is not finite and positive.
    ///
    /// Source: Hartley & Zisserman 2004, eq. 6.8, inverted.
    pub fn lift(&self, pixel: Point2<f64>, depth_m: f64) -> Result<Point3<f64>, LiftError> {
        if !(depth_m.is_finite() && depth_m > 0.0) {
            return Err(LiftError::BadDepth { depth_m });
        }
        let k = &self.intrinsics;
        let in_camera = Point3::new(
            (pixel.x - k.cx) / k.fx * depth_m,
            (pixel.y - k.cy) / k.fy * depth_m,
            depth_m,
        );
        Ok(self.world_from_camera * in_camera)
    }

    /// The box of points in the image; `None` when one of them is behind the camera, or there is none.
    pub fn bounds(&self, points: impl Iterator<Item = Point3<f64>>) -> Option<PixelBox> {
        let pixels: Option<Vec<Point2<f64>>> = points.map(|point| self.project(point)).collect();
        let boxes = pixels?.into_iter().map(|p| PixelBox { x1: p.x, y1: p.y, x2: p.x, y2: p.y });
        boxes.reduce(|a, b| a.hull(&b))
    }

    /// Projects a world point to (column, row); `None` behind the camera.
    pub fn project(&self, point: Point3<f64>) -> Option<Point2<f64>> {
        let p = self.world_from_camera.inverse_transform_point(&point);
        let k = &self.intrinsics;
        (p.z > 1e-9).then(|| Point2::new(k.fx * p.x / p.z + k.cx, k.fy * p.y / p.z + k.cy))
    }
}
