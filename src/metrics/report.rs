//! One episode as a report: the JSON of `groundloop run --json`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::{EpisodeResult, Quantiles};
use crate::messages::{AnswerKind, Verdict};

/// What `groundloop run --json` prints of one episode.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct EpisodeReport {
    /// How it ended; `planned` is the end of a run without a robot.
    #[schemars(extend("enum" = Verdict::WORDS))]
    pub verdict: &'static str,
    /// Why, in words; a limit that was met is named by its key in the run file.
    pub reason: String,
    /// The seed of the episode.
    pub seed: u64,
    /// Cycles that were answered.
    pub cycles: u64,
    /// Frames that the camera has sent.
    pub frames: u64,
    /// Plan switches with a cause.
    pub replans: u64,
    /// Steps whose effects were observed.
    pub skills_done: u64,
    /// Steps that failed.
    pub skills_failed: u64,
    /// Length of the episode in run time, which the camera's stamps tell, in seconds.
    pub sim_seconds: f64,
    /// Length of the episode in wall-clock time, in seconds.
    pub wall_seconds: f64,
    /// CPU time of the process per frame, all threads, in milliseconds.
    pub cpu_ms_per_frame: f64,
    /// How often each source of the plan-reuse cascade has answered.
    pub rungs: BTreeMap<&'static str, u64>,
    /// SHA-256 over every decision.
    pub decision_hash: String,
    /// Latencies in microseconds.
    pub latency_us: Latencies,
    /// The steps of the last plan that were not done, each as `(action object …)`.
    pub plan: Vec<String>,
    /// The goal as a PDDL condition; empty if it was never known.
    pub goal: String,
    /// Whether the goal holds in the simulated world; `null` outside the simulator.
    pub goal_in_simulator: Option<bool>,
    /// The facts that were confirmed at the end.
    pub facts: Vec<String>,
    /// The faults of the run file that happened, and those that could not, in order.
    pub faults: Vec<FaultRecord>,
    /// The steps that were started, judged by what was really so; `null` outside the simulator.
    pub dispatches: Option<DispatchAudit>,
}

impl EpisodeReport {
    /// Whether the loop says that the goal is reached, and in the simulated world it is not.
    pub fn is_false(&self) -> bool {
        self.verdict == Verdict::Reached.word() && self.goal_in_simulator == Some(false)
    }

    /// How many steps were started against what could be known.
    pub fn n_against_evidence(&self) -> u64 {
        self.dispatches.as_ref().map_or(0, |audit| audit.n_against_evidence)
    }
}

/// One occurrence of a `[[fault]]`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FaultRecord {
    /// When, in nanoseconds of simulated time; of actors and messages in run time since the start, 0
    /// before anything was captured.
    pub at_ns: u64,
    /// Which `[[fault]]` of the run file, counted from 0.
    pub fault: usize,
    /// What: the `kind` of its action.
    pub kind: String,
    /// Whom it concerned, by their names in the simulated world; nobody for actors and messages.
    pub objects: Vec<String>,
    /// Whether it happened.
    pub happened: bool,
    /// What was done, or why nothing was.
    pub said: String,
    /// Number of the first frame that can show it; 0 for faults of the system.
    pub frame: u64,
    /// How many frames later the loop no longer believed anything that it had made false; `null` where it
    /// made nothing false that was believed, or the loop never noticed.
    pub noticed_after_frames: Option<u64>,
    /// How many frames later no more steps were left than just before it; `null` where that never came.
    pub recovered_after_frames: Option<u64>,
}

/// The steps that the robot was told to carry out, judged by what was really so.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct DispatchAudit {
    /// How many there were.
    pub n_dispatches: u64,
    /// Those whose precondition did not really hold, in order.
    pub against_truth: Vec<UntrueDispatch>,
    /// How many of these went against what could be known: it had been false, and all that it speaks of in
    /// sight, for as long as a change takes to be believed. There must be none.
    pub n_against_evidence: u64,
}

impl DispatchAudit {
    /// Judges an open loop: it has looked once, before its first step, so nothing was evidence to it.
    pub fn without_evidence(&mut self) {
        self.against_truth.iter_mut().for_each(|step| step.is_against_evidence = false);
        self.n_against_evidence = 0;
    }
}

/// A step that was started though its precondition did not really hold.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct UntrueDispatch {
    /// Number of the frame that it answered.
    pub frame: u64,
    /// The step, as `(action object …)`.
    pub step: String,
    /// The parts of its precondition that did not hold.
    pub unmet: Vec<String>,
    /// For how many frames it had not held, that one included.
    pub untrue_for_frames: u64,
    /// Whether it went against what could be known.
    pub is_against_evidence: bool,
}

/// Latencies by stage, in microseconds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Latencies {
    /// From the frame's sending to the command's sending, by kind of answer.
    pub frame_to_command: BTreeMap<&'static str, Quantiles>,
    /// From pixels to detections.
    pub detect: Quantiles,
    /// From detections to the scene graph.
    pub ground: Quantiles,
    /// From the scene graph to the plan.
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
