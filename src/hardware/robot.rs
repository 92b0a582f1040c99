//! Robots: commands in, motion out. A robot in another process needs no adapter here: it is of the
//! kind `external` and speaks the topics.

use std::sync::Arc;
use std::time::Duration;

use super::HardwareInputs;
use crate::messages::{Command, RobotState, Status};
use crate::metrics::FaultRecord;
use crate::parts::Role;

/// A robot, hosted by the robot actor.
///
/// Life cycle: [`Robot::accept`] for every command; [`Robot::tick`] as time passes, where the
/// robot has a period; after either, what [`Robot::pending`] and [`Robot::state`] say is sent, and
/// [`Robot::published`] lets the world go on.
pub trait Robot: Send {
    /// How often [`Robot::tick`] wants to be called; `None` = time passes with commands only
    /// (lockstep).
    fn period(&self) -> Option<Duration>;

    /// Takes a command; in lockstep, carries on until the next frame is due.
    fn accept(&mut self, command: &Command);

    /// Takes note of a motion that was asked for and cannot be read: it says that it has failed, and why.
    fn refuse(&mut self, command_id: u64, reason: String);

    /// Carries on until now (realtime).
    fn tick(&mut self);

    /// Number of the state, and the state.
    fn state(&self) -> (u64, RobotState);

    /// Statuses that have not been sent yet.
    fn pending(&self) -> Vec<Status>;

    /// Everything pending has been sent.
    fn published(&mut self);
}

/// Opens a robot, for each start of its actor.
pub type OpenRobot = Arc<dyn Fn() -> Box<dyn Robot> + Send + Sync>;

/// The faults that have happened, or could not, in order.
pub type FaultsOf = Arc<dyn Fn() -> Vec<FaultRecord> + Send + Sync>;

/// A robot as a run file chooses it.
#[derive(Clone)]
#[expect(missing_debug_implementations, reason = "holds a closure")]
pub struct RobotPort {
    /// Whether anything acts; if not, the first confirmed plan is the result of a run.
    pub acts: bool,
    /// Opens it in this process; without it, a robot that acts is played by another process.
    pub open: Option<OpenRobot>,
    /// What has gone wrong so far, where faults are made; for reports after the episode.
    pub faults: Option<FaultsOf>,
}

impl Role for RobotPort {
    type Inputs<'a> = HardwareInputs<'a>;
    const NAME: &'static str = "robot";
    const KEY: &'static str = "robot.kind";
    const OPTIONS: &'static str = "robot.options";
}
