//! What is booked while an episode runs.

use std::collections::BTreeMap;

use super::{AnsweredCycle, DecisionHash, Latency};
use crate::messages::{AnswerKind, EpisodeCounts, Verdict};
use crate::pddl::Step;
use crate::scene::Scene;

/// How an episode ended, with all that was measured.
#[derive(Debug, Clone)]
pub struct EpisodeResult {
    /// How the episode has ended, and why.
    pub verdict: Verdict,
    /// What was counted.
    pub counts: EpisodeCounts,
    /// What was booked.
    pub tally: EpisodeMetrics,
    /// The plan that was followed, without what had been done.
    pub remaining: Vec<Step>,
    /// The last scene.
    pub scene: Option<Scene>,
}

/// Latencies, and a hash over every decision.
#[derive(Debug, Clone, Default)]
pub struct EpisodeMetrics {
    frame_to_command: BTreeMap<AnswerKind, Latency>,
    /// Pixels → detections.
    pub detect: Latency,
    /// Detections → scene graph.
    pub ground: Latency,
    /// Scene graph → plan.
    pub plan: Latency,
    /// How often each source of the replanning ladder has answered.
    pub rungs: BTreeMap<&'static str, u64>,
    decisions: DecisionHash,
    first_ns: Option<u64>,
    last_ns: u64,
}

impl EpisodeMetrics {
    /// Run time between the first and the last frame, seconds.
    pub fn run_seconds(&self) -> f64 {
        self.last_ns.saturating_sub(self.first_ns.unwrap_or(self.last_ns)) as f64 / 1e9
    }

    /// Books one answered frame.
    pub fn count(&mut self, cycle: &AnsweredCycle<'_>) {
        let AnsweredCycle { scene, plan, kind, answered_ns, .. } = *cycle;
        let latency_us = answered_ns.saturating_sub(plan.cause.frame_send_ns) / 1000;
        self.frame_to_command.entry(kind).or_default().record_us(latency_us);
        self.detect.record_us(scene.detect_us.into());
        self.ground.record_us(scene.ground_us.into());
        self.plan.record_us(plan.plan_us.into());
        if let Some(source) = plan.source {
            *self.rungs.entry(source.name()).or_default() += 1;
        }
        self.first_ns.get_or_insert(scene.cause.capture_ns);
        self.last_ns = scene.cause.capture_ns;
        self.decisions.add(cycle);
    }

    /// Frame → command latencies of one kind of answer.
    pub fn frame_to_command(&self, kind: AnswerKind) -> Latency {
        self.frame_to_command.get(&kind).cloned().unwrap_or_default()
    }

    /// The [`DecisionHash`] of the cycles so far, in hexadecimal.
    pub fn decision_hash(&self) -> String {
        self.decisions.hex()
    }
}
