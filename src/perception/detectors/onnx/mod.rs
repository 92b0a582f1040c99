//! Exported detectors: any ONNX model with a small TOML file that says what its input, outputs and
//! classes are.
//!
//! The model runs in this process (rten, without native libraries): build with `--features onnx`.
//! Such a detector knows the classes that it was trained for; phrases of a goal are answered by
//! words alone.

#[cfg(any(feature = "onnx", test))]
mod description;
#[cfg(any(feature = "onnx", test))]
mod input;
#[cfg(any(feature = "onnx", test))]
mod decode;
#[cfg(feature = "onnx")]
mod model;

use super::{Detector, DetectorError, DetectorSettings};

/// The entry for the table of detectors.
#[cfg(feature = "onnx")]
pub(super) fn build(settings: &DetectorSettings<'_>) -> Result<Box<dyn Detector>, DetectorError> {
    model::build(settings)
}

/// The entry for the table of detectors.
#[cfg(not(feature = "onnx"))]
pub(super) fn build(_: &DetectorSettings<'_>) -> Result<Box<dyn Detector>, DetectorError> {
    Err(DetectorError::Missing {
        what: "the runtime for ONNX models".to_owned(),
        how: "this groundloop was built without it; build with `cargo build --features onnx`"
            .to_owned(),
    })
}
