//! Where an object is, upwards and sideways: in the image of an upright camera, or in the world.

use crate::perception::model::ObjectBox;

/// The edges of an object: least and greatest coordinate along each direction, in pixels or metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// Against gravity.
    up: [f64; 2],
    /// Across the image; in the world along x and y.
    sides: [[f64; 2]; 2],
}

impl Extent {
    /// From the volume where there is one and `deep` asks for it, from the image otherwise.
    pub(super) fn of(object: &ObjectBox, deep: bool) -> Self {
        if let Some(volume) = object.volume.filter(|_| deep) {
            return Self { up: volume.span(2), sides: [volume.span(0), volume.span(1)] };
        }
        let b = object.pixel_box;
        // Rows count downwards. The image has one direction sideways only.
        Self { up: [-b.y2, -b.y1], sides: [[b.x1, b.x2]; 2] }
    }

    pub(super) fn bottom(&self) -> f64 {
        self.up[0]
    }

    pub(super) fn height(&self) -> f64 {
        self.up[1] - self.up[0]
    }

    /// Twice the height of the middle.
    pub(super) fn level(&self) -> f64 {
        self.up[0] + self.up[1]
    }

    fn width(&self) -> f64 {
        self.sides.iter().map(|[low, high]| high - low).sum::<f64>() / 2.0
    }

    /// How far the lower edge of what lies on `below` is under the upper edge of `below`, as a share
    /// of their mean width. Seen from above at an angle, boxes of touching objects overlap so.
    pub(super) fn sunk(&self, below: &Self) -> f64 {
        share(below.up[1] - self.up[0], f64::midpoint(self.width(), below.width()))
    }

    /// Whether this touches `below`: 1 without a gap, 0 with half an object's height between them,
    /// which is halfway to room for another object, -1 with a whole height or more. `sunk` is the
    /// share by which touching objects overlap.
    pub(super) fn touches(&self, below: &Self, sunk: f64) -> f64 {
        let gap = self.up[0] - below.up[1] + sunk * f64::midpoint(self.width(), below.width());
        let height = f64::midpoint(self.height(), below.height());
        clamped(1.0 - share(gap, height / 2.0))
    }

    /// Whether the middle of this is over `below`: 1 in its middle, 0 at an edge, down to -1.
    pub(super) fn is_over(&self, below: &Self) -> f64 {
        let along = |(own, other): (&[f64; 2], &[f64; 2])| {
            let middle = f64::midpoint(own[0], own[1]);
            let inside = (middle - other[0]).min(other[1] - middle);
            clamped(share(inside, (other[1] - other[0]) / 2.0))
        };
        self.sides.iter().zip(&below.sides).map(along).fold(1.0, f64::min)
    }

    /// Whether each of the two has the middle of the other over or under it.
    pub(super) fn is_in_column_with(&self, other: &Self) -> bool {
        self.is_over(other) > 0.0 && other.is_over(self) > 0.0
    }
}

/// A quotient that is 0 where it has no value.
pub(super) fn share(part: f64, whole: f64) -> f64 {
    let share = part / whole;
    if share.is_finite() { share } else { 0.0 }
}

fn clamped(value: f64) -> f64 {
    value.clamp(-1.0, 1.0)
}
