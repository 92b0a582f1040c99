//! Bytes of a camera to colours or distances: every encoding that cameras give, any row step.
//!
//! An encoding is always said, never guessed: red and blue look alike to a program.

mod depth;
mod packed;
mod yuv;
#[cfg(test)]
mod tests;

use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;

use super::file::decode_rgb;
use crate::mismatch::quoted;
use crate::transport::convert::FRAME_SIDE_MAX;

pub use yuv::YuvColours;

/// Largest row step, bytes: rows of the widest picture with as much again between them, and more.
const STRIDE_MAX: usize = 16 * FRAME_SIDE_MAX as usize;

/// How the bytes of a picture are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// Red, green, blue.
    Rgb8,
    /// Blue, green, red.
    Bgr8,
    /// Red, green, blue, and a byte that is not read.
    Rgba8,
    /// Blue, green, red, and a byte that is not read.
    Bgra8,
    /// Grey.
    Mono8,
    /// Two pixels as Y, U, Y, V; of ROS `yuv422_yuy2`.
    Yuyv,
    /// Two pixels as U, Y, V, Y; of ROS `yuv422`.
    Uyvy,
    /// A plane of Y, then one of U, V with half the rows, both of one row step.
    Nv12,
    /// One JPEG image a picture.
    Mjpeg,
    /// Depth: millimetres, 16 bits, low byte first; 0 is none.
    #[serde(rename = "16UC1")]
    Millimetres,
    /// Depth: millimetres, 16 bits, high byte first; 0 is none.
    #[serde(rename = "16UC1_be")]
    MillimetresBigEndian,
    /// Depth: metres, floating point of 32 bits, low byte first; what is not positive is none.
    #[serde(rename = "32FC1")]
    Metres,
    /// Depth: metres, floating point of 32 bits, high byte first; what is not positive is none.
    #[serde(rename = "32FC1_be")]
    MetresBigEndian,
}

/// A picture as colours or as distances.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// Packed RGB8, row by row.
    Rgb(Vec<u8>),
    /// Distance along the optical axis in metres, row by row; 0 is none.
    DepthM(Vec<f32>),
}

/// How a picture lies in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelLayout {
    /// What its bytes are.
    pub encoding: Encoding,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Bytes from one row to the next; `None` where rows follow one another without a gap.
    pub stride: Option<u32>,
    /// What Y, U and V mean, where the encoding has them.
    pub yuv: YuvColours,
}

/// Bytes are not a picture of a layout.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PixelError {
    /// No picture has that size.
    #[error("size: expected 1 to {FRAME_SIDE_MAX} pixels a side, got {width}x{height}")]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Pixels share their colours in pairs.
    #[error("size: expected even sides for this encoding, got {width}x{height}")]
    Odd {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Rows would lie in one another, or far apart.
    #[error("stride: expected {row_bytes} to {STRIDE_MAX} bytes a row, got {stride}")]
    Stride {
        /// Bytes of a row.
        row_bytes: usize,
        /// Bytes from one row to the next.
        stride: u32,
    },
    /// There are too few bytes, or too many.
    #[error("expected {expected} bytes a picture, got {got}")]
    Length {
        /// Bytes with those between the rows.
        expected: usize,
        /// Bytes that are there.
        got: usize,
    },
    /// A compressed image is of another size.
    #[error("expected {}x{} pixels, got {}x{}", expected[0], expected[1], got[0], got[1])]
    OtherSize {
        /// Columns and rows.
        expected: [u32; 2],
        /// Columns and rows of the image.
        got: [u32; 2],
    },
    /// A compressed image is none.
    #[error("{reason}")]
    Image {
        /// Why.
        reason: String,
    },
}

impl Encoding {
    /// The encoding that ROS 2 and Foxglove call `name`.
    ///
    /// # Errors
    /// What is known, where the name is not, or leaves the order of colours open.
    pub fn of_ros(name: &str, is_big_endian: bool) -> Result<Self, String> {
        Ok(match (name, is_big_endian) {
            ("rgb8", _) => Self::Rgb8,
            ("bgr8", _) => Self::Bgr8,
            ("rgba8", _) => Self::Rgba8,
            ("bgra8", _) => Self::Bgra8,
            ("mono8", _) => Self::Mono8,
            ("yuv422_yuy2" | "yuyv", _) => Self::Yuyv,
            ("yuv422" | "uyvy", _) => Self::Uyvy,
            ("nv12", _) => Self::Nv12,
            ("16UC1", false) => Self::Millimetres,
            ("16UC1", true) => Self::MillimetresBigEndian,
            ("32FC1", false) => Self::Metres,
            ("32FC1", true) => Self::MetresBigEndian,
            (other, _) => {
                return Err(format!(
                    "encoding: expected rgb8, bgr8, rgba8, bgra8, mono8, yuv422_yuy2, yuyv, yuv422, uyvy, \
                     nv12, 16UC1 or 32FC1, got {}",
                    quoted(other)
                ));
            }
        })
    }

    /// Whether pictures of it are distances.
    pub fn is_depth(self) -> bool {
        matches!(
            self,
            Self::Millimetres | Self::MillimetresBigEndian | Self::Metres | Self::MetresBigEndian
        )
    }

    /// Bytes of `width` pixels; none where the image is compressed.
    fn row_bytes(self, width: usize) -> Option<usize> {
        Some(match self {
            Self::Rgb8 | Self::Bgr8 => 3 * width,
            Self::Rgba8 | Self::Bgra8 | Self::Metres | Self::MetresBigEndian => 4 * width,
            Self::Mono8 | Self::Nv12 => width,
            Self::Yuyv | Self::Uyvy | Self::Millimetres | Self::MillimetresBigEndian => 2 * width,
            Self::Mjpeg => return None,
        })
    }

    /// Rows in memory of a picture of `height` rows.
    fn rows(self, height: usize) -> usize {
        if self == Self::Nv12 { height + height / 2 } else { height }
    }
}

/// The rows of a picture: where they are, and how long each is.
#[derive(Debug, Clone, Copy)]
struct Rows {
    row_bytes: usize,
    stride: usize,
    n: usize,
}

impl Rows {
    /// Bytes from the first to the last, with those after the last one.
    fn bytes(self) -> usize {
        self.stride * self.n
    }

    /// Rows `from` and on.
    fn of(self, bytes: &[u8], from: usize) -> impl Iterator<Item = &[u8]> {
        let rows = bytes.chunks(self.stride).skip(from);
        rows.map(move |row| row.get(..self.row_bytes).unwrap_or(row))
    }
}

impl PixelLayout {
    /// Bytes of one picture, with those between its rows; none for compressed images, which say it
    /// themselves.
    ///
    /// # Errors
    /// [`PixelError`]: there is no such picture.
    pub fn bytes(&self) -> Result<Option<usize>, PixelError> {
        Ok(self.rows()?.map(Rows::bytes))
    }

    fn rows(&self) -> Result<Option<Rows>, PixelError> {
        let [width, height] = self.size;
        let sides = 1..=FRAME_SIDE_MAX;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(PixelError::Size { width, height });
        }
        let (in_pairs, in_fours) = match self.encoding {
            Encoding::Yuyv | Encoding::Uyvy => (true, false),
            Encoding::Nv12 => (true, true),
            Encoding::Rgb8
            | Encoding::Bgr8
            | Encoding::Rgba8
            | Encoding::Bgra8
            | Encoding::Mono8
            | Encoding::Mjpeg
            | Encoding::Millimetres
            | Encoding::MillimetresBigEndian
            | Encoding::Metres
            | Encoding::MetresBigEndian => (false, false),
        };
        if (in_pairs && width % 2 != 0) || (in_fours && height % 2 != 0) {
            return Err(PixelError::Odd { width, height });
        }
        let Some(row_bytes) = self.encoding.row_bytes(width as usize) else { return Ok(None) };
        let stride = self.stride.map_or(row_bytes, |stride| stride as usize);
        if !(row_bytes..=STRIDE_MAX).contains(&stride) {
            return Err(PixelError::Stride { row_bytes, stride: self.stride.unwrap_or(0) });
        }
        Ok(Some(Rows { row_bytes, stride, n: self.encoding.rows(height as usize) }))
    }
}

/// The colours or distances that `bytes` are. What follows the last row up to the row step may be left out.
///
/// # Errors
/// [`PixelError`]: the bytes are no picture of that layout.
pub fn decode(layout: &PixelLayout, bytes: &[u8]) -> Result<Pixels, PixelError> {
    let Some(rows) = layout.rows()? else { return jpeg(layout.size, bytes).map(Pixels::Rgb) };
    let expected = rows.bytes();
    if !(expected - (rows.stride - rows.row_bytes)..=expected).contains(&bytes.len()) {
        return Err(PixelError::Length { expected, got: bytes.len() });
    }
    let all = rows.of(bytes, 0);
    Ok(match layout.encoding {
        Encoding::Rgb8 => Pixels::Rgb(packed::rgb(all)),
        Encoding::Bgr8 => Pixels::Rgb(packed::of_pixels::<3>(all, [2, 1, 0])),
        Encoding::Rgba8 => Pixels::Rgb(packed::of_pixels::<4>(all, [0, 1, 2])),
        Encoding::Bgra8 => Pixels::Rgb(packed::of_pixels::<4>(all, [2, 1, 0])),
        Encoding::Mono8 => Pixels::Rgb(packed::of_pixels::<1>(all, [0, 0, 0])),
        Encoding::Yuyv => Pixels::Rgb(yuv::of_pairs(all, [0, 1, 2, 3], layout.yuv)),
        Encoding::Uyvy => Pixels::Rgb(yuv::of_pairs(all, [1, 0, 3, 2], layout.yuv)),
        Encoding::Nv12 => {
            let height = layout.size[1] as usize;
            Pixels::Rgb(yuv::of_planes(all.take(height), rows.of(bytes, height), layout.yuv))
        }
        Encoding::Mjpeg => Pixels::Rgb(jpeg(layout.size, bytes)?),
        Encoding::Millimetres => Pixels::DepthM(depth::of_mm(all, u16::from_le_bytes)),
        Encoding::MillimetresBigEndian => Pixels::DepthM(depth::of_mm(all, u16::from_be_bytes)),
        Encoding::Metres => Pixels::DepthM(depth::of_m(all, f32::from_le_bytes)),
        Encoding::MetresBigEndian => Pixels::DepthM(depth::of_m(all, f32::from_be_bytes)),
    })
}

/// A JPEG image of that size.
fn jpeg(expected: [u32; 2], bytes: &[u8]) -> Result<Vec<u8>, PixelError> {
    let image =
        decode_rgb(bytes).map_err(|error| PixelError::Image { reason: error.to_string() })?;
    let got = [image.width(), image.height()];
    if got != expected {
        return Err(PixelError::OtherSize { expected, got });
    }
    Ok(image.into_raw())
}
