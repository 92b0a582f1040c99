//! What the facts cannot explain.

use std::fmt;

use crate::pddl::Name;

/// Something that the facts cannot explain: an object without support, a gap in a stack, a missing
/// fixture. What depends on it is unknown.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Anomaly {
    /// The objects in question, at least one.
    pub objects: Vec<Name>,
    /// What is wrong, for people; the objects complete it: "a gap between" a and b.
    pub reason: String,
}

impl fmt::Display for Anomaly {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let objects: Vec<&str> = self.objects.iter().map(Name::as_str).collect();
        write!(f, "{} {}", self.reason, objects.join(" and "))
    }
}
