//! What grounding needs to know of an object: who it is, of what type, where in the image.

use crate::geometry::{Aabb, Mask, PixelBox};
use crate::pddl::Name;

/// A named, typed box in the image.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectBox {
    /// The object's identity.
    pub name: Name,
    /// The most special type that is known of it.
    pub type_name: Name,
    /// Its box, in pixels of the image it was seen in.
    pub pixel_box: PixelBox,
    /// Its volume in the world frame, where depth and camera pose are known.
    pub volume: Option<Aabb>,
    /// Its pixels, top to bottom and left to right, where the detector tells them.
    pub mask: Option<Mask>,
}

impl ObjectBox {
    /// An object of which nothing but its box is known.
    pub fn new(name: Name, type_name: Name, pixel_box: PixelBox) -> Self {
        Self { name, type_name, pixel_box, volume: None, mask: None }
    }
}
