//! What the stages say to one another, as plain values. `transport` carries them.

mod device;
mod rung;
mod task;

pub use device::{
    Command, CommandKind, Expect, Frame, Motion, RobotState, Status, StatusKind, Waypoint,
};
pub use rung::{Reuse, Rung};
pub use task::{GoalMessage, PlanMessage, PlanVerdict, Spent, StepOutcome, named_objects};
