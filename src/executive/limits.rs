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
    /// Most frames in a row that are waited for a scene to settle or an unknown fact to show.
    pub observations_max: u32,
    /// Most frames that a goal object may stay unseen.
    pub unseen_frames_max: u32,
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
    /// Longest skill in run time, seconds.
    pub skill_timeout_s: f64,
    /// How far an object may be from where a running skill expects it, metres.
    pub target_moved_m_max: f64,
}
