//! Objects: the vertices of a domain-conditioned scene graph.

use crate::geometry::{Aabb, PixelBox};
use crate::pddl::Name;

/// How an object is known in this frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Visibility {
    /// Seen in this frame.
    Visible,
    /// Not seen, but remembered from an earlier frame.
    Hidden,
    /// At the tool of the robot, which says so.
    Held,
    /// Never seen; the domain says that it is there (the robot itself).
    Implied,
}

/// One object, with the name that stays with it through the episode.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneObject {
    /// Its identity.
    pub name: Name,
    /// Its PDDL type.
    pub type_name: Name,
    /// Where it was last seen in the image; `None` for an implied object.
    pub pixel_box: Option<PixelBox>,
    /// Where it was last seen in the world, where depth and camera pose are known.
    pub volume: Option<Aabb>,
    /// The detector's confidence in 0..=1.
    pub score: f32,
    /// How it is known now.
    pub visibility: Visibility,
    /// Capture stamp of the frame that showed it last.
    pub seen_ns: u64,
}
