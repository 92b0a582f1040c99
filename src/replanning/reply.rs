//! What the ladder answers.

use std::sync::Arc;

use crate::messages::Rung;
use crate::pddl::Atom;
use crate::planning::Outcome;
use crate::planning::solve::INTERRUPTED;

/// A rest of a plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rest {
    /// The whole plan, as operators of the task.
    pub operators: Arc<[u32]>,
    /// The step that is next.
    pub at: usize,
    /// Cost of the rest, without penalties.
    pub cost: u64,
    /// Whether no plan from the observed state costs less, penalties included.
    pub proven_optimal: bool,
}

/// How a question is answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// By a plan; by an empty one when the goal holds.
    Plan(Rest),
    /// By the reason why there is none.
    NoPlan(Outcome),
    /// Not at all: these facts exclude each other.
    Inconsistent(Vec<Atom>),
}

/// An answer with the rung that gave it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// Who answered.
    pub rung: Rung,
    /// The answer.
    pub end: End,
    /// States expanded for it.
    pub expansions: u64,
}

/// What a climb comes to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Climbed {
    /// An answer.
    Reply(Reply),
    /// No rung knows: a search has to tell. [`take`](super::Ladder::take) hears what it says.
    Search,
}

/// How often each rung has answered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters([u64; Rung::ALL.len()]);

impl Counters {
    /// Counts an answer.
    pub(super) fn count(&mut self, rung: Rung) {
        self.0[rung as usize] += 1;
    }

    /// How often a rung has answered.
    pub fn of(&self, rung: Rung) -> u64 {
        self.0[rung as usize]
    }
}

impl Rest {
    /// Nothing is left to do.
    pub(super) fn none() -> Self {
        Self { operators: Arc::new([]), at: 0, cost: 0, proven_optimal: true }
    }
}

impl Reply {
    /// Whether nobody waited for the answer: then the question is still open.
    pub fn is_late(&self) -> bool {
        matches!(&self.end, End::NoPlan(Outcome::OutOfBudget { limit, .. })
            if *limit == INTERRUPTED)
    }
}
