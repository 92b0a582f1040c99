//! What the facts cannot explain.

use std::fmt;

use crate::geometry::PixelBox;
use crate::pddl::Name;

/// Something that the facts cannot explain: an object without support, a gap in a stack, a missing
/// fixture, a thing in front. What depends on it is unknown.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Anomaly {
    /// The objects in question.
    pub objects: Vec<Name>,
    /// What is wrong, for people; the objects complete it: "a gap between" a and b.
    pub reason: String,
    /// Where it is, when it is more than a matter of these objects.
    pub place: Option<Place>,
}

/// A place in an image, in whole pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// Left, upper, right and lower edge.
    pub edges: [u32; 4],
    /// Whether it is large enough for an object to be hidden there.
    pub may_hide: bool,
}

impl Place {
    /// The place of a box.
    pub fn new(b: &PixelBox, may_hide: bool) -> Self {
        Self { edges: [b.x1, b.y1, b.x2, b.y2].map(|v| v.round().max(0.0) as u32), may_hide }
    }

    /// The place as a box.
    pub fn pixel_box(&self) -> PixelBox {
        PixelBox::from(self.edges.map(f64::from))
    }
}

impl Anomaly {
    /// An anomaly about objects, wherever they are.
    pub fn about(objects: Vec<Name>, reason: impl Into<String>) -> Self {
        Self { objects, reason: reason.into(), place: None }
    }

    /// Whether it may hide an object that nobody has seen.
    pub fn may_hide(&self) -> bool {
        self.place.is_some_and(|place| place.may_hide)
    }
}

impl fmt::Display for Anomaly {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)?;
        if let Some(Place { edges: [x1, y1, x2, y2], .. }) = self.place {
            write!(f, " at {x1} {y1} {x2} {y2}")?;
        }
        let objects: Vec<&str> = self.objects.iter().map(Name::as_str).collect();
        match (objects.is_empty(), self.place) {
            (true, _) => Ok(()),
            (false, None) => write!(f, " {}", objects.join(" and ")),
            (false, Some(_)) => write!(f, ", next to {}", objects.join(" and ")),
        }
    }
}
