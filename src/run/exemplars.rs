//! Reading labelled examples and the images they belong to.

use std::path::{Path, PathBuf};

use image::RgbImage;

use super::scaled_examples::scaled_example;
use super::{ConfigError, DomainFolder, ExemplarConfig};
use crate::files::{FileRef, Folder};
use crate::hardware::file::decode_rgb;
use crate::parts::{PartChoice, PartContext};
use crate::pddl::SourceText;
use crate::perception::detectors::{DETECTORS, Detector, DetectorInputs, Watchful};
use crate::perception::grounders::{GROUNDERS, Grounder, GrounderInputs};
use crate::perception::model::{
    Exemplar, ExemplarText, Exemplars, OtherRatio, UndecidedFact, undecided_facts,
};
use crate::perception::{ImageRegion, ImageView};

/// Endings of image files, in the order in which they are looked for.
const IMAGE_ENDINGS: [&str; 3] = ["png", "jpg", "jpeg"];

/// Endings of files beside the boxes, which are no examples of their own.
const BESIDE: [&str; 2] = [".masks.json", ".volumes.json"];

/// Reads an image file (PNG or JPEG) as RGB.
///
/// # Errors
/// [`ConfigError::File`] naming the file: missing, truncated, or not an image.
pub fn read_image(path: &Path) -> Result<RgbImage, ConfigError> {
    image_of(&FileRef::disk(path))
}

fn image_of(file: &FileRef) -> Result<RgbImage, ConfigError> {
    decode_rgb(&file.bytes()?)
        .map_err(|e| ConfigError::File { path: file.to_string(), reason: e.to_string() })
}

/// The files of one labelled example.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExemplarFiles {
    /// The image (PNG or JPEG).
    pub image: FileRef,
    /// Its boxes (JSON). Masks and volumes lie beside it, where they are known.
    pub boxes: FileRef,
    /// Its state, a PDDL problem.
    pub state: FileRef,
}

impl ExemplarFiles {
    /// Files on disk.
    pub fn on_disk(image: &Path, boxes: &Path, state: &Path) -> Self {
        Self {
            image: FileRef::disk(image),
            boxes: FileRef::disk(boxes),
            state: FileRef::disk(state),
        }
    }

    /// Reads the example.
    ///
    /// # Errors
    /// [`ConfigError`] naming file and field.
    pub fn read(&self, folder: &DomainFolder) -> Result<(RgbImage, Exemplar), ConfigError> {
        let (picture, text) = self.texts()?;
        Ok((picture, Exemplar::parse(&text, &folder.domain)?))
    }

    /// Reads an example that is being labelled, with the facts that are not decided.
    ///
    /// # Errors
    /// [`ConfigError`] naming file and field.
    pub fn read_draft(
        &self,
        folder: &DomainFolder,
    ) -> Result<(RgbImage, Exemplar, Vec<UndecidedFact>), ConfigError> {
        let (picture, text) = self.texts()?;
        let undecided = undecided_facts(&text.state.text);
        Ok((picture, Exemplar::parse_draft(&text, &folder.domain)?, undecided))
    }

    fn texts(&self) -> Result<(RgbImage, ExemplarText), ConfigError> {
        let picture = image_of(&self.image)?;
        let source = |file: &FileRef| -> Result<SourceText, ConfigError> {
            Ok(SourceText { name: file.to_string(), text: file.text()? })
        };
        let beside = |ending: &str| -> Result<Option<SourceText>, ConfigError> {
            let file = Some(self.boxes.with_ending(ending)).filter(FileRef::exists);
            file.map(|file| source(&file)).transpose()
        };
        let text = ExemplarText {
            boxes: source(&self.boxes)?,
            state: source(&self.state)?,
            volumes: beside("volumes.json")?,
            masks: beside("masks.json")?,
            image_size: [picture.width(), picture.height()],
        };
        Ok((picture, text))
    }
}

impl ExemplarConfig {
    /// Reads all labelled examples of this camera set-up, those of other sizes scaled to that of the
    /// first.
    ///
    /// # Errors
    /// [`ConfigError`] naming file and field; images of different ratios of width to height do not go
    /// together.
    pub fn read(
        &self,
        folder: &DomainFolder,
        data: Option<&Path>,
    ) -> Result<Vec<(RgbImage, Exemplar)>, ConfigError> {
        let mut size = None;
        let read = |files: &ExemplarFiles| {
            let (picture, exemplar) = files.read(folder)?;
            let first = *size.get_or_insert(exemplar.image_size);
            if exemplar.image_size == first {
                return Ok((picture, exemplar));
            }
            let scaled = scaled_example(&picture, &exemplar, first);
            scaled.map_err(|other| {
                // Here it is the first example that the others must be like.
                let OtherRatio { example, image } = other;
                let other = OtherRatio { example: image, image: example };
                other.mismatch(&files.image.to_string()).into()
            })
        };
        self.files(folder, data)?.iter().map(read).collect()
    }

    fn files(
        &self,
        folder: &DomainFolder,
        data: Option<&Path>,
    ) -> Result<Vec<ExemplarFiles>, ConfigError> {
        match (&self.folder, &self.image, &self.boxes, &self.state) {
            (Some(name), None, None, None) => in_folder(&if is_path(name) {
                Folder::Disk(PathBuf::from(name))
            } else {
                folder.files.below("exemplar").below(name)
            }),
            (None, Some(image), Some(boxes), Some(state)) => Ok(vec![ExemplarFiles::on_disk(
                &self.resolve(image, data)?,
                &self.resolve(boxes, data)?,
                &self.resolve(state, data)?,
            )]),
            _ => Err(ConfigError::Value {
                key: "perception.exemplar".to_owned(),
                expected: "either folder, or image, boxes and state".to_owned(),
                got: "something else".to_owned(),
            }),
        }
    }

    fn resolve(&self, text: &str, data: Option<&Path>) -> Result<PathBuf, ConfigError> {
        let number = self.number.map(|n| n.to_string()).unwrap_or_default();
        in_data("perception.exemplar", &text.replace("{n}", &number), data)
    }
}

/// Whether the folder of examples is a path, and no name below the domain's `exemplar/`.
fn is_path(name: &str) -> bool {
    ["/", "./", "../"].iter().any(|start| name.starts_with(start))
}

/// A path in which `$data` may stand for the folder given with `--data`; `key` is where it is written.
///
/// # Errors
/// [`ConfigError::Value`] when it does and no folder is given.
pub(crate) fn in_data(key: &str, text: &str, data: Option<&Path>) -> Result<PathBuf, ConfigError> {
    let Some(rest) = text.strip_prefix("$data/") else { return Ok(PathBuf::from(text)) };
    data.map(|data| data.join(rest)).ok_or_else(|| ConfigError::Value {
        key: key.to_owned(),
        expected: "--data DIR, the folder that $data stands for".to_owned(),
        got: "none".to_owned(),
    })
}

/// All examples of a folder, by name: `x.json` with `x.pddl` and `x.png` (or `.jpg`), and where they
/// are known `x.masks.json` and `x.volumes.json`.
pub(super) fn in_folder(folder: &Folder) -> Result<Vec<ExemplarFiles>, ConfigError> {
    let fault = |path: String, reason: &str| ConfigError::File { path, reason: reason.to_owned() };
    let mut names = folder.names(".json")?;
    names.retain(|name| !BESIDE.iter().any(|ending| name.ends_with(ending)));
    if names.is_empty() {
        return Err(fault(folder.to_string(), "no labelled example (*.json) in this folder"));
    }
    let files = names.iter().map(|name| {
        let boxes = folder.file(name);
        let image = IMAGE_ENDINGS.iter().map(|e| boxes.with_ending(e)).find(FileRef::exists);
        let image = image.ok_or_else(|| fault(boxes.to_string(), "its image is missing"))?;
        Ok(ExemplarFiles { image, state: boxes.with_ending("pddl"), boxes })
    });
    files.collect()
}

impl DomainFolder {
    /// Makes the chosen detector, taught by the labelled examples.
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown name, or an example that teaches nothing.
    pub fn detector(
        &self,
        choice: &PartChoice,
        examples: &[(RgbImage, Exemplar)],
    ) -> Result<Box<dyn Detector>, ConfigError> {
        self.detector_within(None, choice, examples)
    }

    /// The same for a part of the image.
    ///
    /// # Errors
    /// As [`DomainFolder::detector`].
    pub fn detector_within(
        &self,
        region: Option<ImageRegion>,
        choice: &PartChoice,
        examples: &[(RgbImage, Exemplar)],
    ) -> Result<Box<dyn Detector>, ConfigError> {
        let inputs = DetectorInputs { domain: &self.domain, perception: &self.perception };
        let inner = DETECTORS.build(&PartContext { choice, inputs, environment })?;
        let mut detector: Box<dyn Detector> =
            Box::new(Watchful::new(inner, &self.perception).within(region));
        for (picture, exemplar) in examples {
            detector.learn(&view_of(picture, &exemplar.name)?, &exemplar.objects)?;
        }
        // Tables that are made on first use are made now, not on the first frame of a run.
        if let Some((picture, exemplar)) = examples.first() {
            detector.warm_up(&view_of(picture, &exemplar.name)?)?;
        }
        Ok(detector)
    }

    /// Makes the chosen grounder from the labelled examples, and warns of what they do not teach it.
    ///
    /// # Errors
    /// [`ConfigError`] for an unknown name, or examples that do not go together.
    pub fn grounder(
        &self,
        choice: &PartChoice,
        examples: &[(RgbImage, Exemplar)],
    ) -> Result<Box<dyn Grounder>, ConfigError> {
        let grounder = self.silent_grounder(choice, examples)?;
        for predicate in grounder.untaught() {
            tracing::warn!(
                "no labelled example shows {predicate}: where objects touch it is unknown; label one \
                 that does"
            );
        }
        Ok(grounder)
    }

    /// The same without a warning.
    pub(super) fn silent_grounder(
        &self,
        choice: &PartChoice,
        examples: &[(RgbImage, Exemplar)],
    ) -> Result<Box<dyn Grounder>, ConfigError> {
        GROUNDERS.find(&choice.key, &choice.name)?;
        let exemplars = Exemplars::new(examples.iter().map(|(_, e)| e.clone()).collect())?;
        let (domain, perception) = (&self.domain, &self.perception);
        let inputs = GrounderInputs { domain, perception, exemplars: &exemplars };
        Ok(GROUNDERS.build(&PartContext { choice, inputs, environment })?)
    }
}

/// Looks up an environment variable.
#[expect(clippy::disallowed_methods, reason = "keys of services stand nowhere else")]
pub(crate) fn environment(name: &str) -> Option<String> {
    std::env::var(name).ok()
}

/// An image as detectors look at it.
pub(crate) fn view_of<'a>(picture: &'a RgbImage, path: &str) -> Result<ImageView<'a>, ConfigError> {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    ImageView::new(width, height, picture.as_raw())
        .map_err(|source| ConfigError::Image { path: path.to_owned(), source })
}
