//! What the cascade answers.

use std::sync::Arc;

use crate::messages::PlanSource;
use crate::pddl::Atom;
use crate::planning::Outcome;

/// The part of a plan that is still to be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanSuffix {
    /// The whole plan, as operators of the task.
    pub operators: Arc<[u32]>,
    /// Number of the step that is next; as many as there are operators when none is left.
    pub at: usize,
    /// Cost of the suffix, without penalties.
    pub cost: u64,
    /// Whether no plan from the observed state costs less, penalties included.
    pub proven_optimal: bool,
}

/// How a question is answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CascadeEnd {
    /// By a plan; by an empty one when the goal holds.
    Plan(PlanSuffix),
    /// By the reason why there is none.
    NoPlan(Outcome),
    /// Not at all: these facts exclude each other.
    Inconsistent(Vec<Atom>),
}

/// An answer with the source that gave it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CascadeReply {
    /// The first source that knew.
    pub source: PlanSource,
    /// A plan, or why there is none.
    pub end: CascadeEnd,
    /// States that searches expanded for it; 0 unless there was one.
    pub expansions: u64,
}

/// What [`Cascade::query`](super::Cascade::query) comes to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CascadeResult {
    /// A source has answered.
    Reply(CascadeReply),
    /// No source knows: a search has to tell. [`accept`](super::Cascade::accept) hears what it says.
    Search,
}

/// How often each source has answered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SourceCounts([u64; PlanSource::ALL.len()]);

impl SourceCounts {
    /// Counts an answer.
    pub(super) fn count(&mut self, source: PlanSource) {
        self.0[source as usize] += 1;
    }

    /// How often a source has answered.
    pub fn of(&self, source: PlanSource) -> u64 {
        self.0[source as usize]
    }
}

impl PlanSuffix {
    /// The goal holds: nothing is left to do.
    pub(super) fn none() -> Self {
        Self { operators: Arc::new([]), at: 0, cost: 0, proven_optimal: true }
    }
}

impl CascadeReply {
    /// Whether nobody waited for the answer: then the question is still open.
    pub fn is_late(&self) -> bool {
        matches!(self.end, CascadeEnd::NoPlan(Outcome::Interrupted))
    }
}
