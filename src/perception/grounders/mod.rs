//! State grounding: boxes in, facts in the domain's vocabulary out.
//!
//! Grounders are parts: each is one file with one line in [`GROUNDERS`].

mod candidates;
mod judged;
mod nearest_index;
mod s2s;
mod s2s_joint;

pub use candidates::{CandidateSlots, slots, tuples};
pub use judged::{Basis, Evidence, Grounding, Judged};
pub use s2s::S2s;

use thiserror::Error;

use super::Observation;
use super::model::{Exemplars, Perception, PerceptionError};
use crate::http::WebError;
use crate::parts::{PartError, Registry, Role};
use crate::pddl::{Domain, Name};

/// Turns objects, in the frame that shows them, into judged facts. The same observation gives the
/// same facts, in any order of the objects.
pub trait Grounder: Send + Sync {
    /// Judges every type-valid tuple of the observed predicates that it can judge, in the order of
    /// the atoms.
    ///
    /// # Errors
    /// [`GrounderError`] when something that it asks does not answer. One that rests on boxes alone
    /// never fails.
    fn ground(&self, observation: &Observation<'_>) -> Result<Grounding, GrounderError>;

    /// Whether it looks at the pixels: then [`super::FrameView::image`] must be there.
    fn needs_image(&self) -> bool {
        false
    }

    /// Predicates that the examples do not teach, so that they may be unknown; for a word at the start.
    fn untaught(&self) -> Vec<&Name> {
        Vec::new()
    }

    /// Whether one frame takes longer than the loop should wait for: then detector and grounder work
    /// beside it, as with [`super::detectors::Detector::is_slow`].
    fn is_slow(&self) -> bool {
        false
    }
}

/// A grounder cannot judge a frame.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum GrounderError {
    /// A service does not answer, or refuses.
    #[error(transparent)]
    Service(#[from] WebError),
    /// A service or a model answers what cannot be used.
    #[error("{source_name}: {message}")]
    Reply {
        /// The service without secrets, or the model's file.
        source_name: String,
        /// What was expected and what came.
        message: String,
    },
    /// Something that it needs is missing: exit code 5.
    #[error("{what} is missing: {how}")]
    Missing {
        /// Such as the frame's image.
        what: String,
        /// How to get it.
        how: String,
    },
}

impl GrounderError {
    /// Whether something outside is missing that may be there another time: exit code 5.
    pub fn is_missing(&self) -> bool {
        match self {
            Self::Missing { .. } => true,
            Self::Service(error) => error.is_absent(),
            Self::Reply { .. } => false,
        }
    }
}

/// What grounders are made from.
#[derive(Debug, Clone, Copy)]
pub struct GrounderInputs<'a> {
    /// Whose predicates are judged.
    pub domain: &'a Domain,
    /// Which of them are observed, by which features, under which constraints.
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
pub static GROUNDERS: Registry<dyn Grounder> = Registry(&[s2s::PART, s2s_joint::PART]);
