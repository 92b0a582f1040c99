//! What the stages say to one another, as plain values. `transport` carries them.

mod device;
mod task;

pub use device::{
    Command, CommandKind, Expect, Frame, Motion, RobotState, Status, StatusKind, Waypoint,
};
pub use task::{
    Cause, GoalMessage, Origin, PlanMessage, PlanVerdict, Scene, SceneFact, Spent, StepOutcome,
    named_objects,
};
