//! What is kept of an episode: what is the same on every machine, and what it cost on this one.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::EpisodePlan;
use crate::messages::Verdict;
use crate::metrics::EpisodeReport;

/// One episode: in lockstep the same on every machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SweepRecord {
    /// Its number in the sweep, from 0.
    pub index: u64,
    /// Its point, from 0: episodes of one point differ in their seeds only.
    pub point: u64,
    /// Its seed.
    pub seed: u64,
    /// The level of each factor.
    pub factors: BTreeMap<String, String>,
    /// How it ended; `error` when it ended without a verdict.
    pub verdict: String,
    /// Why, in words.
    pub reason: String,
    /// Whether the goal holds in the simulated world; `null` outside the simulator.
    pub goal_in_simulator: Option<bool>,
    /// Cycles that were answered.
    pub cycles: u64,
    /// Plan switches with a cause.
    pub replans: u64,
    /// Steps whose effects were observed.
    pub skills_done: u64,
    /// Steps that failed.
    pub skills_failed: u64,
    /// Length in run time, seconds.
    pub sim_seconds: f64,
    /// Faults that happened.
    pub faults: u64,
    /// Steps that were started.
    pub dispatches: u64,
    /// Those whose precondition did not really hold.
    pub against_truth: u64,
    /// Those of them that went against what could be known.
    pub against_evidence: u64,
    /// SHA-256 over every decision.
    pub decision_hash: String,
}

/// What an episode cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SweepTiming {
    /// The episode's number in the sweep.
    pub index: u64,
    /// Wall-clock time, seconds.
    pub wall_s: f64,
    /// CPU time of its process, all threads, seconds.
    pub cpu_s: f64,
    /// CPU time per frame, milliseconds.
    pub cpu_ms_per_frame: f64,
}

/// One line of a shard in the making.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepLine {
    /// What is the same on every machine.
    pub record: SweepRecord,
    /// What it cost; none when it ended without a verdict.
    pub timing: Option<SweepTiming>,
}

/// The verdict of an episode that ended without one.
pub(super) const ERROR: &str = "error";

impl SweepRecord {
    /// Whether it ended without a verdict.
    pub fn is_error(&self) -> bool {
        self.verdict == ERROR
    }

    /// Whether the goal is said to be reached, or the plan of an open loop executed, and nothing says that it does
    /// not really hold.
    pub fn is_success(&self) -> bool {
        let says_so = [Verdict::Reached.word(), Verdict::Executed.word()];
        says_so.contains(&self.verdict.as_str()) && self.goal_in_simulator != Some(false)
    }

    /// Whether the loop says that the goal is reached, and in the simulated world it is not.
    pub fn is_false(&self) -> bool {
        self.verdict == Verdict::Reached.word() && self.goal_in_simulator == Some(false)
    }

    /// Whether something is so that must never be: a false "reached", a step against what could be known.
    pub fn is_wrong(&self) -> bool {
        self.is_false() || self.against_evidence > 0
    }
}

impl SweepLine {
    /// What an episode came to; `Err` is why it ended without a verdict.
    pub fn new(plan: &EpisodePlan, ended: Result<&EpisodeReport, &str>) -> Self {
        let factors = plan.settings.iter().map(|s| (s.factor.clone(), s.level.clone())).collect();
        let mut record = SweepRecord {
            index: plan.index,
            point: plan.point,
            seed: plan.seed,
            factors,
            verdict: ERROR.to_owned(),
            reason: String::new(),
            goal_in_simulator: None,
            cycles: 0,
            replans: 0,
            skills_done: 0,
            skills_failed: 0,
            sim_seconds: 0.0,
            faults: 0,
            dispatches: 0,
            against_truth: 0,
            against_evidence: 0,
            decision_hash: String::new(),
        };
        let report = match ended {
            Ok(report) => report,
            Err(reason) => {
                reason.clone_into(&mut record.reason);
                return Self { record, timing: None };
            }
        };
        report.verdict.clone_into(&mut record.verdict);
        record.reason.clone_from(&report.reason);
        record.goal_in_simulator = report.goal_in_simulator;
        record.cycles = report.cycles;
        record.replans = report.replans;
        record.skills_done = report.skills_done;
        record.skills_failed = report.skills_failed;
        record.sim_seconds = report.sim_seconds;
        record.faults = report.faults.iter().filter(|fault| fault.happened).count() as u64;
        if let Some(audit) = &report.dispatches {
            record.dispatches = audit.n_dispatches;
            record.against_truth = audit.against_truth.len() as u64;
            record.against_evidence = audit.n_against_evidence;
        }
        record.decision_hash.clone_from(&report.decision_hash);
        let timing = SweepTiming {
            index: plan.index,
            wall_s: report.wall_seconds,
            cpu_s: report.cpu_ms_per_frame * report.frames as f64 / 1000.0,
            cpu_ms_per_frame: report.cpu_ms_per_frame,
        };
        Self { record, timing: Some(timing) }
    }
}
