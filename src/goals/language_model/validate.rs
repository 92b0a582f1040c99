//! Whether an answer is a goal, whatever the server promised.

use super::super::repair::{self, Repaired};
use super::super::{Language, instruction};
use super::candidates::goal_text;
use super::quantifiers;
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
    let text = goal_text(answer, form, rules.domain)?;
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
    if let Some(wrong) = quantifiers::too_wide(&goal, rules.domain) {
        return Err(wrong);
    }
    let instances_of = |goal: &Condition| instances(goal, rules, false);
    let denied = instances(&goal, rules, true);
    if let Some(atom) = instances_of(&goal).iter().find(|atom| denied.contains(atom)) {
        return Err(format!("it asks for {atom} and for (not {atom})"));
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
    let instances = instances_of(&repaired);
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

/// The atoms that a goal asks for, or with `is_denied` those that it forbids, of the objects that are seen
/// or named, quantifiers included.
fn instances(goal: &Condition, rules: &Rules<'_>, is_denied: bool) -> Vec<Atom> {
    let named = named_objects(goal);
    let is_there = |o: &&Typed| named.contains(&o.name) || !rules.unseen.contains(o);
    let objects: Vec<&Typed> = rules.objects.iter().filter(is_there).collect();
    let mut atoms = Vec::new();
    let mut open = vec![(goal.clone(), true)];
    while let Some((condition, is_wished)) = open.pop() {
        if atoms.len() >= INSTANCES_MAX || open.len() >= INSTANCES_MAX {
            break;
        }
        match condition {
            Condition::And(parts) if is_wished => {
                open.extend(parts.into_iter().map(|part| (part, true)));
            }
            Condition::Or(parts) if !is_wished => {
                open.extend(parts.into_iter().map(|part| (part, false)));
            }
            Condition::Not(inner) => open.push((*inner, !is_wished)),
            Condition::Atom(_) if is_wished != is_denied => {
                atoms.extend(repair::ground_atoms(&condition));
            }
            Condition::Forall(variables, body) if is_wished => {
                open.extend(bound(&variables, &body, &objects, rules).map(|body| (body, true)));
            }
            Condition::Exists(variables, body) if !is_wished => {
                open.extend(bound(&variables, &body, &objects, rules).map(|body| (body, false)));
            }
            Condition::True
            | Condition::False
            | Condition::Atom(_)
            | Condition::Equal(..)
            | Condition::And(_)
            | Condition::Or(_)
            | Condition::Forall(..)
            | Condition::Exists(..) => {}
        }
    }
    // In the order of the goal, as far as it was opened from its end.
    atoms.reverse();
    atoms
}

/// The body for every object that the first variable may be; further variables stay for later.
fn bound<'a>(
    variables: &'a [Typed],
    body: &'a Condition,
    objects: &'a [&'a Typed],
    rules: &'a Rules<'a>,
) -> impl Iterator<Item = Condition> + 'a {
    let (first, rest) = match variables.split_first() {
        Some((first, rest)) => (Some(first), rest),
        None => (None, variables),
    };
    let fits =
        move |o: &&&Typed| first.is_some_and(|v| rules.domain.types.fits(&o.types, &v.types));
    objects.iter().filter(fits).map(move |o| {
        let name = first.map(|variable| variable.name.clone());
        let binding: Bindings = name.map(|name| (name, o.name.clone())).into_iter().collect();
        let body = substitute(body, &binding);
        if rest.is_empty() { body } else { Condition::Forall(rest.to_vec(), Box::new(body)) }
    })
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
            ("(and (on a b) (on b c)) (clear a)", "holds several goals"),
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
    fn several_goals_are_a_question_back() {
        for (answer, wanted) in [
            ("```pddl\n(on a b)\n```\nor\n```\n(on b a)\n```", "holds several goals"),
            ("Either (on a b) or (clear c).", "holds several goals"),
            ("(on a b)\n(clear a)", "holds several goals"),
            ("First I thought (on b a), so:\n```\n(on a b)\n```", "holds several goals"),
        ] {
            check(answer, ChatForm::Grammar, Err(wanted));
        }
        for answer in [
            "```\n(on a b)\n```\nOnce more:\n```\n(on  a b)\n```",
            "```\n(on a b)\n```\nHere (on a b) says that a stands on b (see above).",
            "(on a b) (on a b)",
        ] {
            check(answer, ChatForm::Grammar, Ok("(on a b)"));
        }
    }

    #[test]
    fn denials_and_wide_quantifiers_are_told() {
        for (answer, wanted) in [
            ("(and (on a b) (not (on a b)))", "(on a b) and for (not (on a b))"),
            ("(and (on a b) (forall (?x - block) (not (on ?x b))))", "for (not (on a b))"),
            ("(and (clear a) (not (exists (?x - block) (clear ?x))))", "for (not (clear a))"),
            ("(forall (?x) (ontable ?x))", "write (?x - block)"),
            ("(forall (?x - object) (or (clear ?x) (ontable ?x)))", "?x ranges over every object"),
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
