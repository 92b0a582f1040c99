//! Which (exemplar, test) pairs are evaluated.

use std::collections::BTreeSet;

use super::Labelled;
use super::recorded::Pair;
use crate::pddl::Name;

/// Every ordered pair of different problems.
pub fn ordered_pairs(problems: &[Labelled]) -> Vec<Pair> {
    let numbers = || problems.iter().map(|p| p.number);
    numbers().flat_map(|e| numbers().filter(move |t| *t != e).map(move |t| (e, t))).collect()
}

/// Whether the reference evaluates the pair: the same predicates occur in both true states, derived
/// ones included. An exemplar can teach nothing else.
pub fn is_evaluated(exemplar: &Labelled, test: &Labelled) -> bool {
    predicates(exemplar) == predicates(test)
}

fn predicates(problem: &Labelled) -> BTreeSet<&Name> {
    problem.init.iter().map(|atom| &atom.predicate).collect()
}
