//! The domain-conditioned scene graph: objects of the domain's types, facts over its predicates.

mod truth;
mod facts;
mod object;

pub use facts::Facts;
pub use object::{SceneObject, Visibility, Volume};
pub use truth::Truth;
