//! The simple solids that a shape consists of: boxes and upright cylinders in the frame of a body.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One part of a compound. Lengths in metres, in the frame in which the compound is written down:
/// x and y as in the world, z up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapePart {
    /// A box.
    Box {
        /// Extents along x, y and z.
        size_m: [f64; 3],
        /// The x and y of its middle, and the z of its lower face.
        at_m: [f64; 3],
    },
    /// An upright cylinder.
    Cylinder {
        /// Radius.
        radius_m: f64,
        /// Height.
        height_m: f64,
        /// The x and y of its axis, and the z of its lower face.
        at_m: [f64; 3],
    },
}

impl ShapePart {
    /// The part as a solid in the frame in which it is written down.
    pub(crate) fn solid(&self) -> Solid {
        let (form, half_z, [x, y, z]) = match *self {
            Self::Box { size_m, at_m } => (Form::Box, 0.5 * size_m[2], at_m),
            Self::Cylinder { height_m, at_m, .. } => (Form::Cylinder, 0.5 * height_m, at_m),
        };
        let half = match *self {
            Self::Box { size_m, .. } => Vector3::from(size_m) * 0.5,
            Self::Cylinder { radius_m, .. } => Vector3::new(radius_m, radius_m, half_z),
        };
        Solid { form, middle: Vector3::new(x, y, z + half_z), half }
    }
}

/// What kind of solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// A box.
    Box,
    /// A cylinder around z.
    Cylinder,
}

/// A solid in the frame of a body, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Solid {
    pub(crate) form: Form,
    pub(crate) middle: Vector3<f64>,
    /// Half the extents of its bounding box.
    pub(crate) half: Vector3<f64>,
}

impl Solid {
    /// A solid around the origin.
    pub(crate) fn centred(form: Form, half: Vector3<f64>) -> Self {
        Self { form, middle: Vector3::zeros(), half }
    }

    /// Half its extent along a unit direction of the body's frame.
    pub(crate) fn half_extent_along(&self, direction: &Vector3<f64>) -> f64 {
        match self.form {
            Form::Box => self.half.dot(&direction.abs()),
            Form::Cylinder => self.half.x * direction.xy().norm() + self.half.z * direction.z.abs(),
        }
    }

    /// Distance from a point to its outline seen along z, both from the body's origin; negative
    /// inside.
    pub(crate) fn distance_xy(&self, [x, y]: [f64; 2]) -> f64 {
        let (dx, dy) = (x - self.middle.x, y - self.middle.y);
        match self.form {
            Form::Cylinder => dx.hypot(dy) - self.half.x,
            Form::Box => {
                let (beyond_x, beyond_y) = (dx.abs() - self.half.x, dy.abs() - self.half.y);
                let outside = beyond_x.max(0.0).hypot(beyond_y.max(0.0));
                outside + beyond_x.max(beyond_y).min(0.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_negative_inside_and_go_around_corners() {
        let plate = Solid::centred(Form::Box, Vector3::new(0.2, 0.1, 0.01));
        assert!((plate.distance_xy([0.15, 0.0]) + 0.05).abs() < 1e-12);
        assert!((plate.distance_xy([0.23, 0.14]) - 0.05).abs() < 1e-12);
        let rod = Solid::centred(Form::Cylinder, Vector3::new(0.02, 0.02, 0.1));
        assert!((rod.distance_xy([0.03, 0.04]) - 0.03).abs() < 1e-12);
    }

    #[test]
    fn a_part_stands_on_its_lower_face() {
        let part = ShapePart::Cylinder { radius_m: 0.02, height_m: 0.1, at_m: [0.1, 0.0, 0.01] };
        let solid = part.solid();
        assert!((solid.middle - Vector3::new(0.1, 0.0, 0.06)).norm() < 1e-12);
        assert!((solid.half_extent_along(&Vector3::z()) - 0.05).abs() < 1e-12);
    }
}
