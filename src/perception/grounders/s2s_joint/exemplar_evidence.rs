//! What the labelled examples bear out: which constraints hold there without exception.

use std::collections::BTreeMap;

use super::cardinality::Required;
use super::is_of;
use crate::pddl::{Atom, Name, Types};
use crate::perception::grounders::CandidateSlots;
use crate::perception::model::constraints::{Constraints, ExactlyOneOf, PredicateArgument};
use crate::perception::model::{Exemplar, Exemplars};

/// The examples, and what is judged from them.
pub(super) struct ExemplarEvidence<'a> {
    pub(super) types: &'a Types,
    pub(super) exemplars: &'a Exemplars,
    /// The types that each argument of an observed predicate may have.
    pub(super) slots: &'a BTreeMap<Name, CandidateSlots>,
    /// The predicates that can be judged from the examples.
    pub(super) judged: Vec<&'a Name>,
}

impl ExemplarEvidence<'_> {
    /// Where each object must have exactly one atom.
    pub(super) fn required(&self, constraints: &Constraints) -> Required {
        let alone = |predicate: &Name| {
            let place = PredicateArgument { predicate: predicate.clone(), argument: 0 };
            ExactlyOneOf { arguments: vec![place] }
        };
        let predicates = constraints.exactly_one.iter();
        Required {
            predicates: predicates.filter(|p| self.is_exactly_one(&alone(p))).cloned().collect(),
            groups: constraints.exactly_one_of.iter().map(|g| self.is_exactly_one(g)).collect(),
        }
    }

    /// Whether every object of every example that may stand in these places stands in one, and
    /// every predicate of them is judged, so that it is seen where a scene's objects stand.
    fn is_exactly_one(&self, group: &ExactlyOneOf) -> bool {
        let examples = self.exemplars.examples();
        group.arguments.iter().all(|place| {
            let slots = self.slots.get(&place.predicate);
            let types = slots.and_then(|slots| slots.get(place.argument));
            let types = types.map(Vec::as_slice).unwrap_or_default();
            let each_one = |example: &Exemplar| {
                let parts = self.parts(example, types);
                parts.iter().all(|part| stands(example, group, part) == 1)
            };
            self.judged.contains(&&place.predicate) && examples.iter().all(each_one)
        })
    }

    /// The orders that relate any two objects of every example.
    pub(super) fn total(&self, constraints: &Constraints) -> Vec<Name> {
        let is_total = |order: &&Name| {
            let types = self.slots.get(*order).map(|slots| slots.concat()).unwrap_or_default();
            self.exemplars.examples().iter().all(|example| {
                let parts = self.parts(example, &types);
                let related = |(at, a): (usize, &&Name)| {
                    parts[at + 1..]
                        .iter()
                        .all(|b| holds(example, order, [a, b]) || holds(example, order, [b, a]))
                };
                parts.iter().enumerate().all(related)
            })
        };
        constraints.strict_order.iter().filter(is_total).cloned().collect()
    }

    fn parts<'b>(&self, example: &'b Exemplar, types: &[Name]) -> Vec<&'b Name> {
        let objects = example.objects.iter();
        objects.filter(|o| is_of(self.types, o, types)).map(|o| &o.name).collect()
    }
}

/// How many of the example's facts have the object in one of the places.
fn stands(example: &Exemplar, group: &ExactlyOneOf, object: &Name) -> usize {
    let here = |atom: &Atom, place: &PredicateArgument| {
        place.predicate == atom.predicate && atom.args.get(place.argument) == Some(object)
    };
    let facts = example.init.iter();
    facts.map(|atom| group.arguments.iter().filter(|place| here(atom, place)).count()).sum()
}

/// Whether a binary fact is among the example's.
pub(super) fn holds(example: &Exemplar, predicate: &Name, args: [&Name; 2]) -> bool {
    let args = args.map(Name::clone).to_vec();
    example.init.contains(&Atom { predicate: predicate.clone(), args })
}
