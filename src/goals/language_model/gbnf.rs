//! The form of a goal as a GBNF grammar, made from the domain and the objects.
//!
//! ```text
//! root    ::= "(and" (" " item){1,64} ")"
//! item    ::= atom | all-0 | …
//! atom    ::= "(on " names-0 " " names-0 ")" | …
//! all-0   ::= "(forall (?x - block) " ("(on ?x " names-0 ")" | "(on " names-0 " ?x)" | …) ")"
//! names-0 ::= "red_block" | "blue_block"
//! ```
//!
//! The grammar keeps answers valid; it does not make them right. Negative, disjunctive and
//! existential goals are not in it: instructions that need them are for the dialects without a
//! grammar.

use crate::pddl::{Condition, Domain, Literal, Name, Signature, Term, Typed};

/// Most parts of a goal; without a bound a model may go on until its last token.
const PARTS_MAX: usize = 64;

/// The variable of every quantifier, in the grammar and in the example.
const VARIABLE: &str = "x";

/// The grammar; `None` when these objects leave nothing to say.
pub(super) fn grammar(domain: &Domain, objects: &[Typed]) -> Option<String> {
    let mut names = Names { domain, objects, rules: Vec::new() };
    let atoms: Vec<String> = domain.predicates.iter().filter_map(|p| names.atom(p, None)).collect();
    let quantified: Vec<(Name, Vec<String>)> = types_of(objects)
        .into_iter()
        .map(|of_type| {
            let bodies = domain.predicates.iter().flat_map(|predicate| {
                (0..predicate.params.len()).map(move |place| (predicate, place))
            });
            let bodies = bodies.filter_map(|(p, place)| names.atom(p, Some((place, &of_type))));
            (of_type.clone(), bodies.collect())
        })
        .filter(|(_, bodies): &(Name, Vec<String>)| !bodies.is_empty())
        .collect();
    if atoms.is_empty() && quantified.is_empty() {
        return None;
    }
    let mut lines = vec![format!("root ::= \"(and\" (\" \" item){{1,{PARTS_MAX}}} \")\"")];
    let mut items: Vec<String> = Vec::new();
    if !atoms.is_empty() {
        items.push("atom".to_owned());
    }
    items.extend((0..quantified.len()).map(|idx| format!("all-{idx}")));
    lines.push(format!("item ::= {}", items.join(" | ")));
    if !atoms.is_empty() {
        lines.push(format!("atom ::= {}", atoms.join(" | ")));
    }
    for (idx, (type_name, bodies)) in quantified.iter().enumerate() {
        let head = literal(&format!("(forall (?{VARIABLE} - {type_name}) "));
        lines.push(format!("all-{idx} ::= {head} ({}) \")\"", bodies.join(" | ")));
    }
    for (idx, rule) in names.rules.iter().enumerate() {
        let list: Vec<String> = rule.iter().map(|name| literal(name.as_str())).collect();
        lines.push(format!("names-{idx} ::= {}", list.join(" | ")));
    }
    lines.push(String::new());
    Some(lines.join("\n"))
}

/// Lists of names, each written once.
struct Names<'a> {
    domain: &'a Domain,
    objects: &'a [Typed],
    rules: Vec<Vec<Name>>,
}

impl Names<'_> {
    /// An atom of a predicate; the variable stands at one place, if any. `None` when the variable
    /// or no object fits.
    fn atom(&mut self, predicate: &Signature, variable: Option<(usize, &Name)>) -> Option<String> {
        let types = &self.domain.types;
        let mut parts = vec![literal(&format!("({}", predicate.name))];
        for (place, param) in predicate.params.iter().enumerate() {
            match variable {
                Some((at, of_type)) if at == place => {
                    if !types.fits(std::slice::from_ref(of_type), &param.types) {
                        return None;
                    }
                    parts.push(literal(&format!(" ?{VARIABLE}")));
                }
                Some(_) | None => {
                    let fitting =
                        self.objects.iter().filter(|o| types.fits(&o.types, &param.types));
                    let rule = self.rule(fitting.map(|o| o.name.clone()).collect())?;
                    parts.push(format!("\" \" names-{rule}"));
                }
            }
        }
        parts.push("\")\"".to_owned());
        Some(parts.join(" "))
    }

    fn rule(&mut self, names: Vec<Name>) -> Option<usize> {
        if names.is_empty() {
            return None;
        }
        let known = self.rules.iter().position(|rule| *rule == names);
        Some(known.unwrap_or_else(|| {
            self.rules.push(names);
            self.rules.len() - 1
        }))
    }
}

/// The types that objects have, in order of the objects.
fn types_of(objects: &[Typed]) -> Vec<Name> {
    let mut types: Vec<Name> = Vec::new();
    for name in objects.iter().flat_map(|object| &object.types) {
        if !types.contains(name) {
            types.push(name.clone());
        }
    }
    types
}

/// A text as the grammar writes it.
fn literal(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// A goal in the layout of the grammar: models follow an example's layout more than any rule.
pub(super) fn in_layout(goal: &Condition) -> String {
    let mut parts = Vec::new();
    flatten(goal, &mut parts);
    let parts: Vec<String> = parts.iter().map(|part| format!(" {part}")).collect();
    format!("(and{})", parts.concat())
}

/// The parts of a conjunction, each quantifier over one variable with the grammar's name and around
/// one atom.
fn flatten(goal: &Condition, parts: &mut Vec<Condition>) {
    match goal {
        Condition::True => {}
        Condition::And(inner) => inner.iter().for_each(|part| flatten(part, parts)),
        Condition::Forall(variables, body) => {
            let [variable] = variables.as_slice() else { return parts.push(goal.clone()) };
            let mut bodies = Vec::new();
            flatten(body, &mut bodies);
            for body in bodies {
                let Condition::Atom(atom) = &body else { return parts.push(goal.clone()) };
                let named = Condition::Atom(renamed(atom, &variable.name));
                let variable = Typed { name: VARIABLE.into(), types: variable.types.clone() };
                parts.push(Condition::Forall(vec![variable], Box::new(named)));
            }
        }
        Condition::False
        | Condition::Atom(_)
        | Condition::Equal(..)
        | Condition::Not(_)
        | Condition::Or(_)
        | Condition::Exists(..) => parts.push(goal.clone()),
    }
}

fn renamed(atom: &Literal, variable: &Name) -> Literal {
    let args = atom.args.iter().map(|term| match term {
        Term::Var(name) if name == variable => Term::Var(VARIABLE.into()),
        Term::Var(_) | Term::Object(_) => term.clone(),
    });
    Literal { predicate: atom.predicate.clone(), args: args.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::{SourceText, parse_domain, parse_goal};

    const DOMAIN: &str = "(define (domain d)
        (:types movable place - object cup plate - movable)
        (:predicates (at ?o - movable ?p - place) (on ?x ?y - movable) (full ?c - cup) (done)))";

    fn domain() -> Domain {
        parse_domain(&SourceText::new("domain.pddl", DOMAIN)).unwrap().value
    }

    #[test]
    fn a_grammar_has_one_alternative_per_predicate_and_type() {
        let objects =
            [Typed::new("mug", "cup"), Typed::new("dish", "plate"), Typed::new("sink", "place")];
        insta::assert_snapshot!(grammar(&domain(), &objects).unwrap(), @r#"
        root ::= "(and" (" " item){1,64} ")"
        item ::= atom | all-0 | all-1 | all-2
        atom ::= "(at" " " names-0 " " names-1 ")" | "(on" " " names-0 " " names-0 ")" | "(full" " " names-2 ")" | "(done" ")"
        all-0 ::= "(forall (?x - cup) " ("(at" " ?x" " " names-1 ")" | "(on" " ?x" " " names-0 ")" | "(on" " " names-0 " ?x" ")" | "(full" " ?x" ")") ")"
        all-1 ::= "(forall (?x - plate) " ("(at" " ?x" " " names-1 ")" | "(on" " ?x" " " names-0 ")" | "(on" " " names-0 " ?x" ")") ")"
        all-2 ::= "(forall (?x - place) " ("(at" " " names-0 " ?x" ")") ")"
        names-0 ::= "mug" | "dish"
        names-1 ::= "sink"
        names-2 ::= "mug"
        "#);
    }

    #[test]
    fn what_no_object_fits_is_left_out() {
        let grammar = grammar(&domain(), &[Typed::new("sink", "place")]).unwrap();
        assert!(!grammar.contains("(on") && grammar.contains("(done"), "{grammar}");
        let nothing = "(define (domain d) (:types a) (:predicates (p ?x - a)))";
        let nothing = parse_domain(&SourceText::new("d", nothing)).unwrap().value;
        assert_eq!(super::grammar(&nothing, &[]), None);
    }

    #[test]
    fn examples_are_written_in_the_grammars_layout() {
        let objects = [Typed::new("mug", "cup"), Typed::new("sink", "place")];
        let shown = |text: &str| {
            let goal = SourceText::new("goal", text);
            in_layout(&parse_goal(&goal, &domain(), &objects).unwrap())
        };
        assert_eq!(shown("(at mug sink)"), "(and (at mug sink))");
        assert_eq!(
            shown("(:goal (and\n (full mug) (and (at mug sink)\n (done))))"),
            "(and (full mug) (at mug sink) (done))"
        );
        assert_eq!(
            shown("(forall (?c - cup) (and (full ?c) (at ?c sink)))"),
            "(and (forall (?x - cup) (full ?x)) (forall (?x - cup) (at ?x sink)))"
        );
        let two = "(forall (?a - cup ?b - cup) (on ?a ?b))";
        assert_eq!(shown(two), format!("(and {two})"));
    }
}
