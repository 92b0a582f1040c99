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
mod tensor;
#[cfg(any(feature = "onnx", test))]
mod masks;
#[cfg(any(feature = "onnx", test))]
mod decode;
#[cfg(feature = "onnx")]
mod model;

use schemars::JsonSchema;
use serde::Deserialize;

use super::Detector;
use crate::parts::{Part, options_of};
#[cfg(not(feature = "onnx"))]
use crate::parts::{PartContext, PartError};

/// `[perception.options]`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[cfg_attr(not(feature = "onnx"), expect(dead_code, reason = "described, but not read"))]
struct Options {
    /// The model, an ONNX file.
    model: String,
    /// What goes in and comes out of the model: a TOML file.
    description: String,
}

/// The entry of the table of detectors.
pub(super) const PART: Part<dyn Detector> = Part {
    name: "onnx",
    help: "an exported model, run in this process; needs a build with `--features onnx`",
    options: options_of::<Options>(),
    build,
};

#[cfg(feature = "onnx")]
use model::build;

#[cfg(not(feature = "onnx"))]
fn build(context: &PartContext<'_, dyn Detector>) -> Result<Box<dyn Detector>, PartError> {
    context.options::<Options>()?;
    Err(PartError::missing(
        "the runtime for ONNX models",
        "this groundloop was built without it; build with `cargo build --features onnx`",
    ))
}
