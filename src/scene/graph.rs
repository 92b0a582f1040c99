//! The domain-conditioned scene graph of one frame.

use std::collections::BTreeSet;

use super::{Anomaly, SceneObject};
use crate::logic::{Facts, Truth};
use crate::pddl::{Atom, Typed};

/// What a message rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FrameRef {
    /// Number of the cycle.
    pub cycle: u64,
    /// Number of the frame.
    pub frame_sequence: u64,
    /// Its capture stamp, run time in nanoseconds.
    pub capture_ns: u64,
    /// When it was sent, monotonic nanoseconds; for latency figures only.
    pub frame_send_ns: u64,
}

/// How a fact came to be known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// Judged in this frame's picture.
    Observed,
    /// Judged in this frame by a constraint of the domain, otherwise than by its own feature.
    Constrained,
    /// Told by the robot about itself.
    Proprioceptive,
    /// Derived by a completion rule.
    Completed,
    /// Kept from an earlier frame.
    Remembered,
    /// Expected from a skill that has ended, where the picture cannot show it.
    Predicted,
}

/// One fact: what this frame says and what is believed.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneFact {
    /// Ground atom of an observed predicate.
    pub atom: Atom,
    /// What this frame alone says; for people and recordings.
    pub raw: Truth,
    /// What is believed; for the planner and the executor.
    pub confirmed: Truth,
    /// How it came to be known.
    pub origin: Origin,
    /// Distance-based confidence of the raw judgement, 0..=1.
    pub confidence: f32,
}

/// The domain-conditioned scene graph of one frame.
///
/// `facts` lists every atom that is raw or confirmed true or unknown, or predicted; all others are false.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scene {
    /// The frame.
    pub cause: FrameRef,
    /// The vertices.
    pub objects: Vec<SceneObject>,
    /// The edges (and unary facts).
    pub facts: Vec<SceneFact>,
    /// What no set of facts explains, seen for long enough to count: reasons to look again.
    pub anomalies: Vec<Anomaly>,
    /// How many facts differ from what is believed and are not confirmed yet.
    pub unsettled: u32,
    /// Time spent finding objects, microseconds (latency only).
    pub detect_us: u32,
    /// Time spent on facts, microseconds (latency only).
    pub ground_us: u32,
}

impl Scene {
    /// What is believed.
    pub fn confirmed(&self) -> Facts {
        let mut facts = Facts::default();
        for fact in &self.facts {
            facts.set(fact.atom.clone(), fact.confirmed);
        }
        facts
    }

    /// The object of that name.
    pub fn object(&self, name: &str) -> Option<&SceneObject> {
        self.objects.iter().find(|object| object.name == name)
    }

    /// The objects as PDDL declares them, in order of their names.
    pub fn typed_objects(&self) -> Vec<Typed> {
        let typed: BTreeSet<Typed> =
            self.objects.iter().map(|o| Typed::new(o.name.clone(), o.type_name.clone())).collect();
        typed.into_iter().collect()
    }
}
