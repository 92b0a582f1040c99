//! Why a scene cannot be built.

use thiserror::Error;

/// Most bodies one scene may have; image ids and the cost of a step are bounded by it.
pub const BODIES_MAX: usize = 64;

/// Why a scene cannot be built.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SceneError {
    /// A number of the scene is out of its range.
    #[error("{field} of {of}: expected {min} to {max}, got {got}")]
    BadNumber {
        /// The body or the arrangement.
        of: String,
        /// The field.
        field: &'static str,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
        /// What was written.
        got: f64,
    },
    /// Two bodies share a name, or a name is empty.
    #[error("body names must be unique and not empty: \"{name}\"")]
    BadName {
        /// The name.
        name: String,
    },
    /// The number of bodies is out of range.
    #[error("expected 1 to {BODIES_MAX} bodies, got {got}")]
    BodyCount {
        /// How many there are.
        got: usize,
    },
    /// A body that is fixed has no place.
    #[error("at_m of {name}: a {kind} that is fixed needs a place, got none")]
    PlaceMissing {
        /// The body.
        name: String,
        /// Its kind.
        kind: &'static str,
    },
    /// A body that can move has a place of its own.
    #[error(
        "at_m of {name}: a {kind} that can move is placed by the arrangement: leave at_m out, or say \
         fixed = true"
    )]
    PlaceUnexpected {
        /// The body.
        name: String,
        /// Its kind.
        kind: &'static str,
    },
    /// A peg is to move.
    #[error("fixed of {name}: a {kind} cannot move; take a cylinder")]
    CannotMove {
        /// The body.
        name: String,
        /// Its kind.
        kind: &'static str,
    },
    /// A type's name is empty.
    #[error("type of {name}: expected the name of a type, got \"\"")]
    BadType {
        /// The body.
        name: String,
    },
    /// The number of parts of a compound is out of range.
    #[error("parts of {name}: expected 1 to {max}, got {got}")]
    PartCount {
        /// The body.
        name: String,
        /// Most parts.
        max: usize,
        /// How many there are.
        got: usize,
    },
    /// There is no material of that name.
    #[error("material of {name}: expected {known}, or a table [materials.NAME], got \"{got}\"")]
    UnknownMaterial {
        /// The body.
        name: String,
        /// The names that there are.
        known: String,
        /// What was written.
        got: String,
    },
    /// An area's corners are not the lowest and the highest.
    #[error("areas_m of the arrangement: expected [[x, y], [x, y]], the lowest corner first")]
    BadArea,
    /// There is no free place for a body.
    #[error(
        "no free place for {name} in the areas_m of the arrangement: fewer bodies, a larger area or \
         less clearance_m"
    )]
    NoFreeArea {
        /// The body.
        name: String,
    },
    /// The arrangement names a body that is not in the scene or is of another kind.
    #[error("{field} of the arrangement: expected the name of a {expected}, got \"{name}\"")]
    UnknownBody {
        /// The field.
        field: &'static str,
        /// The kind that is needed.
        expected: &'static str,
        /// The name as written.
        name: String,
    },
    /// A body that can move is placed never or more than once.
    #[error("{name} is placed {times} times by the arrangement, expected once")]
    NotPlacedOnce {
        /// The body.
        name: String,
        /// How often it is placed.
        times: usize,
    },
    /// The slots cannot hold all blocks.
    #[error("{n_blocks} blocks do not fit on {n_slots} slots with stack_height_max {height_max}")]
    TooFewSlots {
        /// Number of blocks.
        n_blocks: usize,
        /// Number of slots.
        n_slots: usize,
        /// Most blocks in one stack.
        height_max: usize,
    },
    /// A random arrangement of disks needs a peg.
    #[error("random_towers needs at least one peg")]
    NoPeg,
    /// Two bodies would be inside each other at the start.
    #[error("{first} and {second} would overlap by {depth_mm:.1} mm")]
    Overlap {
        /// One body.
        first: String,
        /// The other.
        second: String,
        /// How deep, in millimetres.
        depth_mm: f64,
    },
    /// The scene did not come to rest.
    #[error("{name} still moves after {seconds} simulated seconds")]
    Unsettled {
        /// A body that moves.
        name: String,
        /// How long was waited.
        seconds: f64,
    },
}

/// Checks that `value` is a number from `min` to `max`.
pub(crate) fn check_number(
    of: &str,
    field: &'static str,
    value: f64,
    min: f64,
    max: f64,
) -> Result<(), SceneError> {
    if value >= min && value <= max {
        return Ok(());
    }
    Err(SceneError::BadNumber { of: of.to_owned(), field, min, max, got: value })
}
