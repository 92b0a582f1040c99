//! What does not change while an episode lasts.

use std::collections::BTreeSet;

use crate::messages::{PlanSource, Reuse};
use crate::pddl::Atom;
use crate::planning::GroundingLimits;

/// What does not change while a cascade is used.
#[derive(Debug, Clone)]
pub struct CascadeSettings {
    /// When the current plan is kept.
    pub reuse: Reuse,
    /// The sources that are switched on; *mutex*, *goal* and *unchanged* always are.
    pub sources: BTreeSet<PlanSource>,
    /// Cost that each failure adds to a step.
    pub failure_penalty: u32,
    /// Bounds of all distance tables together.
    pub table: TableLimits,
    /// Bounds of grounding one task.
    pub grounding: GroundingLimits,
    /// States that are known to be right: what actions suggest to exclude each other counts only
    /// if it does in all of them. Without any, no observation is doubted.
    pub reference_states: Vec<BTreeSet<Atom>>,
}

/// Bounds of distance tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TableLimits {
    /// Most states of one table.
    pub states_max: usize,
    /// Most memory while it is built, bytes.
    pub bytes_max: usize,
}
