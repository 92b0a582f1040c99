//! One episode as a report: the JSON of `groundloop run --json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{EpisodeResult, Quantiles};
use crate::messages::AnswerKind;

/// The report of one episode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EpisodeReport {
    /// `reached`, `planned` (no robot), `unsolvable`, `gave-up` or `stopped`.
    pub verdict: &'static str,
    /// Why, in one sentence; a met bound is named by its key.
    pub reason: String,
    /// The seed.
    pub seed: u64,
    /// Cycles that were answered.
    pub cycles: u64,
    /// Frames that the camera has sent.
    pub frames: u64,
    /// Plan switches with a cause.
    pub replans: u64,
    /// Steps that did what they were to do.
    pub skills_done: u64,
    /// Steps that did not.
    pub skills_failed: u64,
    /// Length of the episode in run time.
    pub sim_seconds: f64,
    /// Length of the episode on the clock on the wall.
    pub wall_seconds: f64,
    /// Processor time of the process per frame, all threads.
    pub cpu_ms_per_frame: f64,
    /// How often each source of the plan-reuse cascade has answered.
    pub rungs: BTreeMap<&'static str, u64>,
    /// SHA-256 over every decision.
    pub decision_hash: String,
    /// Latencies, microseconds.
    pub latency_us: Latencies,
    /// What had not been done of the plan that was followed.
    pub plan: Vec<String>,
    /// The goal.
    pub goal: String,
    /// Whether the goal really holds, where the simulator knows.
    pub goal_in_simulator: Option<bool>,
    /// The facts believed at the end.
    pub facts: Vec<String>,
}

/// Latencies by stage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Latencies {
    /// From the frame's sending to the command's sending, by kind of answer.
    pub frame_to_command: BTreeMap<&'static str, Quantiles>,
    /// Pixels → detections.
    pub detect: Quantiles,
    /// Detections → scene graph.
    pub ground: Quantiles,
    /// Scene graph → plan.
    pub plan: Quantiles,
}

/// The kinds of answers by their names in reports.
const KINDS: [(&str, AnswerKind); 3] = [
    ("continue", AnswerKind::Continue),
    ("dispatch", AnswerKind::Dispatch),
    ("replan", AnswerKind::Replan),
];

impl Latencies {
    /// The quantiles of what an episode has booked.
    pub fn of(end: &EpisodeResult) -> Self {
        let tally = &end.tally;
        let by_kind = KINDS.map(|(name, kind)| (name, tally.frame_to_command(kind).quantiles()));
        Self {
            frame_to_command: by_kind.into_iter().collect(),
            detect: tally.detect.quantiles(),
            ground: tally.ground.quantiles(),
            plan: tally.plan.quantiles(),
        }
    }
}
