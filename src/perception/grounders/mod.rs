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
use crate::parts::{PartError, Registry, Role};
use crate::pddl::Domain;

/// Turns object boxes into judged facts. Pure: the same boxes give the same facts, in any order
/// of the boxes.
pub trait Grounder: Send + Sync {
    /// Judges every type-valid tuple of every observed predicate, in a fixed order.
    fn ground(&self, objects: &[ObjectBox]) -> Grounding;
}

/// What grounders are made from.
#[derive(Debug, Clone, Copy)]
pub struct GrounderInputs<'a> {
    /// The domain.
    pub domain: &'a Domain,
    /// How it is seen.
    pub perception: &'a Perception,
    /// The labelled examples.
    pub exemplars: &'a Exemplars,
}

impl Role for dyn Grounder {
    type Inputs<'a> = GrounderInputs<'a>;
    const NAME: &'static str = "grounder";
    const KEY: &'static str = "perception.grounder";
    const OPTIONS: &'static str = "perception.grounder_options";
}

impl From<PerceptionError> for PartError {
    fn from(error: PerceptionError) -> Self {
        Self::Inputs { reason: error.to_string() }
    }
}

/// Every grounder by its name in configuration files, in alphabetical order.
pub static GROUNDERS: Registry<dyn Grounder> = Registry(&[nearest::PART, joint::PART]);
