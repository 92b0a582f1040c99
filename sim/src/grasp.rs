//! Whether the closing fingers meet an object: pure geometry.

use nalgebra::{Isometry3, Vector3};

use crate::gripper::{PAD_WIDTH_M, TIP_BELOW_M};
use crate::shape::Shape;
use crate::solid::Solid;

/// Least depth of an object between the pads, across the jaw axis, that gives a grip, in metres.
const OVERLAP_MIN_M: f64 = 0.5 * PAD_WIDTH_M;

/// An object between the fingers, seen along the jaw axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "a unit is part of a name")]
pub(crate) struct Span {
    /// Width of the object along the jaw axis, in metres.
    pub(crate) width_m: f64,
    /// Offset of its middle from the tool centre point along the jaw axis, in metres.
    pub(crate) offset_m: f64,
    /// Distance of its centre from the tool centre point, in metres.
    pub(crate) distance_m: f64,
}

impl Span {
    /// The opening at which the first finger touches the object.
    pub(crate) fn touching_opening_m(&self) -> f64 {
        self.width_m + 2.0 * self.offset_m.abs()
    }
}

/// The object as the fingers see it, when the pads would meet it on both sides.
pub(crate) fn span(
    shape: &Shape,
    world_from_gripper: &Isometry3<f64>,
    world_from_body: &Isometry3<f64>,
) -> Option<Span> {
    let gripper_from_body = world_from_gripper.inv_mul(world_from_body);
    let half_along = |solid: &Solid, axis: Vector3<f64>| {
        solid.half_extent_along(&gripper_from_body.rotation.inverse_transform_vector(&axis))
    };
    // Middle and half width, along the jaw axis, of every part that the pads would meet.
    let met = |solid: &Solid| {
        let middle = gripper_from_body.transform_point(&solid.middle.into());
        let half_y = half_along(solid, Vector3::y());
        let half_z = half_along(solid, Vector3::z());
        let across = overlap(middle.y, half_y, -0.5 * PAD_WIDTH_M, 0.5 * PAD_WIDTH_M);
        let high = overlap(middle.z, half_z, -TIP_BELOW_M, 2.0 * TIP_BELOW_M);
        let is_met = across >= OVERLAP_MIN_M && high >= 0.5 * TIP_BELOW_M;
        is_met.then(|| [middle.x, half_along(solid, Vector3::x())])
    };
    let all = shape.solids().iter().filter_map(met).reduce(|[a, half_a], [b, half_b]| {
        let (low, high) = ((a - half_a).min(b - half_b), (a + half_a).max(b + half_b));
        [f64::midpoint(low, high), 0.5 * (high - low)]
    });
    all.map(|[offset_m, half_width]| Span {
        width_m: 2.0 * half_width,
        offset_m,
        distance_m: gripper_from_body.translation.vector.norm(),
    })
}

/// Length that the interval `middle` ± `half` shares with `low`..`high`.
fn overlap(middle: f64, half: f64, low: f64, high: f64) -> f64 {
    (middle + half).min(high) - (middle - half).max(low)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(dx: f64, dy: f64, dz: f64) -> Option<Span> {
        let block = Shape::Block { size_m: 0.05 };
        span(&block, &Isometry3::identity(), &Isometry3::translation(dx, dy, dz))
    }

    #[test]
    fn only_what_the_pads_meet_is_between_the_fingers() {
        let centred = check(0.0, 0.0, 0.0).unwrap();
        assert!((centred.width_m - 0.05).abs() < 1e-12);
        let aside = check(0.004, 0.01, 0.01).unwrap();
        assert!((aside.touching_opening_m() - 0.058).abs() < 1e-12);
        assert_eq!(check(0.0, 0.034, 0.0), None, "beside the pads");
        assert_eq!(check(0.0, 0.0, -0.031), None, "below the tips");
        assert_eq!(check(0.0, 0.0, 0.04), None, "above the pads");
    }

    /// A mug seen from the side: its handle counts only where the pads reach it.
    #[test]
    fn of_a_compound_the_parts_between_the_pads_count() {
        let text = r#"
            kind = "compound"
            parts = [
              { kind = "cylinder", radius_m = 0.02, height_m = 0.06, at_m = [0.0, 0.0, 0.0] },
              { kind = "box", size_m = [0.03, 0.01, 0.02], at_m = [0.03, 0.0, 0.02] },
            ]
        "#;
        let mug: Shape = toml::from_str(text).unwrap();
        let width = |dz: f64| {
            let at = Isometry3::translation(0.0125, 0.0, dz);
            span(&mug, &Isometry3::identity(), &at).map(|span| (1e6 * span.width_m).round())
        };
        assert_eq!(width(0.0), Some(65_000.0), "rod and handle");
        assert_eq!(width(-0.02), Some(40_000.0), "above the handle");
    }

    #[test]
    fn a_turned_block_is_wider() {
        let block = Shape::Block { size_m: 0.05 };
        let turned = Isometry3::rotation(Vector3::z() * std::f64::consts::FRAC_PI_4);
        let width_m = span(&block, &Isometry3::identity(), &turned).unwrap().width_m;
        assert!((width_m - 0.05 * 2.0_f64.sqrt()).abs() < 1e-9);
    }
}
