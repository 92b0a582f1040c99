//! How a domain's objects and facts are perceived: `perception.toml` and the labelled examples.

mod error;
mod object_box;
mod entries;
mod appearance;
pub(crate) mod constraints;
pub(crate) mod perception;
mod exemplar;
mod masks;
mod scaled;
pub(crate) mod features;

pub use appearance::{Appearance, DepthRule, Naming, Order, Shape, Srgb, TypeSpec};
pub use constraints::Constraints;
pub use entries::json_entries;
pub use error::PerceptionError;
pub use exemplar::{
    Exemplar, ExemplarError, ExemplarText, Exemplars, UNDECIDED, UndecidedFact, undecided_facts,
};
pub use features::{FEATURE_LENGTH_MAX, FEATURES, Feature, FeatureVector, Needs, feature_by_name};
pub use object_box::ObjectBox;
pub use perception::{Implied, ObservedSpec, Perception, Proprioceptive, When};
pub use scaled::{OtherRatio, RATIO_OFF_MAX};
