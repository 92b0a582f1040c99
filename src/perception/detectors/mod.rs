//! Detectors: pixels in, typed boxes out.
//!
//! Detectors are parts: each is one file with one line in [`DETECTORS`]. What a type looks like is
//! the domain's `perception.toml`; a detector knows no domain.

mod colour;
mod boxes;
mod lab;
mod median;
mod light;
mod bitmask;
mod regions;
mod scenery;
mod watchful;
#[cfg(test)]
mod drawn;
mod palette;
mod colour_namer;
mod annotated;
mod http;
mod onnx;

pub use colour::ColourDetector;
pub use colour_namer::colour_name;
pub use watchful::Watchful;

use thiserror::Error;

use super::model::{ObjectBox, Perception};
use super::{Detections, ImageView};
use crate::http::WebError;
use crate::parts::{PartError, Registry, Role};
use crate::pddl::Domain;

/// Finds objects of the domain's types in an image.
pub trait Detector: Send {
    /// Learns from one labelled image of the camera in use: colours, sizes. May be called for
    /// several images.
    ///
    /// # Errors
    /// [`DetectorError`] when a labelled object says nothing about how it looks.
    fn learn(&mut self, image: &ImageView<'_>, objects: &[ObjectBox]) -> Result<(), DetectorError>;

    /// Every object of the domain's types that is seen (the class query), and for each phrase of
    /// the goal where it may be (the phrase query). Depends on the image and on what was learnt,
    /// not on earlier images.
    ///
    /// # Errors
    /// [`DetectorError`] when the image cannot be worked on.
    fn detect(
        &mut self,
        image: &ImageView<'_>,
        phrases: &[String],
    ) -> Result<Detections, DetectorError>;

    /// Does on an example image what the first call would otherwise have to do: makes tables, finds
    /// out whether the image is of the right kind.
    ///
    /// # Errors
    /// As [`Detector::detect`].
    fn warm_up(&mut self, image: &ImageView<'_>) -> Result<(), DetectorError> {
        self.detect(image, &[]).map(drop)
    }

    /// Whether one image takes longer than the loop should wait for: then the detector works
    /// beside it.
    fn is_slow(&self) -> bool {
        false
    }
}

/// A detector cannot do its work.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DetectorError {
    /// More colours than the class table holds.
    #[error("expected at most {limit} colour names over all types, got {got}")]
    TooManyColours {
        /// The most there may be.
        limit: usize,
        /// How many there are.
        got: usize,
    },
    /// A labelled box lies outside its image.
    #[error("{object}: expected a box inside the {width} x {height} image")]
    BoxOutside {
        /// The labelled object.
        object: String,
        /// The image's width.
        width: usize,
        /// The image's height.
        height: usize,
    },
    /// A service does not answer, or refuses.
    #[error(transparent)]
    Service(#[from] WebError),
    /// A service answers something else than its dialect says.
    #[error("{url}: {message}")]
    Reply {
        /// The service, without secrets.
        url: String,
        /// What was expected and what came.
        message: String,
    },
    /// Something outside is missing, or an option or a file is not usable.
    #[error(transparent)]
    Part(#[from] PartError),
}

impl DetectorError {
    /// Whether something outside is missing that may be there another time: exit code 5.
    pub fn is_missing(&self) -> bool {
        match self {
            Self::Part(error) => error.is_missing(),
            Self::Service(error) => error.is_absent(),
            Self::TooManyColours { .. } | Self::BoxOutside { .. } | Self::Reply { .. } => false,
        }
    }
}

impl From<DetectorError> for PartError {
    fn from(error: DetectorError) -> Self {
        match error {
            DetectorError::Part(error) => error,
            DetectorError::TooManyColours { .. }
            | DetectorError::BoxOutside { .. }
            | DetectorError::Service(_)
            | DetectorError::Reply { .. } => Self::Inputs { reason: error.to_string() },
        }
    }
}

/// What detectors are made from.
#[derive(Debug, Clone, Copy)]
pub struct DetectorInputs<'a> {
    /// Whose types are looked for.
    pub domain: &'a Domain,
    /// Colours, outlines and prompts of these types.
    pub perception: &'a Perception,
}

impl Role for dyn Detector {
    type Inputs<'a> = DetectorInputs<'a>;
    const NAME: &'static str = "detector";
    const KEY: &'static str = "perception.detector";
    const OPTIONS: &'static str = "perception.options";
}

/// Every detector by its name in configuration files, in alphabetical order.
pub static DETECTORS: Registry<dyn Detector> =
    Registry(&[annotated::PART, colour::PART, http::PART, onnx::PART]);
