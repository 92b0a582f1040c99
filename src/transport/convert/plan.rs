//! Plans and their steps.

use super::WireError;
use super::context::WireContext;
use super::text::{name_from_wire, name_to_wire, text_from_wire, text_to_wire};
use crate::messages::{PlanMessage, PlanSource, PlanVerdict, Spent};
use crate::pddl::{Atom, Name, Step};
use crate::transport::wire::{ARGS_MAX, NameText, StepRecord, TaskHeader};

/// Most steps of one plan.
const PLAN_STEPS_MAX: usize = 65_536;

/// Flags of a plan, in the field that counts unsettled facts in scenes.
const OF_ALL: u32 = 1;
const IS_PREDICTED: u32 = 2;
const IS_DOUBTED: u32 = 4;
const ALL_FLAGS: u32 = OF_ALL | IS_PREDICTED | IS_DOUBTED;

/// Writes a plan.
///
/// # Errors
/// [`WireError`] when a name is too long or a step has too many arguments.
pub fn plan_to_wire(
    plan: &PlanMessage,
    context: &WireContext,
) -> Result<(TaskHeader, Vec<StepRecord>), WireError> {
    let mut header = context.header(&plan.cause);
    header.stage_us = [plan.plan_us, 0];
    header.unsettled = (u32::from(plan.of_all) * OF_ALL)
        | (u32::from(plan.is_predicted) * IS_PREDICTED)
        | (u32::from(plan.is_doubted) * IS_DOUBTED);
    header.source = source_to_wire(plan.source);
    header.expansions = plan.expansions;
    header.observe_ns = [plan.observe.cpu_ns, plan.observe.wall_ns];
    header.decide_ns = [plan.decide.cpu_ns, plan.decide.wall_ns];
    let mut records = Vec::new();
    let detail = match &plan.verdict {
        PlanVerdict::Plan { steps, cost } => {
            header.cost = *cost;
            records = steps.iter().map(step_to_wire).collect::<Result<_, _>>()?;
            String::new()
        }
        PlanVerdict::Unsolvable { proof, unknowns } => {
            header.verdict = if *unknowns { 2 } else { 1 };
            proof.clone()
        }
        PlanVerdict::OutOfBudget { limit } => {
            header.verdict = 3;
            limit.clone()
        }
        PlanVerdict::Unsupported { feature } => {
            header.verdict = 4;
            feature.clone()
        }
        PlanVerdict::Missing { objects } => {
            header.verdict = 5;
            records = objects.iter().map(missing_to_wire).collect::<Result<_, _>>()?;
            String::new()
        }
        PlanVerdict::Inconsistent { atoms } => {
            header.verdict = 6;
            let fact = |atom: &Atom| call_to_wire("facts", &atom.predicate, &atom.args);
            records = atoms.iter().map(fact).collect::<Result<_, _>>()?;
            String::new()
        }
    };
    header.detail = text_to_wire(&detail);
    Ok((header, records))
}

/// Checks a plan.
///
/// # Errors
/// [`WireError`] naming the field.
pub fn plan_from_wire(
    header: &TaskHeader,
    records: &[StepRecord],
    context: &WireContext,
) -> Result<PlanMessage, WireError> {
    let cause = context.check(header)?;
    if records.len() > PLAN_STEPS_MAX {
        return Err(WireError::new("plan steps", PLAN_STEPS_MAX, records.len()));
    }
    let detail = text_from_wire("detail", &header.detail)?.to_owned();
    let verdict = match header.verdict {
        0 => {
            let steps = records.iter().map(|r| step_from_wire(r, context));
            PlanVerdict::Plan { steps: steps.collect::<Result<_, _>>()?, cost: header.cost }
        }
        1 | 2 => PlanVerdict::Unsolvable { proof: detail, unknowns: header.verdict == 2 },
        3 => PlanVerdict::OutOfBudget { limit: detail },
        4 => PlanVerdict::Unsupported { feature: detail },
        5 => {
            let objects = records.iter().map(|r| name_from_wire("missing object", &r.action));
            PlanVerdict::Missing { objects: objects.collect::<Result<_, _>>()? }
        }
        6 => {
            let atoms = records.iter().map(|r| fact_from_wire(r, context));
            PlanVerdict::Inconsistent { atoms: atoms.collect::<Result<_, _>>()? }
        }
        other => return Err(WireError::new("plan verdict", "0 to 6", other)),
    };
    let flags = header.unsettled;
    if flags & !ALL_FLAGS != 0 {
        return Err(WireError::new("plan flags", format!("0 to {ALL_FLAGS}"), flags));
    }
    let spent = |[cpu_ns, wall_ns]: [u64; 2]| Spent { cpu_ns, wall_ns };
    Ok(PlanMessage {
        cause,
        verdict,
        of_all: flags & OF_ALL != 0,
        is_predicted: flags & IS_PREDICTED != 0,
        is_doubted: flags & IS_DOUBTED != 0,
        source: source_from_wire(header.source)?,
        expansions: header.expansions,
        plan_us: header.stage_us[0],
        observe: spent(header.observe_ns),
        decide: spent(header.decide_ns),
    })
}

fn source_to_wire(source: Option<PlanSource>) -> u32 {
    let place = source.and_then(|source| PlanSource::ALL.iter().position(|known| *known == source));
    place.and_then(|place| u32::try_from(place + 1).ok()).unwrap_or(0)
}

fn source_from_wire(value: u32) -> Result<Option<PlanSource>, WireError> {
    let Some(place) = value.checked_sub(1) else { return Ok(None) };
    let source = PlanSource::ALL.get(place as usize).copied();
    let known = || WireError::new("source", format!("0 to {}", PlanSource::ALL.len()), value);
    source.map(Some).ok_or_else(known)
}

/// An object that nobody has seen travels as a step without arguments.
fn missing_to_wire(object: &Name) -> Result<StepRecord, WireError> {
    Ok(StepRecord { action: name_to_wire(object)?, ..StepRecord::default() })
}

pub(super) fn step_to_wire(step: &Step) -> Result<StepRecord, WireError> {
    call_to_wire("step arguments", &step.action, &step.args)
}

/// A name with its arguments: a step, or a fact.
pub(super) fn call_to_wire(
    field: &'static str,
    name: &Name,
    args: &[Name],
) -> Result<StepRecord, WireError> {
    if args.len() > ARGS_MAX {
        return Err(WireError::new(field, ARGS_MAX, args.len()));
    }
    let n_args = u32::try_from(args.len()).unwrap_or(u32::MAX);
    let mut texts = [NameText::default(); ARGS_MAX];
    for (to, from) in texts.iter_mut().zip(args) {
        *to = name_to_wire(from)?;
    }
    Ok(StepRecord { action: name_to_wire(name)?, n_args, reserved: 0, args: texts })
}

pub(super) fn fact_from_wire(
    record: &StepRecord,
    context: &WireContext,
) -> Result<Atom, WireError> {
    let name = name_from_wire("predicate", &record.action)?;
    let known = context.domain.predicates.iter().find(|p| p.name == name);
    let known = known.ok_or_else(|| WireError::new("predicate", "one of the domain", &name))?;
    let args = args_from_wire("fact arguments", record, known.params.len())?;
    Ok(Atom { predicate: name, args })
}

/// The arguments of a record that must have so many.
fn args_from_wire(
    field: &'static str,
    record: &StepRecord,
    n_args: usize,
) -> Result<Vec<Name>, WireError> {
    if record.n_args as usize != n_args || n_args > ARGS_MAX {
        return Err(WireError::new(field, n_args, record.n_args));
    }
    record.args.iter().take(n_args).map(|arg| name_from_wire("argument", arg)).collect()
}

/// A step of whatever domain: devices know none.
pub(super) fn any_step_from_wire(record: &StepRecord) -> Result<Step, WireError> {
    let action = name_from_wire("action", &record.action)?;
    let n_args = (record.n_args as usize).min(ARGS_MAX);
    Ok(Step { action, args: args_from_wire("step arguments", record, n_args)? })
}

pub(super) fn step_from_wire(
    record: &StepRecord,
    context: &WireContext,
) -> Result<Step, WireError> {
    let action = name_from_wire("action", &record.action)?;
    let schema = context
        .domain
        .action(action.as_str())
        .ok_or_else(|| WireError::new("action", "one of the domain", &action))?;
    let args = args_from_wire("step arguments", record, schema.params.len())?;
    Ok(Step { action, args })
}
