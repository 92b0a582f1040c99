//! Goals of kind "image": a photograph of the goal state.
//!
//! The same detector, grounder and rules that read the camera's frames read the photograph. The goal
//! is that every fact of some predicates that is known to hold there holds: of the observed ones that
//! an action can change, or of those that `goal.options.predicates` lists. What is not so in the
//! photograph is not asked for, nor is what follows from the facts or never changes.
//!
//! Objects are named by the rules of `perception.toml` in both images, so equal names mean the same
//! object. Where several objects of a kind look alike, the rule's order tells them ("the narrowest
//! pink one"), and an order that actions change ("the leftmost red one") may exchange them.

use std::collections::BTreeSet;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Deserialize;

use super::language::MutexRule;
use super::{GoalError, GoalSource, GoalView, ParsedGoal};
use crate::parts::{Part, PartContext, PartError, options_of};
use crate::pddl::{Atom, Condition, Domain, Effect, Literal, Name, Term};
use crate::perception::State;

/// `[goal.options]` of the kind "image".
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Options {
    /// The photograph; without the key, the goal's text is its path.
    image: Option<PathBuf>,
    /// The predicates whose facts the goal is made of. Without the key the observed ones that an
    /// action can change.
    #[schemars(with = "Option<Vec<String>>")]
    predicates: Option<Vec<Name>>,
}

/// The goal source of kind "image".
#[derive(Debug)]
struct GoalImage {
    path: String,
    shown: State,
    predicates: Predicates,
    mutex_rules: Vec<MutexRule>,
}

/// Which predicates count.
#[derive(Debug)]
enum Predicates {
    Chosen(Vec<Name>),
    Observed(Vec<Name>),
}

/// The entry of the table of goal sources.
pub(super) const PART: Part<dyn GoalSource> = Part {
    name: "image",
    help: "a photograph of the goal state, read as the camera's frames are",
    options: options_of::<Options>(),
    build,
};

fn build(context: &PartContext<'_, dyn GoalSource>) -> Result<Box<dyn GoalSource>, PartError> {
    let options: Options = context.options()?;
    let inputs = &context.inputs;
    let path = options.image.unwrap_or_else(|| PathBuf::from(inputs.text.trim()));
    let path = context.choice.folder.join(path);
    let fault = |reason: String| -> PartError {
        GoalError::Image { path: path.display().to_string(), reason }.into()
    };
    let (Some(read_image), Some(perception)) = (&inputs.read_image, inputs.perception) else {
        return Err(fault("there is no detector with labelled examples to read it".to_owned()));
    };
    let shown = read_image(&path).map_err(fault)?.state;
    let observed = || perception.observed.iter().map(|spec| spec.predicate.clone()).collect();
    let predicates =
        options.predicates.map_or_else(|| Predicates::Observed(observed()), Predicates::Chosen);
    let mutex_rules = inputs.language.map(|language| language.mutex_rules.clone());
    let (path, mutex_rules) = (path.display().to_string(), mutex_rules.unwrap_or_default());
    Ok(Box::new(GoalImage { path, shown, predicates, mutex_rules }))
}

impl GoalSource for GoalImage {
    fn read_in(&self, domain: &Domain, view: GoalView<'_>) -> Result<ParsedGoal, GoalError> {
        let fault = |reason: String| GoalError::Image { path: self.path.clone(), reason };
        let predicates: BTreeSet<Name> = match &self.predicates {
            Predicates::Chosen(chosen) => {
                if let Some(unknown) =
                    chosen.iter().find(|p| domain.predicate(p.as_str()).is_none())
                {
                    let message = format!("the domain {} has no predicate", domain.name);
                    return Err(fault(format!("goal.options.predicates: {message} \"{unknown}\"")));
                }
                chosen.iter().cloned().collect()
            }
            Predicates::Observed(observed) => {
                let changed = changed_by_actions(domain);
                observed.iter().filter(|name| changed.contains(*name)).cloned().collect()
            }
        };
        let known = self.shown.facts.known.iter();
        let atoms: Vec<&Atom> = known.filter(|atom| predicates.contains(&atom.predicate)).collect();
        if atoms.is_empty() {
            let list: Vec<&str> = predicates.iter().map(Name::as_str).collect();
            return Err(fault(format!("it shows no fact of {}", list.join(", "))));
        }
        for (idx, later) in atoms.iter().enumerate() {
            let excluding = |e: &&&Atom| self.mutex_rules.iter().any(|n| n.excludes(e, later));
            if let Some(earlier) = atoms[..idx].iter().find(excluding) {
                let advice = "more labelled examples or another grounder may help";
                return Err(fault(format!("it is read as {earlier} and {later}; {advice}")));
            }
        }
        let named: BTreeSet<&Name> = atoms.iter().flat_map(|atom| &atom.args).collect();
        let is_seen = |name: &Name| view.objects.iter().any(|object| object.name == *name);
        let shown = self.shown.objects.iter();
        let expected = shown.filter(|o| named.contains(&o.name) && !is_seen(&o.name)).cloned();
        let expected = expected.collect();
        let unknown = self.shown.facts.unknown.iter().filter(|a| predicates.contains(&a.predicate));
        let notes = unknown.map(|atom| format!("{atom} cannot be told in the goal image"));
        let notes = notes.collect();
        let goal = Condition::And(atoms.into_iter().map(condition).collect());
        Ok(ParsedGoal { goal, phrases: Vec::new(), expected, notes, said: Vec::new() })
    }
}

fn condition(atom: &Atom) -> Condition {
    let args = atom.args.iter().cloned().map(Term::Object).collect();
    Condition::Atom(Literal { predicate: atom.predicate.clone(), args })
}

/// The predicates that some action adds or deletes.
pub fn changed_by_actions(domain: &Domain) -> BTreeSet<Name> {
    let mut changed = BTreeSet::new();
    let mut open: Vec<&Effect> = domain.actions.iter().map(|action| &action.effect).collect();
    while let Some(effect) = open.pop() {
        match effect {
            Effect::And(parts) => open.extend(parts),
            Effect::Add(literal) | Effect::Delete(literal) => {
                changed.insert(literal.predicate.clone());
            }
            Effect::When(_, inner) | Effect::Forall(_, inner) => open.push(inner),
            Effect::Cost(_) => {}
        }
    }
    changed
}
