//! The goal of one episode, over the objects that were detected.

use super::matching::{Matching, Nameless, inverse, nearest, renamed_condition};
use super::{EvalError, FittedDomain};
use crate::goals::{GoalError, GoalObject, GoalSource, Language, ParsedGoal, repaired};
use crate::pddl::{Condition, Name, SourceText, Typed, parse_goal};
use crate::perception::model::ObjectBox;
use crate::run::ConfigError;

/// Where a goal comes from.
#[derive(Debug, Clone, Copy)]
pub enum GoalFrom<'a> {
    /// The recorded answer of the language model, which speaks of the recorded boxes.
    Recorded {
        /// The answer's goal form.
        stub: &'a SourceText,
        /// The recorded boxes.
        boxes: &'a [ObjectBox],
    },
    /// The problem's own goal.
    Truth(&'a Condition),
    /// What a goal source understood.
    Parsed(&'a Result<ParsedGoal, GoalFault>),
}

/// Why there is no goal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GoalFault {
    /// Whether all that is missing is an object that was not detected.
    pub not_seen: bool,
    /// The reason, in one line.
    pub why: String,
}

impl GoalFault {
    fn unread(why: &str) -> Self {
        Self { not_seen: false, why: why.to_owned() }
    }

    fn not_seen(name: &Name) -> Self {
        Self { not_seen: true, why: format!("the goal names {name}, which is not detected") }
    }
}

/// Reads the goal over what was detected: `boxes`, and the implied objects among `objects`.
///
/// Names of the recorded goal stand for recorded boxes. Where other boxes were detected, each name
/// goes to the box that overlaps the recorded one most, as the reference resolves phrases.
pub(super) fn read(
    from: GoalFrom<'_>,
    fitted: &FittedDomain,
    (boxes, objects): (&[ObjectBox], &[Typed]),
    matching: &Matching,
) -> Result<Condition, GoalFault> {
    match from {
        GoalFrom::Recorded { stub, boxes: recorded } => {
            read_recorded(stub, recorded, fitted, (boxes, objects))
        }
        GoalFrom::Truth(goal) => {
            let detected = inverse(matching);
            let constants = &fitted.folder.domain.constants;
            let to = |name: &Name| {
                let constant = constants.iter().find(|c| c.name == *name).map(|c| c.name.clone());
                detected.get(name).cloned().or(constant)
            };
            renamed_condition(goal, &to).map_err(|Nameless(name)| GoalFault::not_seen(&name))
        }
        GoalFrom::Parsed(parsed) => {
            let parsed = parsed.as_ref().map_err(GoalFault::clone)?;
            let is_seen = |name: &Name| objects.iter().any(|object| object.name == *name);
            match parsed.expected.iter().find(|expected| !is_seen(&expected.name)) {
                Some(missing) => Err(GoalFault::not_seen(&missing.name)),
                None => Ok(parsed.goal.clone()),
            }
        }
    }
}

fn read_recorded(
    stub: &SourceText,
    recorded: &[ObjectBox],
    fitted: &FittedDomain,
    (boxes, objects): (&[ObjectBox], &[Typed]),
) -> Result<Condition, GoalFault> {
    let unseen = objects.iter().filter(|object| boxes.iter().all(|b| b.name != object.name));
    let spoken = recorded.iter().map(|b| Typed::new(b.name.clone(), b.type_name.clone()));
    let spoken: Vec<Typed> = spoken.chain(unseen.cloned()).collect();
    let goal = parse_goal(stub, &fitted.folder.domain, &spoken)
        .map_err(|error| GoalFault::unread(&one_line(&error.to_string())))?;
    if recorded == boxes {
        return Ok(goal);
    }
    let to = |name: &Name| {
        let Some(recorded) = recorded.iter().find(|b| b.name == *name) else {
            return Some(name.clone());
        };
        nearest(recorded, boxes).filter(|(iou, _)| *iou > 0.0).map(|(_, b)| b.name.clone())
    };
    renamed_condition(&goal, &to).map_err(|Nameless(name)| GoalFault::not_seen(&name))
}

/// Asks a goal source, over what was detected.
///
/// # Errors
/// [`EvalError`] when the source itself is at fault: its options, its key, its service. Words that
/// are not understood are a fault of the goal.
pub(super) fn ask(
    source: &dyn GoalSource,
    fitted: &FittedDomain,
    boxes: &[ObjectBox],
) -> Result<Result<ParsedGoal, GoalFault>, EvalError> {
    let perception = &fitted.folder.perception;
    let language = fitted.folder.language.as_ref();
    let kind = |name: &Name| language.and_then(|language| kind_of(language, name));
    let mut objects = GoalObject::of_image(perception, boxes);
    for seen in objects.iter_mut().filter(|object| object.pixel_box.is_some()) {
        seen.colour = seen.colour.take().or_else(|| kind(&seen.name));
    }
    match source.read(&fitted.shipped, &objects) {
        Ok(parsed) => Ok(Ok(parsed)),
        Err(error @ (GoalError::Part(_) | GoalError::Language { .. } | GoalError::Key { .. })) => {
            Err(ConfigError::from(error).into())
        }
        Err(
            error @ (GoalError::Logical { .. }
            | GoalError::Instruction { .. }
            | GoalError::GaveUp { .. }
            | GoalError::Image { .. }
            | GoalError::NotYet { .. }),
        ) => Ok(Err(GoalFault {
            not_seen: error.may_resolve_later(),
            why: one_line(&error.to_string()),
        })),
    }
}

/// What tells an object from others of its type, where that is not its colour: the longest of the
/// language's kinds that its name speaks of, a number at its end left aside.
fn kind_of(language: &Language, object: &Name) -> Option<Name> {
    let padded = format!("_{}_", object.as_str().trim_end_matches(|c: char| c.is_ascii_digit()));
    let spoken = language.colours.keys().filter(|kind| padded.contains(&format!("_{kind}_")));
    spoken.max_by_key(|kind| kind.as_str().len()).cloned()
}

/// Drops what contradicts the rest of the goal, and says what and why.
pub(super) fn repair(goal: &Condition, fitted: &FittedDomain) -> (Condition, Vec<String>) {
    let Some(language) = &fitted.folder.language else { return (goal.clone(), Vec::new()) };
    let repaired = repaired(goal, &language.mutex_rules, &fitted.folder.perception.completed);
    (repaired.goal, repaired.dropped.iter().map(ToString::to_string).collect())
}

/// A message in one line.
pub(super) fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}
