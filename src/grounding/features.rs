//! Spatial features of object tuples, computed on image boxes.

use crate::geometry::PixelBox;

/// A feature: a fixed number of boxes to a vector that nearest neighbours are sought in.
#[derive(Debug, Clone, Copy)]
pub struct Feature {
    /// Its name in `perception.toml`.
    pub name: &'static str,
    /// How many boxes it takes.
    pub arity: usize,
    /// Computes it; the slice has `arity` boxes, in the predicate's order.
    pub compute: fn(&[PixelBox]) -> Vec<f64>,
}

/// Every feature, in alphabetical order.
pub const FEATURES: &[Feature] = &[
    Feature { name: "relation5", arity: 2, compute: relation5 },
    Feature { name: "size", arity: 2, compute: size },
    Feature { name: "unary6", arity: 1, compute: unary6 },
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
fn relation5(boxes: &[PixelBox]) -> Vec<f64> {
    let [s, o] = boxes else { return Vec::new() };
    vec![o.x1 - s.x1, o.y1 - s.y1, o.x2 - s.x2, o.y2 - s.y2, 4.0 * s.gap(o)]
}

/// Width and height of the object minus those of the subject, in pixels: free of position.
fn size(boxes: &[PixelBox]) -> Vec<f64> {
    let [s, o] = boxes else { return Vec::new() };
    vec![o.width() - s.width(), o.height() - s.height()]
}

/// All differences between the edges of one box, in pixels. Depends on where the box is, since
/// rows are compared with columns.
///
/// Source: the reference implementation.
fn unary6(boxes: &[PixelBox]) -> Vec<f64> {
    let [b] = boxes else { return Vec::new() };
    vec![b.y2 - b.x2, b.y2 - b.y1, b.y2 - b.x1, b.x2 - b.y1, b.x2 - b.x1, b.y1 - b.x1]
}

/// Euclidean distance.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relation5_is_edge_differences_and_four_gaps() {
        let s = PixelBox::from([0.0, 0.0, 10.0, 10.0]);
        let o = PixelBox::from([13.0, 14.0, 33.0, 24.0]);
        assert_eq!(relation5(&[s, o]), vec![13.0, 14.0, 23.0, 14.0, 20.0]);
    }

    #[test]
    fn size_does_not_depend_on_position() {
        let s = PixelBox::from([0.0, 0.0, 10.0, 10.0]);
        let o = PixelBox::from([100.0, 7.0, 130.0, 12.0]);
        assert_eq!(size(&[s, o]), vec![20.0, -5.0]);
    }

    #[test]
    fn features_are_sorted_and_have_their_arity() {
        assert!(FEATURES.is_sorted_by_key(|f| f.name));
        let b = PixelBox::from([1.0, 2.0, 3.0, 5.0]);
        for f in FEATURES {
            assert!(!(f.compute)(&vec![b; f.arity]).is_empty(), "{}", f.name);
        }
    }
}
