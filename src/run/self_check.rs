//! Labelled examples of run files and of loose files, tried on themselves.

use std::path::Path;

use image::RgbImage;

use super::exemplars::view_of;
use super::{ConfigError, DomainFolder, RunConfig};
use crate::clock::monotonic_ns;
use crate::messages::MAIN_CAMERA;
use crate::perception::detectors::Detector;
use crate::perception::grounders::Grounder;
use crate::perception::model::Exemplar;
use crate::perception::self_check::{ExemplarFinding, FindingKind, LabelledImage, SelfCheck};

/// The detector that colours, outlines and sizes of `perception.toml` are for.
const BY_COLOURS: &str = "colour";
/// The detector that takes boxes from a file: they are those of another picture.
const FROM_FILE: &str = "annotated";
/// The camera that sees a scene file.
#[cfg(feature = "sim")]
const SIMULATED: &str = "sim";

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

impl CameraCheck {
    pub(super) fn new(
        camera: &str,
        examples: &[(RgbImage, Exemplar)],
        mut findings: Vec<ExemplarFinding>,
    ) -> Self {
        // The grounder of a run learns from the examples of `[camera]` only.
        findings.retain(|finding| {
            camera == MAIN_CAMERA || !matches!(finding.kind, FindingKind::Untaught { .. })
        });
        let n_objects = examples.iter().map(|(_, exemplar)| exemplar.objects.len()).sum();
        let (camera, n_examples) = (camera.to_owned(), examples.len());
        Self { camera, n_examples, n_objects, findings }
    }

    /// Warns of what is grave, once for each finding. What grounders warn of by themselves is left
    /// out.
    fn warn(&self) {
        let is_told = |kind: &FindingKind| {
            matches!(kind, FindingKind::Untaught { unknown_where_touching: true, .. })
        };
        for finding in self.findings.iter().filter(|f| f.kind.is_grave() && !is_told(&f.kind)) {
            tracing::warn!("{finding}");
        }
    }
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
        let TaughtParts { detector_name, detector, grounder, has_depth } = parts;
        let mut check = SelfCheck {
            pipeline: self.pipeline(grounder),
            detector: (detector_name != FROM_FILE).then_some(detector),
            goes_by_colours: detector_name == BY_COLOURS,
            has_depth,
        };
        Ok(check.findings(&labelled)?)
    }

    /// Warns of what labelled examples show otherwise than labelled, where that takes little time. It
    /// is no error, and neither is an example that cannot be tried.
    pub(super) fn warn_of_examples(
        &self,
        camera: &str,
        parts: TaughtParts<'_>,
        examples: &[(RgbImage, Exemplar)],
    ) {
        if parts.detector.is_slow() || parts.grounder.is_slow() {
            tracing::debug!(
                "labelled examples of {camera}: not tried, since detector or grounder are slow; \
                 groundloop exemplar check does it"
            );
            return;
        }
        let started_ns = monotonic_ns();
        match self.try_examples(parts, examples) {
            Ok(findings) => {
                let elapsed_ms = (monotonic_ns() - started_ns) / 1_000_000;
                tracing::debug!("labelled examples of {camera}: tried in {elapsed_ms} ms");
                CameraCheck::new(camera, examples, findings).warn();
            }
            Err(error) => tracing::debug!("labelled examples of {camera}: not tried: {error}"),
        }
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
        let others = self.other_cameras().filter(|name| self.has_own_examples(name));
        let cameras = std::iter::once(MAIN_CAMERA).chain(others.map(String::as_str));
        let checks = cameras.map(|camera| {
            let examples = self.exemplar_of(camera).read(&folder, data)?;
            let mut detector = folder.detector_within(
                self.region_of(camera)?,
                &self.detector_choice(),
                &examples,
            )?;
            let grounder = folder.silent_grounder(&self.grounder_choice(), &examples)?;
            let parts = self.taught_parts(&mut *detector, &*grounder);
            let findings = folder.try_examples(parts, &examples)?;
            Ok(CameraCheck::new(camera, &examples, findings))
        });
        checks.collect()
    }

    /// Warns of objects of the simulated scene that `perception.toml` gives no detector a way to find.
    #[cfg(feature = "sim")]
    pub(super) fn warn_of_scene(&self, folder: &DomainFolder) -> Result<(), ConfigError> {
        use crate::hardware::sim::{read_scene, unlabelled_types, unseen_by_colour};
        if self.camera.kind != SIMULATED {
            return Ok(());
        }
        let scene = read_scene(&folder.files.file(&self.sim()?.scene))?;
        let (domain, perception) = (&folder.domain, &folder.perception);
        let mut warnings = unlabelled_types(&scene, domain, perception);
        if self.perception.detector == BY_COLOURS {
            warnings.extend(unseen_by_colour(&scene, domain, perception));
        }
        for warning in warnings {
            tracing::warn!("{warning}");
        }
        Ok(())
    }

    /// Whether another camera has labelled examples that are not those of `[camera]`.
    pub(super) fn has_own_examples(&self, camera: &str) -> bool {
        self.cameras.get(camera).is_some_and(|camera| camera.exemplar.is_some())
    }

    pub(super) fn taught_parts<'a>(
        &'a self,
        detector: &'a mut dyn Detector,
        grounder: &'a dyn Grounder,
    ) -> TaughtParts<'a> {
        let detector_name = &self.perception.detector;
        TaughtParts { detector_name, detector, grounder, has_depth: true }
    }
}
