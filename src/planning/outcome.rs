//! How a planning call ends. Causes stay apart: no plan exists is not the same as none was found.

use std::fmt;

use super::Plan;

/// What a planning call answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// A plan.
    Solved(Plan),
    /// There is no plan; `proof` says why that is certain.
    Unsolvable {
        /// Its `Display` is one sentence.
        proof: Proof,
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

/// Why no plan exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// Grounding found that the goal can never hold.
    GoalFalse,
    /// The goal cannot be reached even in the delete relaxation.
    RelaxedUnreachable,
    /// Every state that can be reached and is no dead end of the relaxation was looked at.
    Exhausted {
        /// How many there are.
        n_states: usize,
    },
    /// Another planner says so; groundloop has not checked it.
    OtherPlanner,
}

impl Proof {
    /// A name for machines.
    pub fn kind(self) -> &'static str {
        match self {
            Self::GoalFalse => "goal-false",
            Self::RelaxedUnreachable => "relaxed-unreachable",
            Self::Exhausted { .. } => "exhausted",
            Self::OtherPlanner => "other-planner",
        }
    }
}

impl fmt::Display for Proof {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::GoalFalse => {
                f.write_str("the goal cannot hold even if nothing ever stopped being possible")
            }
            Self::OtherPlanner => {
                f.write_str("the other planner has looked at everything that can matter")
            }
            Self::RelaxedUnreachable => {
                f.write_str("the goal cannot be reached even if whatever held once held forever")
            }
            Self::Exhausted { n_states } => {
                write!(f, "all {n_states} states that can matter were looked at")
            }
        }
    }
}

/// What a planning call did, in counts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Ground atoms that can change, derived ones included.
    pub n_atoms: usize,
    /// Ground actions.
    pub n_actions: usize,
    /// No plan has a smaller `cost + penalty`, in the units of [`Plan::cost`]; 0 when nothing is
    /// known. It is there when no plan was found too.
    pub lower_bound: u64,
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
    /// Whether it was tried to make a plan cheaper that had been found.
    pub fn improved(&self) -> bool {
        self.phases.iter().any(|phase| phase.name == "improve")
    }

    /// States expanded by all searches.
    pub fn expanded(&self) -> u64 {
        self.phases.iter().map(|p| p.expanded).sum()
    }
}
