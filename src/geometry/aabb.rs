//! Axis-aligned volumes in the world.

use nalgebra::{Point3, Vector3};
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

    /// Its eight corners.
    pub fn corners(&self) -> impl Iterator<Item = Point3<f64>> + use<> {
        let (centre, half) = (self.centre, self.extent.map(|edge| edge / 2.0));
        (0..8).map(move |corner| {
            let sign = |bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            centre + Vector3::new(sign(0) * half[0], sign(1) * half[1], sign(2) * half[2])
        })
    }

    /// Where a ray goes into the volume and out of it, in lengths of `ray`; `None` when it misses it, or
    /// leaves it behind.
    ///
    /// Source: the slab method of Kay & Kajiya 1986.
    pub fn along_ray(&self, origin: Point3<f64>, ray: Vector3<f64>) -> Option<[f64; 2]> {
        let mut hit = [f64::NEG_INFINITY, f64::INFINITY];
        for axis in 0..3 {
            let span = self.span(axis);
            if ray[axis].abs() < f64::EPSILON {
                if origin[axis] < span[0] || origin[axis] > span[1] {
                    return None;
                }
                continue;
            }
            let [a, b] = span.map(|at| (at - origin[axis]) / ray[axis]);
            hit = [hit[0].max(a.min(b)), hit[1].min(a.max(b))];
        }
        (hit[0] <= hit[1] && hit[1] >= 0.0).then_some(hit)
    }

    /// Which share of this volume lies within the other.
    pub fn share_within(&self, other: &Self) -> f64 {
        let along = |axis| {
            let ([a_low, a_high], [b_low, b_high]) = (self.span(axis), other.span(axis));
            (a_high.min(b_high) - a_low.max(b_low)).max(0.0) / (a_high - a_low)
        };
        along(0) * along(1) * along(2)
    }
}
