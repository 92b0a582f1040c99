//! Axis-aligned boxes in an image.

use serde::{Deserialize, Serialize};

/// A box in pixels: x to the right, y down, origin at the top-left corner of the image.
/// Written `[x1, y1, x2, y2]` in files, as detectors do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 4]", into = "[f64; 4]")]
pub struct PixelBox {
    /// Left edge.
    pub x1: f64,
    /// Top edge.
    pub y1: f64,
    /// Right edge.
    pub x2: f64,
    /// Bottom edge.
    pub y2: f64,
}

impl From<[f64; 4]> for PixelBox {
    fn from([x1, y1, x2, y2]: [f64; 4]) -> Self {
        Self { x1, y1, x2, y2 }
    }
}

impl From<PixelBox> for [f64; 4] {
    fn from(b: PixelBox) -> Self {
        [b.x1, b.y1, b.x2, b.y2]
    }
}

impl PixelBox {
    /// Width in pixels.
    pub fn width(&self) -> f64 {
        self.x2 - self.x1
    }

    /// Height in pixels.
    pub fn height(&self) -> f64 {
        self.y2 - self.y1
    }

    /// Area in square pixels; zero for an inverted box.
    pub fn area(&self) -> f64 {
        self.width().max(0.0) * self.height().max(0.0)
    }

    /// Centre as (column, row).
    pub fn centre(&self) -> (f64, f64) {
        (f64::midpoint(self.x1, self.x2), f64::midpoint(self.y1, self.y2))
    }

    /// Whether all edges are finite and the box has an inside.
    pub fn is_valid(&self) -> bool {
        [self.x1, self.y1, self.x2, self.y2].iter().all(|v| v.is_finite()) && self.area() > 0.0
    }

    /// The common part, possibly inverted (area zero).
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        Self {
            x1: self.x1.max(other.x1),
            y1: self.y1.max(other.y1),
            x2: self.x2.min(other.x2),
            y2: self.y2.min(other.y2),
        }
    }

    /// The smallest box that contains both.
    #[must_use]
    pub fn hull(&self, other: &Self) -> Self {
        Self {
            x1: self.x1.min(other.x1),
            y1: self.y1.min(other.y1),
            x2: self.x2.max(other.x2),
            y2: self.y2.max(other.y2),
        }
    }

    /// Intersection over union, in 0..=1.
    pub fn iou(&self, other: &Self) -> f64 {
        let common = self.intersection(other).area();
        let union = self.area() + other.area() - common;
        if union > 0.0 { common / union } else { 0.0 }
    }

    /// Euclidean distance between the two boxes; zero when they touch or overlap.
    pub fn gap(&self, other: &Self) -> f64 {
        let dx = (other.x1 - self.x2).max(self.x1 - other.x2).max(0.0);
        let dy = (other.y1 - self.y2).max(self.y1 - other.y2).max(0.0);
        // Along one axis the answer is there already.
        if dx == 0.0 || dy == 0.0 { dx + dy } else { dx.hypot(dy) }
    }
}
