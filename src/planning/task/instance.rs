//! One ground action, before packing.

use super::TaskError;
use super::formula::Formula;
use super::ground::{GroundCost, GroundEffect, Grounder};
use super::instantiate::binding_of;
use super::lowering::LiftedAction;

/// A ground action; atoms have the grounder's numbers.
pub(super) struct DraftAction {
    /// Number of the domain's action.
    pub(super) action: usize,
    pub(super) args: Vec<u32>,
    pub(super) precondition: Formula,
    pub(super) effects: Vec<GroundEffect>,
    pub(super) cost: GroundCost,
}

/// One action, unless its precondition cannot hold or it changes nothing.
pub(super) fn ground_action(
    idx: usize,
    schema: &LiftedAction,
    args: Vec<u32>,
    grounder: &mut Grounder<'_>,
) -> Result<Option<DraftAction>, TaskError> {
    let mut binding = binding_of(&args, schema.n_slots);
    let precondition = grounder.condition(&schema.condition, &mut binding, true)?;
    if precondition == Formula::False {
        return Ok(None);
    }
    let mut out = (Vec::new(), GroundCost::default());
    grounder.effect(&schema.result, &mut binding, &Formula::True, &mut out)?;
    let (effects, cost) = out;
    Ok(Some(DraftAction { action: idx, args, precondition, effects, cost }))
}
