//! Skills: an action of the plan becomes a motion, from what was perceived.
//!
//! A skill is general (`pick`, `place`); `skills.toml` of a domain says which actions use which
//! skills with which of their parameters. A skill is one file with one line in [`SKILLS`].

mod skill_map;
mod context;
mod pick;
mod place;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use thiserror::Error;

use crate::messages::Motion;
use crate::parts::{Registry, Role};
use crate::pddl::Name;

pub use context::{Held, MotionConfig, SkillContext};
pub use skill_map::{ActionSkills, Preempt, SkillCall, SkillMap, SkillMapError};

/// A skill: appends the waypoints that carry it out.
///
/// Pure: the same perceived scene gives the same motion.
pub trait Skill: std::fmt::Debug + Send + Sync {
    /// Appends its waypoints and leaves the context as it will be afterwards.
    ///
    /// # Errors
    /// [`SkillError`] when what was perceived does not allow it.
    fn extend(
        &self,
        args: &BTreeMap<&str, Name>,
        context: &mut SkillContext<'_>,
        motion: &mut Motion,
    ) -> Result<(), SkillError>;
}

/// A skill needs nothing but its arguments. What its table calls options are the keys that stand
/// beside `skill` in `skills.toml`: its parameters.
impl Role for dyn Skill {
    type Inputs<'a> = ();
    const NAME: &'static str = "skill";
    const KEY: &'static str = "action.sequence.skill";
    const OPTIONS: &'static str = "action.sequence";
}

/// Every skill by its name in `skills.toml`, in alphabetical order.
pub static SKILLS: Registry<dyn Skill> = Registry(&[pick::PART, place::PART]);

/// What was perceived does not allow a skill.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SkillError {
    /// The scene has no such object.
    #[error("{object} is not in the scene")]
    Unseen {
        /// Name of the object that the skill is about.
        object: Name,
    },
    /// The object has no place in the world.
    #[error("the place of {object} in the world is not known: no depth or no camera pose")]
    NoVolume {
        /// Name of the object that the skill is about.
        object: Name,
    },
    /// The jaws do not open far enough.
    #[error("{object} is {width_m:.3} m wide; the jaws open to {opening_m_max:.3} m")]
    TooWide {
        /// Name of the object that the skill is about.
        object: Name,
        /// Its width across the fingers, metres.
        width_m: f64,
        /// The limit.
        opening_m_max: f64,
    },
    /// The place is out of reach.
    #[error(
        "{object} at ({x:.2}, {y:.2}) m is outside the workspace: robot.motion.{key} = [{}, {}]",
        span_m[0], span_m[1]
    )]
    OutOfReach {
        /// Name of the object that the skill is about.
        object: Name,
        /// The bound that it is beyond, by its key.
        key: &'static str,
        /// That bound.
        span_m: [f64; 2],
        /// Its place along x.
        x: f64,
        /// Its place along y.
        y: f64,
    },
    /// Nothing is held that could be placed.
    #[error("{object} should be placed but is not in the gripper")]
    NotHeld {
        /// Name of the object that the skill is about.
        object: Name,
    },
    /// The gripper is full.
    #[error("{object} should be picked but the gripper holds something")]
    HandFull {
        /// Name of the object that the skill is about.
        object: Name,
    },
    /// The table is full.
    #[error(
        "no free place of {width_m:.3} m on the table within robot.motion.place_x_m and reach_y_m"
    )]
    NoFreePlace {
        /// The width that was looked for.
        width_m: f64,
    },
    /// The target is full.
    #[error("no free place of {width_m:.3} m on {target}, with room for the fingers")]
    NoPlaceOn {
        /// What it should come to rest on.
        target: Name,
        /// The width that was looked for, metres.
        width_m: f64,
    },
    /// `skills.toml` says nothing of this action.
    #[error("no skill for action {action} in skills.toml")]
    NoSkill {
        /// Name of the action schema.
        action: Name,
    },
}
