//! Single images read as the frames of a camera are.

use std::path::Path;
use std::sync::Arc;

use image::RgbImage;

use super::exemplars::view_of;
use super::{ConfigError, DomainFolder, read_image};
use crate::goals::Look;
use crate::parts::PartChoice;
use crate::perception::model::Exemplar;
use crate::perception::{Grip, GroundedImage, ground_image};

/// What reads single images: a detector and a grounder with the labelled examples of one camera.
#[derive(Debug, Clone)]
pub struct Eye {
    /// The domain.
    pub folder: Arc<DomainFolder>,
    /// The labelled examples.
    pub examples: Arc<Vec<(RgbImage, Exemplar)>>,
    /// What finds the objects.
    pub detector: PartChoice,
    /// What judges the facts.
    pub grounder: PartChoice,
}

impl Eye {
    /// Reads the state off an image file.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file when it is no image or not of the examples' size, or the part
    /// that cannot be made.
    pub fn look(&self, path: &Path) -> Result<GroundedImage, ConfigError> {
        let fault = |reason: String| ConfigError::File { path: path.display().to_string(), reason };
        let picture = read_image(path)?;
        let (got_width, got_height) = (picture.width(), picture.height());
        let [width, height] = self.examples.first().map_or([0, 0], |(_, e)| e.image_size);
        if [got_width, got_height] != [width, height] {
            return Err(fault(format!(
                "expected {width}x{height} pixels like the labelled example, \
                 got {got_width}x{got_height}"
            )));
        }
        let mut detector = self.folder.detector(&self.detector, &self.examples)?;
        let grounder = self.folder.grounder(&self.grounder, &self.examples)?;
        let pipeline = self.folder.pipeline(&*grounder);
        let view = view_of(&picture, &path.display().to_string())?;
        Ok(ground_image(&pipeline, &mut *detector, &view, &[], &Grip::Empty)?)
    }

    /// The same, for goal sources.
    pub fn into_look(self) -> Look {
        Arc::new(move |path| self.look(path).map_err(|e| e.to_string()))
    }
}
