//! `skills.toml`: which skills carry out which action.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;

use super::{Held, MotionConfig, SKILLS, Skill, SkillContext, SkillError};
use crate::messages::{Motion, RobotState};
use crate::mismatch::Mismatch;
use crate::parts::{PartChoice, PartContext, PartError};
use crate::pddl::{Domain, Name, Step};
use crate::scene::SceneObject;
use crate::settings::{SettingsProblem, TomlFile, joined, near_hint};

/// The skills of a domain's actions.
#[derive(Debug, Clone)]
pub struct SkillMap {
    actions: BTreeMap<Name, ActionSkills>,
    /// Every skill that an action uses, made once.
    skills: BTreeMap<String, Arc<dyn Skill>>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct BookFile {
    action: Vec<ActionSkills>,
}

/// How one action is carried out.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ActionSkills {
    /// Name of the action schema.
    pub name: Name,
    /// Whether it may be broken off before its point of no return.
    pub preempt: Preempt,
    /// The skills, one after the other.
    pub sequence: Vec<SkillCall>,
    /// Names of the action's parameters, in order; filled in from the domain.
    #[serde(skip)]
    params: Vec<Name>,
}

/// What to do with a running action that the plan no longer wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Preempt {
    /// Go up and keep what is held, wherever the motion allows it.
    Retract,
    /// Go up only while nothing is held; otherwise finish, since the domain cannot describe an
    /// object in the gripper.
    RetractEmpty,
}

/// One skill with its parameters: `?x` is a parameter of the action.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
pub struct SkillCall {
    /// A key of [`SKILLS`].
    pub skill: String,
    /// Values by the skill's parameter names.
    #[serde(flatten)]
    pub args: BTreeMap<String, String>,
}

/// A `skills.toml` is not usable.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SkillMapError {
    /// Not TOML, not of the documented form, or at odds with the domain or the skills that there
    /// are: every fault at its place.
    #[error("{}", joined(.0))]
    File(Vec<SettingsProblem>),
    /// A skill cannot be made.
    #[error(transparent)]
    Part(#[from] PartError),
}

impl SkillMap {
    /// A book without skills, for runs without a robot.
    pub fn empty() -> Self {
        Self { actions: BTreeMap::new(), skills: BTreeMap::new() }
    }

    /// Reads `skills.toml` and checks it against the domain; `file` is named in errors.
    ///
    /// # Errors
    /// [`SkillMapError`] with file, line and key: unknown key, action, skill or parameter.
    pub fn parse(file: &str, text: &str, domain: &Domain) -> Result<Self, SkillMapError> {
        let toml = TomlFile::parse(file, text).map_err(SkillMapError::File)?;
        let book: BookFile = toml.read().map_err(SkillMapError::File)?;
        let fault = |mismatch| SkillMapError::File(vec![toml.located(mismatch)]);
        let (mut actions, mut skills) = (BTreeMap::new(), BTreeMap::new());
        for (idx, mut action) in book.action.into_iter().enumerate() {
            let at = format!("action[{idx}]");
            action.params = params_of(&action.name, &at, domain).map_err(fault)?;
            for (idx, call) in action.sequence.iter().enumerate() {
                let at = format!("{at}.sequence[{idx}]");
                check_call(call, &at, &action.params).map_err(fault)?;
                skills.insert(call.skill.clone(), built(&call.skill)?);
            }
            if actions.contains_key(&action.name) {
                let got = format!("a second one of {}", action.name);
                return Err(fault(Mismatch::new(at + ".name", "one entry per action", got)));
            }
            actions.insert(action.name.clone(), action);
        }
        if let Some(action) = domain.actions.iter().find(|a| !actions.contains_key(&a.name)) {
            let expected = "an entry for every action of the domain";
            let got = format!("none for {}", action.name);
            return Err(fault(Mismatch::new("action", expected, got)));
        }
        Ok(Self { actions, skills })
    }

    /// How an action is carried out.
    pub fn action(&self, name: &Name) -> Option<&ActionSkills> {
        self.actions.get(name)
    }

    /// The object that a step moves: the first `object` of its skills.
    pub fn carried(&self, step: &Step) -> Option<Name> {
        let action = self.actions.get(&step.action)?;
        let call = action.sequence.iter().find(|call| call.args.contains_key("object"))?;
        action.args(call, step).remove("object")
    }

    /// The objects that a step goes to, the carried one included.
    pub fn target_objects(&self, step: &Step) -> Vec<Name> {
        let Some(action) = self.actions.get(&step.action) else { return Vec::new() };
        let calls = action.sequence.iter().map(|call| action.args(call, step));
        let mut names: Vec<Name> = calls.flat_map(BTreeMap::into_values).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// The motion of a step, and what the gripper holds after it.
    ///
    /// # Errors
    /// [`SkillError`] when what was perceived does not allow it.
    pub fn motion(
        &self,
        step: &Step,
        objects: &[SceneObject],
        robot: &RobotState,
        held: Option<Held>,
        config: &MotionConfig,
    ) -> Result<(Motion, Option<Held>), SkillError> {
        let action = self
            .actions
            .get(&step.action)
            .ok_or_else(|| SkillError::NoSkill { action: step.action.clone() })?;
        let mut context = SkillContext::new(objects, config, robot, held);
        let mut motion = Motion::default();
        for call in &action.sequence {
            if let Some(skill) = self.skills.get(&call.skill) {
                skill.extend(&action.args(call, step), &mut context, &mut motion)?;
            }
        }
        Ok((motion, context.held))
    }
}

impl ActionSkills {
    /// A skill's arguments, with the step's objects for the action's parameters.
    fn args<'a>(&self, call: &'a SkillCall, step: &Step) -> BTreeMap<&'a str, Name> {
        let value = |text: &str| match text.strip_prefix('?') {
            Some(param) => {
                let at = self.params.iter().position(|p| *p == param);
                at.and_then(|at| step.args.get(at).cloned())
            }
            None => Some(Name::new(text)),
        };
        call.args.iter().filter_map(|(key, text)| Some((key.as_str(), value(text)?))).collect()
    }
}

fn built(name: &str) -> Result<Arc<dyn Skill>, PartError> {
    let choice = PartChoice::new("skill", name);
    let context = PartContext { choice: &choice, inputs: (), environment: |_| None };
    Ok(SKILLS.build(&context)?.into())
}

/// The parameters of a domain's action; `at` is where its entry stands.
fn params_of(name: &Name, at: &str, domain: &Domain) -> Result<Vec<Name>, Mismatch> {
    let Some(action) = domain.action(name.as_str()) else {
        let known: Vec<&str> = domain.actions.iter().map(|action| action.name.as_str()).collect();
        let expected = format!("an action of the domain ({})", known.join(", "));
        let got = format!("{name}{}", near_hint(name.as_str(), known));
        return Err(Mismatch::new(format!("{at}.name"), expected, got));
    };
    Ok(action.params.iter().map(|param| param.name.clone()).collect())
}

/// Checks one skill of an action with these parameters; `at` is where it stands.
fn check_call(call: &SkillCall, at: &str, params: &[Name]) -> Result<(), Mismatch> {
    let Some(skill) = SKILLS.get(&call.skill) else {
        let known: Vec<&str> = SKILLS.names().collect();
        let got = format!("{}{}", call.skill, near_hint(&call.skill, known.clone()));
        return Err(Mismatch::new(format!("{at}.skill"), known.join(" or "), got));
    };
    let described = skill.described();
    let known: Vec<&str> = described.iter().map(|param| param.name.as_str()).collect();
    // A misspelt parameter is why another one is missing.
    if let Some(key) = call.args.keys().find(|key| !known.contains(&key.as_str())) {
        let expected = format!("a parameter of {} ({})", call.skill, known.join(", "));
        let got = format!("{key}{}", near_hint(key, known));
        return Err(Mismatch::new(format!("{at}.{key}"), expected, got));
    }
    for param in described.iter().filter(|param| param.required) {
        if !call.args.contains_key(&param.name) {
            let expected = format!("a value for {} of {}", param.name, call.skill);
            return Err(Mismatch::new(at, expected, "none"));
        }
    }
    for (key, text) in &call.args {
        let Some(named) = text.strip_prefix('?') else { continue };
        if !params.iter().any(|param| *param == named) {
            let known: Vec<String> = params.iter().map(|param| format!("?{param}")).collect();
            let expected = format!("a parameter of the action ({})", known.join(", "));
            let near = near_hint(text, known.iter().map(String::as_str));
            return Err(Mismatch::new(format!("{at}.{key}"), expected, format!("{text}{near}")));
        }
    }
    Ok(())
}
