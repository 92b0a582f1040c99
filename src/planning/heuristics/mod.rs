//! Estimates of the cost from a state to the goal.

mod blind;
mod graph;
mod landmarks;
mod patterns;
mod queue;
mod relaxed;
mod ff;
mod lm_cut;
mod max;

use std::sync::{Arc, OnceLock};

use crate::planning::task::Task;

pub(super) use blind::Blind;
pub(super) use ff::{FastForward, Part};
pub(super) use landmarks::Landmarks;
pub(super) use lm_cut::LmCut;
pub(super) use max::Max;
pub(super) use patterns::{Databases, Patterns};

/// What heuristics of one task share: built when first asked for, the same for every state.
#[derive(Debug, Clone, Default)]
pub(crate) struct Prepared {
    graph: OnceLock<graph::Graph>,
    databases: OnceLock<Option<Arc<Databases>>>,
}

impl Prepared {
    fn graph(task: &Task) -> &graph::Graph {
        task.prepared.graph.get_or_init(|| graph::Graph::new(task))
    }

    /// The task's pattern databases; none where they do not apply.
    pub(super) fn databases(task: &Task) -> Option<&Databases> {
        let make = || Databases::new(task).map(Arc::new);
        task.prepared.databases.get_or_init(make).as_deref()
    }
}

/// An estimate of the cost to the goal.
pub(super) trait Heuristic {
    /// The estimate for a packed state; `None` proves that the goal cannot be reached from it.
    fn estimate(&mut self, state: &[u64]) -> Option<u64>;

    /// Actions that look useful in the state of the last estimate, in rising order.
    fn preferred(&self) -> &[u32] {
        &[]
    }
}
