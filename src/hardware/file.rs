//! Image files, whole or refused.

use std::path::Path;

use image::{ImageFormat, RgbImage};
use thiserror::Error;

/// An image file is not usable.
#[derive(Debug, Error)]
pub enum ImageFileError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] std::io::Error),
    /// It is not an image.
    #[error(transparent)]
    Decode(#[from] image::ImageError),
    /// It is not an image of 16 bits a pixel.
    #[error("expected a grey image of 16 bits a pixel, which are millimetres")]
    NoDepth {},
    /// It is a part of an image.
    #[error("the file ends before the image does")]
    Cut {},
}

/// Reads an image file (PNG or JPEG) as RGB.
///
/// # Errors
/// [`ImageFileError`] when it is missing, truncated, or not an image.
pub fn read_rgb(path: &Path) -> Result<RgbImage, ImageFileError> {
    decode_rgb(&std::fs::read(path)?)
}

/// The image that a file's bytes hold, as RGB.
///
/// # Errors
/// [`ImageFileError`] when it is truncated, or not an image.
pub fn decode_rgb(bytes: &[u8]) -> Result<RgbImage, ImageFileError> {
    let format = image::guess_format(bytes)?;
    // The decoder paints what is missing of a JPEG grey, and says nothing.
    if format == ImageFormat::Jpeg && !jpeg_has_end(bytes) {
        return Err(ImageFileError::Cut {});
    }
    Ok(image::load_from_memory_with_format(bytes, format)?.into_rgb8())
}

/// Columns and rows of a PNG of millimetres, and its distances in metres, row by row; 0 is none.
///
/// # Errors
/// [`ImageFileError`] when it is no image, or none of 16 bits a pixel.
pub fn decode_depth_mm(bytes: &[u8]) -> Result<([u32; 2], Vec<f32>), ImageFileError> {
    const MM_PER_M: f32 = 1000.0;
    let image::DynamicImage::ImageLuma16(image) = image::load_from_memory(bytes)? else {
        return Err(ImageFileError::NoDepth {});
    };
    let depth_m = image.iter().map(|mm| f32::from(*mm) / MM_PER_M).collect();
    Ok(([image.width(), image.height()], depth_m))
}

/// Whether an end marker follows the pixels. Segments before the pixels are skipped by their
/// length (ITU-T T.81, B.1.1.4), since a preview in one of them has an end marker of its own.
fn jpeg_has_end(bytes: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
    let mut rest = bytes.get(2..).unwrap_or_default();
    while let [0xff, kind, after @ ..] = rest {
        rest = match (*kind, after) {
            (START_OF_SCAN, pixels) => return pixels.windows(2).any(|pair| pair == END_OF_IMAGE),
            (0xff, _) => rest.get(1..).unwrap_or_default(), // a fill byte
            (_, [high, low, ..]) => {
                let length = usize::from(u16::from_be_bytes([*high, *low]));
                after.get(length.max(2)..).unwrap_or_default()
            }
            (_, _) => return false,
        };
    }
    false
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// A JPEG with a preview in a segment before its pixels.
    fn jpeg() -> Vec<u8> {
        let picture = RgbImage::from_fn(40, 30, |x, y| image::Rgb([x as u8 * 6, y as u8 * 8, 9]));
        let mut plain = Cursor::new(Vec::new());
        picture.write_to(&mut plain, ImageFormat::Jpeg).unwrap();
        let plain = plain.into_inner();
        let length = u16::try_from(plain.len() + 2).unwrap().to_be_bytes();
        [&plain[..2], &[0xff, 0xe1], &length, &plain, &plain[2..]].concat()
    }

    #[test]
    fn a_jpeg_is_read_whole_or_refused_wherever_it_is_cut() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture");
        let whole = jpeg();
        std::fs::write(&path, &whole).unwrap();
        assert_eq!(read_rgb(&path).unwrap().dimensions(), (40, 30));
        for n_bytes in 0..whole.len() {
            std::fs::write(&path, &whole[..n_bytes]).unwrap();
            assert!(read_rgb(&path).is_err(), "{n_bytes} of {} bytes", whole.len());
        }
        // Some cameras write something of their own after the image.
        std::fs::write(&path, [&whole[..], b"made by a camera"].concat()).unwrap();
        assert!(read_rgb(&path).is_ok());
    }
}
