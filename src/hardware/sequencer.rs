//! Carries out motions on anything that can go to a point and open or close a gripper.

use nalgebra::Point3;

use crate::messages::{CommandKind, Expect, Motion, StatusKind, Waypoint};

/// Where the tool shall go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Tool centre point in the world frame, metres.
    pub position: Point3<f64>,
    /// Rotation about the world's z axis, radians.
    pub yaw_rad: f64,
    /// Jaw opening, metres.
    pub opening_m: f64,
    /// Speed limit, metres per second.
    pub speed_m_s: f64,
}

/// An arm with a gripper, as far as a motion needs it.
pub trait Arm {
    /// Sets the target.
    ///
    /// # Errors
    /// Why the target is refused.
    fn go(&mut self, target: Target) -> Result<(), String>;

    /// Whether position and jaws are where they should be (jaws that close on an object are).
    fn has_arrived(&self) -> bool;

    /// Whether something is in the gripper.
    fn is_holding(&self) -> bool;

    /// Where the tool is: position, yaw, jaw opening.
    fn tool(&self) -> Target;
}

/// The motion that is carried out.
#[derive(Debug, Clone, Default)]
pub struct Sequencer {
    running: Option<Progress>,
}

#[derive(Debug, Clone)]
struct Progress {
    command_id: u64,
    waypoints: Vec<Waypoint>,
    phase: usize,
    /// The motion is over; the tool goes up, and this is what will be said then.
    ending: Option<StatusKind>,
}

impl Sequencer {
    /// The running command.
    pub fn command_id(&self) -> Option<u64> {
        self.running.as_ref().map(|p| p.command_id)
    }

    /// Index of the waypoint that is being approached.
    pub fn phase(&self) -> usize {
        self.running.as_ref().map_or(0, |p| p.phase)
    }

    /// Takes a command; returns what to say at once.
    pub fn accept(
        &mut self,
        command_id: u64,
        kind: &CommandKind,
        arm: &mut dyn Arm,
    ) -> Option<StatusKind> {
        match kind {
            CommandKind::Continue => None,
            CommandKind::Start(motion) => Some(self.start(command_id, motion, arm)),
            CommandKind::Cancel => {
                let progress = self.running.as_mut().filter(|p| p.ending.is_none())?;
                progress.ending = Some(StatusKind::Cancelled);
                go_up(progress, arm);
                None
            }
            CommandKind::Hold => {
                let here = arm.tool();
                // The motion is over: having arrived here is not having reached its next point.
                if let Some(progress) = &mut self.running {
                    progress.ending.get_or_insert(StatusKind::Cancelled);
                }
                // A refusal leaves the arm where its last target is: it stands still there, too.
                arm.go(here).err().map(StatusKind::Failed)
            }
        }
    }

    fn start(&mut self, command_id: u64, motion: &Motion, arm: &mut dyn Arm) -> StatusKind {
        if self.running.is_some() {
            return StatusKind::Failed("another motion is running".to_owned());
        }
        let Some(first) = motion.waypoints.first() else {
            return StatusKind::Failed("the motion has no waypoints".to_owned());
        };
        if let Err(reason) = arm.go(target(first)) {
            return StatusKind::Failed(reason);
        }
        let waypoints = motion.waypoints.clone();
        self.running = Some(Progress { command_id, waypoints, phase: 0, ending: None });
        StatusKind::Accepted
    }

    /// Moves the next release of the running motion, with the way there and away from it, by so much
    /// along x and y; whether a release is still to come.
    pub fn move_release(&mut self, by_m: [f64; 2], arm: &mut dyn Arm) -> bool {
        let Some(progress) = self.running.as_mut().filter(|p| p.ending.is_none()) else {
            return false;
        };
        let Progress { waypoints, phase, .. } = progress;
        let is_release = |i: &usize| {
            waypoints[i - 1].expect == Expect::Holding && waypoints[*i].expect == Expect::Empty
        };
        let Some(release) = (*phase + 1..waypoints.len()).find(is_release) else { return false };
        let goal = waypoints[release].position;
        let is_there = |w: &Waypoint| w.position.xy() == goal.xy();
        // Only what follows the grasp: an object may be put down where it was taken.
        let before = waypoints[..release].windows(2).rev();
        let carried = |pair: &&[Waypoint]| {
            pair.iter().all(|w| w.expect == Expect::Holding) && is_there(&pair[1])
        };
        let first = release - before.take_while(carried).count();
        let n_after = waypoints[release..].iter().take_while(|w| is_there(w)).count();
        for waypoint in &mut waypoints[first..release + n_after] {
            waypoint.position.x += by_m[0];
            waypoint.position.y += by_m[1];
        }
        if first <= *phase
            && let Err(reason) = arm.go(target(&waypoints[*phase]))
        {
            tracing::warn!(reason, "the robot goes on to where it was going");
        }
        true
    }

    /// Ends the running motion as if it had been carried out; whether one was running.
    pub fn end_as_done(&mut self, arm: &mut dyn Arm) -> bool {
        let Some(progress) = self.running.as_mut().filter(|p| p.ending.is_none()) else {
            return false;
        };
        progress.ending = Some(StatusKind::Done);
        go_up(progress, arm);
        true
    }

    /// Carries on; returns the command that has ended, and how.
    pub fn tick(&mut self, arm: &mut dyn Arm) -> Option<(u64, StatusKind)> {
        let progress = self.running.as_mut()?;
        if !arm.has_arrived() {
            return None;
        }
        if let Some(ending) = progress.ending.take() {
            let command_id = progress.command_id;
            self.running = None;
            return Some((command_id, ending));
        }
        let reached = progress.waypoints.get(progress.phase)?;
        let trouble = match (reached.expect, arm.is_holding()) {
            (Expect::Anything, _) | (Expect::Empty, false) | (Expect::Holding, true) => None,
            (Expect::Empty, true) => Some("something is still in the gripper".to_owned()),
            (Expect::Holding, false) => Some("nothing is in the gripper".to_owned()),
        };
        let trouble = trouble.or_else(|| {
            progress.phase += 1;
            progress.waypoints.get(progress.phase).and_then(|next| arm.go(target(next)).err())
        });
        if let Some(reason) = trouble {
            progress.ending = Some(StatusKind::Failed(reason));
            go_up(progress, arm);
            return None;
        }
        if progress.phase < progress.waypoints.len() {
            return None;
        }
        let command_id = progress.command_id;
        self.running = None;
        Some((command_id, StatusKind::Done))
    }
}

fn target(waypoint: &Waypoint) -> Target {
    let Waypoint { position, yaw_rad, opening_m, speed_m_s, .. } = *waypoint;
    Target { position, yaw_rad, opening_m, speed_m_s }
}

/// Straight up to the highest point of the motion, jaws as they are.
fn go_up(progress: &Progress, arm: &mut dyn Arm) {
    let here = arm.tool();
    let top_z = progress.waypoints.iter().map(|w| w.position.z).fold(here.position.z, f64::max);
    let speed_m_s = progress.waypoints.iter().map(|w| w.speed_m_s).fold(here.speed_m_s, f64::max);
    let position = Point3::new(here.position.x, here.position.y, top_z);
    let opening_m = if arm.is_holding() { 0.0 } else { here.opening_m };
    if let Err(reason) = arm.go(Target { position, opening_m, speed_m_s, ..here }) {
        tracing::warn!(reason, "the robot cannot go up");
    }
}
