//! What really was in a simulated world, for judging an episode that has ended. Nothing in the loop may
//! ask.

use std::collections::BTreeSet;

use crate::pddl::{Atom, Name, Step};

/// What really is in a simulated world.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct GroundTruth {
    /// The facts that hold, in the domain's words for relations between bodies.
    pub facts: BTreeSet<Atom>,
    /// The object in the gripper.
    pub held: Option<Name>,
    /// The objects that are there.
    pub objects: BTreeSet<Name>,
    /// Those of them that move, lean, or stand on several others at once: of these it is not sure what holds.
    pub unsettled: BTreeSet<Name>,
    /// Groups of objects that differ in nothing but name and place: no camera can tell which of
    /// them bears which name.
    pub look_alikes: Vec<Vec<Name>>,
}

/// The world as it was from one frame on, until the next moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrueMoment {
    /// Number of the first frame that shows it so.
    pub frame_sequence: u64,
    /// What held.
    pub truth: GroundTruth,
    /// The objects that a camera shows well enough to know them.
    pub seen: BTreeSet<Name>,
}

/// A step that the robot was told to carry out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrueDispatch {
    /// Number of the frame that it answered.
    pub frame_sequence: u64,
    /// The step.
    pub step: Step,
}

/// An episode of a simulated world.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TrueHistory {
    /// What holds now.
    pub now: GroundTruth,
    /// What held, in order of the frames; only moments that differ from the one before.
    pub moments: Vec<TrueMoment>,
    /// What the robot was told, in order.
    pub dispatches: Vec<TrueDispatch>,
}

impl TrueHistory {
    /// The moment that a frame shows.
    pub fn at(&self, frame_sequence: u64) -> Option<&TrueMoment> {
        let later = self.moments.partition_point(|m| m.frame_sequence <= frame_sequence);
        later.checked_sub(1).map(|idx| &self.moments[idx])
    }
}
