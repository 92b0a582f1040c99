//! The cost of the dearest part of the goal in the delete relaxation (h max).
//!
//! Supports costs, conditional effects and axioms. Admissible, consistent, safe.
//!
//! Source: Bonet, Geffner: Planning as heuristic search, 2001.

use super::Heuristic;
use super::relaxation::{Combine, Relaxation};
use super::relaxed_task::RelaxedTask;

/// The max heuristic.
pub(in crate::planning) struct Max<'a> {
    relaxation: Relaxation<'a>,
}

impl<'a> Max<'a> {
    /// `costs` are the actions' costs.
    pub(in crate::planning) fn new(relaxed: &'a RelaxedTask, costs: &[u64]) -> Self {
        Self { relaxation: Relaxation::new(relaxed, costs, Combine::Max) }
    }
}

impl Heuristic for Max<'_> {
    fn estimate(&mut self, state: &[u64]) -> Option<u64> {
        Some(self.relaxation.explore(state)?.saturating_mul(self.relaxation.unit))
    }

    fn work(&self) -> u64 {
        self.relaxation.graph.n_edges() as u64
    }
}
