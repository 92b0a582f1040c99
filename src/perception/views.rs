//! A borrowed colour image.

use thiserror::Error;

/// A packed RGB image: three bytes a pixel, row by row from the top, no padding.
#[derive(Debug, Clone, Copy)]
pub struct ImageView<'a> {
    width: usize,
    height: usize,
    rgb: &'a [u8],
}

/// An image is not what it says it is.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ImageError {
    /// A side that no camera has.
    #[error("{field}: expected 1..={limit} pixels, got {got}")]
    Side {
        /// `width` or `height`.
        field: &'static str,
        /// The most there may be.
        limit: usize,
        /// What it is.
        got: usize,
    },
    /// The buffer does not have three bytes for each pixel.
    #[error("rgb: expected {expected} bytes, got {got}")]
    Length {
        /// Three times width times height.
        expected: usize,
        /// The buffer's length.
        got: usize,
    },
}

/// Longest side of an image, in pixels.
pub(super) const SIDE_MAX: usize = 16_384;

impl<'a> ImageView<'a> {
    /// Looks at a buffer as an image.
    ///
    /// # Errors
    /// [`ImageError`] naming the field when a side is zero or absurd, or the buffer's length is
    /// not three times width times height.
    pub fn new(width: usize, height: usize, rgb: &'a [u8]) -> Result<Self, ImageError> {
        check_sides(width, height)?;
        let expected = 3 * width * height;
        if rgb.len() != expected {
            return Err(ImageError::Length { expected, got: rgb.len() });
        }
        Ok(Self { width, height, rgb })
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All bytes, row by row.
    pub fn rgb(&self) -> &'a [u8] {
        self.rgb
    }

    /// The bytes of one row; empty below the image.
    pub fn row(&self, y: usize) -> &'a [u8] {
        let n = 3 * self.width;
        self.rgb.get(y * n..(y + 1) * n).unwrap_or(&[])
    }

    /// The colour of one pixel; `None` outside the image.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        self.row(y).as_chunks().0.get(x).copied()
    }
}

/// Checks both sides of an image.
pub(super) fn check_sides(width: usize, height: usize) -> Result<(), ImageError> {
    for (field, got) in [("width", width), ("height", height)] {
        if !(1..=SIDE_MAX).contains(&got) {
            return Err(ImageError::Side { field, limit: SIDE_MAX, got });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_side_or_length_is_named() {
        let error = ImageView::new(0, 4, &[]).unwrap_err();
        assert_eq!(error.to_string(), "width: expected 1..=16384 pixels, got 0");
        let error = ImageView::new(2, 2, &[0; 11]).unwrap_err();
        assert_eq!(error.to_string(), "rgb: expected 12 bytes, got 11");
    }

    #[test]
    fn pixels_are_read_row_by_row() {
        let rgb: Vec<u8> = (0..12).collect();
        let image = ImageView::new(2, 2, &rgb).unwrap();
        assert_eq!(image.pixel(1, 1), Some([9, 10, 11]));
        assert_eq!(image.pixel(2, 1), None);
        assert_eq!(image.pixel(0, 2), None);
    }
}
