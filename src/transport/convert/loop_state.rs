//! What steers the loop and what tells how it fares: requests, decisions, health.

use super::context::WireContext;
use super::text::{name_from_wire, name_to_wire, text_from_wire, text_to_wire};
use super::{WireError, flag, single};
use crate::messages::{ActorHealth, AnswerKind, Control, DecisionMessage, FaultCounts, Stop};
use crate::pddl::Name;
use crate::scene::FrameRef;
use crate::transport::wire::{ControlRecord, DecisionRecord, HealthRecord, StreamHeader};

/// Most actors of one run.
const ACTORS_MAX: usize = 64;

/// Writes a request.
pub fn control_to_wire(control: Control) -> ControlRecord {
    let (request, reason) = match control {
        Control::Stop(Stop::Interrupt) => (0, 0),
        Control::Stop(Stop::Terminate) => (0, 1),
        Control::Stop(Stop::Request) => (0, 2),
        Control::Pause => (1, 0),
        Control::Resume => (2, 0),
        Control::Step => (3, 0),
    };
    ControlRecord { request, reason }
}

/// Checks a request.
///
/// # Errors
/// [`WireError`] naming the field.
pub fn control_from_wire(records: &[ControlRecord]) -> Result<Control, WireError> {
    let ControlRecord { request, reason } = *single("control", records)?;
    match (request, reason) {
        (0, 0) => Ok(Control::Stop(Stop::Interrupt)),
        (0, 1) => Ok(Control::Stop(Stop::Terminate)),
        (0, 2) => Ok(Control::Stop(Stop::Request)),
        (0, other) => Err(WireError::new("stop reason", "0 to 2", other)),
        (1, _) => Ok(Control::Pause),
        (2, _) => Ok(Control::Resume),
        (3, _) => Ok(Control::Step),
        (other, _) => Err(WireError::new("request", "0 to 3", other)),
    }
}

/// Writes which scene and plan a command rests on.
pub fn decision_to_wire(
    decision: &DecisionMessage,
    context: &WireContext,
) -> (StreamHeader, DecisionRecord) {
    let record = DecisionRecord {
        plan_cycle: decision.plan_cycle,
        answered_ns: decision.answered_ns,
        kind: match decision.kind {
            AnswerKind::Continue => 0,
            AnswerKind::Dispatch => 1,
            AnswerKind::Replan => 2,
        },
        is_last: u32::from(decision.is_last),
    };
    (context.stream_header(decision.sequence, &decision.cause), record)
}

/// Checks which scene and plan a command rests on.
///
/// # Errors
/// [`WireError`] naming the field.
pub fn decision_from_wire(
    header: &StreamHeader,
    records: &[DecisionRecord],
    context: &WireContext,
) -> Result<DecisionMessage, WireError> {
    let cause = context.check_stream(header)?;
    let record = single("decision", records)?;
    Ok(DecisionMessage {
        sequence: header.sequence,
        cause,
        plan_cycle: record.plan_cycle,
        kind: match record.kind {
            0 => AnswerKind::Continue,
            1 => AnswerKind::Dispatch,
            2 => AnswerKind::Replan,
            other => return Err(WireError::new("decision kind", "0 to 2", other)),
        },
        answered_ns: record.answered_ns,
        is_last: flag("is_last", record.is_last)?,
    })
}

/// Writes how the actors fare; `sequence` numbers the reports.
///
/// # Errors
/// [`WireError`] when an actor's name is too long.
pub fn health_to_wire(
    sequence: u64,
    actors: &[ActorHealth],
    context: &WireContext,
) -> Result<(StreamHeader, Vec<HealthRecord>), WireError> {
    let record = |health: &ActorHealth| {
        let [n_malformed, n_other_size, n_bad_stamp, n_ahead, n_late, n_repeated] =
            health.faults.counts();
        Ok(HealthRecord {
            actor: name_to_wire(&Name::new(&health.actor))?,
            is_alive: u32::from(health.is_alive),
            n_restarts: health.n_restarts,
            n_messages: health.n_messages,
            n_missed: health.n_missed,
            n_rejected: health.n_rejected,
            n_malformed,
            n_other_size,
            n_bad_stamp,
            n_ahead,
            n_late,
            n_repeated,
            last_rejection: text_to_wire(&health.last_rejection),
        })
    };
    let records = actors.iter().map(record).collect::<Result<_, _>>()?;
    Ok((context.stream_header(sequence, &FrameRef::default()), records))
}

/// Checks how the actors fare.
///
/// # Errors
/// [`WireError`] naming the field.
pub fn health_from_wire(
    header: &StreamHeader,
    records: &[HealthRecord],
    context: &WireContext,
) -> Result<Vec<ActorHealth>, WireError> {
    context.check_stream(header)?;
    if records.len() > ACTORS_MAX {
        return Err(WireError::new("actors", ACTORS_MAX, records.len()));
    }
    let health = |record: &HealthRecord| {
        Ok(ActorHealth {
            actor: name_from_wire("actor", &record.actor)?.as_str().to_owned(),
            is_alive: flag("is_alive", record.is_alive)?,
            n_messages: record.n_messages,
            n_restarts: record.n_restarts,
            n_missed: record.n_missed,
            n_rejected: record.n_rejected,
            faults: FaultCounts::new([
                record.n_malformed,
                record.n_other_size,
                record.n_bad_stamp,
                record.n_ahead,
                record.n_late,
                record.n_repeated,
            ]),
            last_rejection: text_from_wire("last_rejection", &record.last_rejection)?.to_owned(),
        })
    };
    records.iter().map(health).collect()
}
