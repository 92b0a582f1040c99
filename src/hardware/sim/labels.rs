//! Labelled examples of the simulated camera: what is rendered, and what is really there.
//!
//! For making `exemplar/` folders, and for scoring an episode that has ended; nothing in the loop
//! may use it.

use std::collections::{BTreeMap, BTreeSet};

use groundloop_sim::{BodyTruth, Frame, Renderer, SceneSpec, Truth, World};
use image::RgbImage;
use schemars::JsonSchema;
use serde::Deserialize;

use super::camera::model_of;
use super::config::SimConfig;
use super::robot::{SimHardware, read_scene};
use super::scene_types::{check_types, unlabelled_types};
use super::visible_share::visible_share;
use super::witness::is_settled;
use crate::files::{FileRef, Folder};
use crate::geometry::{Aabb, CameraModel, MaskRun, PixelBox};
use crate::hardware::{GroundTruth, TrueDispatch, TrueHistory, TrueMoment};
use crate::parts::PartError;
use crate::pddl::{Atom, Condition, Domain, Name, Problem, Typed, print_problem};
use crate::perception::model::{ObjectBox, Perception};
use crate::perception::{DepthView, Detection, volume_of};
use crate::settings::TomlFile;

/// One labelled example, as its files.
#[derive(Debug, Clone)]
pub struct LabelledScene {
    /// Name of the scene file.
    pub name: String,
    /// What the camera sees.
    pub image: RgbImage,
    /// Boxes as JSON.
    pub boxes: String,
    /// Masks as JSON: the pixels of each object.
    pub masks: String,
    /// Volumes as JSON: what the camera's depth says of them.
    pub volumes: String,
    /// State as a PDDL problem.
    pub state: String,
    /// How many objects are labelled.
    pub n_objects: usize,
}

/// What the simulated camera sees of a scene, and what is really there.
#[derive(Debug, Clone)]
pub struct Look {
    /// The frame.
    pub image: RgbImage,
    /// Its depth, metres along the optical axis.
    pub depth_m: Vec<f32>,
    /// The camera.
    pub model: CameraModel,
    /// Every object that can be seen, with box, mask and volume, in the order of the scene.
    pub objects: Vec<ObjectBox>,
    /// The facts that hold among them.
    pub facts: BTreeSet<Atom>,
    /// How much of each object the camera sees: the share of its outline in the image that nothing hides
    /// and that lies in the image, 0 to 1. In the order of `objects`.
    pub visible_shares: Vec<f64>,
    /// How many objects of visible types others hide too far for a volume.
    pub n_hidden: usize,
}

/// Another place for the camera of a run file: metres, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoint {
    /// Where it is.
    pub position_m: [f64; 3],
    /// What is in the middle of its image.
    pub look_at_m: [f64; 3],
}

/// Whose scenes are labelled.
#[derive(Debug, Clone, Copy)]
pub struct ScenesOf<'a> {
    /// The domain's folder.
    pub folder: &'a Folder,
    /// Its words.
    pub domain: &'a Domain,
    /// How it is seen.
    pub perception: &'a Perception,
}

/// Builds scenes, looks at them and labels what is seen.
#[derive(Debug)]
pub struct Labeller<'a> {
    scenes: ScenesOf<'a>,
    sim: SimConfig,
    labels: Labels,
    renderer: Renderer,
}

/// `scenes/labels.toml`: which predicate says what is really there.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Labels {
    label: Vec<Label>,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Label {
    predicate: Name,
    relation: Relation,
}

/// A true relation between two bodies of the types that the predicate wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
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
    domain: Domain,
    hardware: SimHardware,
}

impl Oracle {
    /// Reads the domain's `scenes/labels.toml`; `None` without such a file.
    ///
    /// # Errors
    /// [`PartError::File`] naming the file and line.
    pub fn new(
        folder: &Folder,
        domain: &Domain,
        hardware: SimHardware,
    ) -> Result<Option<Self>, PartError> {
        if !labels_file(folder).exists() {
            return Ok(None);
        }
        let labels = read_labels(folder)?;
        Ok(Some(Self { labels, domain: domain.clone(), hardware }))
    }

    /// What really was and is. For judging an episode that has ended; nothing in the loop may ask.
    pub fn history(&self) -> TrueHistory {
        let (now, look_alikes) = self.hardware.oracle();
        let (moments, dispatches) = self.hardware.remembered();
        let named = |group: Vec<String>| group.iter().map(Name::new).collect();
        let look_alikes: Vec<Vec<Name>> = look_alikes.into_iter().map(named).collect();
        let moments = moments.into_iter().map(|moment| TrueMoment {
            frame_sequence: moment.frame,
            truth: self.in_words(&moment.truth, &look_alikes),
            seen: moment.seen.iter().map(Name::new).collect(),
        });
        let dispatches = dispatches.into_iter();
        TrueHistory {
            moments: moments.collect(),
            dispatches: dispatches
                .map(|(frame_sequence, step)| TrueDispatch { frame_sequence, step })
                .collect(),
            now: self.in_words(&now, &look_alikes),
        }
    }

    fn in_words(&self, truth: &Truth, look_alikes: &[Vec<Name>]) -> GroundTruth {
        let bodies: Vec<&BodyTruth> = truth.bodies.iter().collect();
        let labels = self.labels.label.iter();
        let named = |body: &BodyTruth| Name::new(&body.name);
        GroundTruth {
            facts: labels.flat_map(|label| label.facts(&bodies, &self.domain)).collect(),
            held: truth.bodies.iter().find(|body| body.held).map(named),
            objects: truth.bodies.iter().map(named).collect(),
            unsettled: truth.bodies.iter().filter(|body| !is_settled(body)).map(named).collect(),
            look_alikes: look_alikes.to_vec(),
        }
    }
}

fn labels_file(folder: &Folder) -> FileRef {
    folder.file("scenes/labels.toml")
}

fn read_labels(folder: &Folder) -> Result<Labels, PartError> {
    let file = labels_file(folder);
    Ok(TomlFile::parse(&file.to_string(), &file.text()?)?.read()?)
}

fn fault(file: &FileRef, reason: impl std::fmt::Display) -> PartError {
    PartError::file(file.to_string(), reason.to_string())
}

/// Renders and labels every scene in the domain's `scenes/exemplar/`, with seeds counting up.
///
/// # Errors
/// [`PartError::File`] naming the file.
pub fn label_scenes(
    scenes: ScenesOf<'_>,
    sim: SimConfig,
    seed: u64,
) -> Result<Vec<LabelledScene>, PartError> {
    let mut labeller = Labeller::new(scenes, sim)?;
    let mut labelled = Vec::new();
    let files = exemplar_scenes(scenes.folder)?;
    let mut unlabelled = BTreeSet::new();
    for file in &files {
        let scene = read_scene(file)?;
        unlabelled.extend(unlabelled_types(&scene, scenes.domain, scenes.perception));
    }
    for warning in unlabelled {
        tracing::warn!("{warning}");
    }
    for (file, seed) in files.iter().zip(seed..) {
        let look = labeller.look(file, seed, None)?;
        if look.n_hidden > 0 {
            return Err(fault(file, "an object is hidden"));
        }
        let written = look.written(file.stem(), scenes.domain);
        labelled.push(written.ok_or_else(|| fault(file, "it cannot be written"))?);
    }
    Ok(labelled)
}

/// The scenes that a domain's labelled examples show, in order.
///
/// # Errors
/// [`PartError::File`] when there is no such folder.
pub fn exemplar_scenes(folder: &Folder) -> Result<Vec<FileRef>, PartError> {
    let scenes = folder.below("scenes/exemplar");
    Ok(scenes.names(".toml")?.iter().map(|name| scenes.file(name)).collect())
}

impl<'a> Labeller<'a> {
    /// For a simulator and the scenes of a domain.
    ///
    /// # Errors
    /// [`PartError::File`] when the domain's `scenes/labels.toml` is not usable.
    pub fn new(scenes: ScenesOf<'a>, sim: SimConfig) -> Result<Self, PartError> {
        let labels = read_labels(scenes.folder)?;
        Ok(Self { scenes, sim, labels, renderer: Renderer::new() })
    }

    /// Looks at the start of a scene, from the run file's viewpoint or another.
    ///
    /// # Errors
    /// [`PartError::File`] naming the scene file.
    pub fn look(
        &mut self,
        file: &FileRef,
        seed: u64,
        from: Option<Viewpoint>,
    ) -> Result<Look, PartError> {
        let mut sim = self.sim.clone();
        if let Some(Viewpoint { position_m, look_at_m }) = from {
            (sim.camera.position_m, sim.camera.look_at_m) = (position_m.into(), look_at_m.into());
        }
        self.look_at(&ChangedScene { file, spec: read_scene(file)? }, &sim, seed)
    }

    /// Looks at the start of a scene that need not be as its file says, through another simulator's
    /// camera.
    ///
    /// # Errors
    /// [`PartError::File`] naming the scene file: the scene cannot be built with this seed.
    pub fn look_at(
        &mut self,
        scene: &ChangedScene<'_>,
        sim: &SimConfig,
        seed: u64,
    ) -> Result<Look, PartError> {
        check_types(&scene.spec, self.scenes.domain, scene.file)?;
        let world = scene.world(sim, seed)?;
        let mut camera = sim.camera.clone();
        camera.light.seed = seed;
        let frame = self.renderer.render(&world, &camera, seed);
        let frame = frame.map_err(|e| fault(scene.file, e))?;
        let shot = Shot { frame, model: model_of(&camera), truth: world.truth() };
        shot.labelled(self.scenes, &self.labels).ok_or_else(|| fault(scene.file, "no image"))
    }

    /// The facts of a scene's start over all objects of visible types, whatever a camera shows of them.
    ///
    /// # Errors
    /// As for [`look_at`](Self::look_at).
    pub fn facts_of(
        &self,
        scene: &ChangedScene<'_>,
        sim: &SimConfig,
        seed: u64,
    ) -> Result<BTreeSet<Atom>, PartError> {
        let truth = scene.world(sim, seed)?.truth();
        let is_seen = |body: &&BodyTruth| {
            let type_name = Name::new(&body.type_name);
            self.scenes.perception.type_spec(&type_name).is_some()
        };
        let bodies: Vec<&BodyTruth> = truth.bodies.iter().filter(is_seen).collect();
        let labels = self.labels.label.iter();
        Ok(labels.flat_map(|label| label.facts(&bodies, self.scenes.domain)).collect())
    }
}

/// A scene that was read from a file, and perhaps changed since.
#[derive(Debug)]
pub struct ChangedScene<'a> {
    /// What it is called in messages.
    file: &'a FileRef,
    spec: SceneSpec,
}

impl<'a> ChangedScene<'a> {
    /// Reads a scene from a table that has the form of a scene file.
    ///
    /// # Errors
    /// [`PartError`] naming the file and what is wrong in the table.
    pub fn new(file: &'a FileRef, table: &toml::Table) -> Result<Self, PartError> {
        let spec = TomlFile::parse(&file.to_string(), &table.to_string())?.read()?;
        Ok(Self { file, spec })
    }

    /// Whether the scene can be built: nothing overlaps, and everything comes to rest.
    ///
    /// # Errors
    /// [`PartError::File`] naming the scene file and the bodies.
    pub fn check(&self, sim: &SimConfig, seed: u64) -> Result<(), PartError> {
        self.world(sim, seed).map(drop)
    }

    fn world(&self, sim: &SimConfig, seed: u64) -> Result<World, PartError> {
        World::new(&self.spec, &sim.world, seed).map_err(|e| fault(self.file, e))
    }
}

/// One rendered scene.
struct Shot {
    frame: Frame,
    model: CameraModel,
    truth: Truth,
}

impl Shot {
    fn labelled(self, scenes: ScenesOf<'_>, labels: &Labels) -> Option<Look> {
        let Self { frame, model, truth } = self;
        let (width, height) = (frame.width as usize, frame.height as usize);
        let depth = DepthView::new(width, height, &frame.depth_m).ok()?;
        let (mut bodies, mut objects, mut n_hidden) = (Vec::new(), Vec::new(), 0);
        let mut visible_shares = Vec::new();
        for (i, body) in truth.bodies.iter().enumerate() {
            let type_name = Name::new(&body.type_name);
            let Some(spec) = scenes.perception.type_spec(&type_name) else { continue };
            let seen = visible(&frame, u16::try_from(i + 1).ok()?, body).and_then(|detection| {
                let measured = volume_of(&detection, &depth, &model, spec.depth)?;
                Some(Detection { measured: Some(measured), ..detection })
            });
            let Some(seen) = seen else {
                n_hidden += 1;
                continue;
            };
            visible_shares.push(visible_share(&seen.mask, body, &model));
            bodies.push(body);
            objects.push(seen.object(Name::new(&body.name)));
        }
        let facts =
            labels.label.iter().flat_map(|label| label.facts(&bodies, scenes.domain)).collect();
        let image = RgbImage::from_raw(frame.width, frame.height, frame.rgb)?;
        let depth_m = frame.depth_m;
        Some(Look { image, depth_m, model, objects, facts, visible_shares, n_hidden })
    }
}

impl Look {
    /// The objects as they are declared in a problem.
    pub fn declared(&self) -> Vec<Typed> {
        let objects = self.objects.iter();
        objects.map(|o| Typed::new(o.name.clone(), o.type_name.clone())).collect()
    }

    fn written(self, name: &str, domain: &Domain) -> Option<LabelledScene> {
        let problem = Problem {
            name: Name::new(name),
            domain: domain.name.clone(),
            objects: self.declared(),
            init: self.facts.clone(),
            costs: BTreeMap::new(),
            goal: Condition::True,
            minimise_cost: false,
        };
        Some(LabelledScene {
            name: name.to_owned(),
            boxes: self.boxes_json()?,
            masks: self.masks_json()?,
            volumes: lines(&self.objects, |o| o.volume.as_ref().map(rounded))?,
            state: print_problem(&problem),
            n_objects: self.objects.len(),
            image: self.image,
        })
    }

    /// The boxes as a labelled example has them: JSON, `{"name": [x1, y1, x2, y2]}` in pixels.
    pub fn boxes_json(&self) -> Option<String> {
        lines(&self.objects, |o| Some(<[f64; 4]>::from(o.pixel_box)))
    }

    /// The pixels of each object as a labelled example has them: JSON, `{"name": [[y, x_start, x_end]]}`.
    pub fn masks_json(&self) -> Option<String> {
        let runs = |mask: &[MaskRun]| -> Vec<[u32; 3]> {
            mask.iter().map(|run| [run.y, run.x_start, run.x_end]).collect()
        };
        lines(&self.objects, |o| o.mask.as_deref().map(runs))
    }
}

/// One object to a line, in order of their names; those without the property are left out.
fn lines<T: serde::Serialize>(
    objects: &[ObjectBox],
    property: impl Fn(&ObjectBox) -> Option<T>,
) -> Option<String> {
    let values = objects.iter().filter_map(|o| Some((o.name.as_str(), property(o)?)));
    let line = |(name, value): (&str, T)| {
        let (name, value) =
            (serde_json::to_string(name).ok()?, serde_json::to_string(&value).ok()?);
        Some(format!("  {name}: {value}"))
    };
    let values: BTreeMap<&str, T> = values.collect();
    let lines: Option<Vec<String>> = values.into_iter().map(line).collect();
    Some(format!("{{\n{}\n}}\n", lines?.join(",\n")))
}

/// A volume to a tenth of a millimetre.
fn rounded(volume: &Aabb) -> Aabb {
    let round = |v: f64| (v * 1e4).round() / 1e4;
    Aabb { centre: volume.centre.map(round), extent: volume.extent.map(round) }
}

/// The visible pixels of one instance, as a detector would find them; `None` without any.
fn visible(frame: &Frame, id: u16, body: &BodyTruth) -> Option<Detection> {
    let width = frame.width as usize;
    let mut mask: Vec<MaskRun> = Vec::new();
    for (i, _) in frame.ids.iter().enumerate().filter(|(_, found)| **found == id) {
        let (x, y) = (u32::try_from(i % width).ok()?, u32::try_from(i / width).ok()?);
        match mask.last_mut() {
            Some(run) if run.y == y && run.x_end == x => run.x_end += 1,
            _ => mask.push(MaskRun { y, x_start: x, x_end: x + 1 }),
        }
    }
    let pixel_box = PixelBox {
        x1: f64::from(mask.iter().map(|r| r.x_start).min()?),
        y1: f64::from(mask.first()?.y),
        x2: f64::from(mask.iter().map(|r| r.x_end).max()?),
        y2: f64::from(mask.last()?.y + 1),
    };
    let type_name = Name::new(&body.type_name);
    Some(Detection { mask, ..Detection::new(type_name.clone(), type_name, pixel_box) })
}

impl Label {
    /// The facts of this predicate over bodies of the types that it wants.
    fn facts(&self, bodies: &[&BodyTruth], domain: &Domain) -> Vec<Atom> {
        let Some(signature) = domain.predicate(self.predicate.as_str()) else { return Vec::new() };
        let [first, second] = signature.params.as_slice() else { return Vec::new() };
        let fits = |body: &BodyTruth, param: &Typed| {
            domain.types.fits(&[Name::new(&body.type_name)], &param.types)
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
