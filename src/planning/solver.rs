//! A task with what heuristics derive from it.

use std::sync::OnceLock;

use super::heuristics::{Databases, RelaxedTask};
use super::task::Task;

/// Solves one task again and again, from changing states and at changing prices.
///
/// Owns what heuristics derive from the task: made when first asked for, kept as long as the task.
#[derive(Debug)]
pub struct Solver {
    task: Task,
    relaxed: OnceLock<RelaxedTask>,
    databases: OnceLock<Option<Databases>>,
}

impl Solver {
    /// Solves a task; nothing is computed yet.
    pub fn new(task: Task) -> Self {
        Self { task, relaxed: OnceLock::new(), databases: OnceLock::new() }
    }

    /// What is solved; its states are those that [`Self::solve`] packs.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// The task's delete relaxation.
    pub(super) fn relaxed(&self) -> &RelaxedTask {
        self.relaxed.get_or_init(|| RelaxedTask::new(&self.task))
    }

    /// The task's pattern databases; none where they do not apply.
    pub(super) fn databases(&self) -> Option<&Databases> {
        self.databases.get_or_init(|| Databases::new(&self.task)).as_ref()
    }
}
