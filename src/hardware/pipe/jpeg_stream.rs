//! Where a JPEG image ends in a stream of them: it says no length.

/// Finds the images in bytes that come in pieces. What stands between two images is skipped.
#[derive(Debug, Default)]
pub(super) struct JpegStream {
    state: State,
}

/// What the next byte is (ITU-R T.81, B.1.1).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum State {
    /// Before an image.
    #[default]
    Outside,
    /// Perhaps the second byte of an image.
    Start,
    /// The first byte of a marker.
    Marker,
    /// The kind of a marker.
    Kind,
    /// The length of a segment, high byte.
    LengthHigh { is_scan: bool },
    /// The length of a segment, low byte.
    LengthLow { is_scan: bool, high: u8 },
    /// Bytes of a segment that are left.
    Segment { is_scan: bool, left: u16 },
    /// Pixels.
    Scan,
    /// A byte of pixels, or the kind of a marker among them.
    ScanKind,
}

/// What one byte is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JpegByte {
    /// Not of an image; what was taken of one is none.
    Outside,
    /// The second one of an image: it begins with [`IMAGE_START`].
    Second,
    /// Of an image.
    Inside,
    /// The last one of an image.
    Last,
}

/// The first two bytes of an image.
pub(super) const IMAGE_START: [u8; 2] = [0xff, START_OF_IMAGE];
const START_OF_IMAGE: u8 = 0xd8;
const END_OF_IMAGE: u8 = 0xd9;
const START_OF_SCAN: u8 = 0xda;

impl JpegStream {
    /// Takes the next byte.
    pub(super) fn push(&mut self, byte: u8) -> JpegByte {
        self.state = match (self.state, byte) {
            (State::Outside | State::Start, 0xff) => State::Start,
            (State::Start, START_OF_IMAGE) => {
                self.state = State::Marker;
                return JpegByte::Second;
            }
            (State::Marker | State::Kind, 0xff) => State::Kind,
            (State::Kind | State::ScanKind, END_OF_IMAGE) => {
                self.state = State::Outside;
                return JpegByte::Last;
            }
            // Markers that stand alone.
            (State::Kind, 0x01 | 0xd0..=0xd7) => State::Marker,
            (State::ScanKind, 0x00 | 0xd0..=0xd7) => State::Scan,
            (State::Scan | State::ScanKind, 0xff) => State::ScanKind,
            (State::Kind | State::ScanKind, kind) if kind != START_OF_IMAGE && kind != 0 => {
                State::LengthHigh { is_scan: kind == START_OF_SCAN }
            }
            (State::LengthHigh { is_scan }, high) => State::LengthLow { is_scan, high },
            (State::LengthLow { is_scan, high }, low) => {
                match u16::from_be_bytes([high, low]).checked_sub(2) {
                    Some(left) => after(is_scan, left),
                    None => State::Outside,
                }
            }
            (State::Segment { is_scan, left }, _) => after(is_scan, left.saturating_sub(1)),
            (State::Scan, _) => State::Scan,
            (State::Outside | State::Start | State::Marker | State::Kind | State::ScanKind, _) => {
                State::Outside
            }
        };
        let is_outside = matches!(self.state, State::Outside | State::Start);
        if is_outside { JpegByte::Outside } else { JpegByte::Inside }
    }
}

/// The state when so many bytes of a segment are left.
fn after(is_scan: bool, left: u16) -> State {
    match (is_scan, left) {
        (true, 0) => State::Scan,
        (false, 0) => State::Marker,
        (is_scan, left) => State::Segment { is_scan, left },
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::{ImageFormat, Rgb, RgbImage};
    use proptest::prelude::*;

    use super::*;

    fn images(bytes: &[u8]) -> Vec<Vec<u8>> {
        let (mut stream, mut image, mut found) = (JpegStream::default(), Vec::new(), Vec::new());
        for byte in bytes {
            match stream.push(*byte) {
                JpegByte::Outside => image.clear(),
                JpegByte::Second => image = IMAGE_START.to_vec(),
                JpegByte::Inside => image.push(*byte),
                JpegByte::Last => {
                    image.push(*byte);
                    found.push(std::mem::take(&mut image));
                }
            }
        }
        found
    }

    fn jpeg(seed: u8) -> Vec<u8> {
        let noise = |x: u32, y: u32| (x * 97 + y * 31 + u32::from(seed) * 7) as u8;
        let picture = RgbImage::from_fn(33, 17, |x, y| Rgb([noise(x, y), noise(y, x), seed]));
        let mut plain = Cursor::new(Vec::new());
        picture.write_to(&mut plain, ImageFormat::Jpeg).unwrap();
        let plain = plain.into_inner();
        // A preview in a segment before the pixels has an end of its own.
        let length = u16::try_from(plain.len() + 2).unwrap().to_be_bytes();
        [&plain[..2], &[0xff, 0xe1], &length, &plain, &plain[2..]].concat()
    }

    proptest! {
        #[test]
        fn images_are_found_whole_whatever_stands_between(
            seeds in proptest::collection::vec(any::<u8>(), 1..4),
            between in proptest::collection::vec(prop_oneof![Just(0xff), 0..0xd8_u8], 0..9),
        ) {
            let wanted: Vec<Vec<u8>> = seeds.into_iter().map(jpeg).collect();
            let stream: Vec<u8> =
                wanted.iter().flat_map(|image| [&between[..], image].concat()).collect();
            prop_assert_eq!(images(&stream), wanted);
        }

        #[test]
        fn foreign_bytes_are_no_panic(
            bytes in proptest::collection::vec(any::<u8>(), 0..3000),
        ) {
            for image in images(&bytes) {
                prop_assert!(image.ends_with(&[0xff, END_OF_IMAGE]));
            }
        }
    }
}
