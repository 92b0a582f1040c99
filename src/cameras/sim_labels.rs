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

use crate::config::{ConfigError, DomainFolder, RunConfig, read_text};
use crate::geometry::PixelBox;
use crate::pddl::{Atom, Condition, Name, Problem, Typed, print_problem};
use crate::robots::sim::{SimConfig, SimHardware, read_scene};

/// One labelled example, as its three files.
#[derive(Debug, Clone)]
pub struct LabelledScene {
    /// Name of the scene file.
    pub name: String,
    /// What the camera sees.
    pub image: RgbImage,
    /// Boxes as JSON.
    pub boxes: String,
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
        let world = World::new(&read_scene(path)?, &sim.world, seed)
            .map_err(|e| bad(e.to_string()))?;
        let mut camera = sim.camera.clone();
        camera.light.seed = seed;
        let frame = renderer.render(&world, &camera, seed).map_err(|e| bad(e.to_string()))?;
        let name = path.file_stem().and_then(|s| s.to_str()).unwrap_or("example").to_owned();
        labelled.push(
            describe(name, &frame, &world.truth(), folder, &labels)
                .ok_or_else(|| bad("the rendered frame has no pixels".to_owned()))?,
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

fn describe(
    name: String,
    frame: &Frame,
    truth: &Truth,
    folder: &DomainFolder,
    labels: &Labels,
) -> Option<LabelledScene> {
    let boxes = visible_boxes(frame);
    let seen: Vec<(&BodyTruth, PixelBox)> = truth
        .bodies
        .iter()
        .enumerate()
        .filter(|(_, body)| folder.perception.type_spec(&body.kind.into()).is_some())
        .filter_map(|(i, body)| Some((body, *boxes.get(&(u16::try_from(i + 1).ok()?))?)))
        .collect();
    let bodies: Vec<&BodyTruth> = seen.iter().map(|(body, _)| *body).collect();
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
    let lines = seen
        .iter()
        .map(|(body, b)| format!("  \"{}\": [{}, {}, {}, {}]", body.name, b.x1, b.y1, b.x2, b.y2));
    let boxes = format!("{{\n{}\n}}\n", lines.collect::<Vec<_>>().join(",\n"));
    Some(LabelledScene {
        name,
        image: RgbImage::from_raw(frame.width, frame.height, frame.rgb.clone())?,
        boxes,
        state: print_problem(&problem),
        n_objects: seen.len(),
    })
}

/// The box of every instance's visible pixels, by instance id.
fn visible_boxes(frame: &Frame) -> BTreeMap<u16, PixelBox> {
    let mut boxes: BTreeMap<u16, PixelBox> = BTreeMap::new();
    for (i, id) in frame.ids.iter().enumerate().filter(|(_, id)| **id != 0) {
        let (x, y) = ((i % frame.width as usize) as f64, (i / frame.width as usize) as f64);
        let b = boxes.entry(*id).or_insert(PixelBox { x1: x, y1: y, x2: x, y2: y });
        *b = PixelBox {
            x1: b.x1.min(x),
            y1: b.y1.min(y),
            x2: b.x2.max(x + 1.0),
            y2: b.y2.max(y + 1.0),
        };
    }
    boxes
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
