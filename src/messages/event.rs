//! What people are told while an episode runs.

use std::fmt;

use super::Verdict;
use crate::pddl::{Atom, Step};

/// One thing worth telling.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
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
    /// A running step is cancelled.
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

impl fmt::Display for ReplanCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Deviation(deviation) => deviation.fmt(f),
            Self::Failure { step, reason } => write!(f, "{step} failed: {reason}"),
        }
    }
}

/// Facts about the same objects that are not as expected.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Deviation {
    /// Expected, but known not to hold.
    pub missing: Vec<Atom>,
    /// Not expected, but seen.
    pub seen: Vec<Atom>,
    /// Expected or not, now unknown.
    pub unknown: Vec<Atom>,
}

impl fmt::Display for Deviation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list =
            |atoms: &[Atom]| atoms.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        let mut parts = Vec::new();
        if !self.missing.is_empty() {
            parts.push(format!("expected {}", list(&self.missing)));
        }
        if !self.seen.is_empty() {
            parts.push(format!("observed {}", list(&self.seen)));
        } else if !self.missing.is_empty() {
            parts.push("observed that it does not hold".to_owned());
        }
        if !self.unknown.is_empty() {
            parts.push(format!("unknown {}", list(&self.unknown)));
        }
        f.write_str(&parts.join(", "))
    }
}
