//! The domain-conditioned scene graph: objects of the domain's types, facts over its predicates.

mod object;
mod doubt;
mod graph;

pub use doubt::Doubt;
pub use graph::{Cause, Origin, Scene, SceneFact};
pub use object::{SceneObject, Visibility};
