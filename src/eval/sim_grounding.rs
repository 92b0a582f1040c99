//! Grounding measured on simulated scenes: which feature tells the facts, seen from where.
//!
//! Every scene is labelled by what is really there, which is used for scoring alone, and for the
//! labelled examples: these are always made with the camera that they are used for.

use std::collections::{BTreeMap, BTreeSet};

use image::RgbImage;
use schemars::JsonSchema;
use serde::Serialize;

use crate::files::FileRef;
use crate::hardware::sim::{Labeller, Look, Viewpoint, exemplar_scenes};
use crate::logic::Truth;
use crate::parts::PartChoice;
use crate::pddl::{Atom, Name};
use crate::perception::detectors::Detector;
use crate::perception::grounders::S2s;
use crate::perception::model::{Exemplar, Exemplars, ObjectBox, Perception};
use crate::perception::{
    DepthView, Detection, FrameView, ImageView, UsualSizes, label_of, lift_detections,
};
use crate::run::{ConfigError, DomainFolder, RunConfig};

/// The scene below a domain's folder that is looked at, with one arrangement for each seed.
pub const SCENE: &str = "scenes/evaluation.toml";

/// A detection is the labelled object that it overlaps most, by at least this share: less says
/// that it is something else.
const IOU_MIN: f64 = 0.3;
/// A detection that lies wholly inside a labelled object of its colour counts as much as this overlap.
const PART_WEIGHT: f64 = 0.5;

/// Where the camera stands: its name, and another place than that of the run file.
pub const CAMERAS: [(&str, Option<Viewpoint>); 3] = [
    ("usual", None),
    ("oblique", Some(Viewpoint { position_m: [0.0, -0.82, 0.72], look_at_m: [0.0, 0.0, 0.05] })),
    ("side", Some(Viewpoint { position_m: [0.85, -0.6, 0.48], look_at_m: [0.0, 0.0, 0.05] })),
];

/// Which features of each object are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Used {
    /// Its box: the paper's features.
    Boxes,
    /// Which pixels are its own.
    Masks,
    /// Its volume, from depth.
    Volumes,
}

/// Where the objects come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The colour detector.
    Detected,
    /// The labels.
    Labelled,
}

/// How well the facts of all scenes were told, seen from one place by one feature.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Row {
    /// Name of its folder.
    pub domain: String,
    /// The camera's pose: `usual`, `oblique` or `side`.
    pub camera: &'static str,
    /// Where the objects come from.
    pub objects: Source,
    /// Which features of them are used.
    pub features: Used,
    /// Predicted facts that hold: true positives.
    pub n_true: u64,
    /// Predicted facts that do not hold: false positives.
    pub n_false: u64,
    /// Facts that hold and are not predicted: false negatives.
    pub n_missed: u64,
    /// Scenes whose predicted facts are exactly those that hold.
    pub n_exact: u64,
    /// Scenes that were looked at.
    pub n_scenes: u64,
    /// Objects that are completely occluded, over all scenes; they are not scored.
    pub n_hidden: u64,
}

impl Row {
    /// The share of what was said that is true; 1 when nothing was said.
    pub fn precision(&self) -> f64 {
        share(self.n_true, self.n_false)
    }

    /// The share of what is true that was said; 1 when there is nothing to say.
    pub fn recall(&self) -> f64 {
        share(self.n_true, self.n_missed)
    }

    fn count(&mut self, said: &BTreeSet<Atom>, truth: &BTreeSet<Atom>, n_hidden: usize) {
        self.n_true += said.intersection(truth).count() as u64;
        self.n_false += said.difference(truth).count() as u64;
        self.n_missed += truth.difference(said).count() as u64;
        self.n_exact += u64::from(said == truth);
        self.n_scenes += 1;
        self.n_hidden += n_hidden as u64;
    }
}

fn share(part: u64, rest: u64) -> f64 {
    if part + rest == 0 { 1.0 } else { part as f64 / (part + rest) as f64 }
}

/// Whether a domain has the scene that is looked at.
pub fn has_scene(folder: &DomainFolder) -> bool {
    folder.files.file(SCENE).exists()
}

/// Measures one domain from every camera, on one scene for each seed. `seen` is told after each
/// scene, with the camera's name, the seed and the image.
///
/// # Errors
/// [`ConfigError`] naming the file.
pub fn measure(
    config: &RunConfig,
    folder: &DomainFolder,
    seeds: u64,
    seen: &mut dyn FnMut(&str, u64, &RgbImage),
) -> Result<Vec<Row>, ConfigError> {
    let mut rows = Vec::new();
    for (camera, from) in CAMERAS {
        let mut labeller = Labeller::new(folder.scenes(), config.sim()?)?;
        let examples = examples(&mut labeller, folder, config.seed, from)?;
        let mut setup = SetUp::new(folder, &examples)?;
        let mut measured: Vec<Row> = setup
            .combinations()
            .map(|(objects, features)| row(folder, camera, objects, features))
            .collect();
        for seed in 1..=seeds {
            let look = labeller.look(&folder.files.file(SCENE), seed, from)?;
            setup.count(&look, &mut measured)?;
            seen(camera, seed, &look.image);
        }
        rows.extend(measured);
    }
    Ok(rows)
}

pub(super) fn row(
    folder: &DomainFolder,
    camera: &'static str,
    objects: Source,
    features: Used,
) -> Row {
    let domain = folder.domain.name.to_string();
    let (n_true, n_false, n_missed, n_exact, n_scenes, n_hidden) = Default::default();
    Row {
        domain,
        camera,
        objects,
        features,
        n_true,
        n_false,
        n_missed,
        n_exact,
        n_scenes,
        n_hidden,
    }
}

/// The domain's labelled examples, seen by this camera.
pub(super) fn examples(
    labeller: &mut Labeller<'_>,
    folder: &DomainFolder,
    seed: u64,
    from: Option<Viewpoint>,
) -> Result<Vec<(RgbImage, Exemplar)>, ConfigError> {
    let paths: Vec<FileRef> = exemplar_scenes(&folder.files)?;
    let mut examples = Vec::new();
    for (path, seed) in paths.iter().zip(seed..) {
        let look = labeller.look(path, seed, from)?;
        let exemplar = Exemplar {
            name: path.to_string(),
            image_size: [look.image.width(), look.image.height()],
            objects: look.objects,
            init: look.facts,
        };
        examples.push((look.image, exemplar));
    }
    Ok(examples)
}

/// What one camera and its labelled examples make.
pub(super) struct SetUp<'a> {
    perception: &'a Perception,
    detector: Box<dyn Detector>,
    grounders: Vec<(Used, S2s)>,
    sizes: UsualSizes,
}

impl<'a> SetUp<'a> {
    pub(super) fn new(
        folder: &'a DomainFolder,
        examples: &[(RgbImage, Exemplar)],
    ) -> Result<Self, ConfigError> {
        let perception = &folder.perception;
        let mut grounders = Vec::new();
        for used in [Used::Boxes, Used::Masks, Used::Volumes] {
            let reduced = examples.iter().map(|(_, example)| Exemplar {
                objects: example.objects.iter().map(|o| used.of(o)).collect(),
                ..example.clone()
            });
            let exemplars = Exemplars::new(reduced.collect())?;
            grounders.push((used, S2s::new(&folder.domain, &perception.observed, &exemplars)?));
        }
        let detector =
            folder.detector(&PartChoice::new("perception.detector", "colour"), examples)?;
        let mut sizes = UsualSizes::default();
        for (_, example) in examples {
            sizes.learn(&example.objects);
        }
        Ok(Self { perception, detector, grounders, sizes })
    }

    /// Judges one look by every combination of a row, and counts.
    pub(super) fn count(&mut self, look: &Look, rows: &mut [Row]) -> Result<(), ConfigError> {
        let (detected, labelled) = (self.detect(look)?, self.label(look)?);
        for row in rows {
            let objects = match row.objects {
                Source::Detected => &detected,
                Source::Labelled => &labelled,
            };
            let said = self.facts(objects, row.features);
            row.count(&said, &self.observed(&look.facts), look.n_hidden);
        }
        Ok(())
    }

    /// How sure it is that a detection is a labelled object: by how much they overlap, or by its
    /// colour where it is a part of it.
    fn sameness(&self, label: &Name, detected: &ObjectBox, labelled: &ObjectBox) -> f64 {
        let (b, whole) = (detected.pixel_box, labelled.pixel_box);
        let spec = self.perception.type_spec(&labelled.type_name);
        let is_its_colour = spec.and_then(|spec| label_of(spec, &labelled.name)) == Some(label);
        let inside = b.intersection(&whole).area() / b.area();
        let part = if is_its_colour { inside * PART_WEIGHT } else { 0.0 };
        b.iou(&whole).max(part)
    }

    /// The labelled objects, measured as a detector's would be.
    fn label(&self, look: &Look) -> Result<Vec<ObjectBox>, ConfigError> {
        let detection = |object: &ObjectBox| Detection {
            mask: object
                .mask
                .as_ref()
                .map(|mask| mask.iter().copied().collect())
                .unwrap_or_default(),
            usual_extent: self.sizes.of(&object.type_name),
            ..Detection::new(object.type_name.clone(), object.type_name.clone(), object.pixel_box)
        };
        let mut detections: Vec<Detection> = look.objects.iter().map(detection).collect();
        lift_detections(self.perception, &frame_of(look)?, &mut detections);
        let named = look.objects.iter().zip(detections);
        Ok(named.map(|(object, detection)| detection.object(object.name.clone())).collect())
    }

    pub(super) fn combinations(&self) -> impl Iterator<Item = (Source, Used)> {
        let used = self.grounders.iter().map(|(used, _)| *used);
        used.flat_map(|used| [(Source::Detected, used), (Source::Labelled, used)])
    }

    /// The detector's objects, under the names of the labelled ones that they are.
    fn detect(&mut self, look: &Look) -> Result<Vec<ObjectBox>, ConfigError> {
        let frame = frame_of(look)?;
        let Some(view) = frame.image else { return Ok(Vec::new()) };
        let mut detections = self.detector.detect(&view, &[])?;
        detections.take_back_outside(); // as in the loop, where depth and pose are known
        let mut detections = detections.objects;
        lift_detections(self.perception, &frame, &mut detections);
        let nameless = detections.iter().enumerate();
        let mut objects: Vec<ObjectBox> =
            nameless.map(|(i, d)| d.object(Name::new(format!("unknown{i}")))).collect();
        let setup = &*self;
        let pairs = objects.iter().enumerate().flat_map(|(i, o)| {
            let same = look.objects.iter().filter(|l| l.type_name == o.type_name);
            let label = &detections[i].label;
            same.map(move |labelled| (setup.sameness(label, o, labelled), i, &labelled.name))
        });
        let mut pairs: Vec<_> = pairs.filter(|(iou, ..)| *iou >= IOU_MIN).collect();
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut named: BTreeMap<usize, &Name> = BTreeMap::new();
        for (_, i, name) in pairs {
            if !named.contains_key(&i) && named.values().all(|taken| *taken != name) {
                named.insert(i, name);
            }
        }
        for (i, name) in named {
            objects[i].name = name.clone();
        }
        Ok(objects)
    }

    /// The facts that are said to hold, by one feature.
    fn facts(&self, objects: &[ObjectBox], used: Used) -> BTreeSet<Atom> {
        let objects: Vec<ObjectBox> = objects.iter().map(|object| used.of(object)).collect();
        let grounder = self.grounders.iter().find(|(of, _)| *of == used);
        let judged = grounder.map(|(_, s2s)| s2s.judge(&objects).judged).unwrap_or_default();
        judged.into_iter().filter(|j| j.truth == Truth::True).map(|j| j.atom).collect()
    }

    fn observed(&self, facts: &BTreeSet<Atom>) -> BTreeSet<Atom> {
        let observed =
            |atom: &&Atom| self.perception.observed_predicates().any(|p| *p == atom.predicate);
        facts.iter().filter(observed).cloned().collect()
    }
}

/// What the camera shows of a scene.
fn frame_of(look: &Look) -> Result<FrameView<'_>, ConfigError> {
    let (width, height) = (look.image.width() as usize, look.image.height() as usize);
    let fault = |reason: String| ConfigError::File { path: SCENE.to_owned(), reason };
    let view =
        ImageView::new(width, height, look.image.as_raw()).map_err(|e| fault(e.to_string()))?;
    let depth = DepthView::new(width, height, &look.depth_m).map_err(|e| fault(e.to_string()))?;
    Ok(FrameView { image: Some(view), depth: Some(depth), camera: Some(&look.model) })
}

impl Used {
    /// The object without what is not used.
    fn of(self, object: &ObjectBox) -> ObjectBox {
        ObjectBox {
            volume: object.volume.filter(|_| self == Self::Volumes),
            mask: object.mask.clone().filter(|_| self == Self::Masks),
            ..object.clone()
        }
    }
}
