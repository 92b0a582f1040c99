//! Single images read as the frames of a camera are.

use std::path::Path;
use std::sync::Arc;

use image::RgbImage;

use super::exemplars::view_of;
use super::scaled_examples::{Examples, scaled_examples, size_of};
use super::self_check::{CameraCheck, TaughtParts};
use super::{ConfigError, DomainFolder, read_image};
use crate::goals::ReadImage;
use crate::messages::MAIN_CAMERA;
use crate::parts::PartChoice;
use crate::perception::detectors::Detector;
use crate::perception::grounders::Grounder;
use crate::perception::model::Exemplar;
use crate::perception::{GripperContent, GroundedImage, ImageRegion, ground_image};

/// The parts that read single images of one camera.
#[derive(Debug, Clone)]
pub struct StillImageParts {
    /// Whose objects and facts are looked for.
    pub folder: Arc<DomainFolder>,
    /// The exemplars of the camera, with their images.
    pub examples: Arc<Vec<(RgbImage, Exemplar)>>,
    /// What finds the objects.
    pub detector: PartChoice,
    /// What judges the facts.
    pub grounder: PartChoice,
    /// The part of the image in which objects can be; `None`: the whole image.
    pub region: Option<ImageRegion>,
}

/// Reads the state off single images of one camera.
#[expect(missing_debug_implementations, reason = "parts are known by their names only")]
pub struct StillImageReader {
    parts: StillImageParts,
    /// For images of the size that was read last.
    sized: SizedParts,
}

/// Detector and grounder for images of one size.
struct SizedParts {
    examples: Examples,
    detector: Box<dyn Detector>,
    grounder: Box<dyn Grounder>,
}

impl StillImageParts {
    /// Makes detector and grounder.
    ///
    /// # Errors
    /// [`ConfigError`] naming the part that cannot be made.
    pub fn reader(&self) -> Result<StillImageReader, ConfigError> {
        let sized = SizedParts {
            examples: Arc::clone(&self.examples),
            detector: self.folder.detector_within(self.region, &self.detector, &self.examples)?,
            grounder: self.folder.grounder(&self.grounder, &self.examples)?,
        };
        Ok(StillImageReader { parts: self.clone(), sized })
    }

    /// Detector and grounder for images of a size, taught by the examples scaled to it. `name` is
    /// that of the image.
    fn sized(&self, name: &str, size: [u32; 2]) -> Result<SizedParts, ConfigError> {
        let examples =
            scaled_examples(&self.examples, size).map_err(|other| other.mismatch(name))?;
        tracing::debug!("{name}: labelled examples are scaled to {}x{} pixels", size[0], size[1]);
        Ok(SizedParts {
            detector: self.folder.detector_within(self.region, &self.detector, &examples)?,
            // It has said what the examples do not teach when the reader was made.
            grounder: self.folder.silent_grounder(&self.grounder, &examples)?,
            examples,
        })
    }

    /// Tries the labelled examples on themselves.
    ///
    /// # Errors
    /// [`ConfigError`] naming the part that cannot be made, or what detector or grounder say.
    pub fn check_examples(&self) -> Result<CameraCheck, ConfigError> {
        let Self { folder, examples, .. } = self;
        let mut detector = folder.detector_within(self.region, &self.detector, examples)?;
        let grounder = folder.silent_grounder(&self.grounder, examples)?;
        let parts = TaughtParts {
            detector_name: &self.detector.name,
            detector: &mut *detector,
            grounder: &*grounder,
            has_depth: false,
        };
        let findings = folder.try_examples(parts, examples)?;
        Ok(CameraCheck::new(MAIN_CAMERA, examples, findings))
    }

    /// For goal sources. Nothing is made before the first image is read.
    pub fn into_read_image(self) -> ReadImage {
        Arc::new(move |path| {
            let read = self.reader().and_then(|mut reader| reader.read(path, &[]));
            read.map_err(|e| e.to_string())
        })
    }
}

impl StillImageReader {
    /// Warns of what the labelled examples show otherwise than labelled, where that takes little time.
    pub fn warn_of_examples(&mut self) {
        let SizedParts { examples, detector, grounder } = &mut self.sized;
        let parts = TaughtParts {
            detector_name: &self.parts.detector.name,
            detector: &mut **detector,
            grounder: &**grounder,
            has_depth: false,
        };
        self.parts.folder.warn_of_examples(MAIN_CAMERA, parts, examples);
    }

    /// Reads the state off an image file, in its own pixels: to an image of another size the labelled
    /// examples are scaled. Objects that `phrases` single out take the phrases as their names.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file when it is no image or of another ratio of width to height than
    /// the exemplars, or what detector or grounder say.
    pub fn read(&mut self, path: &Path, phrases: &[String]) -> Result<GroundedImage, ConfigError> {
        let picture = read_image(path)?;
        let name = path.display().to_string();
        let size = [picture.width(), picture.height()];
        if size != size_of(&self.sized.examples) {
            self.sized = self.parts.sized(&name, size)?;
        }
        let SizedParts { detector, grounder, .. } = &mut self.sized;
        let pipeline = self.parts.folder.pipeline(&**grounder);
        let view = view_of(&picture, &name)?;
        let nothing = GripperContent::Empty;
        Ok(ground_image(&pipeline, &mut **detector, &view, phrases, &nothing)?)
    }
}
