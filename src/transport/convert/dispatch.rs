//! Dispatched steps with what they change.

use super::WireError;
use super::context::WireContext;
use super::plan::{call_to_wire, fact_from_wire, step_from_wire, step_to_wire};
use crate::messages::{Dispatch, Effects};
use crate::pddl::Atom;
use crate::transport::wire::{DispatchRecord, StepRecord, StreamHeader};

/// Most atoms that one step changes.
const EFFECTS_MAX: usize = 4_096;

const STEP: u32 = 0;
const ADD: u32 = 1;
const DELETE: u32 = 2;

/// Writes a dispatched step.
///
/// # Errors
/// [`WireError`] when a name is too long, or a step or atom has too many arguments.
pub fn dispatch_to_wire(
    dispatch: &Dispatch,
    context: &WireContext,
) -> Result<(StreamHeader, Vec<DispatchRecord>), WireError> {
    let mut header = context.stream_header(dispatch.sequence, &dispatch.cause);
    header.command_id = dispatch.command_id;
    let record = |tag: u32, call: StepRecord| DispatchRecord { tag, reserved: 0, call };
    let effect = |tag: u32, atom: &Atom| {
        Ok(record(tag, call_to_wire("effect", &atom.predicate, &atom.args)?))
    };
    let Effects { add, delete } = &dispatch.effects;
    let step = std::iter::once(Ok(record(STEP, step_to_wire(&dispatch.step)?)));
    let effects = add.iter().map(|atom| effect(ADD, atom));
    let effects = effects.chain(delete.iter().map(|atom| effect(DELETE, atom)));
    Ok((header, step.chain(effects).collect::<Result<_, _>>()?))
}

/// Checks a dispatched step.
///
/// # Errors
/// [`WireError`] naming the field: another run or domain, no step or a second one, an action or
/// predicate that the domain does not have.
pub fn dispatch_from_wire(
    header: &StreamHeader,
    records: &[DispatchRecord],
    context: &WireContext,
) -> Result<Dispatch, WireError> {
    let cause = context.check_stream(header)?;
    let first = records.split_first().filter(|(first, _)| first.tag == STEP);
    let (step, changes) = first.ok_or_else(|| WireError::new("dispatch", "a step first", ""))?;
    if changes.len() > EFFECTS_MAX {
        return Err(WireError::new("effects", EFFECTS_MAX, changes.len()));
    }
    let mut effects = Effects::default();
    for change in changes {
        let atoms = match change.tag {
            ADD => &mut effects.add,
            DELETE => &mut effects.delete,
            other => return Err(WireError::new("effect tag", "1 or 2", other)),
        };
        atoms.insert(fact_from_wire(&change.call, context)?);
    }
    Ok(Dispatch {
        sequence: header.sequence,
        cause,
        command_id: header.command_id,
        step: step_from_wire(&step.call, context)?,
        effects,
    })
}
