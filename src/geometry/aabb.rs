//! Axis-aligned volumes in the world.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

/// An axis-aligned volume in the world frame, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aabb {
    /// Its middle.
    pub centre: Point3<f64>,
    /// Full edge lengths along x, y and z.
    pub extent: [f64; 3],
}

impl Aabb {
    /// Whether every number is finite and every edge has a length.
    pub fn is_valid(&self) -> bool {
        self.centre.iter().all(|v| v.is_finite())
            && self.extent.iter().all(|v| v.is_finite() && *v > 0.0)
    }

    /// Least and greatest coordinate along an axis (0 = x, 1 = y, 2 = z).
    pub fn span(&self, axis: usize) -> [f64; 2] {
        let half = self.extent[axis] / 2.0;
        [self.centre[axis] - half, self.centre[axis] + half]
    }

    /// Euclidean distance between the two volumes; zero when they touch or overlap.
    pub fn gap(&self, other: &Self) -> f64 {
        let along = |axis| {
            let ([a_low, a_high], [b_low, b_high]) = (self.span(axis), other.span(axis));
            (b_low - a_high).max(a_low - b_high).max(0.0)
        };
        along(0).hypot(along(1)).hypot(along(2))
    }

    /// Height of the upper face.
    pub fn top_z(&self) -> f64 {
        self.centre.z + self.extent[2] / 2.0
    }
}
