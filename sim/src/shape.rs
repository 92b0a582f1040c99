//! What the bodies on the table are: blocks, disks with a hole, pegs, boards, general solids, and
//! their colours.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::solid::{Form, ShapePart, Solid};

/// The shape of one body. A body's frame has its origin in the middle of the shape's bounding box
/// and z along the shape's axis; all lengths are in metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A cube. It can be grasped, moved and stacked.
    Block {
        /// Length of an edge.
        size_m: f64,
    },
    /// A flat ring. It can be grasped by its outer rim and put over a peg.
    Disk {
        /// Radius of the outer rim.
        outer_radius_m: f64,
        /// Radius of the hole; 4 mm more than the peg's radius seats reliably.
        hole_radius_m: f64,
        /// Height of the lying disk.
        thickness_m: f64,
    },
    /// A fixed vertical rod with a hemispherical tip.
    Peg {
        /// Radius of the rod.
        radius_m: f64,
        /// Height of the tip above what the peg stands on (the table, or a board below it).
        height_m: f64,
    },
    /// A fixed plate that lies on the table.
    Board {
        /// Extent along x, along y and height.
        size_m: [f64; 3],
    },
    /// A box.
    Box {
        /// Extent along x, along y and height.
        size_m: [f64; 3],
    },
    /// An upright cylinder.
    Cylinder {
        /// Radius.
        radius_m: f64,
        /// Height.
        height_m: f64,
    },
    /// A hollow upright cylinder: a disk of any height. It can be put over a peg; anything else
    /// stands on it as if it were closed.
    Tube {
        /// Radius of the outer side.
        outer_radius_m: f64,
        /// Radius of the hole.
        inner_radius_m: f64,
        /// Height.
        height_m: f64,
    },
    /// Several boxes and cylinders in one piece, such as a tray with a rim. They may overlap.
    Compound {
        /// The parts.
        parts: Vec<ShapePart>,
    },
}

/// The three measures of a disk or a tube, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "a unit is part of a name")]
pub(crate) struct Ring {
    pub(crate) outer_m: f64,
    pub(crate) hole_m: f64,
    pub(crate) height_m: f64,
}

impl Shape {
    /// The word used for this kind of shape in scene files and in ground truth.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Block { .. } => "block",
            Self::Disk { .. } => "disk",
            Self::Peg { .. } => "peg",
            Self::Board { .. } => "board",
            Self::Box { .. } => "box",
            Self::Cylinder { .. } => "cylinder",
            Self::Tube { .. } => "tube",
            Self::Compound { .. } => "compound",
        }
    }

    /// Whether a body of this shape does not move unless the scene says otherwise.
    pub fn is_usually_fixed(&self) -> bool {
        matches!(self, Self::Peg { .. } | Self::Board { .. })
    }

    /// Extents of the bounding box in the body's own frame, in metres.
    pub fn size_m(&self) -> Vector3<f64> {
        match self {
            Self::Block { size_m } => Vector3::repeat(*size_m),
            Self::Board { size_m } | Self::Box { size_m } => Vector3::from(*size_m),
            Self::Peg { radius_m, height_m } | Self::Cylinder { radius_m, height_m } => {
                Vector3::new(2.0 * radius_m, 2.0 * radius_m, *height_m)
            }
            Self::Disk { .. } | Self::Tube { .. } => self.ring().map_or_else(Vector3::zeros, |r| {
                Vector3::new(2.0 * r.outer_m, 2.0 * r.outer_m, r.height_m)
            }),
            Self::Compound { parts } => {
                let [low, high] = bounds(parts);
                high - low
            }
        }
    }

    /// The measures of a disk or a tube.
    pub(crate) fn ring(&self) -> Option<Ring> {
        match *self {
            Self::Disk { outer_radius_m, hole_radius_m, thickness_m } => {
                Some(Ring { outer_m: outer_radius_m, hole_m: hole_radius_m, height_m: thickness_m })
            }
            Self::Tube { outer_radius_m, inner_radius_m, height_m } => {
                Some(Ring { outer_m: outer_radius_m, hole_m: inner_radius_m, height_m })
            }
            Self::Block { .. }
            | Self::Peg { .. }
            | Self::Board { .. }
            | Self::Box { .. }
            | Self::Cylinder { .. }
            | Self::Compound { .. } => None,
        }
    }

    /// The solids that the shape consists of, in the body's frame; holes and tips are filled.
    pub(crate) fn solids(&self) -> Vec<Solid> {
        let form = match self {
            Self::Block { .. } | Self::Board { .. } | Self::Box { .. } => Form::Box,
            Self::Disk { .. } | Self::Peg { .. } | Self::Cylinder { .. } | Self::Tube { .. } => {
                Form::Cylinder
            }
            Self::Compound { parts } => {
                let [low, high] = bounds(parts);
                let origin = (low + high) * 0.5;
                let moved = |solid: Solid| Solid { middle: solid.middle - origin, ..solid };
                return parts.iter().map(|part| moved(part.solid())).collect();
            }
        };
        vec![Solid::centred(form, self.size_m() * 0.5)]
    }

    /// Half the body's extent along a unit direction given in the body's own frame, in metres.
    pub(crate) fn half_extent_along(&self, direction: &Vector3<f64>) -> f64 {
        let reach =
            |solid: &Solid| solid.middle.dot(direction).abs() + solid.half_extent_along(direction);
        self.solids().iter().map(reach).fold(0.0, f64::max)
    }

    /// Half the extent along the world's z axis of a body at `world_from_body`, in metres.
    pub(crate) fn half_height_at(&self, world_from_body: &Isometry3<f64>) -> f64 {
        let up = world_from_body.rotation.inverse_transform_vector(&Vector3::z());
        self.half_extent_along(&up)
    }

    /// Radius of the circle around the origin that the upright body stays within, in metres.
    pub(crate) fn footprint_radius_m(&self) -> f64 {
        let size = self.size_m();
        match self {
            Self::Block { .. } | Self::Board { .. } | Self::Box { .. } | Self::Compound { .. } => {
                0.5 * size.x.hypot(size.y)
            }
            Self::Disk { .. } | Self::Peg { .. } | Self::Cylinder { .. } | Self::Tube { .. } => {
                0.5 * size.x
            }
        }
    }

    /// Corners of the twelve convex wedges of a disk or a tube (eight each, body frame, metres); empty for
    /// any other shape. Twelve wedges seat best on a peg and come to rest; eight keep moving.
    pub(crate) fn wedges(&self) -> Vec<[Point3<f64>; 8]> {
        const N_WEDGES: usize = 12;
        let Some(Ring { outer_m, hole_m, height_m }) = self.ring() else { return Vec::new() };
        let half = 0.5 * height_m;
        let corner = |radius: f64, k: usize, z: f64| {
            let angle = TAU * k as f64 / N_WEDGES as f64;
            Point3::new(radius * angle.cos(), radius * angle.sin(), z)
        };
        // The hole's flat sides stay outside the true circle, so that no clearance is lost.
        let inner = hole_m / (TAU / (2 * N_WEDGES) as f64).cos();
        (0..N_WEDGES)
            .map(|k| {
                [
                    corner(inner, k, -half),
                    corner(outer_m, k, -half),
                    corner(outer_m, k + 1, -half),
                    corner(inner, k + 1, -half),
                    corner(inner, k, half),
                    corner(outer_m, k, half),
                    corner(outer_m, k + 1, half),
                    corner(inner, k + 1, half),
                ]
            })
            .collect()
    }
}

/// The lowest and the highest corner of the box around all parts, in the frame in which they are
/// written down.
fn bounds(parts: &[ShapePart]) -> [Vector3<f64>; 2] {
    let solids = parts.iter().map(ShapePart::solid);
    let nowhere = [Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN)];
    solids.fold(nowhere, |[low, high], solid| {
        [low.inf(&(solid.middle - solid.half)), high.sup(&(solid.middle + solid.half))]
    })
}

/// Whether a body at this attitude stands on its bottom or its top (within about 8 degrees), or, for
/// a block or a box, on any of its faces.
pub(crate) fn is_upright(shape: &Shape, world_from_body: &Isometry3<f64>) -> bool {
    const COS_MIN: f64 = 0.99;
    let up = world_from_body.rotation.inverse_transform_vector(&Vector3::z()).abs();
    match shape {
        Shape::Block { .. } | Shape::Box { .. } => up.max() > COS_MIN,
        Shape::Disk { .. }
        | Shape::Peg { .. }
        | Shape::Board { .. }
        | Shape::Cylinder { .. }
        | Shape::Tube { .. }
        | Shape::Compound { .. } => up.z > COS_MIN,
    }
}

/// An sRGB colour, eight bits a channel. In files: `"#c82828"` or `[200, 40, 40]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "ColourText", into = "[u8; 3]")]
pub struct Colour(
    /// Red, green and blue.
    pub [u8; 3],
);

impl From<Colour> for [u8; 3] {
    fn from(colour: Colour) -> Self {
        colour.0
    }
}

/// A colour as it may be written in a file.
#[derive(Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a colour: \"#rrggbb\" or [red, green, blue] with 0 to 255")]
enum ColourText {
    Hex(String),
    Bytes([u8; 3]),
}

impl TryFrom<ColourText> for Colour {
    type Error = String;

    fn try_from(text: ColourText) -> Result<Self, String> {
        let hex = match text {
            ColourText::Bytes(bytes) => return Ok(Self(bytes)),
            ColourText::Hex(hex) => hex,
        };
        let digits = hex.strip_prefix('#').unwrap_or(&hex);
        let is_hex = digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit());
        match u32::from_str_radix(digits, 16) {
            Ok(value) if is_hex => {
                let [_, red, green, blue] = value.to_be_bytes();
                Ok(Self([red, green, blue]))
            }
            _ => Err(format!("expected a colour like \"#c82828\", got \"{hex}\"")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_read_from_hex_and_bytes_and_nothing_else() {
        #[derive(Deserialize)]
        struct File {
            c: Colour,
        }
        let read = |text: &str| toml::from_str::<File>(text).map(|f| f.c.0);
        assert_eq!(read("c = '#c82864'").unwrap(), [200, 40, 100]);
        assert_eq!(read("c = [1, 2, 3]").unwrap(), [1, 2, 3]);
        for bad in ["c = '#c8286'", "c = '+c8286'", "c = [1, 2, 256]", "c = 'red'", "c = 'ééé'"]
        {
            let message = read(bad).unwrap_err().to_string();
            assert!(message.contains("expected a colour"), "{bad}: {message}");
        }
    }

    #[test]
    fn a_compound_is_as_large_as_all_its_parts_and_stands_around_its_origin() {
        let text = r#"
            kind = "compound"
            parts = [
              { kind = "box", size_m = [0.2, 0.1, 0.01], at_m = [0.1, 0.0, 0.0] },
              { kind = "cylinder", radius_m = 0.02, height_m = 0.05, at_m = [0.2, 0.0, 0.01] },
            ]
        "#;
        let shape: Shape = toml::from_str(text).unwrap();
        assert!((shape.size_m() - Vector3::new(0.22, 0.1, 0.06)).norm() < 1e-12);
        let solids = shape.solids();
        assert!((solids[0].middle - Vector3::new(-0.01, 0.0, -0.025)).norm() < 1e-12);
        assert!((solids[1].middle - Vector3::new(0.09, 0.0, 0.005)).norm() < 1e-12);
        assert!((shape.half_extent_along(&Vector3::z()) - 0.03).abs() < 1e-12);
    }

    #[test]
    fn wedges_leave_the_whole_hole_free() {
        let disk = Shape::Disk { outer_radius_m: 0.05, hole_radius_m: 0.012, thickness_m: 0.018 };
        for wedge in disk.wedges() {
            let middle = Point3::from((wedge[0].coords + wedge[3].coords) * 0.5);
            assert!(middle.coords.xy().norm() > 0.012 - 1e-12);
        }
    }
}
