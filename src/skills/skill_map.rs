//! `skills.toml`: which skills carry out which action.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Deserialize;
use thiserror::Error;

use super::{Held, MotionConfig, SKILLS, Skill, SkillContext, SkillError};
use crate::messages::{Motion, RobotState};
use crate::parts::{PartChoice, PartContext, PartError};
use crate::pddl::{Domain, Name, Step};
use crate::scene::SceneObject;

/// The skills of a domain's actions.
#[derive(Debug, Clone)]
pub struct SkillMap {
    actions: BTreeMap<Name, ActionSkills>,
    /// Every skill that an action uses, made once.
    skills: BTreeMap<String, Arc<dyn Skill>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BookFile {
    action: Vec<ActionSkills>,
}

/// How one action is carried out.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActionSkills {
    /// Name of the action schema that has no skill, or a wrong one.
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preempt {
    /// Go up and keep what is held, wherever the motion allows it.
    Retract,
    /// Go up only while nothing is held; otherwise finish, since the domain cannot describe an
    /// object in the gripper.
    RetractEmpty,
}

/// One skill with its parameters: `?x` is a parameter of the action.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
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
    /// Not TOML, or not of the documented form.
    #[error("{file}: {message}")]
    Form {
        /// Path of the `skills.toml`.
        file: String,
        /// What the parser says, with line and column.
        message: String,
    },
    /// A skill cannot be made.
    #[error(transparent)]
    Part(#[from] PartError),
    /// It contradicts the domain or the skills that there are.
    #[error("{file}: action {action}: {field}: expected {expected}, got {got}")]
    Value {
        /// Path of the `skills.toml`.
        file: String,
        /// Name of the action schema that has no skill, or a wrong one.
        action: Name,
        /// The key.
        field: String,
        /// What may stand there.
        expected: String,
        /// What does.
        got: String,
    },
}

impl SkillMap {
    /// A book without skills, for runs without a robot.
    pub fn empty() -> Self {
        Self { actions: BTreeMap::new(), skills: BTreeMap::new() }
    }

    /// Reads `skills.toml` and checks it against the domain; `file` is named in errors.
    ///
    /// # Errors
    /// [`SkillMapError`] with file and key: unknown action, skill or parameter.
    pub fn parse(file: &str, text: &str, domain: &Domain) -> Result<Self, SkillMapError> {
        let book: BookFile = toml::from_str(text)
            .map_err(|e| SkillMapError::Form { file: file.to_owned(), message: e.to_string() })?;
        let (mut actions, mut skills) = (BTreeMap::new(), BTreeMap::new());
        for mut action in book.action {
            let fault = |field: &str, expected: String, got: &str| SkillMapError::Value {
                file: file.to_owned(),
                action: action.name.clone(),
                field: field.to_owned(),
                expected,
                got: got.to_owned(),
            };
            let schema = domain.action(action.name.as_str()).ok_or_else(|| {
                fault("name", "an action of the domain".to_owned(), action.name.as_str())
            })?;
            let params: Vec<Name> = schema.params.iter().map(|p| p.name.clone()).collect();
            for call in &action.sequence {
                check_call(call, &params)
                    .map_err(|(field, expected, got)| fault(&field, expected, &got))?;
                skills.insert(call.skill.clone(), built(&call.skill)?);
            }
            if actions.contains_key(&action.name) {
                return Err(fault("name", "one entry per action".to_owned(), "two"));
            }
            action.params = params;
            actions.insert(action.name.clone(), action);
        }
        if let Some(action) = domain.actions.iter().find(|a| !actions.contains_key(&a.name)) {
            return Err(SkillMapError::Value {
                file: file.to_owned(),
                action: action.name.clone(),
                field: "action".to_owned(),
                expected: "an entry for every action of the domain".to_owned(),
                got: "none".to_owned(),
            });
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

fn check_call(call: &SkillCall, params: &[Name]) -> Result<(), (String, String, String)> {
    let Some(skill) = SKILLS.get(&call.skill) else {
        let known: Vec<&str> = SKILLS.names().collect();
        return Err(("skill".to_owned(), known.join(" or "), call.skill.clone()));
    };
    let known = skill.described();
    for param in known.iter().filter(|param| param.required) {
        if !call.args.contains_key(&param.name) {
            let expected = format!("a value for {}", param.name);
            return Err((call.skill.clone(), expected, "none".to_owned()));
        }
    }
    for (key, text) in &call.args {
        if !known.iter().any(|param| param.name == *key) {
            let known: Vec<&str> = known.iter().map(|param| param.name.as_str()).collect();
            return Err((call.skill.clone(), known.join(", "), key.clone()));
        }
        let named = text.strip_prefix('?');
        if named.is_some_and(|param| !params.iter().any(|p| *p == param)) {
            let field = format!("{}.{key}", call.skill);
            return Err((field, "a parameter of the action".to_owned(), text.clone()));
        }
    }
    Ok(())
}
