//! The floating parallel gripper: commands, limits of motion, and its outer shape.
//!
//! The gripper is a kinematic body: it goes where it is told within its limits of speed and
//! acceleration. How it holds is the world's choice: an object between the closing fingers is
//! joined to the gripper, whose links then meet nothing, since they would only fight that joint; or
//! the fingers collide and hold by friction. The held object collides with everything.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Widest opening between the fingers, in metres.
pub const OPENING_MAX_M: f64 = 0.13;
/// Fastest motion of the gripper, in metres per second.
pub const SPEED_MAX_M_S: f64 = 1.2;
/// Strongest acceleration of the gripper, in metres per second squared.
pub const ACCELERATION_MAX_M_S2: f64 = 6.0;
/// Corners of the box the tool centre point can be sent to, in metres, world frame.
pub const WORKSPACE_M: [[f64; 3]; 2] = [[-0.6, -0.45, 0.004], [0.6, 0.45, 0.8]];

/// How far the finger tips reach below the tool centre point, in metres. Less than half the height
/// of the flattest object, so that the tips never touch what lies below it.
pub(crate) const TIP_BELOW_M: f64 = 0.006;
/// Width of a finger pad across the jaw axis, in metres.
pub(crate) const PAD_WIDTH_M: f64 = 0.018;
/// Length of the fingers above the tool centre point: a peg that sticks out 120 mm above a disk
/// being grasped stays below the palm.
pub(crate) const FINGER_LENGTH_M: f64 = 0.15;
const FINGER_THICKNESS_M: f64 = 0.009;
const PAD_THICKNESS_M: f64 = 0.003;
/// Depth of a finger with its pad along the jaw axis, in metres.
pub(crate) const FINGER_DEPTH_M: f64 = FINGER_THICKNESS_M + PAD_THICKNESS_M;
/// Speed of the opening, in metres per second: a full stroke takes 0.15 s.
const JAW_SPEED_M_S: f64 = 0.87;
const TURN_SPEED_MAX_RAD_S: f64 = 4.0;
const TURN_ACCELERATION_RAD_S2: f64 = 25.0;
/// Share of the acceleration that is planned for braking; the rest absorbs the finite step.
const BRAKING_SHARE: f64 = 0.85;

/// A target for the gripper. It moves there in a straight line from rest and stays there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GripperCommand {
    /// Target of the tool centre point, the middle between the finger tips: metres, world frame.
    /// To grasp an object send it to the object's centre.
    pub position: Point3<f64>,
    /// Turn about z in radians; at 0 the fingers open along x. Half turns make no difference.
    pub yaw_rad: f64,
    /// Distance between the fingers, 0 (closed) to [`OPENING_MAX_M`]. An object between the
    /// fingers is grasped when they close on it and let go when they open by more than 2 mm.
    pub opening_m: f64,
    /// Top speed of this motion, in metres per second; [`SPEED_MAX_M_S`] at most.
    pub speed_m_s: f64,
}

/// What the gripper's own sensors tell: hardware could know all of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GripperState {
    /// Tool centre point: metres, world frame.
    pub position: Point3<f64>,
    /// Turn about z in radians, in (-pi/2, pi/2] from the target of the last command.
    pub yaw_rad: f64,
    /// Distance between the fingers, in metres; the object's width while one is held.
    pub opening_m: f64,
    /// Whether something is held. What it is the gripper cannot know.
    pub holding: bool,
    /// Whether the last command's position, yaw and opening are reached. A grasped object stops
    /// the fingers early, and that counts as reached.
    pub at_target: bool,
    /// Speed of the tool centre point, in metres per second.
    pub speed_m_s: f64,
}

/// Why a gripper command is refused. A refused command changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("gripper command: expected {field} from {min} to {max}, got {got}")]
pub struct CommandError {
    /// The field.
    pub field: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// The value as sent.
    pub got: f64,
}

impl GripperCommand {
    /// Checks that every number is finite and in range.
    ///
    /// # Errors
    /// [`CommandError`] with the first field that is not.
    pub fn check(&self) -> Result<(), CommandError> {
        let within = |field, got: f64, min: f64, max: f64| {
            if got >= min && got <= max {
                Ok(())
            } else {
                Err(CommandError { field, min, max, got })
            }
        };
        let [low, high] = WORKSPACE_M;
        within("position.x", self.position.x, low[0], high[0])?;
        within("position.y", self.position.y, low[1], high[1])?;
        within("position.z", self.position.z, low[2], high[2])?;
        within("yaw_rad", self.yaw_rad, -2.0 * PI, 2.0 * PI)?;
        within("opening_m", self.opening_m, 0.0, OPENING_MAX_M)?;
        within("speed_m_s", self.speed_m_s, 0.001, f64::MAX)
    }
}

/// The moving gripper.
#[derive(Debug, Clone)]
pub(crate) struct Gripper {
    pub(crate) position: Point3<f64>,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) yaw_rad: f64,
    yaw_rate: f64,
    pub(crate) opening_m: f64,
    pub(crate) command: GripperCommand,
}

impl Gripper {
    /// At rest at `home`, open.
    pub(crate) fn at(home: Point3<f64>) -> Self {
        let opening_m = 0.08;
        let command =
            GripperCommand { position: home, yaw_rad: 0.0, opening_m, speed_m_s: SPEED_MAX_M_S };
        Self {
            position: home,
            velocity: Vector3::zeros(),
            yaw_rad: 0.0,
            yaw_rate: 0.0,
            opening_m,
            command,
        }
    }

    /// Takes a new target, turned by half turns so that the way there is short.
    pub(crate) fn set_target(&mut self, command: GripperCommand) {
        let half_turns = ((self.yaw_rad - command.yaw_rad) / PI).round();
        self.command = command;
        self.command.yaw_rad += half_turns * PI;
        self.command.speed_m_s = command.speed_m_s.min(SPEED_MAX_M_S);
    }

    /// World from gripper: origin at the tool centre point, x along the jaw axis, z up.
    pub(crate) fn pose(&self) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw_rad);
        Isometry3::from_parts(Translation3::from(self.position.coords), turn)
    }

    /// Moves for one step. The opening does not go below `opening_min_m`, the width of what is
    /// held.
    pub(crate) fn advance(&mut self, dt: f64, opening_min_m: f64) {
        self.travel(dt);
        self.turn(dt);
        let jaw_step = JAW_SPEED_M_S * dt;
        let target = self.command.opening_m.max(opening_min_m);
        self.opening_m += (target - self.opening_m).clamp(-jaw_step, jaw_step);
    }

    fn travel(&mut self, dt: f64) {
        let way = self.command.position - self.position;
        let distance = way.norm();
        let most = ACCELERATION_MAX_M_S2 * dt;
        if distance < 1e-4 && self.velocity.norm() <= most {
            self.position = self.command.position;
            self.velocity = Vector3::zeros();
            return;
        }
        let speed = braking_speed(distance, self.command.speed_m_s, ACCELERATION_MAX_M_S2, dt);
        let change = way * (speed / distance.max(1e-9)) - self.velocity;
        self.velocity += change * (most / change.norm().max(most));
        self.position += self.velocity * dt;
    }

    fn turn(&mut self, dt: f64) {
        let turn = self.command.yaw_rad - self.yaw_rad;
        let most = TURN_ACCELERATION_RAD_S2 * dt;
        if turn.abs() < 1e-4 && self.yaw_rate.abs() <= most {
            self.yaw_rad = self.command.yaw_rad;
            self.yaw_rate = 0.0;
            return;
        }
        let speed = braking_speed(turn.abs(), TURN_SPEED_MAX_RAD_S, TURN_ACCELERATION_RAD_S2, dt);
        self.yaw_rate += (speed * turn.signum() - self.yaw_rate).clamp(-most, most);
        self.yaw_rad += self.yaw_rate * dt;
    }

    /// Whether position, yaw and opening are those of the command.
    pub(crate) fn at_target(&self, opening_min_m: f64) -> bool {
        self.position == self.command.position
            && self.yaw_rad == self.command.yaw_rad
            && (self.opening_m - self.command.opening_m.max(opening_min_m)).abs() < 1e-4
    }
}

/// The speed from which one can still stop within `distance` in steps of `dt`, at most
/// `speed_max`.
fn braking_speed(distance: f64, speed_max: f64, acceleration: f64, dt: f64) -> f64 {
    // Stopping from v in steps takes v^2 / (2 a) + v dt / 2.
    let planned = BRAKING_SHARE * acceleration;
    let half_step = 0.5 * planned * dt;
    ((half_step * half_step + 2.0 * planned * distance).sqrt() - half_step)
        .min(speed_max)
        .min(distance / dt)
}

/// One box of the gripper as it is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Link {
    /// Middle of the box in the gripper's frame, metres.
    pub(crate) middle: Vector3<f64>,
    /// Extents, metres.
    pub(crate) size: Vector3<f64>,
    /// Whether it is a dark pad rather than metal.
    pub(crate) dark: bool,
}

/// The gripper's boxes at an opening, in the gripper's frame: two fingers, each with a pad at its
/// tip and a carriage at its top, the rail they run on, the wrist and the column it hangs from.
pub(crate) fn links(opening_m: f64) -> [Link; 9] {
    let metal = |middle, size| Link { middle, size, dark: false };
    let dark = |middle, size| Link { middle, size, dark: true };
    let finger = |side: f64| {
        let pad = PAD_THICKNESS_M;
        let x = side * (0.5 * opening_m + pad + 0.5 * FINGER_THICKNESS_M);
        let z = 0.5 * (FINGER_LENGTH_M - TIP_BELOW_M);
        let tip_height = 0.026;
        [
            metal(
                Vector3::new(x, 0.0, z),
                Vector3::new(FINGER_THICKNESS_M, PAD_WIDTH_M, FINGER_LENGTH_M + TIP_BELOW_M),
            ),
            dark(
                Vector3::new(side * 0.5 * (opening_m + pad), 0.0, 0.5 * tip_height - TIP_BELOW_M),
                Vector3::new(pad, PAD_WIDTH_M, tip_height),
            ),
            dark(
                Vector3::new(x + side * 0.004, 0.0, FINGER_LENGTH_M + 0.012),
                Vector3::new(0.026, 0.034, 0.024),
            ),
        ]
    };
    let [left, right] = [finger(-1.0), finger(1.0)];
    let rail = Vector3::new(0.2, 0.05, 0.036);
    [
        left[0],
        left[1],
        left[2],
        right[0],
        right[1],
        right[2],
        metal(Vector3::new(0.0, 0.0, FINGER_LENGTH_M + 0.042), rail),
        dark(Vector3::new(0.0, 0.0, FINGER_LENGTH_M + 0.08), Vector3::new(0.075, 0.06, 0.05)),
        metal(Vector3::new(0.0, 0.0, FINGER_LENGTH_M + 0.5), Vector3::new(0.042, 0.042, 0.8)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / 240.0;

    fn command(x: f64, z: f64, yaw_rad: f64) -> GripperCommand {
        GripperCommand { position: Point3::new(x, 0.0, z), yaw_rad, opening_m: 0.0, speed_m_s: 9.0 }
    }

    #[test]
    fn motion_keeps_its_limits_and_ends_exactly_at_the_target() {
        let mut gripper = Gripper::at(Point3::new(0.0, 0.0, 0.5));
        let targets = [command(0.3, 0.1, 0.4), command(-0.3, 0.2, -1.0), command(-0.299, 0.2, 3.0)];
        for target in targets {
            gripper.set_target(target);
            let mut n_steps = 0;
            while !gripper.at_target(0.0) {
                let before = gripper.velocity;
                gripper.advance(DT, 0.0);
                assert!(gripper.velocity.norm() < SPEED_MAX_M_S + 1e-9);
                let acceleration = (gripper.velocity - before).norm() / DT;
                assert!(acceleration < ACCELERATION_MAX_M_S2 + 1e-6, "{acceleration}");
                n_steps += 1;
                assert!(n_steps < 480, "takes more than two seconds");
            }
        }
    }

    #[test]
    fn turning_by_half_a_turn_is_no_turn() {
        let mut gripper = Gripper::at(Point3::origin());
        gripper.set_target(command(0.0, 0.0, PI));
        assert!(gripper.command.yaw_rad.abs() < 1e-12);
    }

    #[test]
    fn a_command_out_of_range_is_refused_with_its_field() {
        let bad = |change: fn(&mut GripperCommand)| {
            let mut sent = command(0.0, 0.1, 0.0);
            change(&mut sent);
            sent.check().unwrap_err().field
        };
        assert_eq!(bad(|c| c.position.z = f64::NAN), "position.z");
        assert_eq!(bad(|c| c.position.x = 3.0), "position.x");
        assert_eq!(bad(|c| c.opening_m = 0.2), "opening_m");
        assert_eq!(bad(|c| c.speed_m_s = 0.0), "speed_m_s");
        assert_eq!(bad(|c| c.yaw_rad = f64::INFINITY), "yaw_rad");
    }
}
