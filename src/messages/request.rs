//! What a long-lived run is asked to reach, and what becomes of it.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{EpisodeCounts, Verdict};

/// A goal that somebody wants to be reached.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Submission {
    /// Who asks chooses it; the same one again is the same request.
    pub id: String,
    /// What reads the text, as `goal.kind` of a run file; without it, the run file's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// The goal, as `goal.text` of a run file.
    pub text: String,
}

/// What a long-lived run is asked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "kebab-case")]
pub enum TaskRequest {
    /// Reach a goal, when those before it have ended.
    Submit(Submission),
    /// Do not go on with a goal: the robot holds, if it was at work for it.
    Cancel {
        /// That of the goal.
        id: String,
    },
}

/// What has become of a submitted goal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "kebab-case")]
pub enum TaskState {
    /// It waits.
    Queued {
        /// How many goals come before it, the running one included.
        ahead: u64,
    },
    /// The robot is at work for it.
    Running,
    /// Its episode has come to a verdict.
    Done(TaskResult),
    /// Somebody cancelled it, or stopped the run; the robot was told to hold if it was at work.
    Cancelled {
        /// Who.
        reason: String,
    },
    /// It was not begun: the goal cannot be read, or nothing more may wait.
    Refused {
        /// Why, with the words that were not understood.
        reason: String,
    },
    /// Its episode broke off without a verdict; the robot was told to hold.
    Failed {
        /// Why.
        reason: String,
    },
}

/// What the episode of a goal came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskResult {
    /// How it ended.
    pub end: Verdict,
    /// What was read out of the text, as PDDL.
    pub goal: String,
    /// What was counted.
    pub counts: EpisodeCounts,
    /// How long it took in run time, seconds.
    pub run_s: f64,
    /// Whether the goal really holds, where the world is simulated.
    pub goal_in_simulator: Option<bool>,
}

/// What a long-lived run says of a goal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskStatus {
    /// The goal as it was submitted.
    #[serde(flatten)]
    pub task: Submission,
    /// What has become of it.
    #[serde(flatten)]
    pub state: TaskState,
}

impl TaskState {
    /// Every [`word`](Self::word).
    pub const WORDS: [&str; 6] = ["queued", "running", "done", "cancelled", "refused", "failed"];

    /// The word for it.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Queued { .. } => "queued",
            Self::Running => "running",
            Self::Done(_) => "done",
            Self::Cancelled { .. } => "cancelled",
            Self::Refused { .. } => "refused",
            Self::Failed { .. } => "failed",
        }
    }

    /// Why it is so, in words; empty where there is nothing to say.
    pub fn reason(&self) -> String {
        match self {
            Self::Queued { ahead: 0 } => "next".to_owned(),
            Self::Queued { ahead: 1 } => "one goal before it".to_owned(),
            Self::Queued { ahead } => format!("{ahead} goals before it"),
            Self::Running => String::new(),
            Self::Done(result) => result.end.reason(),
            Self::Cancelled { reason } | Self::Refused { reason } | Self::Failed { reason } => {
                reason.clone()
            }
        }
    }

    /// Whether nothing more comes of it.
    pub fn is_over(&self) -> bool {
        !matches!(self, Self::Queued { .. } | Self::Running)
    }
}

impl fmt::Display for TaskState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (word, reason) = (self.word(), self.reason());
        match self {
            Self::Running => f.write_str(word),
            Self::Done(result) => write!(f, "{word}: {}: {reason}", result.end.word()),
            Self::Queued { .. }
            | Self::Cancelled { .. }
            | Self::Refused { .. }
            | Self::Failed { .. } => write!(f, "{word}: {reason}"),
        }
    }
}
