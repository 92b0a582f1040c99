//! Goal repair: a goal that contradicts itself loses the atoms that only restate the rest wrongly.
//!
//! A completed predicate follows from the observed ones, so an atom of it that excludes an observed
//! atom is the one to drop: `(ontable a)` beside `(on a b)`. Nothing else is touched, so a wrong but
//! consistent goal stays wrong.

use std::collections::BTreeSet;

use super::language::MutexRule;
use crate::pddl::{Atom, Condition, Literal, Name, Term};

/// A goal without the atoms that were dropped, and what remains wrong with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Repaired {
    /// The goal; as it was, if nothing was dropped.
    pub goal: Condition,
    /// The atoms that were dropped, in the order of the goal. The user's goal was altered by each.
    pub dropped: Vec<Conflict>,
    /// Pairs that exclude each other and of which neither may be dropped: the goal cannot be met.
    pub contradictions: Vec<Conflict>,
}

/// Two atoms of a goal that exclude each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Conflict {
    /// The atom that was dropped; of a contradiction the one that is written later.
    pub atom: Atom,
    /// The atom that it excludes.
    pub against: Atom,
    /// Why they exclude each other, from `language.toml`.
    pub because: String,
}

impl std::fmt::Display for Conflict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} excludes {}: {}", self.atom, self.against, self.because)
    }
}

/// Drops every atom of a `completed` predicate that excludes one of another predicate.
///
/// Only ground atoms that the goal asks for directly, or in nested conjunctions, are looked at: what
/// stands below `or`, `not` or a quantifier asks for no single atom. `mutex_rules` are the `[[never]]`
/// pairs of `language.toml`, `completed` the predicates that `perception.toml` calls so.
pub fn repaired(goal: &Condition, mutex_rules: &[MutexRule], completed: &[Name]) -> Repaired {
    let atoms = ground_atoms(goal);
    let (mut dropped, mut contradictions) = (Vec::new(), Vec::new());
    for (idx, later) in atoms.iter().enumerate() {
        for earlier in &atoms[..idx] {
            let Some(never) = mutex_rules.iter().find(|never| never.excludes(earlier, later))
            else {
                continue;
            };
            let conflict = |atom: &Atom, against: &Atom| Conflict {
                atom: atom.clone(),
                against: against.clone(),
                because: never.because.clone(),
            };
            let is_completed = |atom: &Atom| completed.contains(&atom.predicate);
            match (is_completed(earlier), is_completed(later)) {
                (true, false) => dropped.push(conflict(earlier, later)),
                (false, true) => dropped.push(conflict(later, earlier)),
                (true, true) | (false, false) => contradictions.push(conflict(later, earlier)),
            }
        }
    }
    // One reason per dropped atom is enough; two dropped atoms contradict nothing any more.
    dropped.sort_by_key(|conflict| atoms.iter().position(|atom| *atom == conflict.atom));
    dropped.dedup_by(|later, first| later.atom == first.atom);
    let gone: BTreeSet<Atom> = dropped.iter().map(|conflict| conflict.atom.clone()).collect();
    contradictions.retain(|c| !gone.contains(&c.atom) && !gone.contains(&c.against));
    let goal = if gone.is_empty() { goal.clone() } else { without(goal, &gone) };
    Repaired { goal, dropped, contradictions }
}

/// The ground atoms that a goal asks for directly, or in nested conjunctions, in order.
pub(super) fn ground_atoms(goal: &Condition) -> Vec<Atom> {
    let mut atoms = Vec::new();
    collect(goal, &mut atoms);
    atoms
}

fn collect(goal: &Condition, atoms: &mut Vec<Atom>) {
    match goal {
        Condition::Atom(literal) => atoms.extend(ground(literal)),
        Condition::And(parts) => parts.iter().for_each(|part| collect(part, atoms)),
        Condition::True
        | Condition::False
        | Condition::Equal(..)
        | Condition::Not(_)
        | Condition::Or(_)
        | Condition::Exists(..)
        | Condition::Forall(..) => {}
    }
}

/// The goal without some of the atoms that [`collect`] finds.
fn without(goal: &Condition, gone: &BTreeSet<Atom>) -> Condition {
    match goal {
        Condition::Atom(literal) if ground(literal).is_some_and(|atom| gone.contains(&atom)) => {
            Condition::True
        }
        Condition::And(parts) => {
            let parts = parts.iter().map(|part| without(part, gone));
            Condition::And(parts.filter(|part| *part != Condition::True).collect())
        }
        Condition::Atom(_)
        | Condition::True
        | Condition::False
        | Condition::Equal(..)
        | Condition::Not(_)
        | Condition::Or(_)
        | Condition::Exists(..)
        | Condition::Forall(..) => goal.clone(),
    }
}

fn ground(literal: &Literal) -> Option<Atom> {
    let objects = literal.args.iter().map(|term| match term {
        Term::Object(name) => Some(name.clone()),
        Term::Var(_) => None,
    });
    Some(Atom { predicate: literal.predicate.clone(), args: objects.collect::<Option<_>>()? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::goals::Language;
    use crate::pddl::{SourceText, Typed, parse_domain, parse_goal};

    fn repair(goal: &str) -> Repaired {
        let text = include_str!("../../domains/blocksworld/domain.pddl");
        let domain = parse_domain(&SourceText::new("domain.pddl", text)).unwrap().value;
        let text = include_str!("../../domains/blocksworld/language.toml");
        let language = Language::from_toml("language.toml", text).unwrap();
        let objects: Vec<Typed> = ["a", "b", "c"].map(|n| Typed::new(n, "block")).to_vec();
        let goal = parse_goal(&SourceText::new("goal", goal), &domain, &objects).unwrap();
        repaired(&goal, &language.mutex_rules, &["ontable".into(), "clear".into()])
    }

    #[track_caller]
    fn check(goal: &str, expected: &str, dropped: &[&str], contradictions: &[&str]) {
        let repaired = repair(goal);
        assert_eq!(repaired.goal, repair(expected).goal, "{}", repaired.goal);
        let text = |list: &[Conflict]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!(text(&repaired.dropped), dropped);
        assert_eq!(text(&repaired.contradictions), contradictions);
    }

    #[test]
    fn a_consistent_goal_stays_as_it_is() {
        for goal in ["(and (on a b) (ontable b) (clear a))", "(on a b)", "(and)"] {
            check(goal, goal, &[], &[]);
        }
    }

    #[test]
    fn completed_atoms_that_exclude_observed_ones_are_dropped_and_told() {
        check(
            "(and (ontable a) (and (on a b) (on b c)) (clear b) (ontable c))",
            "(and (and (on a b) (on b c)) (ontable c))",
            &[
                "(ontable a) excludes (on a b): a block on another block is not on the table",
                "(clear b) excludes (on a b): a block under another block is not clear",
            ],
            &[],
        );
    }

    #[test]
    fn an_atom_is_dropped_once_even_if_it_excludes_several() {
        let repaired = repair("(and (on a b) (ontable a) (ontable a) (on a c))");
        assert_eq!(repaired.dropped.len(), 1);
        assert_eq!(repaired.goal, repair("(and (on a b) (on a c))").goal);
        assert_eq!(repaired.contradictions.len(), 1);
    }

    #[test]
    fn observed_atoms_are_never_dropped() {
        check(
            "(and (on a b) (on c b))",
            "(and (on a b) (on c b))",
            &[],
            &["(on c b) excludes (on a b): a block carries one block only"],
        );
    }

    #[test]
    fn what_asks_for_no_single_atom_is_left_alone() {
        let goal = "(and (on a b) (or (ontable a) (clear a)) (not (clear c)))";
        check(goal, goal, &[], &[]);
    }
}
