//! Messages of Foxglove, as Protobuf or JSON. The numbers are those of its published schemas.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use prost::Message;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

use crate::mismatch::quoted;

/// `google.protobuf.Timestamp`; in JSON `sec` and `nsec`.
#[derive(Clone, Copy, Message, Deserialize)]
pub(super) struct Timestamp {
    #[prost(int64, tag = "1")]
    #[serde(alias = "sec")]
    pub(super) seconds: i64,
    #[prost(int32, tag = "2")]
    #[serde(alias = "nsec")]
    pub(super) nanos: i32,
}

/// `foxglove.RawImage`.
#[derive(Clone, Message, Deserialize)]
pub(super) struct RawImage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(fixed32, tag = "2")]
    pub(super) width: u32,
    #[prost(fixed32, tag = "3")]
    pub(super) height: u32,
    #[prost(string, tag = "4")]
    pub(super) encoding: String,
    #[prost(fixed32, tag = "5")]
    pub(super) step: u32,
    #[prost(bytes = "vec", tag = "6")]
    #[serde(deserialize_with = "of_base64")]
    pub(super) data: Vec<u8>,
}

/// `foxglove.CompressedImage`.
#[derive(Clone, Message, Deserialize)]
pub(super) struct CompressedImage {
    #[prost(message, optional, tag = "1")]
    pub(super) timestamp: Option<Timestamp>,
    #[prost(bytes = "vec", tag = "2")]
    #[serde(deserialize_with = "of_base64")]
    pub(super) data: Vec<u8>,
    #[prost(string, tag = "3")]
    pub(super) format: String,
}

/// `foxglove.CameraCalibration`.
#[derive(Clone, Message, Deserialize)]
pub(super) struct CameraCalibration {
    #[prost(fixed32, tag = "2")]
    pub(super) width: u32,
    #[prost(fixed32, tag = "3")]
    pub(super) height: u32,
    #[prost(string, tag = "4")]
    #[serde(default)]
    pub(super) distortion_model: String,
    #[prost(double, repeated, tag = "5")]
    #[serde(rename = "D", default)]
    pub(super) d: Vec<f64>,
    #[prost(double, repeated, tag = "6")]
    #[serde(rename = "K")]
    pub(super) k: Vec<f64>,
    #[prost(double, repeated, tag = "8")]
    #[serde(rename = "P", default)]
    pub(super) p: Vec<f64>,
}

fn of_base64<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<u8>, D::Error> {
    let text = String::deserialize(from)?;
    STANDARD.decode(text).map_err(D::Error::custom)
}

/// Reads a message of an encoding of MCAP.
///
/// # Errors
/// What is wrong with it.
pub(super) fn read<T>(encoding: &str, bytes: &[u8]) -> Result<T, String>
where
    T: Message + Default + for<'de> Deserialize<'de>,
{
    match encoding {
        "protobuf" => T::decode(bytes).map_err(|error| format!("no such message: {error}")),
        "json" => {
            serde_json::from_slice(bytes).map_err(|error| format!("no such message: {error}"))
        }
        other => Err(format!("expected cdr, protobuf or json, got {}", quoted(other))),
    }
}
