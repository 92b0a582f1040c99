//! What a picture may show, proposed to a person who labels it.
//!
//! The labelled examples that are most like it teach detector and grounder. What they are sure of is a
//! proposal; what they are not is told as undecided, and an example with undecided facts is none yet.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use image::RgbImage;

use super::exemplars::{ExemplarFiles, view_of};
use super::fitted_examples::fitted_example;
use super::scaled_examples::{Examples, scaled_examples, size_of};
use super::{ConfigError, DomainFolder, ExemplarConfig, RunConfig};
use crate::logic::Truth;
use crate::parts::PartChoice;
use crate::pddl::{Atom, Name, Typed};
use crate::perception::grounders::Grounding;
use crate::perception::model::{Exemplar, ExemplarError, ObjectBox};
use crate::perception::{
    FrameView, GripperContent, GroundedImage, Observation, Outside, ground_image,
};
use crate::scene::Anomaly;

/// What a picture may show.
#[derive(Debug, Clone, PartialEq)]
pub struct ExemplarProposal {
    /// What was found, under the names that a run would give.
    pub boxes: Vec<ObjectBox>,
    /// Objects that facts speak of and no box shows.
    pub unseen: Vec<Typed>,
    /// Facts that were judged to hold.
    pub facts: Vec<Atom>,
    /// Facts that were not decided.
    pub undecided: Vec<Atom>,
    /// What people should know of it: who has taught it, what cannot be explained, why nothing was found.
    pub remarks: Vec<String>,
}

/// The grounder that says what it does not know.
const CAREFUL_GROUNDER: &str = "s2s-joint";

/// A picture as it was read, and its facts as they were judged once more.
struct Reading {
    image: GroundedImage,
    second: Grounding,
}

/// Labelled examples that may teach a proposal.
struct Teacher {
    name: String,
    examples: Examples,
}

impl Teacher {
    /// How unlike the picture its own are: in shape first, then in height, as factors.
    fn unlikeness(&self, size: [u32; 2]) -> [f64; 2] {
        let [w, h] = size_of(&self.examples).map(f64::from);
        let [width, height] = size.map(f64::from);
        let apart = |a: f64, b: f64| ((a / b).ln().abs() * 100.0).round();
        [apart(w / h, width / height), apart(h, height)]
    }

    /// The examples as pictures of this size, and what was done to them.
    fn fitted(&self, size: [u32; 2]) -> Result<(Examples, String), ConfigError> {
        let [w, h] = size_of(&self.examples);
        let [width, height] = size;
        let taught =
            format!("taught by the {} labelled examples {}", self.examples.len(), self.name);
        if let Ok(scaled) = scaled_examples(&self.examples, size) {
            return Ok((scaled, taught));
        }
        let fitted = self.examples.iter().map(|(p, e)| fitted_example(p, e, size));
        let fitted = fitted.collect::<Result<Vec<_>, _>>();
        let mut fitted = fitted.map_err(|other| other.mismatch(&self.name))?;
        fitted.retain(|(_, exemplar)| !exemplar.objects.is_empty());
        let how = format!("{taught}, cut or continued from {w}x{h} to {width}x{height} pixels");
        Ok((Arc::new(fitted), how))
    }
}

impl RunConfig {
    /// What a picture of a camera may show. Without labelled examples, or where they teach nothing, no
    /// object is proposed, and a remark says why. `data` is what `$data` stands for.
    ///
    /// # Errors
    /// [`ConfigError`] of the domain folder.
    pub fn propose_example(
        &self,
        camera: &str,
        picture: &RgbImage,
        data: Option<&Path>,
    ) -> Result<ExemplarProposal, ConfigError> {
        let folder = self.domain_folder()?;
        let size = [picture.width(), picture.height()];
        let mut remarks = Vec::new();
        let mut teachers = self.teachers(&folder, camera, data, &mut remarks);
        let key = |teacher: &Teacher| teacher.unlikeness(size);
        teachers.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
        let Some(teacher) = teachers.first() else {
            remarks.push(
                "the domain has no labelled example yet that could teach a detector".to_owned(),
            );
            return Ok(ExemplarProposal::empty(remarks));
        };
        let read = teacher.fitted(size).and_then(|(examples, how)| {
            remarks.push(how);
            self.read_as(&folder, camera, picture, &examples)
        });
        match read {
            Ok(reading) => Ok(ExemplarProposal::of(&reading, remarks)),
            Err(error) => {
                remarks.push(format!("nothing could be found: {error}"));
                Ok(ExemplarProposal::empty(remarks))
            }
        }
    }

    /// All labelled examples of the domain: those of the run file's camera, then each folder.
    fn teachers(
        &self,
        folder: &DomainFolder,
        camera: &str,
        data: Option<&Path>,
        remarks: &mut Vec<String>,
    ) -> Vec<Teacher> {
        let own = self.exemplar_of(camera);
        let folders = folder.files.below("exemplar").folder_names();
        let others = folders.iter().map(|name| ExemplarConfig::in_folder(name));
        let mut teachers = Vec::new();
        for (idx, config) in std::iter::once(own.clone()).chain(others).enumerate() {
            let name = config.folder.clone().or(config.image.clone()).unwrap_or_default();
            if idx > 0 && config == *own {
                continue;
            }
            match config.read(folder, data) {
                Ok(examples) => teachers.push(Teacher { name, examples: Arc::new(examples) }),
                Err(error) => {
                    remarks.push(format!("the labelled examples {name} are left out: {error}"));
                }
            }
        }
        teachers
    }

    /// Reads a picture with parts that these examples have taught. Another camera than theirs shows things
    /// in other shades and sizes, of which all together may allow too little: each example teaches a
    /// detector by itself, too, and the one that finds most counts.
    fn read_as(
        &self,
        folder: &DomainFolder,
        camera: &str,
        picture: &RgbImage,
        examples: &[(RgbImage, Exemplar)],
    ) -> Result<Reading, ConfigError> {
        let region = self.region_of(camera)?;
        let view = view_of(picture, "the picture")?;
        let grounder = folder.silent_grounder(&self.grounder_choice(), examples)?;
        let alone = if examples.len() > 1 { examples.len() } else { 0 };
        let lessons = std::iter::once(examples).chain(examples.chunks(1).take(alone));
        let mut best: Option<GroundedImage> = None;
        for lesson in lessons {
            let mut detector = folder.detector_within(region, &self.detector_choice(), lesson)?;
            let nothing = GripperContent::Empty;
            let pipeline = folder.pipeline(&*grounder);
            let read = ground_image(&pipeline, &mut *detector, &view, &[], &nothing)?;
            let n_found = |read: &GroundedImage| read.named.boxes.len();
            if best.as_ref().is_none_or(|best| n_found(&read) > n_found(best)) {
                best = Some(read);
            }
        }
        let image = best.ok_or(ExemplarError::Empty)?;
        let careful = PartChoice::new("perception.grounder", CAREFUL_GROUNDER);
        let careful = folder.silent_grounder(&careful, examples)?;
        let unexplained = &image.named.detections.unexplained;
        let frame = FrameView { image: Some(view), ..FrameView::default() };
        let observation = Observation { frame, objects: &image.named.boxes, unexplained };
        let second = folder.pipeline(&*careful).judge(&observation)?;
        Ok(Reading { image, second })
    }
}

impl ExemplarProposal {
    fn empty(remarks: Vec<String>) -> Self {
        let (boxes, unseen) = (Vec::new(), Vec::new());
        Self { boxes, unseen, facts: Vec::new(), undecided: Vec::new(), remarks }
    }

    /// What was read. What the grounders do not agree on, and what an anomaly throws doubt on, is not
    /// decided.
    fn of(reading: &Reading, mut remarks: Vec<String>) -> Self {
        let Reading { image: GroundedImage { named, state }, second } = reading;
        let anomalies: BTreeSet<&Anomaly> =
            state.grounding.anomalies.iter().chain(&second.anomalies).collect();
        remarks.extend(anomalies.iter().map(ToString::to_string));
        remarks.extend(named.detections.outside.iter().map(
            |Outside { detection, reason, .. }| {
                let [x1, y1, x2, y2] = <[f64; 4]>::from(detection.pixel_box).map(f64::round);
                format!("a {} at {x1} {y1} {x2} {y2} was left out: {reason}", detection.label)
            },
        ));
        let is_doubted = |name: &Name| anomalies.iter().any(|a| a.objects.contains(name));
        let (mut facts, mut undecided) = (Vec::new(), Vec::new());
        for judged in &state.grounding.judged {
            let atom = &judged.atom;
            let other = second.judged.iter().find(|other| other.atom == *atom);
            let is_agreed = other.is_none_or(|other| other.truth == judged.truth);
            let is_sure = is_agreed && !atom.args.iter().any(is_doubted);
            match judged.truth {
                Truth::True if is_sure => facts.push(atom.clone()),
                Truth::False if is_agreed => {}
                Truth::True | Truth::False | Truth::Unknown => undecided.push(atom.clone()),
            }
        }
        let is_said = |name: &Name| facts.iter().chain(&undecided).any(|a| a.args.contains(name));
        let is_seen = |name: &Name| named.boxes.iter().any(|o| o.name == *name);
        let unseen = state.objects.iter().filter(|o| is_said(&o.name) && !is_seen(&o.name));
        let unseen = unseen.cloned().collect();
        Self { boxes: named.boxes.clone(), unseen, facts, undecided, remarks }
    }
}

impl ExemplarFiles {
    /// All labelled examples in a folder on disk, by name.
    ///
    /// # Errors
    /// [`ConfigError::File`] when there is none, or one lacks its image.
    pub fn in_folder(folder: &Path) -> Result<Vec<Self>, ConfigError> {
        super::exemplars::in_folder(&crate::files::Folder::Disk(folder.to_owned()))
    }
}
