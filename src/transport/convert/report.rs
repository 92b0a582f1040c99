//! What leaves the loop as JSON: events, the verdict, the run's description of itself.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::WireError;
use super::context::WireContext;
use super::text::is_pddl_name;
use crate::messages::{
    Deviation, EpisodeCounts, EpisodeEnd, Event, EventMessage, ReplanCause, RunDescriptor, Verdict,
};
use crate::mismatch::quoted;
use crate::pddl::{Atom, Name, SourceText, Step, parse_domain};
use crate::transport::wire::{DeviceHeader, SCHEMA, StreamHeader};

/// Longest text of one message, in bytes.
const TEXT_BYTES_MAX: usize = 1 << 20;

/// An event as it travels: what people read, and what programs read.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct EventText {
    text: String,
    event: Event,
}

/// The end as it travels.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct EndText {
    text: String,
    end: Verdict,
    counts: EpisodeCounts,
    remaining: Vec<Step>,
}

/// Writes an event.
///
/// # Errors
/// [`WireError`] when it cannot be put into JSON.
pub fn event_to_wire(
    message: &EventMessage,
    context: &WireContext,
) -> Result<(StreamHeader, Vec<u8>), WireError> {
    let header = context.stream_header(message.sequence, &message.cause);
    let text = EventText { text: message.event.to_string(), event: message.event.clone() };
    Ok((header, to_json("event", &text)?))
}

/// Checks an event.
///
/// # Errors
/// [`WireError`] naming the field: another run or domain, no JSON of an event, an action or
/// predicate that the domain does not have, control characters.
pub fn event_from_wire(
    header: &StreamHeader,
    payload: &[u8],
    context: &WireContext,
) -> Result<EventMessage, WireError> {
    let cause = context.check_stream(header)?;
    let EventText { text, event } = from_json("event", payload)?;
    check_text(&text)?;
    check_event(&event, context)?;
    Ok(EventMessage { sequence: header.sequence, cause, event })
}

/// Writes how an episode has ended.
///
/// # Errors
/// [`WireError`] when it cannot be put into JSON.
pub fn end_to_wire(
    end: &EpisodeEnd,
    context: &WireContext,
) -> Result<(StreamHeader, Vec<u8>), WireError> {
    let EpisodeEnd { cause, verdict, counts, remaining } = end.clone();
    let text = EndText { text: verdict.to_string(), end: verdict, counts, remaining };
    Ok((context.stream_header(0, &cause), to_json("verdict", &text)?))
}

/// Checks how an episode has ended.
///
/// # Errors
/// [`WireError`] naming the field, as for [`event_from_wire`].
pub fn end_from_wire(
    header: &StreamHeader,
    payload: &[u8],
    context: &WireContext,
) -> Result<EpisodeEnd, WireError> {
    let cause = context.check_stream(header)?;
    let EndText { text, end, counts, remaining } = from_json("verdict", payload)?;
    check_text(&text)?;
    check_verdict(&end)?;
    remaining.iter().try_for_each(|step| check_step(step, context))?;
    Ok(EpisodeEnd { cause, verdict: end, counts, remaining })
}

/// Writes a run's description of itself.
///
/// # Errors
/// [`WireError`] when it cannot be put into JSON.
pub fn run_to_wire(run: &RunDescriptor) -> Result<(DeviceHeader, Vec<u8>), WireError> {
    Ok((super::device_header(0, 0), to_json("run", run)?))
}

/// Checks a run's description, and makes of it what is needed to read the run's other messages.
///
/// # Errors
/// [`WireError`] naming the field: no JSON of a description, another version of the layouts, a
/// domain that does not parse.
pub fn run_from_wire(payload: &[u8]) -> Result<(RunDescriptor, WireContext), WireError> {
    let run: RunDescriptor = from_json("run", payload)?;
    if run.wire_schema != SCHEMA {
        return Err(WireError::new("wire_schema", SCHEMA, run.wire_schema));
    }
    let source = SourceText { name: "run topic".to_owned(), text: run.domain_text.clone() };
    let parsed = parse_domain(&source)
        .map_err(|e| WireError::new("domain_text", "a PDDL domain", e.render()))?;
    let context = WireContext::new(run.run_id, run.domain_hash, parsed.value);
    Ok((run, context))
}

pub(super) fn to_json<T: Serialize>(field: &'static str, value: &T) -> Result<Vec<u8>, WireError> {
    serde_json::to_vec(value).map_err(|e| WireError::new(field, "what JSON can say", e))
}

pub(super) fn from_json<T: DeserializeOwned>(
    field: &'static str,
    payload: &[u8],
) -> Result<T, WireError> {
    if payload.len() > TEXT_BYTES_MAX {
        return Err(WireError::new(field, format!("{TEXT_BYTES_MAX} bytes"), payload.len()));
    }
    serde_json::from_slice(payload).map_err(|e| WireError::new(field, "JSON of its form", e))
}

fn check_event(event: &Event, context: &WireContext) -> Result<(), WireError> {
    match event {
        Event::Goal { goal, said } => {
            check_text(goal)?;
            said.iter().try_for_each(|clause| check_text(clause))
        }
        Event::State { facts, unknown, constrained } => {
            let mut atoms = facts.iter().chain(unknown).chain(constrained);
            atoms.try_for_each(|atom| check_atom(atom, context))
        }
        Event::Plan { steps, .. } => steps.iter().try_for_each(|step| check_step(step, context)),
        Event::Started { step } | Event::Done { step, .. } => check_step(step, context),
        Event::Failed { step, reason, .. } | Event::Cancel { step, reason } => {
            check_text(reason)?;
            check_step(step, context)
        }
        Event::Deviation(deviation) => check_deviation(deviation, context),
        Event::Replan { causes, old } => {
            old.iter().try_for_each(|step| check_step(step, context))?;
            causes.iter().try_for_each(|cause| match cause {
                ReplanCause::Deviation(deviation) => check_deviation(deviation, context),
                ReplanCause::Failure { step, reason } => {
                    check_text(reason)?;
                    check_step(step, context)
                }
            })
        }
        Event::Look { reason } => check_text(reason),
        Event::Paused | Event::Resumed => Ok(()),
        Event::End(verdict) => check_verdict(verdict),
    }
}

fn check_deviation(deviation: &Deviation, context: &WireContext) -> Result<(), WireError> {
    let Deviation { missing, seen, unknown } = deviation;
    missing.iter().chain(seen).chain(unknown).try_for_each(|atom| check_atom(atom, context))
}

pub(super) fn check_verdict(verdict: &Verdict) -> Result<(), WireError> {
    match verdict {
        Verdict::Unsolvable { proof } => check_text(proof),
        Verdict::GaveUp { detail, .. } => check_text(detail),
        Verdict::Reached | Verdict::Planned | Verdict::Executed | Verdict::Stopped(_) => Ok(()),
    }
}

fn check_atom(atom: &Atom, context: &WireContext) -> Result<(), WireError> {
    let predicate = context.domain.predicates.iter().find(|p| p.name == atom.predicate);
    let known = predicate.map(|predicate| predicate.params.len());
    check_call("predicate", &atom.predicate, &atom.args, known)
}

fn check_step(step: &Step, context: &WireContext) -> Result<(), WireError> {
    let known = context.domain.action(step.action.as_str()).map(|action| action.params.len());
    check_call("action", &step.action, &step.args, known)
}

fn check_call(
    field: &'static str,
    name: &Name,
    args: &[Name],
    n_args: Option<usize>,
) -> Result<(), WireError> {
    let n_args = n_args.ok_or_else(|| WireError::new(field, "one of the domain", name))?;
    if args.len() != n_args {
        return Err(WireError::new("arguments", n_args, args.len()));
    }
    match args.iter().find(|arg| !is_pddl_name(arg.as_str())) {
        Some(arg) => Err(WireError::new("argument", "a PDDL name", quoted(arg.as_str()))),
        None => Ok(()),
    }
}

/// Text that people read on a terminal: no control characters.
pub(super) fn check_text(text: &str) -> Result<(), WireError> {
    if text.chars().any(char::is_control) {
        return Err(WireError::new("text", "a line without control characters", quoted(text)));
    }
    Ok(())
}
