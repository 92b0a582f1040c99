//! Boxes that are a little off, as detectors draw them.

use schemars::JsonSchema;
use serde::Serialize;

use super::recorded::Pair;
use crate::draws::Draws;
use crate::geometry::PixelBox;
use crate::perception::model::ObjectBox;

/// How boxes are disturbed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Jitter {
    /// Standard deviation of the noise on every coordinate, in pixels.
    pub px: f64,
    /// How many seeds are averaged over; they are 0, 1, 2, …
    pub seeds: u64,
}

/// The boxes of a test with Gaussian noise on every coordinate, drawn anew for each seed and pair.
///
/// No detector gives a box without an inside, so edges that come to lie the wrong way round are
/// swapped.
pub fn disturbed(boxes: &[ObjectBox], px: f64, seed: u64, (e, t): Pair) -> Vec<ObjectBox> {
    let mut draws = Draws::stream(seed, u64::from(e) << 32 | u64::from(t));
    let mut moved = |value: f64| value + px * draws.normal();
    let mut disturb = |object: &ObjectBox| {
        let PixelBox { x1, y1, x2, y2 } = object.pixel_box;
        let [x1, y1, x2, y2] = [x1, y1, x2, y2].map(&mut moved);
        let (x1, x2, y1, y2) = (x1.min(x2), x1.max(x2), y1.min(y2), y1.max(y2));
        ObjectBox { pixel_box: PixelBox { x1, y1, x2, y2 }, ..object.clone() }
    };
    boxes.iter().map(&mut disturb).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::Name;

    fn boxes(n: usize) -> Vec<ObjectBox> {
        let pixel_box = PixelBox::from([100.0, 100.0, 200.0, 200.0]);
        (0..n)
            .map(|i| ObjectBox::new(Name::new(format!("o{i}")), "thing".into(), pixel_box))
            .collect()
    }

    #[test]
    fn the_same_seed_and_pair_give_the_same_boxes_and_others_others() {
        let boxes = boxes(3);
        let one = disturbed(&boxes, 2.0, 1, (2, 3));
        assert_eq!(one, disturbed(&boxes, 2.0, 1, (2, 3)));
        assert_ne!(one, disturbed(&boxes, 2.0, 2, (2, 3)));
        assert_ne!(one, disturbed(&boxes, 2.0, 1, (3, 2)));
        assert_eq!(boxes, disturbed(&boxes, 0.0, 1, (2, 3)));
    }

    #[test]
    fn the_noise_has_the_spread_that_is_asked_for() {
        let disturbed = disturbed(&boxes(2000), 3.0, 5, (1, 2));
        let offsets = disturbed.iter().map(|b| b.pixel_box.x1 - 100.0);
        let variance = offsets.map(|d| d * d).sum::<f64>() / 2000.0;
        assert!((variance.sqrt() - 3.0).abs() < 0.2, "{variance}");
    }

    #[test]
    fn boxes_keep_an_inside() {
        let small = ObjectBox::new("a".into(), "t".into(), PixelBox::from([5.0, 5.0, 6.0, 6.0]));
        let disturbed = disturbed(&vec![small; 100], 10.0, 0, (1, 2));
        assert!(disturbed.iter().all(|b| b.pixel_box.is_valid()));
    }
}
