//! One cycle of an episode, as figures and hashes look at it.

use crate::messages::{AnswerKind, Command, PlanMessage, Verdict};
use crate::scene::Scene;

/// One answered frame: what was seen, planned and commanded.
#[derive(Debug, Clone, Copy)]
pub struct AnsweredCycle<'a> {
    /// The scene that the command rests on.
    pub scene: &'a Scene,
    /// The plan that it rests on.
    pub plan: &'a PlanMessage,
    /// What the robot was told.
    pub command: &'a Command,
    /// Which kind of answer it is.
    pub kind: AnswerKind,
    /// How the episode ends with it, if it does.
    pub verdict: Option<&'a Verdict>,
    /// Monotonic clock once the command had been sent, nanoseconds (latency only).
    pub answered_ns: u64,
}
