//! Robots: commands in, motion out. A robot that speaks the topics needs no adapter here.

use std::time::Duration;

use crate::messages::{Command, RobotState, Status};

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

    /// Carries on until now (realtime).
    fn tick(&mut self);

    /// Number of the state, and the state.
    fn state(&self) -> (u64, RobotState);

    /// Statuses that have not been sent yet.
    fn pending(&self) -> Vec<Status>;

    /// Everything pending has been sent.
    fn published(&mut self);
}
