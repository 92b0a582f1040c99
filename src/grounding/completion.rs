//! Completes observed facts by the rules of `completion.pddl`.

use std::collections::BTreeSet;

use super::Judged;
use crate::pddl::{Axiom, Typed, Types, Universe, derive};
use crate::scene::{Facts, Truth};

/// Judged tuples as facts, without unknowns.
pub fn facts_of(judged: &[Judged]) -> Facts {
    let known: BTreeSet<_> = judged.iter().filter(|j| j.truth).map(|j| j.atom.clone()).collect();
    Facts::new(known)
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
