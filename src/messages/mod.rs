//! What the stages say to one another, as plain values. `transport` carries them.

mod control;
mod device;
mod event;
mod health;
mod request;
mod run;
mod plan_source;
mod task;
mod verdict;

pub use control::Control;
pub use device::{
    Command, CommandKind, CommandWatch, Expect, Frame, MAIN_CAMERA, Motion, RobotState, Status,
    StatusKind, Waypoint,
};
pub use event::{Deviation, Event, EventMessage, ReplanCause};
pub use health::{ActorHealth, FaultCounts, FrameFault};
pub use plan_source::{PlanSource, Reuse};
pub use request::{Submission, TaskRequest, TaskResult, TaskState, TaskStatus};
pub use run::RunDescriptor;
pub use task::{
    Dispatch, Effects, GoalMessage, GoalUpdate, PlanMessage, PlanVerdict, Spent, StepOutcome,
    named_objects,
};
pub use verdict::{AnswerKind, DecisionMessage, EpisodeCounts, EpisodeEnd, Limit, Stop, Verdict};
