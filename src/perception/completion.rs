//! Completes observed facts by the rules of `completion.pddl`.

use super::grounders::Judged;
use crate::logic::{Facts, Truth, Universe, derive};
use crate::pddl::{Axiom, Typed, Types};

/// Judged tuples as facts. Each tuple is judged once.
pub fn facts_of(judged: &[Judged]) -> Facts {
    let of = |truth: Truth| {
        judged.iter().filter(|judged| judged.truth == truth).map(|j| j.atom.clone()).collect()
    };
    Facts { known: of(Truth::True), unknown: of(Truth::Unknown) }
}

/// Adds what the rules derive from `base` over the given objects.
///
/// A derived predicate is recomputed from scratch, whatever `base` says of it; a derived fact is
/// unknown where an unknown one decides it.
pub fn complete(rules: &[Axiom], types: &Types, objects: &[Typed], base: &Facts) -> Facts {
    derive(rules, &Universe { types, objects }, base)
}

/// Both sets together; where they differ on an atom, the second holds.
pub fn merged(mut first: Facts, second: Facts) -> Facts {
    for (atoms, truth) in [(second.known, Truth::True), (second.unknown, Truth::Unknown)] {
        for atom in atoms {
            first.set(atom, truth);
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::pddl::{Atom, Domain, SourceText, parse_domain, parse_rules};
    use crate::perception::model::Perception;
    use crate::perception::{GripperContent, proprioception};

    fn read(domain: &str, rules: &str) -> (Domain, Vec<Axiom>) {
        let domain = parse_domain(&SourceText::new("domain.pddl", domain)).unwrap().value;
        let rules = parse_rules(&SourceText::new("completion.pddl", rules), &domain).unwrap();
        (domain, rules)
    }

    fn blocks(grip: &GripperContent, on: &[[&str; 2]]) -> Facts {
        let (domain, rules) = read(
            include_str!("../../domains/blocksworld/domain.pddl"),
            include_str!("../../domains/blocksworld/completion.pddl"),
        );
        let text = include_str!("../../domains/blocksworld/perception.toml");
        let perception = Perception::parse("perception.toml", text).unwrap();
        let objects = [("a", "block"), ("b", "block"), ("arm", "robot")];
        let objects = objects.map(|(n, t)| Typed::new(n, t));
        let seen = Facts::new(on.iter().map(|pair| Atom::new("on", pair)).collect());
        let base = merged(seen, proprioception(&domain, &perception, &objects, grip));
        complete(&rules, &domain.types, &objects, &base)
    }

    #[track_caller]
    fn check(facts: &Facts, known: &[&str], unknown: &[&str]) {
        let text = |atoms: &BTreeSet<Atom>| -> Vec<String> {
            atoms.iter().map(ToString::to_string).collect()
        };
        assert_eq!(text(&facts.known), known);
        assert_eq!(text(&facts.unknown), unknown);
    }

    #[test]
    fn a_free_block_is_clear_and_stands_on_the_table() {
        let facts = blocks(&GripperContent::Empty, &[["a", "b"]]);
        check(&facts, &["(clear a)", "(handempty arm)", "(on a b)", "(ontable b)"], &[]);
    }

    #[test]
    fn a_held_block_is_neither_clear_nor_on_the_table() {
        let facts = blocks(&GripperContent::Holds("a".into()), &[]);
        check(&facts, &["(clear b)", "(handfull arm)", "(holding a)", "(ontable b)"], &[]);
    }

    #[test]
    fn holding_something_unknown_leaves_unknown_what_depends_on_it() {
        let facts = blocks(&GripperContent::HoldsSomething, &[]);
        let unknown =
            ["(clear a)", "(clear b)", "(holding a)", "(holding b)", "(ontable a)", "(ontable b)"];
        check(&facts, &["(handfull arm)"], &unknown);
    }

    #[test]
    fn a_disk_around_no_peg_is_off_peg() {
        let (domain, rules) = read(
            include_str!("../../domains/hanoi/domain.pddl"),
            include_str!("../../domains/hanoi/completion.pddl"),
        );
        let objects = [("d", "disk"), ("e", "disk"), ("p", "peg")];
        let objects = objects.map(|(n, t)| Typed::new(n, t));
        let seen = Facts::new(BTreeSet::from([Atom::new("on-peg", &["d", "p"])]));
        let facts = complete(&rules, &domain.types, &objects, &seen);
        check(&facts, &["(clear d)", "(clear e)", "(off-peg e)", "(on-peg d p)"], &[]);
    }
}
