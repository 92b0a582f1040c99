//! How a planning call ends. Causes stay apart: no plan exists is not the same as none was found.

use std::fmt;

use super::Plan;

/// What a planning call answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// The steps, their cost, and whether that is proven cheapest.
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
        /// What it allows; 0 where it is no number.
        value: u64,
    },
    /// The deadline passed, or the caller cancelled, before an answer was found.
    Interrupted,
    /// The task uses a feature that this planner does not support.
    Unsupported {
        /// Its name.
        feature: String,
    },
    /// The objects, facts, goal or costs do not fit the domain.
    BadInput {
        /// What was expected and what was found.
        reason: String,
    },
}

impl Outcome {
    /// Every [`word`](Self::word).
    pub const WORDS: [&str; 6] =
        ["solved", "unsolvable", "out-of-budget", "interrupted", "unsupported", "bad-input"];

    /// The plan, where there is one.
    pub fn plan(&self) -> Option<&Plan> {
        if let Self::Solved(plan) = self { Some(plan) } else { None }
    }

    /// The word for it in reports.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Solved(_) => "solved",
            Self::Unsolvable { .. } => "unsolvable",
            Self::OutOfBudget { .. } => "out-of-budget",
            Self::Interrupted => "interrupted",
            Self::Unsupported { .. } => "unsupported",
            Self::BadInput { .. } => "bad-input",
        }
    }

    /// Why no plan exists, where that is certain.
    pub fn proof(&self) -> Option<Proof> {
        if let Self::Unsolvable { proof } = self { Some(*proof) } else { None }
    }

    /// Why there is no plan: the proof, the limit with its value, the feature, or what does not
    /// fit. `None` when there is one.
    pub fn reason(&self) -> Option<String> {
        match self {
            Self::Solved(_) => None,
            Self::Unsolvable { proof } => Some(proof.to_string()),
            Self::OutOfBudget { limit, value } => Some(format!("{limit} = {value}")),
            Self::Interrupted => Some("the deadline has passed".to_owned()),
            Self::Unsupported { feature } => Some(feature.clone()),
            Self::BadInput { reason } => Some(reason.clone()),
        }
    }
}

/// One line: the word, then why there is no plan, or how long the plan is.
impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self, self.reason()) {
            (Self::Solved(plan), _) => write!(f, "solved: a plan of {} steps", plan.steps.len()),
            (_, reason) => write!(f, "{}: {}", self.word(), reason.unwrap_or_default()),
        }
    }
}

/// Why no plan exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// Grounding simplified the goal to false.
    GoalFalse,
    /// The goal is unreachable even in the delete relaxation.
    RelaxedUnreachable,
    /// Every reachable state that is no dead end of the delete relaxation was expanded.
    Exhausted {
        /// How many were expanded.
        n_states: usize,
    },
    /// An external planner reports it; it has not been verified here.
    OtherPlanner,
}

impl Proof {
    /// Every [`kind`](Self::kind).
    pub const KINDS: [&str; 4] =
        ["goal-false", "relaxed-unreachable", "exhausted", "other-planner"];

    /// A fixed word for JSON.
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
            Self::GoalFalse => f.write_str("the goal simplifies to false during grounding"),
            Self::RelaxedUnreachable => {
                f.write_str("the goal is unreachable even in the delete relaxation")
            }
            Self::Exhausted { n_states } => {
                write!(f, "the search is exhausted after {n_states} states, dead ends left out")
            }
            Self::OtherPlanner => {
                f.write_str("the external planner reports it; this has not been verified")
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
    /// The limit, and its value, that ended the search for a cheapest plan before it had an answer.
    pub unproven: Option<(&'static str, u64)>,
    /// One entry for each search that ran, in order.
    pub phases: Vec<Phase>,
    /// Processor time of processes that were started for the answer, nanoseconds.
    pub process_cpu_ns: u64,
}

/// What one search did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Phase {
    /// Name of the search and its heuristic.
    pub name: &'static str,
    /// States whose successors were generated.
    pub expanded: u64,
    /// Successors generated, states met before among them.
    pub generated: u64,
    /// States given to the heuristic.
    pub evaluated: u64,
}

impl Phase {
    /// Name of the search that makes a plan cheaper which another one has found.
    pub(super) const IMPROVE: &'static str = "improve";
}

impl Statistics {
    /// Whether it was tried to make a plan cheaper that had been found.
    pub fn improved(&self) -> bool {
        self.phases.iter().any(|phase| phase.name == Phase::IMPROVE)
    }

    /// States expanded by all searches.
    pub fn expanded(&self) -> u64 {
        self.phases.iter().map(|p| p.expanded).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::Number;

    #[test]
    fn every_outcome_is_told_in_words() {
        let solved = Plan {
            steps: Vec::new(),
            cost: 0,
            cost_unit: Number::ONE,
            penalty: 0,
            proven_optimal: true,
            lower_bound: 0,
        };
        let feature = "numeric fluents".to_owned();
        let outcomes = [
            Outcome::Solved(solved),
            Outcome::Unsolvable { proof: Proof::GoalFalse },
            Outcome::Unsolvable { proof: Proof::RelaxedUnreachable },
            Outcome::Unsolvable { proof: Proof::Exhausted { n_states: 7 } },
            Outcome::Unsolvable { proof: Proof::OtherPlanner },
            Outcome::OutOfBudget { limit: "greedy_expansions_max", value: 2 },
            Outcome::Interrupted,
            Outcome::Unsupported { feature },
            Outcome::BadInput { reason: "expected an object, got cup".to_owned() },
        ];
        assert_eq!(
            outcomes.map(|outcome| outcome.to_string()),
            [
                "solved: a plan of 0 steps",
                "unsolvable: the goal simplifies to false during grounding",
                "unsolvable: the goal is unreachable even in the delete relaxation",
                "unsolvable: the search is exhausted after 7 states, dead ends left out",
                "unsolvable: the external planner reports it; this has not been verified",
                "out-of-budget: greedy_expansions_max = 2",
                "interrupted: the deadline has passed",
                "unsupported: numeric fluents",
                "bad-input: expected an object, got cup",
            ]
        );
    }
}
