//! Why a fault cannot happen.

use thiserror::Error;

/// Why a fault could not be applied. Nothing has changed then.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FaultError {
    /// There is no such object, or it is fixed.
    #[error("fault: expected the name of a body that can move, got \"{object}\"")]
    UnknownObject {
        /// The name.
        object: String,
    },
    /// The object is in the gripper.
    #[error("fault: {object} is held by the gripper")]
    Held {
        /// The name.
        object: String,
    },
    /// The gripper is empty.
    #[error("fault: the gripper holds nothing")]
    NothingHeld,
    /// The object does not stand on anything it could be pushed off.
    #[error("fault: {object} does not stand on another object, so it cannot be knocked off")]
    NotStacked {
        /// The name.
        object: String,
    },
    /// The object cannot be pushed off, since a peg goes through it.
    #[error("fault: {object} is around a peg, so it cannot be knocked off")]
    AroundPeg {
        /// The name.
        object: String,
    },
    /// Something lies on the object.
    #[error("fault: {object} has {on_top} on it")]
    NotClear {
        /// The name.
        object: String,
        /// What lies on it.
        on_top: String,
    },
    /// The object is not a disk around a peg.
    #[error("fault: {object} is not a disk around a peg")]
    NotAroundPeg {
        /// The name.
        object: String,
    },
    /// No place is free.
    #[error("fault: no free place on the table for {object}")]
    NoFreePlace {
        /// The name.
        object: String,
    },
    /// The object is not in the world.
    #[error("fault: {object} has been taken away")]
    Out {
        /// The name.
        object: String,
    },
    /// The object is in the world already.
    #[error("fault: {object} has not been taken away, so it cannot come back")]
    NotOut {
        /// The name.
        object: String,
    },
    /// Two objects are needed.
    #[error("fault: expected two different objects, got {object} twice")]
    SameObject {
        /// The name.
        object: String,
    },
    /// The object stands on another one.
    #[error("fault: {object} stands on {below}; expected a board, or an object on the table")]
    NotAtBottom {
        /// The name.
        object: String,
        /// What it stands on.
        below: String,
    },
    /// Something is in the way, or the place is outside the free area.
    #[error("fault: no room for {object} there: {reason}")]
    NoRoom {
        /// The name.
        object: String,
        /// What is in the way.
        reason: String,
    },
    /// A number is not usable.
    #[error("fault: {key} must be {expected}")]
    BadNumber {
        /// The key.
        key: &'static str,
        /// What is expected.
        expected: &'static str,
    },
}

impl FaultError {
    /// Checks how long a fault lasts, in seconds.
    ///
    /// # Errors
    /// [`FaultError::BadNumber`] with the key `for_s`.
    pub fn check_duration(for_s: f64) -> Result<(), Self> {
        let expected = "a finite number above 0";
        (for_s.is_finite() && for_s > 0.0)
            .then_some(())
            .ok_or(Self::BadNumber { key: "for_s", expected })
    }

    /// Checks how far a fault shifts something, in metres.
    ///
    /// # Errors
    /// [`FaultError::BadNumber`] with the key `by_m`.
    pub fn check_offset([x, y]: [f64; 2]) -> Result<(), Self> {
        let (expected, away_m) = ("two finite numbers that are not both 0", x.hypot(y));
        (away_m.is_finite() && away_m > 0.0)
            .then_some(())
            .ok_or(Self::BadNumber { key: "by_m", expected })
    }
}
