//! What people are told while an episode runs.

use super::{Deviation, Verdict};
use crate::pddl::{Atom, Step};

/// One thing worth telling.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// The believed state has changed (or is known for the first time).
    State {
        /// All facts that hold.
        facts: Vec<Atom>,
        /// All facts that are unknown.
        unknown: Vec<Atom>,
        /// Those of both that a constraint of the domain decided, against their own feature.
        constrained: Vec<Atom>,
    },
    /// A plan is followed from now on.
    Plan {
        /// Its steps.
        steps: Vec<Step>,
        /// Its cost.
        cost: u64,
    },
    /// A step was started.
    Started {
        /// The step.
        step: Step,
    },
    /// A step did what it was to do.
    Done {
        /// The step.
        step: Step,
        /// How long it took in run time, seconds.
        seconds: f64,
    },
    /// A step did not do what it was to do.
    Failed {
        /// The step.
        step: Step,
        /// Why.
        reason: String,
        /// How often this very step has failed so far.
        failures: u32,
    },
    /// The world is not as expected.
    Deviation(Deviation),
    /// The plan was switched.
    Replan {
        /// Why.
        causes: Vec<ReplanCause>,
        /// The step of the old plan that would have come next.
        old: Option<Step>,
    },
    /// A running step is broken off.
    Cancel {
        /// The step.
        step: Step,
        /// Why.
        reason: String,
    },
    /// The loop waits for another look.
    Look {
        /// Why.
        reason: String,
    },
    /// The episode ends.
    End(Verdict),
}

/// Why a plan was switched.
#[derive(Debug, Clone, PartialEq)]
pub enum ReplanCause {
    /// The world is not as expected.
    Deviation(Deviation),
    /// A step failed.
    Failure {
        /// The step.
        step: Step,
        /// Why.
        reason: String,
    },
}

impl std::fmt::Display for ReplanCause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Deviation(deviation) => deviation.fmt(f),
            Self::Failure { step, reason } => write!(f, "{step} failed: {reason}"),
        }
    }
}
