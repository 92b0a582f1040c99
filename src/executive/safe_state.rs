//! When a robot that moves must hold: the one place that decides it. `docs/safe-state.md` has the table.

use std::fmt;

use super::Limits;
use crate::messages::CommandKind;

/// A camera may miss this many frames in a row before nobody watches.
const FRAMES_MISSED_MAX: f64 = 3.0;

/// Who watches the robot, as the executor knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Watch {
    /// Whether the episode has ended, with whatever verdict.
    pub is_over: bool,
    /// Whether the loop is paused.
    pub is_paused: bool,
    /// Since the newest plan has come, which every frame leads to, nanoseconds.
    pub plan_ns: u64,
    /// Since the newest state of the robot has come, nanoseconds.
    pub robot_ns: u64,
    /// Since the picture of the newest scene was captured, nanoseconds.
    pub scene_age_ns: u64,
    /// Since the newest state of the robot was taken, nanoseconds.
    pub robot_age_ns: u64,
}

/// For how long each of them may be missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WatchBounds {
    /// `limits.unwatched_ms_max`.
    pub unwatched_ms_max: u64,
    /// `limits.state_age_ms_max`.
    pub state_age_ms_max: u64,
    /// Time between two frames, seconds.
    pub frame_s: f64,
}

/// Why the robot must hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HoldCause {
    /// The episode has ended.
    Over,
    /// Somebody has paused the loop.
    Paused,
    /// No frame has led to a plan for so long.
    NoPlan(Overdue),
    /// The robot says nothing.
    NoRobotState(Overdue),
    /// The newest scene shows what was.
    OldScene(Overdue),
    /// The newest state of the robot says what was.
    OldRobotState(Overdue),
}

/// A time and what it may be, milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overdue {
    /// How long it is.
    pub ms: f64,
    /// How long it may be.
    pub ms_max: f64,
}

/// A time in nanoseconds, what it may be in milliseconds, and the cause when it is longer.
type Row = (u64, f64, fn(Overdue) -> HoldCause);

impl WatchBounds {
    /// Those of a run file, with the time between two frames in seconds.
    pub fn of(limits: &Limits, frame_s: f64) -> Self {
        let Limits { unwatched_ms_max, state_age_ms_max, .. } = *limits;
        Self { unwatched_ms_max, state_age_ms_max, frame_s }
    }

    /// How long nothing may come, milliseconds: three frames at least.
    pub fn silence_ms_max(&self) -> f64 {
        (self.unwatched_ms_max as f64).max(1000.0 * FRAMES_MISSED_MAX * self.frame_s)
    }

    /// How old what counts as new may be, milliseconds: as old as it may be for a step to start, and then nothing
    /// newer for as long as nothing may come.
    pub fn age_ms_max(&self) -> f64 {
        self.state_age_ms_max as f64 + self.silence_ms_max()
    }
}

impl Watch {
    /// Why the robot must hold; nothing when it may go on.
    pub fn hold_cause(&self, bounds: &WatchBounds) -> Option<HoldCause> {
        if self.is_over {
            return Some(HoldCause::Over);
        }
        if self.is_paused {
            return Some(HoldCause::Paused);
        }
        let (silence, age) = (bounds.silence_ms_max(), bounds.age_ms_max());
        let rows: [Row; 4] = [
            (self.plan_ns, silence, HoldCause::NoPlan),
            (self.robot_ns, silence, HoldCause::NoRobotState),
            (self.scene_age_ns, age, HoldCause::OldScene),
            (self.robot_age_ns, age, HoldCause::OldRobotState),
        ];
        rows.into_iter().find_map(|(ns, ms_max, cause)| {
            let ms = ns as f64 / 1e6;
            (ms > ms_max).then(|| cause(Overdue { ms, ms_max }))
        })
    }
}

/// What a robot is told when it shall be told `wanted`: nothing that lets it move while it must hold.
pub fn safe_command(wanted: CommandKind, cause: Option<&HoldCause>) -> CommandKind {
    match (wanted, cause) {
        (CommandKind::Continue | CommandKind::Start(_), Some(_)) => CommandKind::Hold,
        (wanted, _) => wanted,
    }
}

impl fmt::Display for HoldCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SILENCE: &str = "limits.unwatched_ms_max, three frames";
        const AGE: &str = "limits.state_age_ms_max + limits.unwatched_ms_max";
        f.write_str("the robot holds: ")?;
        match self {
            Self::Over => f.write_str("the episode has ended"),
            Self::Paused => f.write_str("the loop is paused"),
            Self::NoPlan(Overdue { ms, ms_max }) => {
                write!(f, "no frame has led to a plan for {ms:.0} ms ({SILENCE}: {ms_max:.0})")
            }
            Self::NoRobotState(Overdue { ms, ms_max }) => {
                write!(f, "no state of the robot for {ms:.0} ms ({SILENCE}: {ms_max:.0})")
            }
            Self::OldScene(Overdue { ms, ms_max }) => {
                write!(f, "the newest scene is {ms:.0} ms old ({AGE}: {ms_max:.0})")
            }
            Self::OldRobotState(Overdue { ms, ms_max }) => {
                write!(f, "the newest state of the robot is {ms:.0} ms old ({AGE}: {ms_max:.0})")
            }
        }
    }
}
