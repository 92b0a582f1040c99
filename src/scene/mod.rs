//! The domain-conditioned scene graph: objects of the domain's types, facts over its predicates.

mod object;
mod anomaly;
mod graph;

pub use anomaly::{Anomaly, Place};
pub use graph::{FrameRef, Origin, Scene, SceneFact};
pub use object::{SceneObject, Visibility};
