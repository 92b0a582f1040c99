//! Single images read as the frames of a camera are.

use std::path::Path;
use std::sync::Arc;

use image::RgbImage;

use super::exemplars::view_of;
use super::self_check::{CameraCheck, TaughtParts};
use super::{ConfigError, DomainFolder, read_image};
use crate::goals::ReadImage;
use crate::messages::MAIN_CAMERA;
use crate::parts::PartChoice;
use crate::perception::detectors::Detector;
use crate::perception::grounders::Grounder;
use crate::perception::model::Exemplar;
use crate::perception::{GripperContent, GroundedImage, ground_image};

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
}

/// Reads the state off single images of one camera.
#[expect(missing_debug_implementations, reason = "parts are known by their names only")]
pub struct StillImageReader {
    folder: Arc<DomainFolder>,
    examples: Arc<Vec<(RgbImage, Exemplar)>>,
    detector_name: String,
    detector: Box<dyn Detector>,
    grounder: Box<dyn Grounder>,
}

impl StillImageParts {
    /// Makes detector and grounder.
    ///
    /// # Errors
    /// [`ConfigError`] naming the part that cannot be made.
    pub fn reader(&self) -> Result<StillImageReader, ConfigError> {
        Ok(StillImageReader {
            folder: Arc::clone(&self.folder),
            examples: Arc::clone(&self.examples),
            detector_name: self.detector.name.clone(),
            detector: self.folder.detector(&self.detector, &self.examples)?,
            grounder: self.folder.grounder(&self.grounder, &self.examples)?,
        })
    }

    /// Tries the labelled examples on themselves.
    ///
    /// # Errors
    /// [`ConfigError`] naming the part that cannot be made, or what detector or grounder say.
    pub fn check_examples(&self) -> Result<CameraCheck, ConfigError> {
        let Self { folder, examples, .. } = self;
        let mut detector = folder.detector(&self.detector, examples)?;
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
        let parts = TaughtParts {
            detector_name: &self.detector_name,
            detector: &mut *self.detector,
            grounder: &*self.grounder,
            has_depth: false,
        };
        self.folder.warn_of_examples(MAIN_CAMERA, parts, &self.examples);
    }

    /// Reads the state off an image file. Objects that `phrases` single out take the phrases as
    /// their names.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file when it is no image or not of the exemplars' size, or what
    /// detector or grounder say.
    pub fn read(&mut self, path: &Path, phrases: &[String]) -> Result<GroundedImage, ConfigError> {
        let picture = read_image(path)?;
        let name = path.display().to_string();
        let [width, height] = self.examples.first().map_or([0, 0], |(_, e)| e.image_size);
        let got = [picture.width(), picture.height()];
        if got != [width, height] {
            let reason = format!(
                "expected {width}x{height} pixels like the labelled example, got {}x{}",
                got[0], got[1]
            );
            return Err(ConfigError::File { path: name, reason });
        }
        let pipeline = self.folder.pipeline(&*self.grounder);
        let view = view_of(&picture, &name)?;
        let nothing = GripperContent::Empty;
        Ok(ground_image(&pipeline, &mut *self.detector, &view, phrases, &nothing)?)
    }
}
