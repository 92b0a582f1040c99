//! One scene of a data set, as its files.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::{ImageBuffer, ImageError, ImageFormat, Luma, RgbImage};
use serde::Serialize;

use super::instruction::{Speech, condition_of};
use super::{DrawnScene, Factor, IndexLine, SceneSetting, SceneSource};
use crate::draws::Draws;
use crate::goals::GoalObject;
use crate::goals::image::changed_by_actions;
use crate::hardware::sim::{Labeller, Look};
use crate::logic::Facts;
use crate::mismatch::Mismatch;
use crate::pddl::{Atom, Name, Problem, Typed, print_problem};
use crate::perception::{GripperContent, complete, proprioception};
use crate::run::ConfigError;

/// Most arrangements that are drawn for one scene.
const ARRANGEMENTS_MAX: u32 = 200;
/// Most arrangements that are drawn for one goal.
const GOALS_MAX: u32 = 50;
/// Quality of the photographs' compression, of 100.
const JPEG_QUALITY: u8 = 95;

/// One scene, as it is written.
pub(super) struct Example {
    pub(super) line: IndexLine,
    /// Paths below the domain's folder, and what the files hold.
    pub(super) files: Vec<(String, Vec<u8>)>,
}

/// The camera of a scene.
#[derive(Debug, Serialize)]
struct CameraFile {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    world_from_camera: [[f64; 4]; 4],
}

/// Makes one scene. It depends on what is given here, and on nothing else.
///
/// # Errors
/// [`ConfigError`] naming the scene file or factor: no arrangement shows every object, or none makes a goal.
pub(super) fn example(
    source: &SceneSource,
    labeller: &mut Labeller<'_>,
    factors: &[Factor],
    (seed, number): (u64, u64),
) -> Result<Example, ConfigError> {
    let mut draws = Draws::of_key([seed, number, 0, 0]);
    let values: Vec<_> = factors.iter().map(|factor| factor.drawn(&mut draws)).collect();
    let setting = source.setting(&values)?;
    let seen = seen(&setting, labeller, &mut draws, number)?;
    let (objects, init) = state(source, &seen.look);
    let goal = goal(source, labeller, &setting, (&seen, &init), &mut draws)?;
    let instruction = instruction(source, &seen.look, &goal, &mut draws);
    let domain = &source.folder.domain;
    let problem = Problem {
        name: Name::new(format!("{}{number}", domain.name)),
        domain: domain.name.clone(),
        objects,
        init,
        costs: BTreeMap::new(),
        goal: condition_of(&goal),
        minimise_cost: false,
    };
    let shares = seen.look.objects.iter().zip(&seen.look.visible_shares);
    let line = IndexLine {
        problem: number,
        seed: seen.seed,
        arrangements: seen.n_drawn,
        factors: values.into_iter().map(|value| (value.key, value.value)).collect(),
        visible_shares: shares.map(|(object, share)| (object.name.to_string(), *share)).collect(),
        has_instruction: instruction.is_some(),
    };
    let text = print_problem(&problem);
    Ok(Example { line, files: files(&seen.look, &text, instruction, number)? })
}

/// An arrangement of which the camera sees every object.
struct Seen<'a> {
    scene: DrawnScene<'a>,
    seed: u64,
    look: Look,
    n_drawn: u32,
}

fn seen<'a>(
    setting: &'a SceneSetting,
    labeller: &mut Labeller<'_>,
    draws: &mut Draws,
    number: u64,
) -> Result<Seen<'a>, ConfigError> {
    let mut why = String::new();
    for n_drawn in 1..=ARRANGEMENTS_MAX {
        let scene = setting.drawn(draws)?;
        let seed = draws.seed();
        match labeller.look_at(&scene.start, &setting.sim, seed) {
            Ok(look) if look.n_hidden == 0 && !look.objects.is_empty() => {
                return Ok(Seen { scene, seed, look, n_drawn });
            }
            Ok(_) => "an object cannot be seen".clone_into(&mut why),
            // An unlucky arrangement: bodies that overlap, or that do not come to rest.
            Err(error) => why = error.to_string(),
        }
    }
    let expected = format!("an arrangement of {ARRANGEMENTS_MAX} that shows every object");
    Err(Mismatch::new(format!("scene {number}"), expected, why).into())
}

/// The objects and the facts of a look, with those that nobody sees.
fn state(source: &SceneSource, look: &Look) -> (Vec<Typed>, BTreeSet<Atom>) {
    let folder = &source.folder;
    let (domain, perception) = (&folder.domain, &folder.perception);
    let implied = perception.implied.iter();
    let implied = implied.map(|i| Typed::new(i.name.clone(), i.type_name.clone()));
    let objects: Vec<Typed> = look.declared().into_iter().chain(implied).collect();
    let all: Vec<Typed> = objects.iter().chain(&domain.constants).cloned().collect();
    let own = proprioception(domain, perception, &all, &GripperContent::Empty);
    let base = Facts::new(look.facts.union(&own.known).cloned().collect());
    (objects, complete(&folder.rules, &domain.types, &all, &base).known)
}

/// What another arrangement of the same objects shows, of the observed predicates that actions change.
fn goal(
    source: &SceneSource,
    labeller: &Labeller<'_>,
    setting: &SceneSetting,
    (seen, init): (&Seen<'_>, &BTreeSet<Atom>),
    draws: &mut Draws,
) -> Result<BTreeSet<Atom>, ConfigError> {
    let changed = changed_by_actions(&source.folder.domain);
    let observed: BTreeSet<&Name> = source.folder.perception.observed_predicates().collect();
    let counts =
        |atom: &Atom| changed.contains(&atom.predicate) && observed.contains(&atom.predicate);
    for _ in 0..GOALS_MAX {
        let Ok(mut facts) = labeller.facts_of(&seen.scene.as_written, &setting.sim, draws.seed())
        else {
            continue;
        };
        facts.retain(counts);
        if !facts.is_subset(init) {
            return Ok(facts);
        }
    }
    let at = format!("{}: arrangement", setting.file);
    let expected = "another arrangement of the same objects as the goal; a random arrangement, or more \
                    objects";
    Err(Mismatch::new(at, expected, format!("none in {GOALS_MAX} draws")).into())
}

fn instruction(
    source: &SceneSource,
    look: &Look,
    goal: &BTreeSet<Atom>,
    draws: &mut Draws,
) -> Option<String> {
    let language = source.folder.language.as_ref()?;
    let objects = GoalObject::of_image(&source.folder.perception, &look.objects);
    let speech = Speech { domain: &source.folder.domain, language, objects: &objects };
    speech.said(goal, draws)
}

fn files(
    look: &Look,
    problem: &str,
    instruction: Option<String>,
    number: u64,
) -> Result<Vec<(String, Vec<u8>)>, ConfigError> {
    let fault = |path: &str, reason: String| ConfigError::File { path: path.to_owned(), reason };
    let named = |kind: &str, end: &str| format!("{kind}/problem{number}.{end}");
    let missing = |kind: &str| fault(kind, "it cannot be written".to_owned());
    let boxes = look.boxes_json().ok_or_else(|| missing("annotated_bboxes"))?;
    let masks = look.masks_json().ok_or_else(|| missing("masks"))?;
    let camera = serde_json::to_string(&camera_file(look));
    let camera = camera.map_err(|e| fault("cameras", e.to_string()))?;
    let photograph = jpeg(&look.image).map_err(|e| fault("observations", e.to_string()))?;
    let depth = depth_png(look).map_err(|e| fault("depth", e.to_string()))?;
    let mut files = vec![
        (named("problems", "pddl"), problem.as_bytes().to_vec()),
        (named("annotated_bboxes", "json"), boxes.into_bytes()),
        (named("masks", "json"), masks.into_bytes()),
        (named("cameras", "json"), format!("{camera}\n").into_bytes()),
        (named("observations", "jpg"), photograph),
        (named("depth", "png"), depth),
    ];
    files.extend(instruction.map(|text| (named("instructions", "txt"), text.into_bytes())));
    Ok(files)
}

fn camera_file(look: &Look) -> CameraFile {
    let k = &look.model.intrinsics;
    let pose = look.model.world_from_camera.to_homogeneous();
    CameraFile {
        width: look.image.width(),
        height: look.image.height(),
        fx: k.fx,
        fy: k.fy,
        cx: k.cx,
        cy: k.cy,
        world_from_camera: std::array::from_fn(|row| std::array::from_fn(|col| pose[(row, col)])),
    }
}

fn jpeg(image: &RgbImage) -> Result<Vec<u8>, ImageError> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).encode_image(image)?;
    Ok(bytes)
}

/// Depth as 16 bits, in millimetres; 0 where there is none.
fn depth_png(look: &Look) -> Result<Vec<u8>, ImageError> {
    let millimetres = |metres: &f32| (metres * 1000.0).round() as u16; // saturates; NaN is 0
    let (width, height) = (look.image.width(), look.image.height());
    let pixels: Vec<u16> = look.depth_m.iter().map(millimetres).collect();
    let mut bytes = Cursor::new(Vec::new());
    let image: Option<ImageBuffer<Luma<u16>, _>> = ImageBuffer::from_raw(width, height, pixels);
    image.unwrap_or_default().write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
