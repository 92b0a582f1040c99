//! Points and rectangles of the picture, in pixels: x to the right, y down.

/// A point of the picture.
pub(super) type Point = (f32, f32);

/// An axis-aligned rectangle of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) x1: f32,
    pub(super) y1: f32,
    pub(super) x2: f32,
    pub(super) y2: f32,
}

impl Area {
    pub(super) fn new(x: f32, y: f32, width: f32, height: f32) -> Self {
        Self { x1: x, y1: y, x2: x + width, y2: y + height }
    }

    pub(super) fn width(&self) -> f32 {
        self.x2 - self.x1
    }

    pub(super) fn height(&self) -> f32 {
        self.y2 - self.y1
    }

    pub(super) fn centre(&self) -> Point {
        (f32::midpoint(self.x1, self.x2), f32::midpoint(self.y1, self.y2))
    }

    /// The area with `margin` more on each side.
    pub(super) fn grown(&self, margin: f32) -> Self {
        Self {
            x1: self.x1 - margin,
            y1: self.y1 - margin,
            x2: self.x2 + margin,
            y2: self.y2 + margin,
        }
    }

    pub(super) fn contains(&self, (x, y): Point) -> bool {
        (self.x1..=self.x2).contains(&x) && (self.y1..=self.y2).contains(&y)
    }

    /// Area of the common part.
    pub(super) fn overlap(&self, other: &Self) -> f32 {
        let width = self.x2.min(other.x2) - self.x1.max(other.x1);
        let height = self.y2.min(other.y2) - self.y1.max(other.y1);
        width.max(0.0) * height.max(0.0)
    }

    /// The nearest point of the area.
    pub(super) fn nearest(&self, (x, y): Point) -> Point {
        (x.clamp(self.x1, self.x2), y.clamp(self.y1, self.y2))
    }
}
