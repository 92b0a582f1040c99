//! Whether an answer is a goal, whatever the server promised.

use super::super::repair::{self, Repaired};
use super::super::{Language, instruction};
use crate::http::chat::{ChatForm, ChatResponse};
use crate::logic::{Bindings, substitute};
use crate::messages::named_objects;
use crate::pddl::{Atom, Condition, Domain, Name, SourceText, Typed, parse_goal};

/// Most atoms that are looked at for contradictions.
const INSTANCES_MAX: usize = 1000;

/// What answers are held against.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rules<'a> {
    pub(super) domain: &'a Domain,
    pub(super) language: Option<&'a Language>,
    /// Predicates that follow from others.
    pub(super) completed: &'a [Name],
    /// Seen objects, then those that the instruction may mean.
    pub(super) objects: &'a [Typed],
    /// Those of them that nobody has seen.
    pub(super) unseen: &'a [Typed],
}

/// A goal that says something and fits the domain.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Judged {
    /// It can be met, as far as the language's rules tell.
    Good(Condition),
    /// It contradicts itself; without the atoms named it would not.
    Repairable {
        /// The goal without them.
        goal: Condition,
        /// What was dropped, and why.
        dropped: Vec<String>,
        /// What the model is told.
        wrong: String,
    },
}

/// Judges an answer; the error is for the model to read.
pub(super) fn judged(
    answer: &ChatResponse,
    form: ChatForm,
    rules: &Rules<'_>,
) -> Result<Judged, String> {
    let text = goal_text(answer, form)?;
    let source = SourceText::new("goal", text);
    let goal = parse_goal(&source, rules.domain, rules.objects).map_err(|error| {
        let names: Vec<&str> = rules.objects.iter().map(|o| o.name.as_str()).collect();
        let known = format!("The objects are: {}.", names.join(", "));
        let hint = if error.message.contains("object") { known.as_str() } else { "" };
        format!("{}{hint}", error.render())
    })?;
    if !has_atom(&goal) {
        return Err("it asks for nothing".to_owned());
    }
    let Some(language) = rules.language else { return Ok(Judged::Good(goal)) };
    if let Some(circle) = instruction::first_circle(&repair::ground_atoms(&goal), &language.acyclic)
    {
        return Err(format!("these statements go in a circle: {circle}"));
    }
    let Repaired { goal: repaired, dropped, contradictions } =
        repair::repaired(&goal, &language.mutex_rules, rules.completed);
    let told = |list: &[repair::Conflict]| -> Vec<String> {
        list.iter().map(ToString::to_string).collect()
    };
    if !contradictions.is_empty() {
        return Err(told(&contradictions).join("\n"));
    }
    let instances = instances(&repaired, rules);
    for (idx, later) in instances.iter().enumerate() {
        let mut earlier = instances[..idx].iter();
        let excluding =
            |e: &Atom| language.mutex_rules.iter().find(|never| never.excludes(e, later));
        if let Some((earlier, never)) = earlier.find_map(|e| Some((e, excluding(e)?))) {
            return Err(format!("{later} excludes {earlier}: {}", never.because));
        }
    }
    if dropped.is_empty() {
        return Ok(Judged::Good(goal));
    }
    let dropped = told(&dropped);
    Ok(Judged::Repairable { goal: repaired, wrong: dropped.join("\n"), dropped })
}

/// The atoms that a goal asks for of the objects that are seen or named, quantifiers over one
/// variable included.
fn instances(goal: &Condition, rules: &Rules<'_>) -> Vec<Atom> {
    let named = named_objects(goal);
    let is_there = |o: &&Typed| named.contains(&o.name) || !rules.unseen.contains(o);
    let objects: Vec<&Typed> = rules.objects.iter().filter(is_there).collect();
    let mut atoms = repair::ground_atoms(goal);
    let mut open = vec![goal];
    while let Some(condition) = open.pop() {
        match condition {
            Condition::And(parts) => open.extend(parts),
            Condition::Forall(variables, body) => {
                let [variable] = variables.as_slice() else { continue };
                let fitting = objects.iter();
                let fitting =
                    fitting.filter(|o| rules.domain.types.fits(&o.types, &variable.types));
                let with = fitting.flat_map(|o| {
                    let binding = Bindings::from([(variable.name.clone(), o.name.clone())]);
                    repair::ground_atoms(&substitute(body, &binding))
                });
                atoms.extend(with.take(INSTANCES_MAX - atoms.len().min(INSTANCES_MAX)));
            }
            Condition::True
            | Condition::False
            | Condition::Atom(_)
            | Condition::Equal(..)
            | Condition::Not(_)
            | Condition::Or(_)
            | Condition::Exists(..) => {}
        }
    }
    atoms
}

/// Whether any atom stands in a condition.
fn has_atom(condition: &Condition) -> bool {
    match condition {
        Condition::Atom(_) => true,
        Condition::True | Condition::False | Condition::Equal(..) => false,
        Condition::Not(inner) | Condition::Exists(_, inner) | Condition::Forall(_, inner) => {
            has_atom(inner)
        }
        Condition::And(parts) | Condition::Or(parts) => parts.iter().any(has_atom),
    }
}

/// The PDDL in an answer, which may stand in a fence, in JSON, after a model's thoughts or between
/// sentences.
fn goal_text(answer: &ChatResponse, form: ChatForm) -> Result<String, String> {
    let text = answer.text.rsplit("</think>").next().unwrap_or_default();
    let text = fenced(text).trim();
    let cut = if answer.is_cut { " (the answer was too long and has been cut)" } else { "" };
    if text.is_empty() {
        return Err(format!("the answer is empty{cut}"));
    }
    let text = if text.starts_with('{') || form == ChatForm::Json && !text.starts_with('(') {
        let parsed: Result<serde_json::Value, _> = serde_json::from_str(text);
        let value = parsed.map_err(|e| format!("expected JSON {{\"goal\": \"…\"}}: {e}{cut}"))?;
        let goal = value.get("goal").and_then(serde_json::Value::as_str);
        goal.ok_or("expected JSON with a text \"goal\"")?.to_owned()
    } else {
        text.to_owned()
    };
    let start = text.find('(').ok_or_else(|| format!("expected (and …), got no form{cut}"))?;
    let end = text.rfind(')').filter(|end| *end > start);
    let end = end.ok_or_else(|| format!("expected (and …), got an open form{cut}"))?;
    Ok(text[start..=end].to_owned())
}

/// What stands in the first fence, or everything.
fn fenced(text: &str) -> &str {
    let Some((_, rest)) = text.split_once("```") else { return text };
    let inside = rest.split("```").next().unwrap_or(rest);
    // The first line of a fence may name a language.
    let first = inside.lines().next().unwrap_or_default();
    if first.contains(['(', '{']) { inside } else { inside.get(first.len()..).unwrap_or_default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::parse_domain;

    #[track_caller]
    fn check(answer: &str, form: ChatForm, expected: Result<&str, &str>) {
        let text = include_str!("../../../domains/blocksworld/domain.pddl");
        let domain = parse_domain(&SourceText::new("domain.pddl", text)).unwrap().value;
        let text = include_str!("../../../domains/blocksworld/language.toml");
        let language = Language::from_toml("language.toml", text).unwrap();
        let objects: Vec<Typed> = ["a", "b", "c"].map(|n| Typed::new(n, "block")).to_vec();
        let completed = ["ontable".into(), "clear".into()];
        let rules = Rules {
            domain: &domain,
            language: Some(&language),
            completed: &completed,
            objects: &objects,
            unseen: &objects[2..],
        };
        let answer = ChatResponse { text: answer.to_owned(), is_cut: false };
        match (judged(&answer, form, &rules), expected) {
            (Ok(Judged::Good(goal)), Ok(wanted)) => assert_eq!(goal.to_string(), wanted),
            (Ok(Judged::Repairable { goal, wrong, .. }), Ok(wanted)) => {
                assert_eq!(format!("{goal} without {wrong}"), wanted);
            }
            (Err(error), Err(wanted)) => assert!(error.contains(wanted), "{error}"),
            (got, wanted) => panic!("expected {wanted:?}, got {got:?}"),
        }
    }

    #[test]
    fn the_goal_is_found_in_what_surrounds_it() {
        for answer in [
            "(on a b)",
            " (:goal (on a b)) ",
            "```pddl\n(on a b)\n```",
            "Here it is:\n```\n(:goal (on a b))\n```\nI hope this helps (really).",
            "```(on a b)```",
            "The goal is (on a b).",
            "<think>(on c c)? no (</think>\n(on a b)",
            "{\"goal\": \"(on a b)\"}",
            "```json\n{\"goal\": \"(:goal (on a b))\"}\n```",
        ] {
            check(answer, ChatForm::Grammar, Ok("(on a b)"));
            check(
                answer,
                ChatForm::Json,
                if answer.starts_with("The") { Err("expected JSON") } else { Ok("(on a b)") },
            );
        }
    }

    #[test]
    fn what_is_no_goal_is_told() {
        for (answer, wanted) in [
            ("", "the answer is empty"),
            ("I cannot do that.", "got no form"),
            ("(and (on a b)", "goal:1:"),
            ("(and", "got an open form"),
            ("{\"goal\": \"(on a", "expected JSON {\"goal\": \"…\"}: EOF"),
            ("{\"answer\": 1}", "expected JSON with a text \"goal\""),
            ("(on a b c)", "expected 2"),
            ("(on a d)", "The objects are: a, b, c."),
            ("(over a b)", "over"),
            ("(forall (?x - cube) (clear ?x))", "cube"),
            ("(and (on a b) (on b c)) (clear a)", "goal:1:"),
            ("(and)", "asks for nothing"),
            ("(and (on a b) (on b a))", "circle"),
            ("(and (on a b) (on a c))", "a block stands on one block only"),
            ("(and (forall (?x - block) (on ?x c)))", "a block carries one block only"),
            ("(and (on b c) (forall (?x - block) (and (on a ?x) (clear c))))", "excludes"),
        ] {
            check(answer, ChatForm::Grammar, Err(wanted));
        }
    }

    #[test]
    fn completed_atoms_that_contradict_the_rest_can_be_dropped() {
        let wanted = "(and (on a b)) without (clear b) excludes (on a b): a block under another \
                      block is not clear";
        check("(and (on a b) (clear b))", ChatForm::Grammar, Ok(wanted));
        check(
            "(forall (?x - block) (clear ?x))",
            ChatForm::Grammar,
            Ok("(forall (?x - block) (clear ?x))"),
        );
    }
}
