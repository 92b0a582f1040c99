//! State grounding: boxes in, facts in the domain's vocabulary out.
//!
//! Grounders are parts: each is one file with one line in [`GROUNDERS`].

mod perception;
mod appearance;
mod constraints;
mod object_box;
mod entries;
mod exemplar;
mod candidates;
mod masks;
mod features;
mod judged;
mod examples;
mod nearest;
mod joint;
mod proprioception;
mod completion;

pub use appearance::{Appearance, DepthRule, Naming, Order, Shape, Srgb, TypeSpec};
pub use candidates::{CandidateSlots, slots, tuples};
pub use completion::{complete, facts_of, merged};
pub use constraints::Constraints;
pub use entries::json_entries;
pub use exemplar::{Exemplar, ExemplarError, ExemplarText, Exemplars};
pub use features::{FEATURE_LENGTH_MAX, FEATURES, Feature, FeatureVector, Needs, feature_by_name};
pub use judged::{Basis, Doubt, Evidence, Grounding, Judged};
pub use nearest::S2s;
pub use object_box::ObjectBox;
pub use perception::{Implied, ObservedSpec, Perception, PerceptionError, Proprioceptive, When};
pub use proprioception::{Grip, proprioception};

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
