//! Labelled examples of the simulated camera: what is rendered, and what is really there.
//!
//! For making `exemplar/` folders, and for scoring an episode that has ended; nothing in the loop
//! may use it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use groundloop_sim::{BodyTruth, Frame, Renderer, Truth, World};
use image::RgbImage;
use serde::Deserialize;

use super::sim::model_of;
use crate::config::{ConfigError, DomainFolder, RunConfig, read_text};
use crate::detectors::{DepthView, Detection, volume_of};
use crate::geometry::{CameraModel, PixelBox, RowRun};
use crate::pddl::{Atom, Condition, Name, Problem, Typed, print_problem};
use crate::robots::sim::{SimConfig, SimHardware, read_scene};
use crate::scene::Volume;

/// One labelled example, as its three files.
#[derive(Debug, Clone)]
pub struct LabelledScene {
    /// Name of the scene file.
    pub name: String,
    /// What the camera sees.
    pub image: RgbImage,
    /// Boxes as JSON.
    pub boxes: String,
    /// Volumes as JSON: what the camera's depth says of them.
    pub volumes: String,
    /// State as a PDDL problem.
    pub state: String,
    /// How many objects are labelled.
    pub n_objects: usize,
}

/// `scenes/labels.toml`: which predicate says what is really there.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Labels {
    label: Vec<Label>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Label {
    predicate: Name,
    relation: Relation,
}

/// A true relation between two bodies of the types that the predicate wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Relation {
    /// The first rests on the second.
    RestsOn,
    /// The second goes through the first.
    Around,
    /// The first is narrower than the second.
    Narrower,
}

/// The domain's words for what is really there.
#[derive(Debug, Clone)]
pub struct Oracle {
    labels: Labels,
    folder: Arc<DomainFolder>,
    hardware: SimHardware,
}

impl Oracle {
    /// Reads the domain's `scenes/labels.toml`; `None` without such a file.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file and line.
    pub fn new(
        folder: &Arc<DomainFolder>,
        hardware: SimHardware,
    ) -> Result<Option<Self>, ConfigError> {
        if !labels_path(folder).is_file() {
            return Ok(None);
        }
        let labels = read_labels(folder)?;
        Ok(Some(Self { labels, folder: Arc::clone(folder), hardware }))
    }

    /// What really holds now. For scoring after an episode; nothing in the loop may ask.
    pub fn facts(&self) -> BTreeSet<Atom> {
        let truth = self.hardware.oracle();
        let bodies: Vec<&BodyTruth> = truth.bodies.iter().collect();
        let labels = self.labels.label.iter();
        labels.flat_map(|label| label.facts(&bodies, &self.folder)).collect()
    }
}

fn labels_path(folder: &DomainFolder) -> PathBuf {
    folder.path.join("scenes").join("labels.toml")
}

fn read_labels(folder: &DomainFolder) -> Result<Labels, ConfigError> {
    let path = labels_path(folder);
    toml::from_str(&read_text(&path)?).map_err(|e| toml_error(&path, &e))
}

fn toml_error(path: &Path, error: &toml::de::Error) -> ConfigError {
    ConfigError::Toml { path: path.display().to_string(), message: error.to_string() }
}

/// Renders and labels every scene in the domain's `scenes/exemplar/`.
///
/// # Errors
/// [`ConfigError`] naming the file.
pub fn label_scene(
    config: &RunConfig,
    folder: &DomainFolder,
) -> Result<Vec<LabelledScene>, ConfigError> {
    let labels = read_labels(folder)?;
    let table = config.sim.clone().unwrap_or_default();
    let sim: SimConfig = table.try_into().map_err(|e| toml_error(&config.origin, &e))?;
    let scenes = scene_files(&folder.path.join("scenes").join("exemplar"))?;
    let mut renderer = Renderer::new();
    let mut labelled = Vec::new();
    for (i, path) in scenes.iter().enumerate() {
        let bad = |reason: String| ConfigError::File { path: path.display().to_string(), reason };
        let seed = config.seed.wrapping_add(i as u64);
        let world =
            World::new(&read_scene(path)?, &sim.world, seed).map_err(|e| bad(e.to_string()))?;
        let mut camera = sim.camera.clone();
        camera.light.seed = seed;
        let frame = renderer.render(&world, &camera, seed).map_err(|e| bad(e.to_string()))?;
        let name = path.file_stem().and_then(|s| s.to_str()).unwrap_or("example").to_owned();
        let shot = Shot { frame: &frame, model: model_of(&camera), truth: world.truth() };
        labelled.push(
            describe(name, &shot, folder, &labels)
                .ok_or_else(|| bad("an object is hidden".to_owned()))?,
        );
    }
    Ok(labelled)
}

fn scene_files(folder: &Path) -> Result<Vec<PathBuf>, ConfigError> {
    let entries = std::fs::read_dir(folder).map_err(|e| ConfigError::File {
        path: folder.display().to_string(),
        reason: e.to_string(),
    })?;
    let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut scenes: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    scenes.sort();
    Ok(scenes)
}

/// One rendered scene.
struct Shot<'a> {
    frame: &'a Frame,
    model: CameraModel,
    truth: Truth,
}

/// `None` when an object cannot be seen well enough to have a box and a volume.
fn describe(
    name: String,
    shot: &Shot<'_>,
    folder: &DomainFolder,
    labels: &Labels,
) -> Option<LabelledScene> {
    let Shot { frame, model, truth } = shot;
    let depth = DepthView::new(frame.width as usize, frame.height as usize, &frame.depth_m).ok()?;
    let mut seen: Vec<(&BodyTruth, PixelBox, Volume)> = Vec::new();
    for (i, body) in truth.bodies.iter().enumerate() {
        let Some(spec) = folder.perception.type_spec(&body.kind.into()) else { continue };
        let detection = visible(frame, u16::try_from(i + 1).ok()?, body)?;
        let volume = volume_of(&detection, &depth, model, spec.depth)?.volume;
        seen.push((body, detection.pixel_box, volume));
    }
    let bodies: Vec<&BodyTruth> = seen.iter().map(|(body, ..)| *body).collect();
    let init = labels.label.iter().flat_map(|label| label.facts(&bodies, folder)).collect();
    let problem = Problem {
        name: Name::new(&name),
        domain: folder.domain.name.clone(),
        objects: bodies.iter().map(|body| Typed::new(body.name.as_str(), body.kind)).collect(),
        init,
        costs: BTreeMap::new(),
        goal: Condition::True,
        minimise_cost: false,
    };
    let boxes = seen.iter().map(|(body, b, _)| (&body.name, [b.x1, b.y1, b.x2, b.y2]));
    let volumes = seen.iter().map(|(body, _, volume)| (&body.name, rounded(volume)));
    let boxes: BTreeMap<_, _> = boxes.collect();
    let volumes: BTreeMap<_, _> = volumes.collect();
    Some(LabelledScene {
        name,
        image: RgbImage::from_raw(frame.width, frame.height, frame.rgb.clone())?,
        boxes: lines(&boxes)?,
        volumes: lines(&volumes)?,
        state: print_problem(&problem),
        n_objects: seen.len(),
    })
}

/// One entry to a line.
fn lines<T: serde::Serialize>(entries: &BTreeMap<&String, T>) -> Option<String> {
    let line = |(name, value): (&&String, &T)| {
        let (name, value) = (serde_json::to_string(name).ok()?, serde_json::to_string(value).ok()?);
        Some(format!("  {name}: {value}"))
    };
    let lines: Option<Vec<String>> = entries.iter().map(line).collect();
    Some(format!("{{\n{}\n}}\n", lines?.join(",\n")))
}

/// A volume to a tenth of a millimetre.
fn rounded(volume: &Volume) -> Volume {
    let round = |v: f64| (v * 1e4).round() / 1e4;
    Volume { centre: volume.centre.map(round), extent: volume.extent.map(round) }
}

/// The visible pixels of one instance, as a detector would find them; `None` without any.
fn visible(frame: &Frame, id: u16, body: &BodyTruth) -> Option<Detection> {
    let width = frame.width as usize;
    let mut mask: Vec<RowRun> = Vec::new();
    for (i, _) in frame.ids.iter().enumerate().filter(|(_, found)| **found == id) {
        let (x, y) = (u32::try_from(i % width).ok()?, u32::try_from(i / width).ok()?);
        match mask.last_mut() {
            Some(run) if run.y == y && run.x_end == x => run.x_end += 1,
            _ => mask.push(RowRun { y, x_start: x, x_end: x + 1 }),
        }
    }
    let pixel_box = PixelBox {
        x1: f64::from(mask.iter().map(|r| r.x_start).min()?),
        y1: f64::from(mask.first()?.y),
        x2: f64::from(mask.iter().map(|r| r.x_end).max()?),
        y2: f64::from(mask.last()?.y + 1),
    };
    let type_name = Name::new(body.kind);
    Some(Detection { name: None, label: type_name.clone(), type_name, pixel_box, score: 1.0, mask })
}

impl Label {
    /// The facts of this predicate over bodies of the types that it wants.
    fn facts(&self, bodies: &[&BodyTruth], folder: &DomainFolder) -> Vec<Atom> {
        let domain = &folder.domain;
        let Some(signature) = domain.predicate(self.predicate.as_str()) else { return Vec::new() };
        let [first, second] = signature.params.as_slice() else { return Vec::new() };
        let fits = |body: &BodyTruth, param: &Typed| {
            domain.types.fits(&[Name::new(body.kind)], &param.types)
        };
        let mut facts = Vec::new();
        for a in bodies.iter().filter(|body| fits(body, first)) {
            for b in bodies.iter().filter(|body| fits(body, second) && body.name != a.name) {
                if self.relation.holds(a, b) {
                    facts.push(Atom {
                        predicate: self.predicate.clone(),
                        args: vec![Name::new(&a.name), Name::new(&b.name)],
                    });
                }
            }
        }
        facts
    }
}

impl Relation {
    fn holds(self, a: &BodyTruth, b: &BodyTruth) -> bool {
        match self {
            Self::RestsOn => a.on.as_ref() == Some(&b.name),
            Self::Around => a.peg.as_ref() == Some(&b.name),
            Self::Narrower => a.size_m.x < b.size_m.x,
        }
    }
}
