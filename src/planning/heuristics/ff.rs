//! The cost of a plan that solves the delete relaxation (h FF, with h add choosing the actions).
//!
//! Supports costs, conditional effects and axioms. Safe; neither admissible nor consistent.
//!
//! Source: Hoffmann, Nebel: The FF planning system, 2001; Keyder, Geffner: Heuristics for planning
//! with action costs revisited, 2008.

use super::Heuristic;
use super::relaxation::{Combine, Relaxation};
use super::relaxed_task::RelaxedTask;
use crate::planning::task::{Formula, Task};

/// The FF heuristic.
pub(in crate::planning) struct FastForward<'a> {
    task: &'a Task,
    relaxation: Relaxation<'a>,
    costs: Vec<u64>,
    plan: Vec<u32>,
    /// The whole relaxed plan of the last estimate.
    relaxed_plan: Vec<u32>,
}

impl<'a> FastForward<'a> {
    /// `costs` are the actions' costs; each should be above 0 so that short plans are preferred.
    pub(in crate::planning) fn new(
        task: &'a Task,
        relaxed: &'a RelaxedTask,
        costs: Vec<u64>,
    ) -> Self {
        let relaxation = Relaxation::new(relaxed, &costs, Combine::Sum);
        Self { task, relaxation, costs, plan: Vec::new(), relaxed_plan: Vec::new() }
    }

    /// The actions of the relaxed plan that gave the last estimate.
    pub(in crate::planning) fn relaxed_plan(&self) -> &[u32] {
        &self.relaxed_plan
    }
}

impl Heuristic for FastForward<'_> {
    fn estimate(&mut self, state: &[u64]) -> Option<u64> {
        self.relaxation.explore(state)?;
        self.relaxation.relaxed_plan(&mut self.plan);
        let costs = self.plan.iter().map(|&action| self.costs[action as usize]);
        let sum = costs.fold(0_u64, u64::saturating_add);
        self.relaxed_plan.clone_from(&self.plan);
        self.plan.retain(|&action| self.task.operators[action as usize].applicable(state));
        Some(sum)
    }

    fn work(&self) -> u64 {
        self.relaxation.graph.n_edges() as u64
    }

    fn preferred(&self) -> &[u32] {
        &self.plan
    }
}

/// What it costs to reach another goal with some of the actions: relaxed plans of parts of a plan.
pub(in crate::planning) struct Part {
    relaxed: RelaxedTask,
}

impl Part {
    /// The part of a task with these actions and this goal.
    pub(in crate::planning) fn new(task: &Task, actions: &[u32], goal: &Formula) -> Self {
        Self { relaxed: RelaxedTask::restricted(task, actions.iter().copied(), goal) }
    }

    /// Estimates within the part.
    pub(in crate::planning) fn estimates<'a>(
        &'a self,
        task: &'a Task,
        costs: Vec<u64>,
    ) -> FastForward<'a> {
        FastForward::new(task, &self.relaxed, costs)
    }
}
