//! What people are told while an episode runs.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::Verdict;
use crate::pddl::{Atom, Step};
use crate::scene::FrameRef;

/// One thing worth telling.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// The goal is known, and stays as it is. Told before anything moves.
    Goal {
        /// The goal as PDDL.
        goal: String,
        /// The same in the domain's words, one clause each; none where its source has no words.
        said: Vec<String>,
    },
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
        /// Ground actions that are left to do, first one first.
        steps: Vec<Step>,
        /// Sum of action costs, or the number of steps where the domain has none.
        cost: u64,
    },
    /// A step was started.
    Started {
        /// Ground action that the robot was told to carry out.
        step: Step,
    },
    /// A step did what it was to do.
    Done {
        /// Ground action that the robot was told to carry out.
        step: Step,
        /// How long it took in run time, seconds.
        seconds: f64,
    },
    /// A step did not do what it was to do.
    Failed {
        /// Ground action that the robot was told to carry out.
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
        /// Ground action that the robot was told to carry out.
        step: Step,
        /// Why.
        reason: String,
    },
    /// The loop waits for another look.
    Look {
        /// Why.
        reason: String,
    },
    /// The loop answers no further frame until it is told to.
    Paused,
    /// The loop goes on.
    Resumed,
    /// The episode ends.
    End(Verdict),
}

/// An event with its place in the episode.
#[derive(Debug, Clone, PartialEq)]
pub struct EventMessage {
    /// Number in the executor's stream of events.
    pub sequence: u64,
    /// The frame that it belongs to.
    pub cause: FrameRef,
    /// What has happened.
    pub event: Event,
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Goal { goal, said } if said.is_empty() => write!(f, "goal: {goal}"),
            Self::Goal { goal, said } => write!(f, "goal: {}: {goal}", said.join(", ")),
            Self::State { facts, unknown, .. } => {
                write!(f, "state: {}", list(facts))?;
                if unknown.is_empty() { Ok(()) } else { write!(f, ", unknown: {}", list(unknown)) }
            }
            Self::Plan { steps, cost } => {
                write!(f, "plan: {} steps, cost {cost}: {}", steps.len(), list(steps))
            }
            Self::Started { step } => write!(f, "started {step}"),
            Self::Done { step, seconds } => write!(f, "done {step} in {seconds:.1} s"),
            Self::Failed { step, reason, failures } => {
                write!(f, "failed {step}, {failures} so far: {reason}")
            }
            Self::Deviation(deviation) => deviation.fmt(f),
            Self::Replan { causes, .. } => {
                let causes: Vec<String> = causes.iter().map(ToString::to_string).collect();
                write!(f, "replan because {}", causes.join("; "))
            }
            Self::Cancel { step, reason } => write!(f, "cancel {step}: {reason}"),
            Self::Look { reason } => write!(f, "look: {reason}"),
            Self::Paused => f.write_str("paused"),
            Self::Resumed => f.write_str("resumed"),
            Self::End(verdict) => write!(f, "end: {verdict}"),
        }
    }
}

fn list<T: fmt::Display>(items: &[T]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// Why a plan was switched.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "cause", rename_all = "kebab-case")]
pub enum ReplanCause {
    /// The world is not as expected.
    Deviation(Deviation),
    /// A step failed.
    Failure {
        /// Ground action that the robot was told to carry out.
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
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
