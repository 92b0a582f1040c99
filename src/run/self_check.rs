//! Labelled examples of run files and of loose files, tried on themselves.

use std::path::Path;

use image::RgbImage;

use super::exemplars::view_of;
use super::{ConfigError, DomainFolder, RunConfig};
use crate::messages::MAIN_CAMERA;
use crate::perception::detectors::Detector;
use crate::perception::grounders::Grounder;
use crate::perception::model::Exemplar;
use crate::perception::self_check::{ExemplarFinding, FindingKind, LabelledImage, SelfCheck};

/// The detector that colours, outlines and sizes of `perception.toml` are for.
const BY_COLOURS: &str = "colour";

/// Why examples are not tried at the start; `groundloop exemplar check` does it.
pub(super) const SLOW: &str = "detector or grounder are slow; groundloop exemplar check does it";

/// The parts that examples are tried with; both have learnt from them.
pub(super) struct TaughtParts<'a> {
    /// The name of the detector.
    pub(super) detector_name: &'a str,
    pub(super) detector: &'a mut dyn Detector,
    pub(super) grounder: &'a dyn Grounder,
    /// Whether facts will be judged from volumes, where the examples have them.
    pub(super) has_depth: bool,
}

/// What the examples of one camera came to.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraCheck {
    /// Its name.
    pub camera: String,
    /// How many examples there are.
    pub n_examples: usize,
    /// How many objects are labelled in them.
    pub n_objects: usize,
    /// What is not as labelled.
    pub findings: Vec<ExemplarFinding>,
}

impl DomainFolder {
    /// Tries labelled examples on parts that have learnt from them.
    pub(super) fn try_examples(
        &self,
        parts: TaughtParts<'_>,
        examples: &[(RgbImage, Exemplar)],
    ) -> Result<Vec<ExemplarFinding>, ConfigError> {
        let labelled = examples.iter().map(|(picture, exemplar)| {
            Ok(LabelledImage { image: view_of(picture, &exemplar.name)?, exemplar })
        });
        let labelled = labelled.collect::<Result<Vec<_>, ConfigError>>()?;
        let mut check = SelfCheck {
            pipeline: self.pipeline(parts.grounder),
            detector: parts.detector,
            goes_by_colours: parts.detector_name == BY_COLOURS,
            has_depth: parts.has_depth,
        };
        Ok(check.findings(&labelled)?)
    }
}

impl RunConfig {
    /// Tries the labelled examples of every camera on themselves: those of `[camera]`, then those of
    /// each `[cameras.NAME]` that is used and has examples of its own. `data` is what `$data` stands
    /// for.
    ///
    /// # Errors
    /// [`ConfigError`] naming file and line or key.
    pub fn check_examples(&self, data: Option<&Path>) -> Result<Vec<CameraCheck>, ConfigError> {
        let folder = self.domain_folder()?;
        self.check_domain(&folder)?;
        let cameras = std::iter::once(MAIN_CAMERA).chain(self.cameras_with_examples());
        let checks = cameras.map(|camera| {
            let examples = self.exemplar_of(camera).read(&folder, data)?;
            let detector = folder.detector(&self.detector_choice(), &examples)?;
            self.check_camera_examples(&folder, camera, (detector, &examples))
        });
        checks.collect()
    }

    /// The cameras beside that of `[camera]` that are used and have examples of their own.
    pub(super) fn cameras_with_examples(&self) -> impl Iterator<Item = &str> {
        let has_own = |name: &&String| self.cameras[*name].exemplar.is_some();
        self.other_cameras().filter(has_own).map(String::as_str)
    }

    /// Tries the examples of one camera on a detector that has learnt from them.
    pub(super) fn check_camera_examples(
        &self,
        folder: &DomainFolder,
        camera: &str,
        (mut detector, examples): (Box<dyn Detector>, &[(RgbImage, Exemplar)]),
    ) -> Result<CameraCheck, ConfigError> {
        let grounder = folder.grounder(&self.grounder_choice(), examples)?;
        let parts = TaughtParts {
            detector_name: &self.perception.detector,
            detector: &mut *detector,
            grounder: &*grounder,
            has_depth: true,
        };
        let mut findings = folder.try_examples(parts, examples)?;
        // The grounder of a run learns from the examples of `[camera]` only.
        let is_told = |finding: &ExemplarFinding| {
            camera == MAIN_CAMERA || !matches!(finding.kind, FindingKind::Untaught { .. })
        };
        findings.retain(is_told);
        let n_objects = examples.iter().map(|(_, exemplar)| exemplar.objects.len()).sum();
        Ok(CameraCheck {
            camera: camera.to_owned(),
            n_examples: examples.len(),
            n_objects,
            findings,
        })
    }
}

/// Warns of what is grave, once for each finding. What a grounder warns of by itself is left out.
pub(super) fn warn(findings: &[ExemplarFinding]) {
    let is_told = |kind: &FindingKind| {
        matches!(kind, FindingKind::Untaught { unknown_where_touching: true, .. })
    };
    for finding in findings.iter().filter(|f| f.kind.is_grave() && !is_told(&f.kind)) {
        tracing::warn!("{finding}");
    }
}
