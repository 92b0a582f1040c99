//! Detectors: pixels in, typed boxes out.
//!
//! Detectors are parts: each is one file with one line in [`DETECTORS`]. What a type looks like is
//! the domain's `perception.toml`; a detector knows no domain.

mod colour;
mod boxes;
mod options;
mod lab;
mod palette;
mod looks;
mod annotated;
mod http;
mod onnx;

pub use colour::ColourDetector;

use std::path::Path;

use thiserror::Error;

use super::model::{ObjectBox, Perception};
use super::{Detections, ImageView};
use crate::http::WebError;
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
    /// The detector's own options are not of the documented form.
    #[error("perception.options: {message}")]
    Options {
        /// What the parser says.
        message: String,
    },
    /// An option has a value that cannot be.
    #[error("perception.options.{option}: expected {expected}, got {got}")]
    Option {
        /// The option.
        option: String,
        /// What may stand there.
        expected: String,
        /// What does.
        got: String,
    },
    /// A file of the detector is not usable.
    #[error("{file}: {message}")]
    File {
        /// The file.
        file: String,
        /// What is wrong with it: the field, what was expected and what stands there.
        message: String,
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
    /// Something that the detector needs is missing: exit code 5.
    #[error("{what} is missing: {how}")]
    Missing {
        /// What.
        what: String,
        /// How to get it.
        how: String,
    },
}

impl DetectorError {
    /// Whether something outside is missing that may be there another time: exit code 5.
    pub fn is_missing(&self) -> bool {
        match self {
            Self::Missing { .. } => true,
            Self::Service(error) => error.is_absent(),
            Self::TooManyColours { .. }
            | Self::BoxOutside { .. }
            | Self::Options { .. }
            | Self::Option { .. }
            | Self::File { .. }
            | Self::Reply { .. } => false,
        }
    }

    fn option(option: &str, expected: impl Into<String>, got: impl Into<String>) -> Self {
        let (expected, got) = (expected.into(), got.into());
        Self::Option { option: option.to_owned(), expected, got }
    }
}

/// What a detector is made from.
#[derive(Debug, Clone, Copy)]
pub struct DetectorSettings<'a> {
    /// The domain.
    pub domain: &'a Domain,
    /// How it is seen.
    pub perception: &'a Perception,
    /// The detector's own options, `[perception.options]` of the run file.
    pub options: Option<&'a toml::Table>,
    /// What relative paths in the options start from.
    pub folder: &'a Path,
    /// Looks up environment variables: keys of services come from there only.
    pub environment: fn(&str) -> Option<String>,
}

/// Makes a detector for one domain.
pub type Build = fn(&DetectorSettings<'_>) -> Result<Box<dyn Detector>, DetectorError>;

/// Every detector by its name in configuration files, in alphabetical order.
pub const DETECTORS: &[(&str, Build)] = &[
    ("annotated", annotated::build),
    ("colour", colour::build),
    ("http", http::build),
    ("onnx", onnx::build),
];
