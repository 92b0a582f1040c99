//! Known colours, and bytes that are none.

use std::io::Cursor;

use image::{ImageFormat, Rgb, RgbImage};
use proptest::prelude::*;

use super::*;

const ALL: [Encoding; 13] = [
    Encoding::Rgb8,
    Encoding::Bgr8,
    Encoding::Rgba8,
    Encoding::Bgra8,
    Encoding::Mono8,
    Encoding::Yuyv,
    Encoding::Uyvy,
    Encoding::Nv12,
    Encoding::Mjpeg,
    Encoding::Millimetres,
    Encoding::MillimetresBigEndian,
    Encoding::Metres,
    Encoding::MetresBigEndian,
];

fn layout(encoding: Encoding, size: [u32; 2]) -> PixelLayout {
    PixelLayout { encoding, size, stride: None, yuv: YuvColours::Bt601 }
}

#[track_caller]
fn rgb(layout: PixelLayout, bytes: &[u8]) -> Vec<u8> {
    let pixels = decode(&layout, bytes).unwrap();
    let Pixels::Rgb(rgb) = pixels else { panic!("{pixels:?}") };
    rgb
}

/// No byte is off by more than `off`.
#[track_caller]
fn close(got: &[u8], expected: &[u8], off: u8) {
    let is_close = got.iter().zip(expected).all(|(a, b)| a.abs_diff(*b) <= off);
    assert!(got.len() == expected.len() && is_close, "{got:?}, expected {expected:?}");
}

#[test]
fn orders_of_colours_are_told_apart() {
    let orange = [255, 128, 0];
    for (encoding, bytes) in [
        (Encoding::Rgb8, &[255, 128, 0][..]),
        (Encoding::Bgr8, &[0, 128, 255]),
        (Encoding::Rgba8, &[255, 128, 0, 7]),
        (Encoding::Bgra8, &[0, 128, 255, 7]),
    ] {
        assert_eq!(rgb(layout(encoding, [2, 1]), &bytes.repeat(2)), orange.repeat(2));
    }
    assert_eq!(rgb(layout(Encoding::Mono8, [2, 1]), &[9, 200]), [9, 9, 9, 200, 200, 200]);
}

/// What `OpenCV` 5.0 makes of these colours with `COLOR_RGB2YUV_YUY2`: Y, U and V.
const OF_OPENCV: [([u8; 3], [u8; 3]); 7] = [
    ([255, 0, 0], [82, 90, 240]),
    ([0, 255, 0], [145, 54, 34]),
    ([0, 0, 255], [41, 240, 110]),
    ([255, 255, 255], [235, 128, 128]),
    ([0, 0, 0], [16, 128, 128]),
    ([128, 128, 128], [126, 128, 128]),
    ([200, 100, 50], [123, 91, 175]),
];

#[test]
fn yuv_is_read_as_opencv_writes_it() {
    for (colour, [y, u, v]) in OF_OPENCV {
        let expected = colour.repeat(4);
        for (encoding, bytes) in [
            (Encoding::Yuyv, [y, u, y, v].repeat(2)),
            (Encoding::Uyvy, [u, y, v, y].repeat(2)),
            (Encoding::Nv12, vec![y, y, y, y, u, v]),
        ] {
            close(&rgb(layout(encoding, [2, 2]), &bytes), &expected, 1);
        }
    }
}

/// Full range is that of `COLOR_RGB2YCrCb`; red of BT.709 is that of its table of primaries.
#[test]
fn ranges_and_standards_are_told_apart() {
    for (yuv, bytes, colour) in [
        (YuvColours::Bt601Full, [76, 85, 76, 255], [255, 0, 0]),
        (YuvColours::Bt601Full, [255, 128, 255, 128], [255, 255, 255]),
        (YuvColours::Bt601Full, [124, 86, 124, 182], [200, 100, 50]),
        (YuvColours::Bt709, [63, 102, 63, 240], [255, 0, 0]),
        (YuvColours::Bt709, [173, 42, 173, 26], [0, 255, 0]),
        (YuvColours::Bt709Full, [18, 255, 18, 116], [0, 0, 255]),
    ] {
        let got = rgb(PixelLayout { yuv, ..layout(Encoding::Yuyv, [2, 1]) }, &bytes);
        close(&got, &colour.repeat(2), 2);
    }
}

#[test]
fn each_pixel_of_a_pair_and_of_a_square_has_its_own_brightness() {
    let grey = |values: [u8; 4]| values.map(|v| [v; 3]).concat();
    let expected = grey([0, 255, 128, 0]);
    let got = rgb(layout(Encoding::Yuyv, [4, 1]), &[16, 128, 235, 128, 126, 128, 16, 128]);
    close(&got, &expected, 0);
    let got = rgb(layout(Encoding::Nv12, [2, 2]), &[16, 235, 126, 16, 128, 128]);
    close(&got, &expected, 0);
}

#[test]
fn depth_is_metres_whatever_its_byte_order() {
    let depth = |encoding, bytes: &[u8]| decode(&layout(encoding, [2, 1]), bytes).unwrap();
    let of_mm = Pixels::DepthM(vec![0.0, 1.5]);
    assert_eq!(depth(Encoding::Millimetres, &[0, 0, 0xdc, 0x05]), of_mm);
    assert_eq!(depth(Encoding::MillimetresBigEndian, &[0, 0, 0x05, 0xdc]), of_mm);
    let (bad, good) = (f32::NAN, 0.75_f32);
    let expected = Pixels::DepthM(vec![0.0, 0.75]);
    let bytes = [bad.to_le_bytes(), good.to_le_bytes()].concat();
    assert_eq!(depth(Encoding::Metres, &bytes), expected);
    let bytes = [(-good).to_be_bytes(), good.to_be_bytes()].concat();
    assert_eq!(depth(Encoding::MetresBigEndian, &bytes), expected);
}

/// Colours of many frequencies as a JPEG.
fn jpeg(width: u32, height: u32) -> Vec<u8> {
    let picture = RgbImage::from_fn(width, height, |x, y| Rgb([x as u8 * 5, y as u8 * 7, 90]));
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
    bytes.into_inner()
}

/// Cameras of USB leave the Huffman tables of the standard out and say so in their first segment.
#[test]
fn motion_jpeg_without_tables_is_read_as_with_them() {
    let whole = jpeg(40, 24);
    let mut bare = whole[..2].to_vec();
    bare.extend(b"\xff\xe0\x00\x10AVI1\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00");
    let mut at = 2;
    while whole[at + 1] != 0xda {
        let length = 2 + usize::from(u16::from_be_bytes([whole[at + 2], whole[at + 3]]));
        if !matches!(whole[at + 1], 0xc4 | 0xe0) {
            bare.extend(&whole[at..at + length]);
        }
        at += length;
    }
    bare.extend(&whole[at..]);
    assert!(bare.len() < whole.len());
    let layout = layout(Encoding::Mjpeg, [40, 24]);
    assert_eq!(rgb(layout, &bare), rgb(layout, &whole));
}

#[test]
fn what_is_no_picture_is_told() {
    let told = |layout: PixelLayout, bytes: &[u8]| decode(&layout, bytes).unwrap_err().to_string();
    let rgb8 = layout(Encoding::Rgb8, [2, 2]);
    assert_eq!(told(rgb8, &[0; 11]), "expected 12 bytes a picture, got 11");
    assert_eq!(told(rgb8, &[0; 13]), "expected 12 bytes a picture, got 13");
    let narrow = PixelLayout { stride: Some(5), ..rgb8 };
    assert_eq!(told(narrow, &[0; 12]), "stride: expected 6 to 131072 bytes a row, got 5");
    let wide = PixelLayout { stride: Some(u32::MAX), ..rgb8 };
    assert!(told(wide, &[0; 12]).contains("131072"));
    for size in [[0, 2], [2, 8193]] {
        assert!(told(layout(Encoding::Rgb8, size), &[]).starts_with("size: expected 1 to 8192"));
    }
    assert!(told(layout(Encoding::Yuyv, [3, 2]), &[0; 12]).contains("even sides"));
    assert!(told(layout(Encoding::Nv12, [2, 3]), &[0; 9]).contains("even sides"));
    let said = told(layout(Encoding::Mjpeg, [8, 8]), &jpeg(16, 8));
    assert_eq!(said, "expected 8x8 pixels, got 16x8");
    let half = &jpeg(8, 8)[..200];
    assert!(told(layout(Encoding::Mjpeg, [8, 8]), half).contains("ends before"));
}

#[test]
fn names_of_ros_are_known_and_others_told() {
    assert_eq!(Encoding::of_ros("yuv422", false), Ok(Encoding::Uyvy));
    assert_eq!(Encoding::of_ros("yuv422_yuy2", true), Ok(Encoding::Yuyv));
    assert_eq!(Encoding::of_ros("16UC1", true), Ok(Encoding::MillimetresBigEndian));
    let said = Encoding::of_ros("8UC3", false).unwrap_err();
    assert!(said.contains("expected rgb8, bgr8") && said.ends_with("got \"8UC3\""), "{said}");
}

proptest! {
    /// Whatever the bytes are, there is a picture of the right size or an error.
    #[test]
    fn foreign_bytes_are_a_picture_or_an_error(
        which in 0..ALL.len(),
        size in [0..40_u32, 0..40_u32],
        stride in proptest::option::of(0..200_u32),
        bytes in proptest::collection::vec(any::<u8>(), 0..5_000),
        is_fitting: bool,
    ) {
        let layout = PixelLayout { stride, ..layout(ALL[which], size) };
        let n = layout.bytes().ok().flatten().filter(|_| is_fitting);
        let bytes: Vec<u8> = match n {
            Some(n) => bytes.into_iter().chain(std::iter::repeat(3)).take(n).collect(),
            None => bytes,
        };
        let n_pixels = (size[0] * size[1]) as usize;
        match decode(&layout, &bytes) {
            Ok(Pixels::Rgb(rgb)) => prop_assert_eq!(rgb.len(), 3 * n_pixels),
            Ok(Pixels::DepthM(depth_m)) => {
                prop_assert_eq!(depth_m.len(), n_pixels);
                prop_assert!(depth_m.iter().all(|z| z.is_finite() && *z >= 0.0));
            }
            Err(_) => prop_assert!(n.is_none()),
        }
    }

    /// What lies between the rows is never seen, and may be left out behind the last one.
    #[test]
    fn bytes_between_rows_are_not_read(
        which in 0..ALL.len(),
        (width, height) in (1..9_u32, 1..9_u32),
        padding in 0..5_usize,
        seed: u8,
    ) {
        let packed = layout(ALL[which], [2 * width, 2 * height]);
        let Some(n) = packed.bytes().unwrap() else { return Ok(()) };
        let bytes: Vec<u8> = (0..n).map(|i| (i * 31) as u8 ^ seed).collect();
        let row_bytes = packed.encoding.row_bytes(2 * width as usize).unwrap();
        let gaps = |gap: u8| {
            let row = |row: &[u8]| [row, &vec![gap; padding]].concat();
            bytes.chunks(row_bytes).flat_map(row).collect::<Vec<u8>>()
        };
        let padded = PixelLayout { stride: Some((row_bytes + padding) as u32), ..packed };
        let expected = decode(&packed, &bytes).unwrap();
        let (zeros, ones) = (gaps(0), gaps(255));
        prop_assert_eq!(&decode(&padded, &zeros).unwrap(), &expected);
        prop_assert_eq!(&decode(&padded, &ones).unwrap(), &expected);
        prop_assert_eq!(&decode(&padded, &ones[..ones.len() - padding]).unwrap(), &expected);
    }

    /// Greys of the limited range are the same grey to a digit.
    #[test]
    fn grey_stays_grey(y: u8) {
        let [red, green, blue] = rgb(layout(Encoding::Yuyv, [2, 1]), &[y, 128, y, 128])[..3] else {
            return Err(TestCaseError::fail("no pixel"));
        };
        prop_assert!(red == green && green == blue);
        let exact = ((f64::from(y) - 16.0) * 255.0 / 219.0).clamp(0.0, 255.0);
        prop_assert!((f64::from(red) - exact).abs() <= 0.51);
    }
}
