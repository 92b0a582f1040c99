//! Faults of the robot: it does not do what it is told, and may not know.

use groundloop_sim::{FaultError, GripperCommand, Random, World};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::schedule::Tag;
use crate::hardware::{Arm, Sequencer, Target};
use crate::metrics::FaultRecord;

/// Jaws that are told to go below this opening shall take something, in metres.
const CLOSED_M: f64 = 0.001;
/// How fast a slipping object slides down between the fingers, in metres per second.
const SLIDE_M_S: f64 = 0.015;
/// How long an object slips before it falls, in seconds: drawn between these.
const SLIP_S: [f64; 2] = [0.3, 1.2];
/// Speed that is reported for the tool at rest, and used for going back to where it is.
const HOLD_SPEED_M_S: f64 = 0.5;

/// One thing that the robot does wrongly. Written in run files with the key `kind`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ActingFault {
    /// The next time the jaws close, they hold nothing: what is between them slides out.
    MissGrasp {},
    /// What is held falls at once.
    Drop {},
    /// What is held sinks between the fingers, and falls after 0.3 to 1.2 s; the seed draws when.
    Slip {},
    /// The running motion, or the next one that lets something go, lets go that far off its goal: the
    /// tool goes there.
    PlaceOff {
        /// How far off, x and y in metres.
        by_m: [f64; 2],
    },
    /// The arm stands still, jaws too, and goes on afterwards.
    Hang {
        /// For how long, seconds of simulated time.
        for_s: f64,
    },
    /// The running step, or the next one, is broken off: the tool goes straight up with the jaws as they
    /// are, and reports success.
    FalseSuccess {},
    /// The jaws do not move while the arm does.
    Jam {
        /// For how long, seconds of simulated time.
        for_s: f64,
    },
}

impl ActingFault {
    /// The kinds of this group, as run files have them.
    pub(super) const KINDS: [&'static str; 7] =
        ["miss_grasp", "drop", "slip", "place_off", "hang", "false_success", "jam"];

    /// Checks its numbers.
    ///
    /// # Errors
    /// [`FaultError::BadNumber`].
    pub fn check(&self) -> Result<(), FaultError> {
        match self {
            Self::Hang { for_s } | Self::Jam { for_s } => FaultError::check_duration(*for_s),
            Self::PlaceOff { by_m } => FaultError::check_offset(*by_m),
            Self::MissGrasp {} | Self::Drop {} | Self::Slip {} | Self::FalseSuccess {} => Ok(()),
        }
    }
}

/// What is wrong with the arm now, and what will be at its next occasion.
#[derive(Debug, Clone, Default)]
pub(in crate::hardware::sim) struct ArmFaults {
    /// The newest target, as the motion wants it.
    wanted: Option<Target>,
    /// Until when the arm stands still.
    hang_until_ns: Option<u64>,
    /// Until when the jaws do not move, and their opening.
    jam: Option<(u64, f64)>,
    /// When what slips will fall.
    slip_until_ns: Option<u64>,
    /// What waits for its occasion.
    waiting: Vec<(Tag, ActingFault)>,
    /// What has waited and happened, for whoever writes it down.
    pub(in crate::hardware::sim) happened: Vec<FaultRecord>,
}

/// What came of a fault: done, or why not.
type Said = Result<String, String>;

impl ArmFaults {
    /// Lets a fault begin; `None` when it waits for its occasion.
    pub(super) fn begin(
        &mut self,
        fault: &ActingFault,
        tag: &Tag,
        mut draws: Random,
        robot: RobotParts<'_>,
    ) -> Option<Said> {
        let RobotParts { world, sequencer, has_step } = robot;
        let now_ns = world.time_ns();
        let later = |seconds: f64| now_ns.saturating_add((seconds * 1e9) as u64);
        let empty = || FaultError::NothingHeld.to_string();
        let said = match fault {
            ActingFault::Drop {} => {
                let fallen = world.let_fall();
                fallen.map(|object| format!("the gripper drops {object}")).ok_or_else(empty)
            }
            ActingFault::Slip {} => {
                let seconds = draws.between(SLIP_S[0], SLIP_S[1]);
                let slips = world.held().map(|object| {
                    format!("{object} slips in the gripper, and falls after {seconds:.1} s")
                });
                self.slip_until_ns = slips.is_some().then(|| later(seconds)).or(self.slip_until_ns);
                slips.ok_or_else(empty)
            }
            ActingFault::Hang { for_s } => {
                let here = SimArm { world, faults: self }.tool();
                self.hang_until_ns = Some(later(*for_s));
                send(world, here).map(|()| format!("the arm stands still for {for_s:.1} s"))
            }
            ActingFault::Jam { for_s } => {
                let opening_m = SimArm { world, faults: self }.tool().opening_m;
                self.jam = Some((later(*for_s), opening_m));
                self.resend(world);
                Ok(format!("the jaws are stuck for {for_s:.1} s"))
            }
            ActingFault::MissGrasp {}
            | ActingFault::FalseSuccess {}
            | ActingFault::PlaceOff { .. } => {
                self.waiting.push((tag.clone(), *fault));
                self.moving(RobotParts { world, sequencer, has_step });
                return None;
            }
        };
        Some(said)
    }

    /// A motion is running: what has waited for one happens.
    pub(in crate::hardware::sim) fn moving(&mut self, robot: RobotParts<'_>) {
        let RobotParts { world, sequencer, has_step } = robot;
        for (tag, fault) in std::mem::take(&mut self.waiting) {
            let arm = &mut SimArm { world, faults: self };
            let done = match fault {
                ActingFault::PlaceOff { by_m } => {
                    let [x, y] = by_m;
                    let moved = sequencer.move_release(by_m, arm);
                    moved.then(|| format!("the next release is off its goal by ({x:.3}, {y:.3}) m"))
                }
                ActingFault::FalseSuccess {} => (has_step && sequencer.end_as_done(arm))
                    .then(|| "the step is broken off, and success is reported".to_owned()),
                ActingFault::MissGrasp {}
                | ActingFault::Drop {}
                | ActingFault::Slip {}
                | ActingFault::Hang { .. }
                | ActingFault::Jam { .. } => None,
            };
            match done {
                Some(done) => self.has_happened(world, &tag, done),
                None => self.waiting.push((tag, fault)),
            }
        }
    }

    /// Ends what has lasted long enough, and lets what slips sink on. `period_ns` have passed.
    pub(in crate::hardware::sim) fn pass(&mut self, world: &mut World, period_ns: u64) {
        let now_ns = world.time_ns();
        if self.slip_until_ns.is_some_and(|until_ns| until_ns <= now_ns) {
            self.slip_until_ns = None;
            world.let_fall();
        } else if self.slip_until_ns.is_some() {
            world.slide_held(SLIDE_M_S * period_ns as f64 / 1e9);
        }
        if world.held().is_none() {
            self.slip_until_ns = None;
        }
        let hangs = self.hang_until_ns.take_if(|until_ns| *until_ns <= now_ns);
        let jams = self.jam.take_if(|(until_ns, _)| *until_ns <= now_ns);
        if hangs.is_some() || jams.is_some() {
            self.resend(world);
        }
    }

    /// Sends the arm where the motion wants it, as far as the faults let it go.
    fn resend(&mut self, world: &mut World) {
        let Some(mut target) = self.wanted.filter(|_| self.hang_until_ns.is_none()) else { return };
        if let Some((_, opening_m)) = self.jam {
            target.opening_m = opening_m;
        } else {
            self.miss(world, &target);
        }
        if let Err(reason) = send(world, target) {
            tracing::warn!(reason, "the arm cannot go on");
        }
    }

    /// Lets closing jaws miss, where a fault waits for that.
    fn miss(&mut self, world: &mut World, target: &Target) {
        let gripper = world.gripper();
        let is_grasp = target.opening_m < CLOSED_M && gripper.opening_m > CLOSED_M;
        if !is_grasp || gripper.holding {
            return;
        }
        for (tag, fault) in std::mem::take(&mut self.waiting) {
            if fault == (ActingFault::MissGrasp {}) {
                world.make_slippery();
                let done = "the jaws close and hold nothing".to_owned();
                self.has_happened(world, &tag, done);
            } else {
                self.waiting.push((tag, fault));
            }
        }
    }

    fn has_happened(&mut self, world: &World, tag: &Tag, done: String) {
        let held = world.held().map(str::to_owned).into_iter().collect();
        self.happened.push(super::record(world.time_ns(), tag, held, Ok(done)));
    }
}

/// The robot as a fault finds it.
pub(in crate::hardware::sim) struct RobotParts<'a> {
    pub(in crate::hardware::sim) world: &'a mut World,
    pub(in crate::hardware::sim) sequencer: &'a mut Sequencer,
    /// Whether a step of a plan is carried out.
    pub(in crate::hardware::sim) has_step: bool,
}

/// The gripper of a world, with what is wrong with it.
pub(in crate::hardware::sim) struct SimArm<'a> {
    pub(in crate::hardware::sim) world: &'a mut World,
    pub(in crate::hardware::sim) faults: &'a mut ArmFaults,
}

impl Arm for SimArm<'_> {
    fn go(&mut self, target: Target) -> Result<(), String> {
        command(target).check().map_err(|e| e.to_string())?;
        self.faults.wanted = Some(target);
        self.faults.resend(self.world);
        Ok(())
    }

    fn has_arrived(&self) -> bool {
        self.faults.hang_until_ns.is_none() && self.world.gripper().at_target
    }

    fn is_holding(&self) -> bool {
        self.world.gripper().holding
    }

    fn tool(&self) -> Target {
        let gripper = self.world.gripper();
        Target {
            position: gripper.position,
            yaw_rad: gripper.yaw_rad,
            opening_m: if gripper.holding { 0.0 } else { gripper.opening_m },
            speed_m_s: HOLD_SPEED_M_S,
        }
    }
}

fn command(target: Target) -> GripperCommand {
    let Target { position, yaw_rad, opening_m, speed_m_s } = target;
    GripperCommand { position, yaw_rad, opening_m, speed_m_s }
}

fn send(world: &mut World, target: Target) -> Result<(), String> {
    world.command(&command(target)).map_err(|e| e.to_string())
}
