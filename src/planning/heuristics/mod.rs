//! Estimates of the cost from a state to the goal.
//!
//! What is derived once from a task ([`RelaxedTask`], [`Databases`]) is handed in: its owner keeps it
//! for as long as it keeps the task.

mod blind;
mod relaxed_task;
mod landmarks;
mod patterns;
mod queue;
mod relaxation;
mod ff;
mod lm_cut;
mod max;

pub(super) use blind::Blind;
pub(super) use ff::{FastForward, Part};
pub(super) use landmarks::Landmarks;
pub(super) use lm_cut::LmCut;
pub(super) use max::Max;
pub(super) use patterns::{Databases, Patterns};
pub(super) use relaxed_task::RelaxedTask;

/// Largest cost of an action within the relaxation, whose costs are narrow for speed.
const RELAXED_COST_MAX: u64 = 1 << 20;

/// The unit that makes the costs narrow enough for the relaxation; 1 for those of a table top.
fn coarse_unit(costs: &[u64]) -> u64 {
    costs.iter().max().map_or(1, |dearest| dearest.div_ceil(RELAXED_COST_MAX)).max(1)
}

/// An estimate of the cost to the goal.
pub(super) trait Heuristic {
    /// The estimate for a packed state; `None` proves that the goal cannot be reached from it.
    fn estimate(&mut self, state: &[u64]) -> Option<u64>;

    /// About how many elementary steps the last estimate took.
    fn work(&self) -> u64 {
        1
    }

    /// Actions that look useful in the state of the last estimate, in rising order.
    fn preferred(&self) -> &[u32] {
        &[]
    }
}
