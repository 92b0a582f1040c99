//! What recorded messages show: pictures and calibrations, whoever wrote them.

use super::foxglove::{self, CameraCalibration, CompressedImage, RawImage, Timestamp};
use super::ros::{self, RosCameraInfo, RosCompressed, RosImage};
use crate::hardware::calibration::{Calibration, Distortion};
use crate::hardware::encodings::{Encoding, PixelLayout, Pixels, YuvColours, decode};
use crate::hardware::file::{decode_depth_mm, decode_rgb};
use crate::mismatch::quoted;

/// The types of messages that are pictures, as MCAP names their schemas.
pub(super) const PICTURES: [&str; 4] = [
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/CompressedImage",
    "foxglove.RawImage",
    "foxglove.CompressedImage",
];

/// One recorded message.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recorded<'a> {
    /// The name of its schema.
    pub(super) schema: &'a str,
    /// `cdr`, `protobuf` or `json`.
    pub(super) encoding: &'a str,
    /// Its bytes.
    pub(super) data: &'a [u8],
}

/// A picture with the stamp of its camera.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shown {
    pub(super) stamp_ns: i128,
    pub(super) size: [u32; 2],
    pub(super) pixels: Pixels,
}

const NS_PER_S: i128 = 1_000_000_000;

/// The picture that a message is. `yuv` is what Y, U and V are in it.
///
/// # Errors
/// Why it is none.
pub(super) fn picture(message: Recorded<'_>, yuv: YuvColours) -> Result<Shown, String> {
    let Recorded { schema, encoding, data } = message;
    match schema {
        "sensor_msgs/msg/Image" => {
            let image: RosImage<'_> = ros::read(data)?;
            let encoding = Encoding::of_ros(&image.encoding, image.is_bigendian != 0)?;
            let RosImage { width, height, step, .. } = image;
            raw(of_ros(image.header.stamp), (encoding, [width, height], step), image.data, yuv)
        }
        "sensor_msgs/msg/CompressedImage" => {
            let image: RosCompressed<'_> = ros::read(data)?;
            compressed(of_ros(image.header.stamp), &image.format, image.data)
        }
        "foxglove.RawImage" => {
            let image: RawImage = foxglove::read(encoding, data)?;
            let encoding = Encoding::of_ros(&image.encoding, false)?;
            let RawImage { width, height, step, .. } = image;
            raw(of_foxglove(image.timestamp), (encoding, [width, height], step), &image.data, yuv)
        }
        "foxglove.CompressedImage" => {
            let image: CompressedImage = foxglove::read(encoding, data)?;
            compressed(of_foxglove(image.timestamp), &image.format, &image.data)
        }
        other => Err(format!("schema: expected {}, got {}", PICTURES.join(", "), quoted(other))),
    }
}

/// The calibration that a message is. Of rectified pictures it is that of their projection, without a lens.
///
/// # Errors
/// Why it is none.
pub(super) fn calibration(
    message: Recorded<'_>,
    is_rectified: bool,
) -> Result<Calibration, String> {
    let Recorded { schema, encoding, data } = message;
    let (size, model, d, k, p) = match schema {
        "sensor_msgs/msg/CameraInfo" => {
            let info: RosCameraInfo = ros::read(data)?;
            let RosCameraInfo { width, height, distortion_model, d, k, p, .. } = info;
            ([width, height], distortion_model, d, k.to_vec(), p.to_vec())
        }
        "foxglove.CameraCalibration" => {
            let info: CameraCalibration = foxglove::read(encoding, data)?;
            let CameraCalibration { width, height, distortion_model, d, k, p } = info;
            ([width, height], distortion_model, d, k, p)
        }
        other => {
            return Err(format!(
                "schema: expected sensor_msgs/msg/CameraInfo or foxglove.CameraCalibration, got {}",
                quoted(other)
            ));
        }
    };
    let size = (size != [0, 0]).then_some(size);
    if !is_rectified {
        return Calibration::of_matrix(size, &k, Distortion::of_model(&model, &d)?);
    }
    let left: Vec<f64> = p.chunks(4).flat_map(|row| row.iter().take(3)).copied().collect();
    Calibration::of_matrix(size, &left, Distortion::NONE)
}

fn of_ros(stamp: ros::Time) -> i128 {
    i128::from(stamp.sec) * NS_PER_S + i128::from(stamp.nanosec)
}

fn of_foxglove(stamp: Option<Timestamp>) -> i128 {
    stamp.map_or(0, |stamp| i128::from(stamp.seconds) * NS_PER_S + i128::from(stamp.nanos))
}

fn raw(
    stamp_ns: i128,
    (encoding, size, step): (Encoding, [u32; 2], u32),
    data: &[u8],
    yuv: YuvColours,
) -> Result<Shown, String> {
    let layout = PixelLayout { encoding, size, stride: Some(step), yuv };
    let pixels = decode(&layout, data).map_err(|error| error.to_string())?;
    Ok(Shown { stamp_ns, size, pixels })
}

/// Bytes before the image of `compressedDepth`: its format and the two numbers of its inverse depth.
const DEPTH_HEADER_BYTES: usize = 12;

fn compressed(stamp_ns: i128, format: &str, data: &[u8]) -> Result<Shown, String> {
    let told = |error: crate::hardware::file::ImageFileError| error.to_string();
    if format.contains("compressedDepth") || format.starts_with("16UC1") {
        if !format.starts_with("16UC1") || format.contains("rvl") {
            return Err(format!("format: expected 16UC1 as PNG, got {}", quoted(format)));
        }
        let has_header = format.contains("compressedDepth");
        let image = data.get(if has_header { DEPTH_HEADER_BYTES } else { 0 }..).unwrap_or_default();
        let (size, depth_m) = decode_depth_mm(image).map_err(told)?;
        return Ok(Shown { stamp_ns, size, pixels: Pixels::DepthM(depth_m) });
    }
    let image = decode_rgb(data).map_err(told)?;
    let size = [image.width(), image.height()];
    Ok(Shown { stamp_ns, size, pixels: Pixels::Rgb(image.into_raw()) })
}
