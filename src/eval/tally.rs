//! What is booked while an episode runs.

use std::collections::BTreeMap;

use sha2::{Digest as _, Sha256};

use crate::executive::{AnswerKind, Counts, Decision, Verdict};
use crate::messages::{CommandKind, PlanMessage, PlanVerdict, Scene};
use crate::pddl::Step;
use crate::telemetry::Latency;

/// How an episode ended, as the executor announces it.
#[derive(Debug, Clone)]
pub struct EpisodeEnd {
    /// The verdict.
    pub verdict: Verdict,
    /// What was counted.
    pub counts: Counts,
    /// What was booked.
    pub tally: Tally,
    /// The plan that was followed, without what had been done.
    pub remaining: Vec<Step>,
    /// The last scene.
    pub scene: Option<Scene>,
}

/// Latencies, and a hash over every decision.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    frame_to_command: BTreeMap<AnswerKind, Latency>,
    /// Pixels → detections.
    pub detect: Latency,
    /// Detections → scene graph.
    pub ground: Latency,
    /// Scene graph → plan.
    pub plan: Latency,
    /// How often each rung of the replanning ladder has answered.
    pub rungs: BTreeMap<&'static str, u64>,
    hash: Sha256,
    first_ns: Option<u64>,
    last_ns: u64,
}

impl Tally {
    /// Run time between the first and the last frame, seconds.
    pub fn run_seconds(&self) -> f64 {
        self.last_ns.saturating_sub(self.first_ns.unwrap_or(self.last_ns)) as f64 / 1e9
    }

    /// Books one answered frame. `now_ns` is the monotonic clock after the command was sent.
    pub fn count(&mut self, scene: &Scene, plan: &PlanMessage, decision: &Decision, now_ns: u64) {
        let latency_us = now_ns.saturating_sub(plan.cause.frame_send_ns) / 1000;
        self.frame_to_command.entry(decision.kind).or_default().record_us(latency_us);
        self.detect.record_us(scene.detect_us.into());
        self.ground.record_us(scene.ground_us.into());
        self.plan.record_us(plan.plan_us.into());
        if let Some(rung) = plan.rung {
            *self.rungs.entry(rung.name()).or_default() += 1;
        }
        self.first_ns.get_or_insert(scene.cause.capture_ns);
        self.last_ns = scene.cause.capture_ns;
        self.digest(scene, plan, decision);
    }

    /// Frame → command latencies of one kind of answer.
    pub fn frame_to_command(&self, kind: AnswerKind) -> Latency {
        self.frame_to_command.get(&kind).cloned().unwrap_or_default()
    }

    /// SHA-256 over what was believed, planned and commanded in every cycle, in hexadecimal.
    pub fn decision_hash(&self) -> String {
        let digest = self.hash.clone().finalize();
        digest.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
    }

    /// No wall-clock value enters: the same decisions give the same hash on any machine.
    fn digest(&mut self, scene: &Scene, plan: &PlanMessage, decision: &Decision) {
        let mut word = |text: &str| {
            self.hash.update(text.as_bytes());
            self.hash.update([0]);
        };
        let cause = &scene.cause;
        word(&format!("{} {} {}", cause.cycle, cause.frame_sequence, cause.capture_ns));
        for fact in &scene.facts {
            word(&format!("{} {:?} {:?}", fact.atom, fact.raw, fact.confirmed));
        }
        match &plan.verdict {
            PlanVerdict::Plan { steps, cost } => {
                word(&format!("plan {cost}"));
                for step in steps {
                    word(&step.to_string());
                }
            }
            PlanVerdict::Unsolvable { .. }
            | PlanVerdict::OutOfBudget { .. }
            | PlanVerdict::Unsupported { .. }
            | PlanVerdict::Missing { .. }
            | PlanVerdict::Inconsistent { .. } => word(&format!("{:?}", plan.verdict)),
        }
        let command = &decision.command;
        word(&format!("{} {}", command.id, command.label));
        match &command.kind {
            CommandKind::Start(motion) => {
                for waypoint in &motion.waypoints {
                    let p = waypoint.position;
                    word(&format!("{:x} {:x} {:x}", p.x.to_bits(), p.y.to_bits(), p.z.to_bits()));
                }
            }
            CommandKind::Continue | CommandKind::BreakOff | CommandKind::Hold => {
                word(&format!("{:?}", command.kind));
            }
        }
        if let Some(verdict) = &decision.verdict {
            word(&verdict.to_string());
        }
    }
}
