//! What a grounder says of one image.

use std::sync::Arc;

use crate::logic::Truth;
use crate::pddl::Atom;
use crate::scene::Anomaly;

/// Everything that a grounder says of one set of objects.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grounding {
    /// Every judged tuple, in order of its atom.
    pub judged: Vec<Judged>,
    /// What the facts cannot explain: reasons to look again.
    pub anomalies: Vec<Anomaly>,
}

/// A judged tuple with what the judgement rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Predicate and objects.
    pub atom: Atom,
    /// Whether it was judged to hold.
    pub truth: Truth,
    /// What the judgement rests on.
    pub basis: Basis,
    /// Distance to the nearest example that holds, in the feature's unit (pixels).
    pub d_pos: f64,
    /// Distance to the nearest example that does not hold, likewise.
    pub d_neg: f64,
    /// The nearest example that holds.
    pub nearest_pos: Arc<Evidence>,
    /// The nearest example that does not hold.
    pub nearest_neg: Arc<Evidence>,
}

/// What a judgement rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Basis {
    /// The tuple's own feature.
    Observed,
    /// A constraint of the domain together with other facts.
    Constrained,
}

/// One example tuple that a judgement rests on.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Evidence {
    /// Which labelled example it is from.
    pub exemplar: String,
    /// The tuple, with the example's object names.
    pub atom: Atom,
}

impl Judged {
    /// How clear the judgement is, from -1 (like an example that does not hold) to 1 (like one
    /// that does); 0 is undecided.
    pub fn confidence(&self) -> f64 {
        let sum = self.d_neg + self.d_pos;
        if sum > 0.0 { (self.d_neg - self.d_pos) / sum } else { 0.0 }
    }
}
