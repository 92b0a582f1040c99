//! No look-ahead: the cheapest action, unless the goal holds.
//!
//! Supports costs, conditional effects and axioms. Admissible, consistent, safe.

use super::Heuristic;
use crate::planning::task::Task;

/// The blind heuristic.
pub(in crate::planning) struct Blind<'a> {
    task: &'a Task,
    cost_min: u64,
}

impl<'a> Blind<'a> {
    /// `costs` are the actions' costs.
    pub(in crate::planning) fn new(task: &'a Task, costs: &[u64]) -> Self {
        Self { task, cost_min: costs.iter().min().copied().unwrap_or(0) }
    }
}

impl Heuristic for Blind<'_> {
    fn estimate(&mut self, state: &[u64]) -> Option<u64> {
        Some(if self.task.is_goal(state) { 0 } else { self.cost_min })
    }
}
