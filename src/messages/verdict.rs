//! How an episode ends.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::pddl::Step;
use crate::scene::FrameRef;

/// The named bound that ended an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// `limits.cycles_max`.
    Cycles,
    /// `limits.seconds_max`.
    Seconds,
    /// `limits.observing_s_max`.
    Observing,
    /// `limits.unseen_s_max`.
    Unseen,
    /// `limits.planner_timeouts_max`.
    PlannerTimeouts,
    /// `limits.failures_max`.
    Failures,
    /// `limits.revisits_max`.
    Revisits,
    /// `limits.skill_timeout_s`, twice: the robot did not even confirm the cancel.
    SkillTimeout,
    /// The planner does not understand the domain or the goal.
    Planner,
    /// `supervisor.restarts_max`.
    Restarts,
}

impl Limit {
    /// Its key in the run file.
    pub fn key(self) -> &'static str {
        match self {
            Self::Cycles => "limits.cycles_max",
            Self::Seconds => "limits.seconds_max",
            Self::Observing => "limits.observing_s_max",
            Self::Unseen => "limits.unseen_s_max",
            Self::PlannerTimeouts => "limits.planner_timeouts_max",
            Self::Failures => "limits.failures_max",
            Self::Revisits => "limits.revisits_max",
            Self::SkillTimeout => "limits.skill_timeout_s",
            Self::Planner => "planner",
            Self::Restarts => "supervisor.restarts_max",
        }
    }
}

/// Who stopped the episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// Ctrl-C.
    Interrupt,
    /// SIGTERM.
    Terminate,
    /// A request on the bus.
    Request,
}

/// How an episode ends.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "verdict", content = "of", rename_all = "kebab-case")]
pub enum Verdict {
    /// The goal holds in a confirmed state.
    Reached,
    /// Without a robot: a plan rests on a confirmed state.
    Planned,
    /// In an open loop: all steps of the first plan were carried out. Nobody has looked what came of them.
    Executed,
    /// No plan exists from a confirmed state.
    Unsolvable {
        /// The kind of proof.
        proof: String,
    },
    /// A bound was met.
    GaveUp {
        /// The budget, which `detail` gives the value of.
        limit: Limit,
        /// What happened.
        detail: String,
    },
    /// Stopped from outside; the robot was told to hold.
    Stopped(Stop),
}

impl Verdict {
    /// Every [`word`](Self::word).
    pub const WORDS: [&str; 6] =
        ["reached", "planned", "executed", "unsolvable", "gave-up", "stopped"];

    /// The word for it in reports.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Reached => "reached",
            Self::Planned => "planned",
            Self::Executed => "executed",
            Self::Unsolvable { .. } => "unsolvable",
            Self::GaveUp { .. } => "gave-up",
            Self::Stopped(_) => "stopped",
        }
    }

    /// The process's exit code for it.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Reached | Self::Planned | Self::Executed => 0,
            Self::Unsolvable { .. } => 3,
            Self::GaveUp { .. } => 4,
            Self::Stopped(Stop::Interrupt | Stop::Request) => 130,
            Self::Stopped(Stop::Terminate) => 143,
        }
    }

    /// One sentence that says why.
    pub fn reason(&self) -> String {
        match self {
            Self::Reached => "the goal holds in a confirmed state".to_owned(),
            Self::Planned => "planned from a confirmed state; no robot is configured".to_owned(),
            Self::Executed => {
                "all steps of the first plan were carried out blindly; what came of them was not looked at"
                    .to_owned()
            }
            Self::Unsolvable { proof } => format!("no plan exists: {proof}"),
            Self::GaveUp { limit, detail } => format!("{}: {detail}", limit.key()),
            Self::Stopped(Stop::Interrupt) => {
                "interrupted (SIGINT); the robot was told to hold".to_owned()
            }
            Self::Stopped(Stop::Terminate) => {
                "terminated (SIGTERM); the robot was told to hold".to_owned()
            }
            Self::Stopped(Stop::Request) => {
                "stopped on request; the robot was told to hold".to_owned()
            }
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.word(), self.reason())
    }
}

/// Which kind of answer a frame got; latencies are kept apart by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum AnswerKind {
    /// The frame changed nothing.
    Continue,
    /// A skill was started.
    Dispatch,
    /// The plan was switched, whether a skill was started or not.
    Replan,
}

/// What is counted over an episode.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeCounts {
    /// Cycles that were answered.
    pub cycles: u64,
    /// Plan switches with a cause.
    pub replans: u64,
    /// Steps that did what they were to do.
    pub skills_done: u64,
    /// Steps that did not.
    pub skills_failed: u64,
}

impl From<Stop> for Verdict {
    fn from(stop: Stop) -> Self {
        Self::Stopped(stop)
    }
}

/// How an episode has ended, as the executor announces it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EpisodeEnd {
    /// The last frame that was looked at.
    pub cause: FrameRef,
    /// How the episode has ended, and why.
    pub verdict: Verdict,
    /// What was counted.
    pub counts: EpisodeCounts,
    /// The plan that was followed, without what had been done.
    pub remaining: Vec<Step>,
}

/// Which scene and plan one command rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DecisionMessage {
    /// Number of the command in the executor's stream of commands.
    pub sequence: u64,
    /// The scene's frame.
    pub cause: FrameRef,
    /// Cycle of the scene that the plan was made for; older than `cause` when the planner is late.
    pub plan_cycle: u64,
    /// Which kind of answer the command is.
    pub kind: AnswerKind,
    /// Monotonic clock once the command had been sent, nanoseconds (latency only).
    pub answered_ns: u64,
    /// Whether the episode ends with it.
    pub is_last: bool,
}
