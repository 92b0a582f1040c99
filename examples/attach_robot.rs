//! A robot of your own: a gripper without weight that follows the waypoints it is told.
//!
//! ```console
//! cargo run --release --example attach_robot -- NAME
//! ```
//!
//! `NAME` is the run's, whose run file has `robot.kind = "external"`, how the robot moves in `[robot.motion]`, and
//! `clock = "realtime"`.
//! To drive a real robot, let [`Arm`] speak to its controller and read its sensors.

#![expect(clippy::print_stderr, reason = "an example says what is wrong")]

use std::process::ExitCode;
use std::time::Duration;

use groundloop::actors::{ActorError, Monitor, robot};
use groundloop::clock::monotonic_ns;
use groundloop::hardware::{Arm, Robot, Sequencer, Target};
use groundloop::messages::{Command, RobotState, Status, StatusKind};
use groundloop::transport::{Bus, BusConfig};
use nalgebra::Point3;

/// Control periods per second.
const CONTROL_HZ: u32 = 50;

/// The arm: it moves in a straight line, at the speed that it is told.
struct Gripper {
    tool: Target,
    target: Target,
}

impl Gripper {
    /// Moves on for one control period.
    fn step(&mut self) {
        let way = self.target.position - self.tool.position;
        let step_m = self.target.speed_m_s / f64::from(CONTROL_HZ);
        let share = if way.norm() > step_m { step_m / way.norm() } else { 1.0 };
        self.tool = Target { position: self.tool.position + way * share, ..self.target };
    }
}

impl Arm for Gripper {
    fn go(&mut self, target: Target) -> Result<(), String> {
        if target.position.z < 0.0 {
            return Err("that is below the table".to_owned());
        }
        self.target = target;
        Ok(())
    }

    fn has_arrived(&self) -> bool {
        (self.target.position - self.tool.position).norm() < 1e-3
    }

    /// Closed jaws hold something, since nothing here can feel that they do not.
    fn is_holding(&self) -> bool {
        self.tool.opening_m <= 0.0
    }

    fn tool(&self) -> Target {
        self.tool
    }
}

/// The robot: the arm, the motion that it carries out, and what it has to say.
struct MyRobot {
    arm: Gripper,
    sequencer: Sequencer,
    pending: Vec<Status>,
    n_statuses: u64,
    n_states: u64,
}

impl MyRobot {
    fn say(&mut self, command_id: u64, kind: StatusKind) {
        let (sequence, capture_ns) = (self.n_statuses, monotonic_ns());
        self.n_statuses += 1;
        self.pending.push(Status { sequence, capture_ns, command_id, kind });
    }
}

impl Robot for MyRobot {
    fn period(&self) -> Option<Duration> {
        Some(Duration::from_secs(1) / CONTROL_HZ)
    }

    fn accept(&mut self, command: &Command) {
        if let Some(kind) = self.sequencer.accept(command.id, &command.kind, &mut self.arm) {
            self.say(command.id, kind);
        }
    }

    fn refuse(&mut self, command_id: u64, reason: String) {
        self.say(command_id, StatusKind::Failed(reason));
    }

    fn tick(&mut self) {
        self.arm.step();
        if let Some((command_id, kind)) = self.sequencer.tick(&mut self.arm) {
            self.say(command_id, kind);
        }
    }

    fn state(&self) -> (u64, RobotState) {
        let Target { position, yaw_rad, opening_m, .. } = self.arm.tool;
        let state = RobotState {
            capture_ns: monotonic_ns(),
            position,
            yaw_rad,
            opening_m,
            holding: self.arm.is_holding(),
            command_id: self.sequencer.command_id(),
            phase: self.sequencer.phase(),
            answered: None,
        };
        (self.n_states, state)
    }

    fn pending(&self) -> Vec<Status> {
        self.pending.clone()
    }

    fn published(&mut self) {
        self.pending.clear();
        self.n_states += 1;
    }
}

/// Plays the robot until it is stopped (Ctrl-C); the run may come before or after it.
async fn serve(run: String) -> Result<(), ActorError> {
    let position = Point3::new(0.0, 0.0, 0.5);
    let home = Target { position, yaw_rad: 0.0, opening_m: 0.08, speed_m_s: 0.5 };
    let robot = MyRobot {
        arm: Gripper { tool: home, target: home },
        sequencer: Sequencer::default(),
        pending: Vec::new(),
        n_statuses: 0,
        n_states: 0,
    };
    // The same root and prefix as the run's: the defaults.
    let bus = Bus::open(&BusConfig::for_run(run))?;
    robot::serve(bus, Box::new(robot), Monitor::default(), robot::COMMAND_AGE_MAX).await
}

#[tokio::main]
async fn main() -> ExitCode {
    let Some(run) = std::env::args().nth(1) else {
        eprintln!("usage: attach_robot NAME");
        return ExitCode::from(2);
    };
    let Err(error) = serve(run).await else { return ExitCode::SUCCESS };
    eprintln!("error: {error}");
    ExitCode::FAILURE
}
