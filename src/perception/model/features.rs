//! Spatial features of object tuples, computed on image boxes, on masks or on volumes in the world.

use super::ObjectBox;
use crate::geometry::{Aabb, Mask, PixelBox};

/// Most numbers that a feature has.
pub const FEATURE_LENGTH_MAX: usize = 8;

/// A feature's numbers, with zeros behind them, which change no distance.
pub type FeatureVector = [f64; FEATURE_LENGTH_MAX];

/// A feature: a fixed number of objects to a vector that nearest neighbours are sought in.
#[derive(Debug, Clone, Copy)]
pub struct Feature {
    /// Its name in `perception.toml`.
    pub name: &'static str,
    /// How many objects it takes.
    pub arity: usize,
    /// What it must know of each object.
    pub needs: Needs,
    /// How many numbers it has; the others of its vectors are 0.
    pub length: usize,
    /// Computes it; the slice has `arity` objects, in the predicate's order. `None` when one of
    /// them lacks what the feature needs.
    pub compute: fn(&[&ObjectBox]) -> Option<FeatureVector>,
}

/// What a feature must know of each object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Its box in the image.
    Boxes,
    /// Which pixels are its own, run by run.
    Masks,
    /// Its volume in the world.
    Volumes,
}

/// Every feature, in alphabetical order.
pub const FEATURES: &[Feature] = &[
    Feature {
        name: "mask_relation",
        arity: 2,
        needs: Needs::Masks,
        length: 7,
        compute: mask_relation,
    },
    Feature { name: "mask_size", arity: 2, needs: Needs::Masks, length: 3, compute: mask_size },
    Feature { name: "relation5", arity: 2, needs: Needs::Boxes, length: 5, compute: relation5 },
    Feature { name: "size", arity: 2, needs: Needs::Boxes, length: 2, compute: size },
    Feature { name: "unary6", arity: 1, needs: Needs::Boxes, length: 6, compute: unary6 },
    Feature {
        name: "volume_relation",
        arity: 2,
        needs: Needs::Volumes,
        length: 7,
        compute: volume_relation,
    },
    Feature {
        name: "volume_size",
        arity: 2,
        needs: Needs::Volumes,
        length: 3,
        compute: volume_size,
    },
];

/// The feature of that name.
pub fn feature_by_name(name: &str) -> Option<&'static Feature> {
    FEATURES.iter().find(|f| f.name == name)
}

/// The feature used where none is named: the reference's.
pub(in crate::perception) fn default_feature(arity: usize) -> Option<&'static Feature> {
    match arity {
        1 => feature_by_name("unary6"),
        2 => feature_by_name("relation5"),
        _ => None,
    }
}

/// `relation5` with what a box only bounds measured on the pixels: four times the gap between them,
/// and where their middles lie to each other, object minus subject, in pixels.
fn mask_relation(objects: &[&ObjectBox]) -> Option<FeatureVector> {
    let [s, o] = masks(objects)?;
    let [left, top, right, bottom, ..] = relation5(objects)?;
    let ([sx, sy], [ox, oy]) = (s.centroid(), o.centroid());
    Some([left, top, right, bottom, 4.0 * s.gap(o), ox - sx, oy - sy, 0.0])
}

/// Width and height of the object minus those of the subject, and the difference of the sides of
/// two squares with as many pixels.
fn mask_size(objects: &[&ObjectBox]) -> Option<FeatureVector> {
    let [s, o] = masks(objects)?;
    let [width, height, ..] = size(objects)?;
    Some([width, height, o.area().sqrt() - s.area().sqrt(), 0.0, 0.0, 0.0, 0.0, 0.0])
}

/// Edge differences object minus subject, and four times the gap between the boxes, in pixels.
///
/// Source: the reference implementation of the paper's equation 5. The paper's text has the four
/// differences only; without the gap, side by side and on top of each other are easily confused.
fn relation5(objects: &[&ObjectBox]) -> Option<FeatureVector> {
    let [s, o] = boxes(objects)?;
    let [left, top, right, bottom] = [o.x1 - s.x1, o.y1 - s.y1, o.x2 - s.x2, o.y2 - s.y2];
    Some([left, top, right, bottom, 4.0 * s.gap(o), 0.0, 0.0, 0.0])
}

/// Width and height of the object minus those of the subject, in pixels: free of position.
fn size(objects: &[&ObjectBox]) -> Option<FeatureVector> {
    let [s, o] = boxes(objects)?;
    let (width, height) = (o.width() - s.width(), o.height() - s.height());
    Some([width, height, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
}

/// All differences between the edges of one box, in pixels. Depends on where the box is, since
/// rows are compared with columns.
///
/// Source: the reference implementation.
fn unary6(objects: &[&ObjectBox]) -> Option<FeatureVector> {
    let [b] = boxes(objects)?;
    let [x1, y1, x2, y2] = [b.x1, b.y1, b.x2, b.y2];
    Some([y2 - x2, y2 - y1, y2 - x1, x2 - y1, x2 - x1, y1 - x1, 0.0, 0.0])
}

/// Edge differences object minus subject in the world frame, and four times the gap between the
/// volumes, in millimetres: `relation5` with depth. It does not depend on where the camera is.
fn volume_relation(objects: &[&ObjectBox]) -> Option<FeatureVector> {
    let [s, o] = volumes(objects)?;
    let mut vector = FeatureVector::default();
    for axis in 0..3 {
        let ([s_low, s_high], [o_low, o_high]) = (s.span(axis), o.span(axis));
        vector[2 * axis] = 1e3 * (o_low - s_low);
        vector[2 * axis + 1] = 1e3 * (o_high - s_high);
    }
    vector[6] = 4e3 * s.gap(o);
    Some(vector)
}

/// Edge lengths of the object minus those of the subject, in millimetres.
fn volume_size(objects: &[&ObjectBox]) -> Option<FeatureVector> {
    let [s, o] = volumes(objects)?;
    let longer = |axis: usize| 1e3 * (o.extent[axis] - s.extent[axis]);
    Some([longer(0), longer(1), longer(2), 0.0, 0.0, 0.0, 0.0, 0.0])
}

fn boxes<'a, const N: usize>(objects: &[&'a ObjectBox]) -> Option<[&'a PixelBox; N]> {
    let objects: [&ObjectBox; N] = objects.try_into().ok()?;
    Some(objects.map(|object| &object.pixel_box))
}

fn masks<'a>(objects: &[&'a ObjectBox]) -> Option<[&'a Mask; 2]> {
    let [s, o] = objects else { return None };
    let masks = [s.mask.as_ref()?, o.mask.as_ref()?];
    masks.iter().all(|mask| !mask.is_empty()).then_some(masks)
}

fn volumes<'a>(objects: &[&'a ObjectBox]) -> Option<[&'a Aabb; 2]> {
    let [s, o] = objects else { return None };
    Some([s.volume.as_ref()?, o.volume.as_ref()?])
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::geometry::MaskRun;

    fn object(edges: [f64; 4], centre: [f64; 3], extent: [f64; 3]) -> ObjectBox {
        let [x1, y1, x2, y2] = edges.map(|edge| edge as u32);
        let rows = (y1..y2).map(|y| MaskRun { y, x_start: x1, x_end: x2 });
        ObjectBox {
            name: "o".into(),
            type_name: "t".into(),
            pixel_box: edges.into(),
            volume: Some(Aabb { centre: Point3::from(centre), extent }),
            mask: Some(rows.collect()),
        }
    }

    fn flat(edges: [f64; 4]) -> ObjectBox {
        ObjectBox { volume: None, mask: None, ..object(edges, [0.0; 3], [0.05; 3]) }
    }

    /// The vector that begins with these numbers.
    fn vector(numbers: &[f64]) -> FeatureVector {
        let mut vector = FeatureVector::default();
        vector[..numbers.len()].copy_from_slice(numbers);
        vector
    }

    #[test]
    fn relation5_is_edge_differences_and_four_gaps() {
        let (s, o) = (flat([0.0, 0.0, 10.0, 10.0]), flat([13.0, 14.0, 33.0, 24.0]));
        assert_eq!(relation5(&[&s, &o]), Some(vector(&[13.0, 14.0, 23.0, 14.0, 20.0])));
    }

    #[test]
    fn size_does_not_depend_on_position() {
        let (s, o) = (flat([0.0, 0.0, 10.0, 10.0]), flat([100.0, 7.0, 130.0, 12.0]));
        assert_eq!(size(&[&s, &o]), Some(vector(&[20.0, -5.0])));
    }

    #[test]
    fn mask_features_are_those_of_the_pixels() {
        let at = |edges| object(edges, [0.0; 3], [0.05; 3]);
        let (s, o) = (at([0.0, 0.0, 10.0, 10.0]), at([6.0, 13.0, 10.0, 17.0]));
        let expect = [6.0, 13.0, 0.0, 7.0, 12.0, 3.0, 10.0];
        assert_eq!(mask_relation(&[&s, &o]), Some(vector(&expect)));
        assert_eq!(mask_size(&[&s, &o]), Some(vector(&[-6.0, -6.0, -6.0])));
    }

    #[test]
    fn volume_relation_tells_behind_from_above_where_the_image_does_not() {
        let pixels = [0.0, 0.0, 10.0, 10.0];
        let below = object(pixels, [0.0, 0.0, 0.025], [0.05; 3]);
        let above = object(pixels, [0.0, 0.0, 0.075], [0.05; 3]);
        let behind = object(pixels, [0.0, 0.11, 0.025], [0.05; 3]);
        let close = |a: Option<FeatureVector>, b: [f64; 7]| {
            a.is_some_and(|a| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6))
        };
        let on = volume_relation(&[&above, &below]);
        assert!(close(on, [0.0, 0.0, 0.0, 0.0, -50.0, -50.0, 0.0]));
        let beside = volume_relation(&[&behind, &below]);
        assert!(close(beside, [0.0, 0.0, -110.0, -110.0, 0.0, 0.0, 240.0]));
    }

    #[test]
    fn a_feature_says_nothing_without_what_it_needs() {
        let (s, o) = (flat([0.0, 0.0, 10.0, 10.0]), flat([13.0, 14.0, 33.0, 24.0]));
        for feature in FEATURES {
            let said = (feature.compute)(&[&s, &o][..feature.arity]);
            assert_eq!(said.is_some(), feature.needs == Needs::Boxes, "{}", feature.name);
        }
        let empty = ObjectBox { mask: Some(Vec::new().into()), ..s };
        assert_eq!(mask_relation(&[&empty, &empty]), None);
    }

    #[test]
    fn features_are_sorted_and_have_their_arity() {
        assert!(FEATURES.is_sorted_by_key(|f| f.name));
        let o = object([1.0, 2.0, 3.0, 5.0], [0.0; 3], [0.05; 3]);
        for f in FEATURES {
            let vector = (f.compute)(&vec![&o; f.arity]).unwrap();
            assert!(vector[f.length..].iter().all(|number| *number == 0.0), "{}", f.name);
            assert_eq!((f.compute)(&vec![&o; f.arity + 1]), None, "{}", f.name);
        }
    }
}
