//! Variables of conditions: which are free, and how they are replaced.

use std::collections::{BTreeMap, BTreeSet};

use crate::pddl::{Condition, Literal, Name, Term, Typed};

/// The object each variable stands for.
pub type Bindings = BTreeMap<Name, Name>;

/// The condition with its free variables replaced by the objects that they are bound to.
pub fn substitute(condition: &Condition, bindings: &Bindings) -> Condition {
    let terms = bindings.iter().map(|(name, object)| (name.clone(), Term::Object(object.clone())));
    replaced(condition, &terms.collect())
}

/// Whether a condition speaks of all objects of a type: one that nobody has seen could make it false.
pub fn speaks_of_all(condition: &Condition) -> bool {
    fn speaks(condition: &Condition, negated: bool) -> bool {
        match condition {
            Condition::True | Condition::False | Condition::Atom(_) | Condition::Equal(..) => false,
            Condition::Not(inner) => speaks(inner, !negated),
            Condition::And(parts) | Condition::Or(parts) => {
                parts.iter().any(|part| speaks(part, negated))
            }
            Condition::Exists(_, inner) => negated || speaks(inner, negated),
            Condition::Forall(_, inner) => !negated || speaks(inner, negated),
        }
    }
    speaks(condition, false)
}

/// The condition with free variables replaced by terms. A variable among those terms must have a
/// name that no quantifier of the condition binds.
pub(super) fn replaced(condition: &Condition, terms: &BTreeMap<Name, Term>) -> Condition {
    let of = |inner: &Condition| replaced(inner, terms);
    let below = |variables: &[Typed], inner: &Condition| {
        let mut visible = terms.clone();
        visible.retain(|name, _| variables.iter().all(|v| v.name != *name));
        Box::new(replaced(inner, &visible))
    };
    match condition {
        Condition::True => Condition::True,
        Condition::False => Condition::False,
        Condition::Atom(literal) => Condition::Atom(replaced_in_literal(literal, terms)),
        Condition::Equal(a, b) => {
            Condition::Equal(replaced_in_term(a, terms), replaced_in_term(b, terms))
        }
        Condition::Not(inner) => Condition::Not(Box::new(of(inner))),
        Condition::And(parts) => Condition::And(parts.iter().map(of).collect()),
        Condition::Or(parts) => Condition::Or(parts.iter().map(of).collect()),
        Condition::Exists(vars, inner) => Condition::Exists(vars.clone(), below(vars, inner)),
        Condition::Forall(vars, inner) => Condition::Forall(vars.clone(), below(vars, inner)),
    }
}

/// The literal with variables replaced by terms.
pub(super) fn replaced_in_literal(literal: &Literal, terms: &BTreeMap<Name, Term>) -> Literal {
    let args = literal.args.iter().map(|term| replaced_in_term(term, terms)).collect();
    Literal { predicate: literal.predicate.clone(), args }
}

fn replaced_in_term(term: &Term, terms: &BTreeMap<Name, Term>) -> Term {
    match term {
        Term::Var(name) => terms.get(name).unwrap_or(term).clone(),
        Term::Object(_) => term.clone(),
    }
}

/// Collects the variables that a condition needs from outside.
pub(super) fn free_variables(condition: &Condition, free: &mut BTreeSet<Name>) {
    let mut add = |term: &Term| {
        if let Term::Var(name) = term {
            free.insert(name.clone());
        }
    };
    match condition {
        Condition::True | Condition::False => {}
        Condition::Atom(literal) => literal.args.iter().for_each(add),
        Condition::Equal(left, right) => {
            add(left);
            add(right);
        }
        Condition::Not(inner) => free_variables(inner, free),
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                free_variables(part, free);
            }
        }
        Condition::Exists(variables, inner) | Condition::Forall(variables, inner) => {
            let mut inside = BTreeSet::new();
            free_variables(inner, &mut inside);
            inside.retain(|name| variables.iter().all(|v| v.name != *name));
            free.extend(inside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::{SourceText, parse_domain, parse_goal};

    #[test]
    fn what_could_fail_for_an_unseen_object_speaks_of_all() {
        let domain = "(define (domain d) (:requirements :adl) (:types t) (:constants a - t)
                      (:predicates (p ?x - t)))";
        let domain = parse_domain(&SourceText::new("domain.pddl", domain)).unwrap().value;
        for (text, speaks) in [
            ("(and (p a) (not (p a)))", false),
            ("(exists (?x - t) (p ?x))", false),
            ("(not (forall (?x - t) (p ?x)))", false),
            ("(or (p a) (forall (?x - t) (p ?x)))", true),
            ("(not (exists (?x - t) (p ?x)))", true),
            ("(exists (?x - t) (not (exists (?y - t) (p ?y))))", true),
        ] {
            let goal = parse_goal(&SourceText::new("goal", text), &domain, &[]).unwrap();
            assert_eq!(speaks_of_all(&goal), speaks, "{text}");
        }
    }
}
