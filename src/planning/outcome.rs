//! How a planning call ends. Causes stay apart: no plan exists is not the same as none was found.

use super::Plan;

/// What a planning call answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// A plan.
    Solved(Plan),
    /// There is no plan; `proof` says why that is certain.
    Unsolvable {
        /// One sentence.
        proof: String,
    },
    /// A limit was met before an answer was found.
    OutOfBudget {
        /// Name of the limit, as in [`super::Budget`].
        limit: &'static str,
        /// Its value.
        value: u64,
    },
    /// The task uses something this planner does not understand.
    Unsupported {
        /// What.
        feature: String,
    },
    /// The objects, facts, goal or costs do not fit the domain.
    BadInput {
        /// What was expected and what was found.
        reason: String,
    },
}

/// What a planning call did, in counts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Ground atoms that can change, derived ones included.
    pub n_atoms: usize,
    /// Ground actions.
    pub n_actions: usize,
    /// One entry for each search that ran, in order.
    pub phases: Vec<Phase>,
}

/// What one search did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Phase {
    /// Name of the search and its heuristic.
    pub name: &'static str,
    /// States whose successors were generated.
    pub expanded: u64,
    /// Successors generated.
    pub generated: u64,
    /// States given to the heuristic.
    pub evaluated: u64,
}

impl Statistics {
    /// States expanded by all searches.
    pub fn expanded(&self) -> u64 {
        self.phases.iter().map(|p| p.expanded).sum()
    }
}
