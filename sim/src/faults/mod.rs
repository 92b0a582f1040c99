//! Faults of the world: what happens to the objects behind the robot's back.

mod error;
mod gripping;
mod placing;
mod pushing;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use error::FaultError;

use crate::world::World;

/// One thing that goes wrong in the world. Written in run files with the key `kind`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum WorldFault {
    /// An object is taken away and set down on a free place of the table, upright.
    Displace {
        /// Name of a block or a disk.
        object: String,
        /// The place wanted, x and y in metres; the nearest free place is used. A seeded free
        /// place when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        to: Option<[f64; 2]>,
    },
    /// A stacked block and whatever stands on it are pushed off what they stand on.
    KnockOver {
        /// Name of a block that stands on another body.
        object: String,
    },
    /// What the gripper holds is taken out of it and set down on a free place of the table.
    TakeFromGripper {},
    /// The top disk of a peg is taken off and laid flat on the table in front of the pegs.
    BesidePeg {
        /// Name of a disk with nothing on it.
        object: String,
    },
    /// An object is taken out of the world for good; what stood on it falls.
    Remove {
        /// Name of a block or a disk.
        object: String,
    },
    /// An object that was taken out of the world is set down on a free place of the table.
    PutBack {
        /// Name of a block or a disk that `remove` or `hold` has taken away.
        object: String,
        /// The place wanted, x and y in metres; the nearest free place is used. A seeded free
        /// place when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        to: Option<[f64; 2]>,
    },
    /// Two objects with nothing on them change places.
    Swap {
        /// Names of two blocks, or disks that are around no peg.
        objects: [String; 2],
    },
    /// A whole tower is pushed, harder the higher up, until each block of it is off the one below.
    Topple {
        /// Name of any block of the tower.
        object: String,
    },
    /// A person lifts an object out of the picture, and sets it down on a free place of the table
    /// after a while; what stood on it falls.
    Hold {
        /// Name of a block or a disk.
        object: String,
        /// How long the person holds it, seconds of simulated time.
        for_s: f64,
    },
    /// What stands on the table is shifted with everything on it: a board with its pegs and disks, or
    /// the lowest block of a tower.
    Push {
        /// Name of a board, of a peg on it, or of an object on the table.
        object: String,
        /// By how much, x and y in metres.
        by_m: [f64; 2],
    },
}

impl WorldFault {
    /// The objects that it names.
    pub fn objects(&self) -> Vec<&str> {
        match self {
            Self::TakeFromGripper {} => Vec::new(),
            Self::Swap { objects } => objects.iter().map(String::as_str).collect(),
            Self::Displace { object, .. }
            | Self::KnockOver { object }
            | Self::BesidePeg { object }
            | Self::Remove { object }
            | Self::PutBack { object, .. }
            | Self::Topple { object }
            | Self::Hold { object, .. }
            | Self::Push { object, .. } => vec![object],
        }
    }

    /// The same, done to another object; a swap keeps its own.
    #[must_use]
    pub fn done_to(mut self, name: &str) -> Self {
        match &mut self {
            Self::TakeFromGripper {} | Self::Swap { .. } => {}
            Self::Displace { object, .. }
            | Self::KnockOver { object }
            | Self::BesidePeg { object }
            | Self::Remove { object }
            | Self::PutBack { object, .. }
            | Self::Topple { object }
            | Self::Hold { object, .. }
            | Self::Push { object, .. } => name.clone_into(object),
        }
        self
    }

    /// Checks its numbers.
    ///
    /// # Errors
    /// [`FaultError::BadNumber`].
    pub fn check(&self) -> Result<(), FaultError> {
        match self {
            Self::Displace { to: Some([x, y]), .. } | Self::PutBack { to: Some([x, y]), .. }
                if !(x.is_finite() && y.is_finite()) =>
            {
                Err(FaultError::BadNumber { key: "to", expected: "two finite numbers" })
            }
            Self::Hold { for_s, .. } => FaultError::check_duration(*for_s),
            Self::Push { by_m, .. } => FaultError::check_offset(*by_m),
            Self::Displace { .. }
            | Self::KnockOver { .. }
            | Self::TakeFromGripper {}
            | Self::BesidePeg { .. }
            | Self::Remove { .. }
            | Self::PutBack { .. }
            | Self::Swap { .. }
            | Self::Topple { .. } => Ok(()),
        }
    }
}

impl World {
    /// Lets a fault happen now and says what was done, for people.
    ///
    /// A knock is a push: its objects fall in the following second, and are pushed again, harder,
    /// when they did not. A shift takes its way at 0.25 m/s, and what a person holds comes back later.
    /// Everything else has happened on return.
    ///
    /// # Errors
    /// [`FaultError`] when the fault does not fit the state of the world; nothing changes then.
    pub fn apply_fault(&mut self, fault: &WorldFault) -> Result<String, FaultError> {
        fault.check()?;
        match fault {
            WorldFault::Displace { object, to } => self.displace(object, *to),
            WorldFault::KnockOver { object } => self.knock_over(object),
            WorldFault::TakeFromGripper {} => self.take_from_gripper(),
            WorldFault::BesidePeg { object } => self.beside_peg(object),
            WorldFault::Remove { object } => self.remove(object),
            WorldFault::PutBack { object, to } => self.put_back(object, *to),
            WorldFault::Swap { objects } => self.swap(objects),
            WorldFault::Topple { object } => self.topple(object),
            WorldFault::Hold { object, for_s } => self.hold(object, *for_s),
            WorldFault::Push { object, by_m } => self.shift(object, *by_m),
        }
    }

    /// Objects that a fault without a named one may be done to: what can move and stands free. For
    /// `put_back` what was taken away; for pushes and knocks also what carries others.
    pub fn fault_candidates(&self, fault: &WorldFault) -> Vec<String> {
        let fits = |idx: &usize| {
            let view = self.view(*idx);
            let is_clear = || self.with_all_above(*idx).len() == 1;
            !view.spec.is_fixed()
                && match fault {
                    WorldFault::PutBack { .. } => view.is_out,
                    WorldFault::KnockOver { .. }
                    | WorldFault::Topple { .. }
                    | WorldFault::Push { .. } => !view.held && !view.is_out,
                    WorldFault::Displace { .. }
                    | WorldFault::TakeFromGripper {}
                    | WorldFault::BesidePeg { .. }
                    | WorldFault::Remove { .. }
                    | WorldFault::Swap { .. }
                    | WorldFault::Hold { .. } => !view.held && !view.is_out && is_clear(),
                }
        };
        (0..self.bodies.len()).filter(fits).map(|idx| self.name(idx).to_owned()).collect()
    }

    fn name(&self, idx: usize) -> &str {
        &self.bodies[idx].spec.name
    }

    fn movable(&self, object: &str) -> Result<usize, FaultError> {
        self.index_of(object)
            .filter(|&idx| !self.bodies[idx].spec.is_fixed())
            .ok_or_else(|| FaultError::UnknownObject { object: object.to_owned() })
    }

    /// A body that can move and is in the world.
    fn present(&self, object: &str) -> Result<usize, FaultError> {
        let idx = self.movable(object)?;
        if self.bodies[idx].is_out {
            return Err(FaultError::Out { object: object.to_owned() });
        }
        Ok(idx)
    }

    /// A body and everything that directly or indirectly stands on it, the body first.
    fn with_all_above(&self, idx: usize) -> Vec<usize> {
        let on: Vec<Option<usize>> =
            (0..self.bodies.len()).map(|other| self.support(other).on).collect();
        let mut group = vec![idx];
        let mut n_seen = 0;
        while let Some(&below) = group.get(n_seen) {
            n_seen += 1;
            let above = (0..on.len()).filter(|&other| on[other] == Some(below));
            let new: Vec<usize> = above.filter(|other| !group.contains(other)).collect();
            group.extend(new);
        }
        group
    }
}
