//! Spatial features of object tuples, computed on image boxes or on volumes in the world.

use super::ObjectBox;
use crate::geometry::PixelBox;
use crate::scene::Volume;

/// A feature: a fixed number of objects to a vector that nearest neighbours are sought in.
#[derive(Debug, Clone, Copy)]
pub struct Feature {
    /// Its name in `perception.toml`.
    pub name: &'static str,
    /// How many objects it takes.
    pub arity: usize,
    /// Whether it needs the objects' volumes.
    pub needs_volumes: bool,
    /// Computes it; the slice has `arity` objects, in the predicate's order. `None` when one of
    /// them lacks what the feature needs.
    pub compute: fn(&[&ObjectBox]) -> Option<Vec<f64>>,
}

/// Every feature, in alphabetical order.
pub const FEATURES: &[Feature] = &[
    Feature { name: "relation5", arity: 2, needs_volumes: false, compute: relation5 },
    Feature { name: "size", arity: 2, needs_volumes: false, compute: size },
    Feature { name: "unary6", arity: 1, needs_volumes: false, compute: unary6 },
    Feature { name: "volume_relation", arity: 2, needs_volumes: true, compute: volume_relation },
    Feature { name: "volume_size", arity: 2, needs_volumes: true, compute: volume_size },
];

/// The feature of that name.
pub fn feature_by_name(name: &str) -> Option<&'static Feature> {
    FEATURES.iter().find(|f| f.name == name)
}

/// The feature used where none is named: the reference's.
pub(super) fn default_feature(arity: usize) -> Option<&'static Feature> {
    match arity {
        1 => feature_by_name("unary6"),
        2 => feature_by_name("relation5"),
        _ => None,
    }
}

/// Edge differences object minus subject, and four times the gap between the boxes, in pixels.
///
/// Source: the reference implementation of the paper's equation 5. The paper's text has the four
/// differences only; without the gap, side by side and on top of each other are easily confused.
fn relation5(objects: &[&ObjectBox]) -> Option<Vec<f64>> {
    let [s, o] = boxes(objects)?;
    Some(vec![o.x1 - s.x1, o.y1 - s.y1, o.x2 - s.x2, o.y2 - s.y2, 4.0 * s.gap(&o)])
}

/// Width and height of the object minus those of the subject, in pixels: free of position.
fn size(objects: &[&ObjectBox]) -> Option<Vec<f64>> {
    let [s, o] = boxes(objects)?;
    Some(vec![o.width() - s.width(), o.height() - s.height()])
}

/// All differences between the edges of one box, in pixels. Depends on where the box is, since
/// rows are compared with columns.
///
/// Source: the reference implementation.
fn unary6(objects: &[&ObjectBox]) -> Option<Vec<f64>> {
    let [b] = boxes(objects)?;
    Some(vec![b.y2 - b.x2, b.y2 - b.y1, b.y2 - b.x1, b.x2 - b.y1, b.x2 - b.x1, b.y1 - b.x1])
}

/// Edge differences object minus subject in the world frame, and four times the gap between the
/// volumes, in millimetres: `relation5` with depth. It does not depend on where the camera is.
fn volume_relation(objects: &[&ObjectBox]) -> Option<Vec<f64>> {
    let [s, o] = volumes(objects)?;
    let mut vector = Vec::with_capacity(7);
    for axis in 0..3 {
        let ([s_low, s_high], [o_low, o_high]) = (s.span(axis), o.span(axis));
        vector.extend([1e3 * (o_low - s_low), 1e3 * (o_high - s_high)]);
    }
    vector.push(4e3 * s.gap(&o));
    Some(vector)
}

/// Edge lengths of the object minus those of the subject, in millimetres.
fn volume_size(objects: &[&ObjectBox]) -> Option<Vec<f64>> {
    let [s, o] = volumes(objects)?;
    Some(s.extent.iter().zip(o.extent).map(|(s, o)| 1e3 * (o - s)).collect())
}

fn boxes<const N: usize>(objects: &[&ObjectBox]) -> Option<[PixelBox; N]> {
    let boxes: Vec<PixelBox> = objects.iter().map(|object| object.pixel_box).collect();
    boxes.try_into().ok()
}

fn volumes<const N: usize>(objects: &[&ObjectBox]) -> Option<[Volume; N]> {
    let volumes: Option<Vec<Volume>> = objects.iter().map(|object| object.volume).collect();
    volumes?.try_into().ok()
}

/// Euclidean distance.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    fn object(edges: [f64; 4], centre: [f64; 3], extent: [f64; 3]) -> ObjectBox {
        ObjectBox {
            name: "o".into(),
            type_name: "t".into(),
            pixel_box: edges.into(),
            volume: Some(Volume { centre: Point3::from(centre), extent }),
            mask: None,
        }
    }

    fn flat(edges: [f64; 4]) -> ObjectBox {
        ObjectBox { volume: None, ..object(edges, [0.0; 3], [0.05; 3]) }
    }

    #[test]
    fn relation5_is_edge_differences_and_four_gaps() {
        let (s, o) = (flat([0.0, 0.0, 10.0, 10.0]), flat([13.0, 14.0, 33.0, 24.0]));
        assert_eq!(relation5(&[&s, &o]), Some(vec![13.0, 14.0, 23.0, 14.0, 20.0]));
    }

    #[test]
    fn size_does_not_depend_on_position() {
        let (s, o) = (flat([0.0, 0.0, 10.0, 10.0]), flat([100.0, 7.0, 130.0, 12.0]));
        assert_eq!(size(&[&s, &o]), Some(vec![20.0, -5.0]));
    }

    #[test]
    fn volume_relation_tells_behind_from_above_where_the_image_does_not() {
        let pixels = [0.0, 0.0, 10.0, 10.0];
        let below = object(pixels, [0.0, 0.0, 0.025], [0.05; 3]);
        let above = object(pixels, [0.0, 0.0, 0.075], [0.05; 3]);
        let behind = object(pixels, [0.0, 0.11, 0.025], [0.05; 3]);
        let close = |a: Option<Vec<f64>>, b: [f64; 7]| {
            a.is_some_and(|a| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6))
        };
        let on = volume_relation(&[&above, &below]);
        assert!(close(on, [0.0, 0.0, 0.0, 0.0, -50.0, -50.0, 0.0]));
        let beside = volume_relation(&[&behind, &below]);
        assert!(close(beside, [0.0, 0.0, -110.0, -110.0, 0.0, 0.0, 240.0]));
    }

    #[test]
    fn a_feature_of_volumes_says_nothing_without_them() {
        let (s, o) = (flat([0.0, 0.0, 10.0, 10.0]), flat([13.0, 14.0, 33.0, 24.0]));
        assert_eq!(volume_relation(&[&s, &o]), None);
        assert_eq!(volume_size(&[&s, &o]), None);
    }

    #[test]
    fn features_are_sorted_and_have_their_arity() {
        assert!(FEATURES.is_sorted_by_key(|f| f.name));
        let o = object([1.0, 2.0, 3.0, 5.0], [0.0; 3], [0.05; 3]);
        for f in FEATURES {
            let vector = (f.compute)(&vec![&o; f.arity]);
            assert!(vector.is_some_and(|v| !v.is_empty()), "{}", f.name);
            assert_eq!((f.compute)(&vec![&o; f.arity + 1]), None, "{}", f.name);
        }
    }
}
