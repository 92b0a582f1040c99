//! Goal, scene and outcome.

use nalgebra::Point3;

use super::context::WireContext;
use super::plan::{step_from_wire, step_to_wire};
use super::text::{name_from_wire, name_to_wire, text_from_wire, text_to_wire};
use super::{WireError, finite, flag, single};
use crate::geometry::{Aabb, PixelBox};
use crate::logic::Truth;
use crate::messages::{GoalMessage, GoalUpdate, StepOutcome};
use crate::mismatch::quoted;
use crate::pddl::{self, Atom, Name, SourceText, Typed};
use crate::scene::{Anomaly, FrameRef, Origin, Place, Scene, SceneFact, SceneObject, Visibility};
use crate::transport::wire::{ARGS_MAX, NameText, OutcomeRecord, SceneRecord, TaskHeader};

/// Most records of one scene.
const SCENE_RECORDS_MAX: usize = 65_536;
/// `TaskHeader::verdict` of a goal.
const GOAL_KNOWN: u32 = 0;
/// `TaskHeader::verdict` of "not yet".
const GOAL_PENDING: u32 = 1;
/// Longest goal, in bytes of PDDL.
const GOAL_BYTES_MAX: usize = 1 << 20;

/// Writes a scene.
///
/// # Errors
/// [`WireError`] when a name is too long, or a type or predicate is not the domain's.
pub fn scene_to_wire(
    scene: &Scene,
    context: &WireContext,
) -> Result<(TaskHeader, Vec<SceneRecord>), WireError> {
    let mut header = context.header(&scene.cause);
    header.stage_us = [scene.detect_us, scene.ground_us];
    header.unsettled = scene.unsettled;
    let n_records = scene.objects.len() + scene.facts.len() + scene.anomalies.len();
    let mut records = Vec::with_capacity(n_records);
    for object in &scene.objects {
        records.push(object_to_wire(object, context)?);
    }
    for fact in &scene.facts {
        records.push(fact_to_wire(fact, scene, context)?);
    }
    for anomaly in &scene.anomalies {
        // What is next to more objects than a record has room for is told in several.
        let is_alone = anomaly.objects.is_empty().then_some([].as_slice());
        for objects in anomaly.objects.chunks(ARGS_MAX).chain(is_alone) {
            records.push(anomaly_to_wire(anomaly, objects, scene)?);
        }
    }
    Ok((header, records))
}

fn object_to_wire(object: &SceneObject, context: &WireContext) -> Result<SceneRecord, WireError> {
    let mut record = SceneRecord {
        tag: 0,
        kind: index_of("object type", &context.types, &object.type_name)?,
        source: match object.visibility {
            Visibility::Visible => 0,
            Visibility::Hidden => 1,
            Visibility::Held => 2,
            Visibility::Implied => 3,
        },
        score: object.score,
        seen_ns: object.seen_ns,
        name: name_to_wire(&object.name)?,
        ..SceneRecord::default()
    };
    if let Some(pixel_box) = object.pixel_box {
        record.state |= 1;
        record.pixel_box = pixel_box.into();
    }
    if let Some(volume) = object.volume {
        record.state |= 2;
        record.centre = volume.centre.coords.into();
        record.extent = volume.extent;
    }
    Ok(record)
}

fn fact_to_wire(
    fact: &SceneFact,
    scene: &Scene,
    context: &WireContext,
) -> Result<SceneRecord, WireError> {
    let predicates = &context.domain.predicates;
    let kind = predicates
        .iter()
        .position(|p| p.name == fact.atom.predicate)
        .ok_or_else(|| WireError::new("predicate", "one of the domain", &fact.atom.predicate))?;
    let (n_args, args) = args_to_wire(&fact.atom.args, scene)?;
    Ok(SceneRecord {
        tag: 1,
        kind: u32::try_from(kind).unwrap_or(u32::MAX),
        source: match fact.origin {
            Origin::Observed => 0,
            Origin::Proprioceptive => 1,
            Origin::Completed => 2,
            Origin::Remembered => 3,
            Origin::Predicted => 4,
            Origin::Constrained => 5,
        },
        state: truth_to_wire(fact.raw),
        confirmed: truth_to_wire(fact.confirmed),
        n_args,
        args,
        score: fact.confidence,
        ..SceneRecord::default()
    })
}

fn anomaly_to_wire(
    anomaly: &Anomaly,
    objects: &[Name],
    scene: &Scene,
) -> Result<SceneRecord, WireError> {
    let (n_args, args) = args_to_wire(objects, scene)?;
    let name = NameText { bytes: text_to_wire(&anomaly.reason) };
    let (state, pixel_box) = anomaly.place.map_or((0, [0.0; 4]), |place| {
        (if place.may_hide { 2 } else { 1 }, place.pixel_box().into())
    });
    Ok(SceneRecord { tag: 2, state, n_args, args, pixel_box, name, ..SceneRecord::default() })
}

/// How many objects, and which.
fn args_to_wire(names: &[Name], scene: &Scene) -> Result<(u32, [u32; ARGS_MAX]), WireError> {
    if names.len() > ARGS_MAX {
        return Err(WireError::new("n_args", ARGS_MAX, names.len()));
    }
    let mut args = [0; ARGS_MAX];
    for (to, from) in args.iter_mut().zip(names) {
        let at = scene.objects.iter().position(|o| o.name == *from);
        let at = at.ok_or_else(|| WireError::new("argument", "an object of the scene", from))?;
        *to = u32::try_from(at).unwrap_or(u32::MAX);
    }
    Ok((u32::try_from(names.len()).unwrap_or(u32::MAX), args))
}

/// Checks a scene.
///
/// # Errors
/// [`WireError`] naming the field: another run or domain, a tag out of range, NaN, an argument
/// that points nowhere, too few or many arguments.
pub fn scene_from_wire(
    header: &TaskHeader,
    records: &[SceneRecord],
    context: &WireContext,
) -> Result<Scene, WireError> {
    let cause = context.check(header)?;
    if records.len() > SCENE_RECORDS_MAX {
        return Err(WireError::new("scene records", SCENE_RECORDS_MAX, records.len()));
    }
    let (mut objects, mut facts, mut anomalies) = (Vec::new(), Vec::new(), Vec::new());
    for record in records {
        match record.tag {
            0 => objects.push(object_from_wire(record, context)?),
            1 => facts.push(fact_from_wire(record, &objects, context)?),
            2 => anomalies.push(anomaly_from_wire(record, &objects)?),
            other => return Err(WireError::new("tag", "0 to 2", other)),
        }
    }
    let [detect_us, ground_us] = header.stage_us;
    let unsettled = header.unsettled;
    Ok(Scene { cause, objects, facts, anomalies, unsettled, detect_us, ground_us })
}

fn object_from_wire(record: &SceneRecord, context: &WireContext) -> Result<SceneObject, WireError> {
    let types = &context.types;
    let type_name = types.get(record.kind as usize).ok_or_else(|| {
        WireError::new("object type", format!("below {}", types.len()), record.kind)
    })?;
    let visibility = match record.source {
        0 => Visibility::Visible,
        1 => Visibility::Hidden,
        2 => Visibility::Held,
        3 => Visibility::Implied,
        other => return Err(WireError::new("visibility", "0 to 3", other)),
    };
    if record.state > 3 {
        return Err(WireError::new("object state", "0 to 3", record.state));
    }
    let pixel_box = PixelBox::from(finite("pixel_box", record.pixel_box)?);
    let centre = Point3::from(finite("centre", record.centre)?);
    let extent = finite("extent", record.extent)?;
    Ok(SceneObject {
        name: name_from_wire("object name", &record.name)?,
        type_name: type_name.clone(),
        pixel_box: (record.state & 1 != 0).then_some(pixel_box),
        volume: (record.state & 2 != 0).then_some(Aabb { centre, extent }),
        score: unit("score", record.score)?,
        visibility,
        seen_ns: record.seen_ns,
    })
}

fn fact_from_wire(
    record: &SceneRecord,
    objects: &[SceneObject],
    context: &WireContext,
) -> Result<SceneFact, WireError> {
    let predicates = &context.domain.predicates;
    let predicate = predicates.get(record.kind as usize).ok_or_else(|| {
        WireError::new("predicate", format!("below {}", predicates.len()), record.kind)
    })?;
    if record.n_args as usize != predicate.params.len() {
        return Err(WireError::new("n_args", predicate.params.len(), record.n_args));
    }
    let args = args_from_wire(record, objects)?;
    let origin = match record.source {
        0 => Origin::Observed,
        1 => Origin::Proprioceptive,
        2 => Origin::Completed,
        3 => Origin::Remembered,
        4 => Origin::Predicted,
        5 => Origin::Constrained,
        other => return Err(WireError::new("origin", "0 to 5", other)),
    };
    Ok(SceneFact {
        atom: Atom { predicate: predicate.name.clone(), args },
        raw: truth_from_wire("raw", record.state)?,
        confirmed: truth_from_wire("confirmed", record.confirmed)?,
        origin,
        confidence: unit("confidence", record.score)?,
    })
}

fn anomaly_from_wire(record: &SceneRecord, objects: &[SceneObject]) -> Result<Anomaly, WireError> {
    if record.n_args as usize > ARGS_MAX {
        return Err(WireError::new("n_args", ARGS_MAX, record.n_args));
    }
    let place = PixelBox::from(finite("pixel_box", record.pixel_box)?);
    let place = match record.state {
        0 => None,
        1 | 2 => Some(Place::new(&place, record.state == 2)),
        other => return Err(WireError::new("anomaly state", "0 to 2", other)),
    };
    let reason = text_from_wire("reason", &record.name.bytes)?;
    if reason.is_empty() || reason.chars().any(char::is_control) {
        return Err(WireError::new("reason", "a line of text", quoted(reason)));
    }
    Ok(Anomaly { objects: args_from_wire(record, objects)?, reason: reason.to_owned(), place })
}

/// The objects that a record points at.
fn args_from_wire(record: &SceneRecord, objects: &[SceneObject]) -> Result<Vec<Name>, WireError> {
    let indices = record.args.iter().take(record.n_args as usize);
    let name = |&at: &u32| {
        let found = objects.get(at as usize).map(|object| object.name.clone());
        found.ok_or_else(|| WireError::new("argument", objects.len(), at))
    };
    indices.map(name).collect()
}

fn index_of(field: &'static str, names: &[Name], name: &Name) -> Result<u32, WireError> {
    let at = names.iter().position(|known| known == name);
    let at = at.ok_or_else(|| WireError::new(field, "one of the domain", name))?;
    Ok(u32::try_from(at).unwrap_or(u32::MAX))
}

fn unit(field: &'static str, value: f32) -> Result<f32, WireError> {
    if (0.0..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(WireError::new(field, "0 to 1", value))
    }
}

fn truth_to_wire(truth: Truth) -> u32 {
    match truth {
        Truth::False => 0,
        Truth::Unknown => 1,
        Truth::True => 2,
    }
}

fn truth_from_wire(field: &'static str, value: u32) -> Result<Truth, WireError> {
    match value {
        0 => Ok(Truth::False),
        1 => Ok(Truth::Unknown),
        2 => Ok(Truth::True),
        other => Err(WireError::new(field, "0 to 2", other)),
    }
}

/// Writes the outcome of a step.
///
/// # Errors
/// [`WireError`] when a name is too long.
pub fn outcome_to_wire(
    outcome: &StepOutcome,
    context: &WireContext,
) -> Result<(TaskHeader, OutcomeRecord), WireError> {
    let cause = FrameRef { cycle: outcome.sequence, ..FrameRef::default() };
    let record = OutcomeRecord {
        step: step_to_wire(&outcome.step)?,
        failures: outcome.failures,
        succeeded: u32::from(outcome.succeeded),
    };
    Ok((context.header(&cause), record))
}

/// Checks the outcome of a step.
///
/// # Errors
/// [`WireError`] naming the field.
pub fn outcome_from_wire(
    header: &TaskHeader,
    records: &[OutcomeRecord],
    context: &WireContext,
) -> Result<StepOutcome, WireError> {
    let cause = context.check(header)?;
    let record = single("outcome", records)?;
    Ok(StepOutcome {
        sequence: cause.cycle,
        step: step_from_wire(&record.step, context)?,
        succeeded: flag("succeeded", record.succeeded)?,
        failures: record.failures,
    })
}

/// Before each clause of the goal in words: a comment of the PDDL.
const SAID: &str = ";; said: ";

/// Writes what is known of the goal: as a PDDL problem without facts, whose objects are those that
/// the goal names; nothing while it is not known.
pub fn goal_to_wire(update: &GoalUpdate, context: &WireContext) -> (TaskHeader, Vec<u8>) {
    let goal = match update {
        GoalUpdate::Known(goal) => goal,
        GoalUpdate::Pending { cycle } => {
            let cause = FrameRef { cycle: *cycle, ..FrameRef::default() };
            let header = TaskHeader { verdict: GOAL_PENDING, ..context.header(&cause) };
            return (header, Vec::new());
        }
    };
    let problem = pddl::Problem {
        name: "goal".into(),
        domain: context.domain.name.clone(),
        objects: goal.named.clone(),
        init: std::collections::BTreeSet::new(),
        costs: std::collections::BTreeMap::new(),
        goal: goal.goal.clone(),
        minimise_cost: false,
    };
    let said = goal.said.iter().map(|clause| [SAID, clause, "\n"].concat());
    let text = said.collect::<String>() + &pddl::print_problem(&problem);
    (context.header(&FrameRef::default()), text.into_bytes())
}

/// Checks what is known of the goal.
///
/// # Errors
/// [`WireError`] naming the field; a goal that does not parse carries the parser's message.
pub fn goal_from_wire(
    header: &TaskHeader,
    payload: &[u8],
    context: &WireContext,
) -> Result<GoalUpdate, WireError> {
    let cause = context.check(header)?;
    match header.verdict {
        GOAL_KNOWN => {}
        GOAL_PENDING => return Ok(GoalUpdate::Pending { cycle: cause.cycle }),
        other => return Err(WireError::new("goal verdict", "0 or 1", other)),
    }
    if payload.len() > GOAL_BYTES_MAX {
        return Err(WireError::new("goal", format!("{GOAL_BYTES_MAX} bytes"), payload.len()));
    }
    let text = std::str::from_utf8(payload).map_err(|e| WireError::new("goal", "UTF-8", e))?;
    let source = SourceText { name: "goal message".to_owned(), text: text.to_owned() };
    let parsed = pddl::parse_problem(&source, &context.domain)
        .map_err(|e| WireError::new("goal", "a PDDL goal", e.render()))?;
    let named: Vec<Typed> = parsed.value.objects;
    let said = text.lines().map_while(|line| line.strip_prefix(SAID)).map(str::to_owned).collect();
    Ok(GoalUpdate::Known(GoalMessage { goal: parsed.value.goal, named, said }))
}
