//! A frame as text.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use schemars::JsonSchema;
use serde::Deserialize;
use sha2::{Digest as _, Sha256};

use crate::perception::ImageView;

/// How much of a frame a JPEG keeps, of 100: what is lost is less than sensor noise.
const JPEG_QUALITY: u8 = 92;

/// How frames are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum Encoding {
    /// Nothing is lost.
    Png,
    /// About a tenth of the size, for slow connections.
    Jpeg,
}

impl Encoding {
    /// The MIME type.
    pub(super) fn mime(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
        }
    }

    /// What stands for the frame in records: its size and a hash of its pixels, which no version of an
    /// encoder changes.
    pub(super) fn name(self, frame: &ImageView<'_>) -> String {
        let (mime, width, height) = (self.mime(), frame.width(), frame.height());
        format!("{mime}, {width} x {height} pixels, sha256 {:x}", Sha256::digest(frame.rgb()))
    }

    /// The frame in this encoding, base64.
    pub(super) fn base64(self, frame: &ImageView<'_>) -> Result<String, image::ImageError> {
        let (width, height) = (frame.width() as u32, frame.height() as u32);
        let mut bytes = Vec::new();
        match self {
            Self::Png => {
                let encoder = PngEncoder::new(&mut bytes);
                encoder.write_image(frame.rgb(), width, height, ExtendedColorType::Rgb8)?;
            }
            Self::Jpeg => {
                let encoder = JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY);
                encoder.write_image(frame.rgb(), width, height, ExtendedColorType::Rgb8)?;
            }
        }
        Ok(STANDARD.encode(bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_comes_back_from_its_text() {
        let rgb: Vec<u8> = (0..3 * 20 * 10).map(|i| (i % 251) as u8).collect();
        let frame = ImageView::new(20, 10, &rgb).unwrap();
        for encoding in [Encoding::Png, Encoding::Jpeg] {
            let bytes = STANDARD.decode(encoding.base64(&frame).unwrap()).unwrap();
            let read = image::load_from_memory(&bytes).unwrap().to_rgb8();
            assert_eq!((read.width(), read.height()), (20, 10));
            assert_eq!(image::guess_format(&bytes).unwrap().to_mime_type(), encoding.mime());
            assert!(encoding == Encoding::Jpeg || *read.as_raw() == rgb);
        }
    }
}
