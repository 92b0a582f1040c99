//! Faults of a run file: when they happen, what they do, and what came of them.

mod acting;
mod draws;
mod schedule;
mod sensing;
mod picture;
mod detections;
mod sensors;
#[cfg(test)]
mod tests;

use std::borrow::Cow;

use groundloop_sim::{BodySpec, FaultError, Random, SceneSpec, Shape, World, WorldFault};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::Value;

pub use acting::ActingFault;
pub(super) use acting::{ArmFaults, RobotParts, SimArm};
use draws::{Purpose, draws};
pub(super) use schedule::{Due, FaultSchedule, Occasion};
pub use sensing::{Disturbance, SensingFault};
pub(super) use sensors::{Planned, Rendered, SensorFaults};

use crate::hardware::{ANY, FaultConfig, SystemFault};
use crate::metrics::FaultRecord;
use crate::mismatch::{Mismatch, listed};
use crate::settings::near_hint;

/// One thing that goes wrong. Its `kind` says to which group it belongs: what is done to the objects
/// is the world's, what the robot does wrongly is the robot's, what is seen wrongly is the cameras'.
#[derive(Debug, Clone, PartialEq)]
pub enum FaultAction {
    /// Something happens to the objects.
    World(WorldFault),
    /// The robot does not do what it is told.
    Acting(ActingFault),
    /// A camera or its detector shows what is not so.
    Sensing(SensingFault),
}

impl FaultAction {
    /// Reads the `action` of a `[[fault]]`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(action: &toml::Table) -> Result<Self, toml::de::Error> {
        let kind = action.get("kind").and_then(toml::Value::as_str);
        if kind.is_some_and(|kind| ActingFault::KINDS.contains(&kind)) {
            return Ok(Self::Acting(action.clone().try_into()?));
        }
        if kind.is_some_and(|kind| SensingFault::KINDS.contains(&kind)) {
            return Ok(Self::Sensing(SensingFault::read(action)?));
        }
        Ok(Self::World(action.clone().try_into()?))
    }
}

impl JsonSchema for FaultAction {
    fn schema_name() -> Cow<'static, str> {
        "FaultAction".into()
    }

    /// The kinds of all groups, side by side.
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let groups = [
            WorldFault::json_schema(generator),
            ActingFault::json_schema(generator),
            SystemFault::json_schema(generator),
        ];
        let kinds = groups.iter().filter_map(|group| group.get("oneOf")?.as_array());
        let sensing = SensingFault::schemas(generator);
        let kinds: Vec<&Value> = kinds.flatten().chain(&sensing).collect();
        json_schema!({ "description": "One thing that goes wrong.", "oneOf": kinds })
    }
}

/// Lets a fault happen; what came of it, if that is known already.
pub(super) fn happen(
    due: Due,
    seed: u64,
    robot: RobotParts<'_>,
    (arm_faults, sensor_faults): (&mut ArmFaults, &mut SensorFaults),
) -> Option<FaultRecord> {
    let Due { tag, action, camera } = due;
    let world = &mut *robot.world;
    let at_ns = world.time_ns();
    let (objects, said) = match action {
        FaultAction::World(fault) => {
            let draws = draws(seed, (tag.fault, tag.occurrence), Purpose::Object);
            apply(world, &fault, draws)
        }
        FaultAction::Acting(fault) => {
            let draws = draws(seed, (tag.fault, tag.occurrence), Purpose::Length);
            let held: Vec<String> = world.held().map(str::to_owned).into_iter().collect();
            let said = arm_faults.begin(&fault, &tag, draws, robot)?;
            (held, said)
        }
        FaultAction::Sensing(fault) => {
            sensor_faults.begin(tag, fault, camera);
            return None;
        }
    };
    Some(record(at_ns, &tag, objects, said))
}

/// Tells of an occurrence, and writes it down.
fn record(
    at_ns: u64,
    tag: &schedule::Tag,
    objects: Vec<String>,
    said: Result<String, String>,
) -> FaultRecord {
    match &said {
        Ok(done) => tracing::info!(target: "fault", "{done}"),
        Err(error) => tracing::info!(target: "fault", %error, "not applied"),
    }
    let (fault, kind, happened) = (tag.fault, tag.kind.clone(), said.is_ok());
    let said = said.unwrap_or_else(|error| error);
    FaultRecord { at_ns, fault, kind, objects, happened, said, ..FaultRecord::default() }
}

/// Does a fault to its objects, or to one that it fits and that is drawn.
fn apply(
    world: &mut World,
    fault: &WorldFault,
    mut draws: Random,
) -> (Vec<String>, Result<String, String>) {
    if let WorldFault::TakeFromGripper {} = fault {
        let held = world.held().map(str::to_owned).into_iter().collect();
        return (held, world.apply_fault(fault).map_err(|e| e.to_string()));
    }
    if fault.objects() != [ANY] {
        let objects = fault.objects().into_iter().map(str::to_owned).collect();
        return (objects, world.apply_fault(fault).map_err(|e| e.to_string()));
    }
    let mut candidates = world.fault_candidates(fault);
    draws.shuffle(&mut candidates);
    let mut reason = "fault: there is no object that it could be done to".to_owned();
    for object in candidates {
        match world.apply_fault(&fault.clone().done_to(&object)) {
            Ok(done) => return (vec![object], Ok(done)),
            Err(error) => reason = error.to_string(),
        }
    }
    (Vec::new(), Err(reason))
}

/// What faults name that a scene and its cameras do not have, and numbers that cannot be, each by its key.
pub fn fault_mismatches(
    scene: &SceneSpec,
    cameras: &[&str],
    faults: &[FaultConfig],
) -> Vec<Mismatch> {
    let wrong = |(idx, fault): (usize, &FaultConfig)| {
        let at = format!("fault[{idx}]");
        let held = fault.holding.as_deref().filter(|name| *name != ANY);
        let held = held.and_then(|name| unknown(scene, name, &MOVABLE, &format!("{at}.holding")));
        let in_action = FaultAction::read(&fault.action).ok().and_then(|action| match action {
            FaultAction::World(fault) => wrong_object(scene, &fault, &at),
            FaultAction::Acting(_) => None,
            FaultAction::Sensing(fault) => wrong_sight(scene, cameras, &fault, &at),
        });
        let frame = fault.frame.as_deref().filter(|name| *name != ANY);
        let frame = frame.and_then(|name| no_camera(cameras, name, format!("{at}.frame")));
        held.or(frame).or(in_action).or_else(|| wrong_number(fault, &at))
    };
    let faults = faults.iter().enumerate().filter(|(_, fault)| !fault.is_system());
    faults.filter_map(wrong).collect()
}

/// What an object must be, in words and as a check.
type Wanted = (&'static str, fn(&BodySpec) -> bool);

const MOVABLE: Wanted = ("an object that can move", |body| !body.is_fixed());

fn wrong_object(scene: &SceneSpec, fault: &WorldFault, at: &str) -> Option<Mismatch> {
    let wanted = match fault {
        WorldFault::BesidePeg { .. } => (
            "a disk",
            (|body| matches!(body.shape, Shape::Disk { .. } | Shape::Tube { .. }))
                as fn(&BodySpec) -> bool,
        ),
        WorldFault::Push { .. } => ("an object", (|_| true) as fn(&BodySpec) -> bool),
        WorldFault::Displace { .. }
        | WorldFault::KnockOver { .. }
        | WorldFault::TakeFromGripper {}
        | WorldFault::Remove { .. }
        | WorldFault::PutBack { .. }
        | WorldFault::Swap { .. }
        | WorldFault::Topple { .. }
        | WorldFault::Hold { .. } => MOVABLE,
    };
    if let WorldFault::Swap { objects: [first, second] } = fault {
        let key = |idx: usize| format!("{at}.action.objects[{idx}]");
        let same = || Mismatch::new(key(1), "another object than the first", quoted(second));
        return unknown(scene, first, &wanted, &key(0))
            .or_else(|| unknown(scene, second, &wanted, &key(1)))
            .or_else(|| (first == second).then(same));
    }
    let named = fault.objects().into_iter().find(|name| *name != ANY)?;
    unknown(scene, named, &wanted, &format!("{at}.action.object"))
}

/// A camera or an object that a fault of the cameras names, and that there is not.
fn wrong_sight(
    scene: &SceneSpec,
    cameras: &[&str],
    fault: &SensingFault,
    at: &str,
) -> Option<Mismatch> {
    let camera = fault.camera.as_deref();
    let camera = camera.and_then(|name| no_camera(cameras, name, format!("{at}.action.camera")));
    camera.or_else(|| {
        let named = fault.what.object().filter(|name| *name != ANY)?;
        let any: Wanted = ("an object", |_| true);
        unknown(scene, named, &any, &format!("{at}.action.object"))
    })
}

/// A camera that is not simulated.
fn no_camera(cameras: &[&str], name: &str, key: String) -> Option<Mismatch> {
    if cameras.contains(&name) {
        return None;
    }
    let got = format!("{}{}", quoted(name), near_hint(name, cameras.iter().copied()));
    Some(Mismatch::new(key, format!("a simulated camera ({})", cameras.join(", ")), got))
}

/// An object that the scene does not have.
fn unknown(scene: &SceneSpec, object: &str, (what, fits): &Wanted, key: &str) -> Option<Mismatch> {
    let known = scene.bodies.iter().filter(|body| fits(body));
    let known: Vec<&str> = known.map(|body| body.name.as_str()).collect();
    if known.contains(&object) {
        return None;
    }
    let list = if known.is_empty() { "there is none".to_owned() } else { known.join(", ") };
    let got = format!("{}{}", quoted(object), near_hint(object, known));
    Some(Mismatch::new(key, format!("{what} in the scene ({list})"), got))
}

fn nanoseconds(seconds: f64) -> u64 {
    (seconds.max(0.0) * 1e9) as u64
}

fn quoted(text: &str) -> String {
    format!("\"{text}\"")
}

/// A number of an action that cannot be.
fn wrong_number(fault: &FaultConfig, at: &str) -> Option<Mismatch> {
    let checked = match FaultAction::read(&fault.action).ok()? {
        FaultAction::World(fault) => fault.check(),
        FaultAction::Acting(fault) => fault.check(),
        FaultAction::Sensing(fault) => fault.check(),
    };
    let FaultError::BadNumber { key, expected } = checked.err()? else { return None };
    let got = match fault.action.get(key) {
        Some(toml::Value::Array(values)) => listed(values),
        got => got.map(ToString::to_string).unwrap_or_default(),
    };
    Some(Mismatch::new(format!("{at}.action.{key}"), expected, got))
}
