//! Messages from and to devices, which know nothing of the task.

use nalgebra::Point3;

use crate::geometry::CameraModel;
use crate::pddl::Step;

/// The name of the camera that every run has.
pub const MAIN_CAMERA: &str = "main";

/// One picture, as a camera gives it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// Number of the frame.
    pub sequence: u64,
    /// Capture stamp in run time, nanoseconds.
    pub capture_ns: u64,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Packed RGB8, `width * height * 3` bytes, row by row.
    pub rgb: Vec<u8>,
    /// Distance along the optical axis in metres, `width * height` values, 0 = none.
    pub depth_m: Option<Vec<f32>>,
    /// Intrinsics and pose, where known.
    pub model: Option<CameraModel>,
}

/// What a robot knows of itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotState {
    /// Run time it belongs to, nanoseconds.
    pub capture_ns: u64,
    /// Tool centre point in the world frame, metres.
    pub position: Point3<f64>,
    /// Rotation about the world's z axis, radians.
    pub yaw_rad: f64,
    /// Jaw opening, metres.
    pub opening_m: f64,
    /// Whether something is in the gripper. Not what: no gripper knows.
    pub holding: bool,
    /// The running command.
    pub command_id: Option<u64>,
    /// Index of the waypoint that it approaches.
    pub phase: usize,
    /// The newest frame whose command has been carried out (lockstep).
    pub answered: Option<u64>,
}

/// One command, and what the robot's states have said of it: they tell that it has ended where the status that
/// says so, or the command itself, was lost. States come in order.
#[derive(Debug, Clone, Copy)]
pub struct CommandWatch {
    command_id: u64,
    /// The frame that it answered.
    frame_sequence: u64,
    is_taken: bool,
}

impl CommandWatch {
    /// A command that has just been sent as the answer to a frame.
    pub fn new(command_id: u64, frame_sequence: u64) -> Self {
        Self { command_id, frame_sequence, is_taken: false }
    }

    /// Takes in the newest state; whether the robot has had the command, and does not carry it out any
    /// more. A robot that never tells what it carries out is not judged.
    pub fn is_over(&mut self, robot: &RobotState) -> bool {
        let is_running = robot.command_id == Some(self.command_id);
        let is_answered = robot.answered.is_some_and(|frame| frame >= self.frame_sequence);
        self.is_taken |= is_running || is_answered;
        self.is_taken && !is_running
    }
}

/// What the gripper must feel once a waypoint is done; anything else fails the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expect {
    /// Nothing in particular.
    Anything,
    /// Nothing in the gripper.
    Empty,
    /// Something in the gripper.
    Holding,
}

/// One point of a motion: go there, then set the jaws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Tool centre point in the world frame, metres.
    pub position: Point3<f64>,
    /// Rotation about the world's z axis, radians.
    pub yaw_rad: f64,
    /// Jaw opening wanted at its end, metres.
    pub opening_m: f64,
    /// Speed limit, metres per second.
    pub speed_m_s: f64,
    /// What the gripper must feel when it is done.
    pub expect: Expect,
    /// Whether the motion may be cancelled, by going straight up, until this point is reached.
    pub retractable: bool,
}

/// A bounded list of waypoints (at most `transport::wire::WAYPOINTS_MAX`).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// In order.
    pub waypoints: Vec<Waypoint>,
}

/// What a robot is told.
#[derive(Debug, Clone, PartialEq)]
pub enum CommandKind {
    /// Go on with what you do.
    Continue,
    /// Start a motion; the robot must be idle.
    Start(Motion),
    /// Break the running motion off: go straight up, keep what is held.
    Cancel,
    /// Stand still, now.
    Hold,
}

/// The answer to one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// Identity of the motion it starts or concerns; grows with every start.
    pub id: u64,
    /// The frame that it answers.
    pub frame_sequence: u64,
    /// Run time of that frame, nanoseconds.
    pub capture_ns: u64,
    /// What to do.
    pub kind: CommandKind,
    /// The step that its motion carries out, if any; a robot need not read it.
    pub step: Option<Step>,
}

/// How a command fares.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StatusKind {
    /// It will be carried out.
    Accepted,
    /// It has been carried out.
    Done,
    /// It could not be carried out.
    Failed(String),
    /// It was cancelled as told.
    Cancelled,
}

/// What a robot says of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    /// Number in the robot's stream of statuses.
    pub sequence: u64,
    /// Run time, nanoseconds.
    pub capture_ns: u64,
    /// Number of the command, as in [`Command::id`].
    pub command_id: u64,
    /// How it fares.
    pub kind: StatusKind,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(command_id: Option<u64>, answered: Option<u64>) -> RobotState {
        RobotState {
            capture_ns: 0,
            position: Point3::origin(),
            yaw_rad: 0.0,
            opening_m: 0.0,
            holding: false,
            command_id,
            phase: 0,
            answered,
        }
    }

    #[test]
    fn a_command_is_over_once_it_was_had_and_is_not_carried_out() {
        let mut watch = CommandWatch::new(7, 40);
        assert!(
            !watch.is_over(&state(None, None)),
            "it is still on its way, or the robot never tells"
        );
        assert!(!watch.is_over(&state(Some(7), None)));
        assert!(watch.is_over(&state(None, None)));
        assert!(watch.is_over(&state(Some(8), None)));
        let mut watch = CommandWatch::new(7, 40);
        assert!(!watch.is_over(&state(None, Some(39))));
        assert!(!watch.is_over(&state(Some(7), Some(40))));
        let mut lost = CommandWatch::new(7, 40);
        assert!(lost.is_over(&state(None, Some(40))), "its frame was answered otherwise");
    }
}
