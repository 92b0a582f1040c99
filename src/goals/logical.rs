//! Goals of kind "logical": a PDDL condition, written out.

use super::{GoalError, GoalObject, GoalSource, GoalView, ParsedGoal};
use crate::parts::{Part, no_options};
use crate::pddl::{Domain, Name, SourceText, Typed, parse_goal};

/// The goal source of kind "logical".
#[derive(Debug)]
struct Logical {
    source: SourceText,
}

/// The entry of the table of goal sources.
pub(super) const PART: Part<dyn GoalSource> = Part {
    name: "logical",
    help: "a PDDL condition, written out",
    options: no_options,
    // The text is checked when it is read against a domain.
    build: |context| {
        let source = SourceText::new(context.inputs.origin, context.inputs.text);
        Ok(Box::new(Logical { source }))
    },
};

impl GoalSource for Logical {
    fn read_in(&self, domain: &Domain, view: GoalView<'_>) -> Result<ParsedGoal, GoalError> {
        parse(&self.source, domain, view.objects)
    }
}

/// Reads a PDDL goal (`(on a b)` or `(:goal (and …))`).
///
/// An object that has not been seen is expected to turn up, with the type that the predicate asks
/// for.
///
/// # Errors
/// [`GoalError::Logical`] pointing at the text.
pub fn parse(
    source: &SourceText,
    domain: &Domain,
    objects: &[GoalObject],
) -> Result<ParsedGoal, GoalError> {
    let mut known: Vec<Typed> = objects
        .iter()
        .map(|object| Typed::new(object.name.clone(), object.type_name.clone()))
        .collect();
    let expected = unseen(&source.text, domain, &known);
    known.extend(expected.iter().cloned());
    let goal = parse_goal(source, domain, &known)?;
    Ok(ParsedGoal { goal, phrases: Vec::new(), expected, notes: Vec::new(), said: Vec::new() })
}

/// The names at argument places of the domain's predicates that no object has, in order of mention.
/// Of two places with different types the narrower type counts.
fn unseen(text: &str, domain: &Domain, known: &[Typed]) -> Vec<Typed> {
    let mut found: Vec<Typed> = Vec::new();
    let code: Vec<&str> = text.lines().map(|line| line.split(';').next().unwrap_or("")).collect();
    let code = code.join("\n");
    for form in code.split('(').skip(1) {
        let inner = form.split(')').next().unwrap_or("");
        let mut words = inner.split_whitespace();
        let signature =
            words.next().map(Name::new).and_then(|name| domain.predicate(name.as_str()));
        let Some(signature) = signature else { continue };
        for (word, param) in words.zip(&signature.params) {
            let name = Name::new(word);
            let is_known = known.iter().chain(&domain.constants).any(|typed| typed.name == name);
            if word.starts_with('?') || is_known {
                continue;
            }
            match found.iter_mut().find(|typed| typed.name == name) {
                None => found.push(Typed { name, types: param.types.clone() }),
                Some(typed) if domain.types.fits(&param.types, &typed.types) => {
                    typed.types.clone_from(&param.types);
                }
                Some(_) => {}
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::parse_domain;

    const DOMAIN: &str = "(define (domain d) (:types block thing - object cube - block)
        (:constants anchor - thing)
        (:predicates (on ?x - block ?y - block) (near ?x - thing) (marked ?c - cube)))";

    fn read(text: &str, objects: &[GoalObject]) -> Result<ParsedGoal, GoalError> {
        let domain = parse_domain(&SourceText::new("domain.pddl", DOMAIN)).unwrap().value;
        parse(&SourceText::new("run.toml", text), &domain, objects)
    }

    fn block(name: &str) -> GoalObject {
        GoalObject { name: name.into(), type_name: "block".into(), colour: None, pixel_box: None }
    }

    #[test]
    fn unseen_objects_get_the_type_their_places_ask_for() {
        let text = "(:goal (and (on a b) (marked b) (near anchor) ; (near c)
            (forall (?x - block) (not (on ?x a)))))";
        let goal = read(text, &[block("a")]).unwrap();
        assert_eq!(goal.expected, [Typed::new("b", "cube")]);
        assert!(goal.goal.to_string().contains("(marked b)"), "{}", goal.goal);
        assert!(read("(on a b)", &[block("a"), block("b")]).unwrap().expected.is_empty());
    }

    #[test]
    fn errors_point_at_the_text() {
        for text in ["(on a)", "(over a b)", "(on a b", "", "(and (on ?x a))"] {
            let error = read(text, &[block("a"), block("b")]).unwrap_err();
            assert!(error.render().starts_with("run.toml:1:"), "{}", error.render());
            assert!(!error.may_resolve_later());
        }
        let error = read("(near a)", &[block("a")]).unwrap_err();
        assert!(error.to_string().contains("thing"), "{error}");
    }
}
