//! Every bound of the loop, by its name in the run file.

use schemars::JsonSchema;
use serde::Deserialize;

/// `[limits]` of a run file. When one is met, the verdict names it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Most cycles of an episode.
    pub cycles_max: u64,
    /// Longest episode in run time, seconds.
    pub seconds_max: f64,
    /// How long is waited for a scene to settle or an unknown fact to show before the next step, seconds;
    /// but for eight frames at least.
    pub observing_s_max: f64,
    /// How long a goal object may stay unseen, seconds; but for eight frames at least.
    pub unseen_s_max: f64,
    /// How long the goal must be seen to hold, with everything at rest, before it counts as reached, seconds.
    pub goal_rest_s: f64,
    /// Most plans in a row that come too late: the planner used up a budget or its deadline.
    pub planner_timeouts_max: u32,
    /// Most failed skills of an episode.
    pub failures_max: u32,
    /// Most returns to the same state before the loop counts as going in circles.
    pub revisits_max: u32,
    /// Oldest scene that a skill may be started on, milliseconds.
    pub state_age_ms_max: u64,
    /// How long a robot that moves may go without a frame that has led to a plan, or say nothing itself, before
    /// it is told to hold, milliseconds; realtime only, and three frames at least.
    pub unwatched_ms_max: u64,
    /// Longest skill in run time, seconds.
    pub skill_timeout_s: f64,
    /// How far an object may be from where a running skill expects it, metres.
    pub target_moved_m_max: f64,
}

/// A frame counts for at most this part of a budget of time: a slow camera has as many frames.
const FRAMES_MIN: u64 = 8;

/// Time spent on looking, of a budget in seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct LookTime {
    ns: u64,
}

impl LookTime {
    /// With one more frame, `frame_ns` after the one before.
    pub(super) fn after(self, frame_ns: u64, max_s: f64) -> Self {
        Self { ns: self.ns + frame_ns.min(budget_ns(max_s) / FRAMES_MIN) }
    }

    /// Whether more than the budget is spent.
    pub(super) fn exceeds(self, max_s: f64) -> bool {
        self.ns > budget_ns(max_s)
    }

    /// How many of `n` equal shares of the budget are spent.
    pub(super) fn shares(self, n: usize, max_s: f64) -> usize {
        let share_ns = (budget_ns(max_s) / (n.max(1) as u64)).max(1);
        usize::try_from(self.ns / share_ns).unwrap_or(usize::MAX)
    }

    /// Whether nothing is spent.
    pub(super) fn is_zero(self) -> bool {
        self.ns == 0
    }
}

fn budget_ns(max_s: f64) -> u64 {
    (max_s * 1e9) as u64
}
