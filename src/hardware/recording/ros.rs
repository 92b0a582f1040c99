//! Messages of ROS 2, in plain CDR.

use byteorder::{BigEndian, LittleEndian};
use serde::Deserialize;

/// `builtin_interfaces/msg/Time`.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(super) struct Time {
    pub(super) sec: i32,
    pub(super) nanosec: u32,
}

/// `std_msgs/msg/Header`.
#[derive(Debug, Deserialize)]
pub(super) struct Header {
    pub(super) stamp: Time,
    #[expect(dead_code, reason = "it lies before what is read")]
    frame_id: String,
}

/// `sensor_msgs/msg/Image`.
#[derive(Debug, Deserialize)]
pub(super) struct RosImage<'a> {
    pub(super) header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) encoding: String,
    pub(super) is_bigendian: u8,
    pub(super) step: u32,
    pub(super) data: &'a [u8],
}

/// `sensor_msgs/msg/CompressedImage`.
#[derive(Debug, Deserialize)]
pub(super) struct RosCompressed<'a> {
    pub(super) header: Header,
    pub(super) format: String,
    pub(super) data: &'a [u8],
}

/// `sensor_msgs/msg/CameraInfo`, up to its matrices.
#[derive(Debug, Deserialize)]
pub(super) struct RosCameraInfo {
    #[expect(dead_code, reason = "it lies before what is read")]
    header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) distortion_model: String,
    pub(super) d: Vec<f64>,
    pub(super) k: [f64; 9],
    #[expect(dead_code, reason = "it lies before what is read")]
    r: [f64; 9],
    pub(super) p: [f64; 12],
}

/// Reads a message behind its encapsulation header.
///
/// # Errors
/// What is wrong with it.
pub(super) fn read<'de, T: Deserialize<'de>>(bytes: &'de [u8]) -> Result<T, String> {
    let read = match bytes {
        [0, 0, _, _, rest @ ..] => cdr_encoding::from_bytes::<T, BigEndian>(rest),
        [0, 1, _, _, rest @ ..] => cdr_encoding::from_bytes::<T, LittleEndian>(rest),
        _ => return Err("expected plain CDR, got another encapsulation".to_owned()),
    };
    read.map(|(message, _)| message).map_err(|error| format!("no such message: {error}"))
}
