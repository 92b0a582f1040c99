//! What the stages say to one another, as plain values. `transport` carries them.

mod device;
mod event;
mod rung;
mod task;
mod verdict;

pub use device::{
    Command, CommandKind, Expect, Frame, Motion, RobotState, Status, StatusKind, Waypoint,
};
pub use event::{Deviation, Event, ReplanCause};
pub use rung::{Reuse, Rung};
pub use task::{GoalMessage, PlanMessage, PlanVerdict, Spent, StepOutcome, named_objects};
pub use verdict::{AnswerKind, Counts, Limit, Stop, Verdict};
