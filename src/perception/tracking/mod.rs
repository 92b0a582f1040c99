//! The scene parser: detections of one frame in, the domain-conditioned scene graph out.
//!
//! Pure: its memory is a value, everything else arrives with the frame. The stages are those of
//! the paper's state grounding function, plus what a loop needs: names that stay (`tracker`), occlusion by the robot
//! itself (`occlusion`), places that are seen to be empty (`free_space`), what the gripper holds (`gripper`), and one
//! belief that the planner and the executor rely on (`belief`).

mod streak;
mod occlusion;
mod free_space;
mod tracker;
mod belief;
mod gripper;
mod handover;
mod parse;
#[cfg(test)]
mod tests;

use schemars::JsonSchema;
use serde::Deserialize;

use super::grounders::Grounder;
use super::model::Perception;
use super::{Detections, FrameView, Pipeline};
use crate::messages::{Dispatch, RobotState, Status};
use crate::pddl::{Axiom, Domain};
use crate::scene::FrameRef;
use crate::skills::SkillMap;

pub use occlusion::SelfFilterConfig;
pub use parse::SceneParser;

/// `[perception]` of a run file: what depends on the camera and on time, not on the domain.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeliefConfig {
    /// How long a change must be seen, in every frame that shows it, before it is believed, seconds; that takes
    /// two frames at least. 0: at once.
    pub confirm_s: f64,
    /// How long an object which cannot be seen keeps its last facts, seconds; then they are unknown.
    pub hidden_s_max: f64,
    /// How near to the tool centre an object must be to count as taken, metres.
    pub grasp_reach_m: f64,
}

impl BeliefConfig {
    fn confirm_ns(&self) -> u64 {
        (self.confirm_s * 1e9) as u64
    }

    fn hidden_ns_max(&self) -> u64 {
        (self.hidden_s_max * 1e9) as u64
    }
}

/// What does not change during an episode.
#[expect(missing_debug_implementations, reason = "a grounder is known by its name only")]
pub struct ParserConfig {
    /// Types, predicates and constants.
    pub domain: Domain,
    /// Its perception file.
    pub perception: Perception,
    /// Its completion rules.
    pub rules: Vec<Axiom>,
    /// How its actions are carried out: says which object a running step carries.
    pub skills: SkillMap,
    /// Judges tuples of boxes.
    pub grounder: Box<dyn Grounder>,
    /// Confirmation.
    pub belief: BeliefConfig,
    /// The robot's own shape; `None` without a robot.
    pub self_filter: Option<SelfFilterConfig>,
}

impl ParserConfig {
    /// The way from detections to facts.
    pub fn pipeline(&self) -> Pipeline<'_> {
        Pipeline {
            domain: &self.domain,
            perception: &self.perception,
            rules: &self.rules,
            grounder: &*self.grounder,
        }
    }
}

/// What comes with a frame besides its detections.
#[derive(Debug, Clone, Copy)]
pub struct FrameContext<'a> {
    /// Which frame it is, and when it was captured.
    pub cause: FrameRef,
    /// What the camera shows in it; of several cameras the one whose image all boxes are in.
    pub view: FrameView<'a>,
    /// What other cameras show of the same moment.
    pub others: &'a [OtherView<'a>],
    /// The newest robot state, where there is a robot.
    pub robot: Option<&'a RobotState>,
    /// Steps that the robot was told to carry out since the last frame.
    pub dispatches: &'a [Dispatch],
    /// What the robot has said since the last frame.
    pub statuses: &'a [Status],
}

/// What another camera shows of the moment of a frame.
#[derive(Debug, Clone)]
pub struct OtherView<'a> {
    /// The camera's name.
    pub camera: &'a str,
    /// Its image, with depth and pose.
    pub view: FrameView<'a>,
    /// What was found in it.
    pub detections: Detections,
}
