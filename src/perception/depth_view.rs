//! A borrowed depth image.

use thiserror::Error;

use super::ImageError;
use super::views::check_sides;

/// A depth image: metres along the optical axis, row by row from the top; 0 where unknown.
#[derive(Debug, Clone, Copy)]
pub struct DepthView<'a> {
    width: usize,
    depth_m: &'a [f32],
}

/// A depth image is not what it says it is.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DepthError {
    /// Its sides are not an image's.
    #[error(transparent)]
    Side(#[from] ImageError),
    /// The buffer does not have one value for each pixel.
    #[error("depth_m: expected {expected} values, got {got}")]
    Length {
        /// Width times height.
        expected: usize,
        /// The buffer's length.
        got: usize,
    },
}

/// Something is in front when it is nearer by more than this, in metres.
const NEARER_M: f64 = 0.015;

impl<'a> DepthView<'a> {
    /// Looks at a buffer as a depth image.
    ///
    /// # Errors
    /// [`DepthError`] naming the field when a side is zero or absurd, or the buffer's length is
    /// not width times height.
    pub fn new(width: usize, height: usize, depth_m: &'a [f32]) -> Result<Self, DepthError> {
        check_sides(width, height)?;
        let expected = width * height;
        if depth_m.len() != expected {
            return Err(DepthError::Length { expected, got: depth_m.len() });
        }
        Ok(Self { width, depth_m })
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.width, self.depth_m.len() / self.width].map(|n| n as u32)
    }

    /// The depth of one pixel in metres, `None` where it is unknown or outside the image.
    pub(super) fn at(&self, x: u32, y: u32) -> Option<f64> {
        let index = (x as usize) < self.width;
        let depth = index.then(|| self.depth_m.get(y as usize * self.width + x as usize));
        depth.flatten().map(|d| f64::from(*d)).filter(|d| d.is_finite() && *d > 0.0)
    }

    /// Whether what lies `beyond` (columns, rows) a pixel is nearer than `here_m`, or outside the image.
    pub(super) fn is_covered(&self, (x, y): (u32, u32), beyond: (i64, i64), here_m: f64) -> bool {
        let (x2, y2) = (i64::from(x) + beyond.0, i64::from(y) + beyond.1);
        let (Ok(x2), Ok(y2)) = (u32::try_from(x2), u32::try_from(y2)) else { return true };
        if x2 as usize >= self.width || y2 as usize >= self.depth_m.len() / self.width {
            return true;
        }
        self.at(x2, y2).is_some_and(|there_m| there_m < here_m - NEARER_M)
    }
}
