//! Why the world is not as expected.

use std::collections::BTreeSet;

use crate::logic::Facts;
use crate::messages::Deviation;
use crate::pddl::{Atom, Domain, Name};

/// Compares what is seen with what is expected, grouped by the object that each fact is about (its
/// first argument). Derived facts follow from others and are left out unless nothing else changed
/// for their object.
pub fn deviations(expected: &Facts, seen: &Facts, domain: &Domain) -> Vec<Deviation> {
    let missing: BTreeSet<&Atom> =
        expected.known.iter().filter(|a| seen.truth(a).is_false()).collect();
    let surplus: BTreeSet<&Atom> =
        seen.known.iter().filter(|a| expected.truth(a).is_false()).collect();
    let unknown: BTreeSet<&Atom> =
        seen.unknown.iter().filter(|a| !expected.unknown.contains(a)).collect();
    let subjects: BTreeSet<Option<&Name>> =
        missing.iter().chain(&surplus).chain(&unknown).map(|a| a.args.first()).collect();
    let mut found: Vec<Deviation> = subjects
        .into_iter()
        .map(|subject| {
            let about = |atoms: &BTreeSet<&Atom>| -> Vec<Atom> {
                let own = atoms.iter().filter(|a| a.args.first() == subject);
                own.map(|a| (*a).clone()).collect()
            };
            Deviation { missing: about(&missing), seen: about(&surplus), unknown: about(&unknown) }
        })
        .collect();
    // A change that is told by a fact of more objects says more; such deviations come first.
    let arity = |d: &Deviation| {
        d.missing.iter().chain(&d.seen).chain(&d.unknown).map(|a| a.args.len()).max()
    };
    found.sort_by_key(|d| std::cmp::Reverse(arity(d)));
    let relational = found.iter().filter(|d| arity(d) > Some(1)).count();
    if relational > 0 && has_relations(domain) {
        found.truncate(relational);
    }
    found
}

fn has_relations(domain: &Domain) -> bool {
    domain.predicates.iter().any(|p| p.params.len() > 1)
}
