//! A thing in an image that is neither an object nor anything that the labelled examples show.

use crate::geometry::PixelBox;

/// A thing is next to an object when it is nearer than this share of the object's short side.
const NEAR_SHARE: f64 = 0.25;

/// A thing that nothing explains: it may hide an object.
#[derive(Debug, Clone, PartialEq)]
pub struct Unexplained {
    /// The box around it, in pixels.
    pub place: PixelBox,
    /// Its pixels, as boxes of few rows.
    pub stripes: Vec<PixelBox>,
    /// Whether an object could be behind it: it is large enough.
    pub may_hide: bool,
}

impl Unexplained {
    /// Whether it is in front of an object, or beside it.
    pub fn is_near(&self, b: &PixelBox) -> bool {
        let near = NEAR_SHARE * b.width().min(b.height());
        self.stripes.iter().any(|stripe| stripe.gap(b) <= near)
    }
}
