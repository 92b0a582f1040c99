//! State grounding: boxes in, facts in the domain's vocabulary out.
//!
//! Grounders are parts: each is one file with one line in [`GROUNDERS`].

mod candidates;
mod judged;
mod examples;
mod nearest;
mod joint;

pub use candidates::{CandidateSlots, slots, tuples};
pub use judged::{Basis, Evidence, Grounding, Judged};
pub use nearest::S2s;

use super::model::{Exemplars, ObjectBox, Perception, PerceptionError};
use crate::pddl::Domain;

/// Turns object boxes into judged facts. Pure: the same boxes give the same facts, in any order
/// of the boxes.
pub trait Grounder: Send + Sync {
    /// Judges every type-valid tuple of every observed predicate, in a fixed order.
    fn ground(&self, objects: &[ObjectBox]) -> Grounding;
}

/// Makes a grounder for one domain from its labelled examples.
pub type Build = fn(&Domain, &Perception, &Exemplars) -> Result<Box<dyn Grounder>, PerceptionError>;

/// Every grounder by its name in configuration files, in alphabetical order.
pub const GROUNDERS: &[(&str, Build)] = &[("s2s", nearest::build), ("s2s-joint", joint::build)];
