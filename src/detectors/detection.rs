//! What a detector says of one object.

use crate::geometry::PixelBox;
use crate::pddl::Name;

/// Pixels `x_start..x_end` of row `y`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RowRun {
    /// The row.
    pub y: u32,
    /// First column.
    pub x_start: u32,
    /// One past the last column.
    pub x_end: u32,
}

/// One detected object, not yet named.
#[derive(Debug, Clone, PartialEq)]
pub struct Detection {
    /// Its PDDL type.
    pub type_name: Name,
    /// What tells it from others of its type: a colour, or another detector's class text.
    pub label: Name,
    /// Its box: left and top edge of its first pixels, right and bottom edge of its last.
    pub pixel_box: PixelBox,
    /// Confidence in 0..=1.
    pub score: f32,
    /// Its pixels, top to bottom and left to right.
    pub mask: Vec<RowRun>,
}

impl Detection {
    /// The number of pixels in the mask.
    pub fn mask_area(&self) -> usize {
        self.mask.iter().map(|r| (r.x_end - r.x_start) as usize).sum()
    }
}
