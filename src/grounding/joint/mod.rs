//! `s2s-joint`: S2S's distances, judged together under the constraints of `perception.toml`.
//!
//! Each tuple's evidence is how much nearer it is to an example that holds than to one that does not.
//! Accepted is the set of atoms with the most evidence that keeps every constraint; where the evidence
//! does not decide, an atom is unknown, and what no set of facts explains is a doubt. Stages:
//!
//! 1. `fixtures`: predicates that constrain by number (`exactly_one`, `functional`, …), by branch and
//!    bound (`choice`);
//! 2. `support`: what rests on what, from the same evidence and from where the boxes are (`extent`);
//! 3. `order`: strict orders.
//!
//! What the examples do not bear out is not assumed: an `exactly_one` that an example violates is
//! "at most one", and an order is total only where the examples relate all objects.

mod extent;
mod board;
mod choice;
mod fixtures;
mod support;
mod order;
#[cfg(test)]
mod tests;

use super::candidates::slots;
use super::constraints::{Constraints, ExactlyOneOf, Place, SecondOpinion, Support};
use super::{
    Exemplar, Exemplars, Grounder, Grounding, ObjectBox, ObservedSpec, Perception, PerceptionError,
    S2s,
};
use crate::pddl::{Atom, Domain, Name, Types};
use board::Board;
use fixtures::Due;
use support::Lesson;

/// The joint grounder.
#[derive(Debug, Clone)]
struct Joint {
    s2s: S2s,
    /// The same tuples by further features.
    opinions: Option<S2s>,
    constraints: Constraints,
    /// The observed predicates that only numbers constrain.
    numbered: Vec<Name>,
    due: Due,
    types: Types,
    /// For each `support`: the types of the objects that may rest on each other.
    parts: Vec<Vec<Name>>,
    /// For each `support`: what the examples show in the image.
    flat: Vec<Option<Lesson>>,
    /// The same in the world, where the examples have volumes.
    deep: Option<Vec<Option<Lesson>>>,
    /// The strict orders that the examples show to be total.
    total: Vec<Name>,
}

/// The entry for the table of grounders.
pub(super) fn build(
    domain: &Domain,
    perception: &Perception,
    exemplars: &Exemplars,
) -> Result<Box<dyn Grounder>, PerceptionError> {
    Ok(Box::new(Joint::new(domain, perception, exemplars)?))
}

impl Joint {
    fn new(
        domain: &Domain,
        perception: &Perception,
        exemplars: &Exemplars,
    ) -> Result<Self, PerceptionError> {
        let constraints = perception.constraints.clone();
        let s2s = S2s::new(domain, &perception.observed, exemplars)?;
        let candidates = |predicate: &Name| -> Result<Vec<Vec<Name>>, PerceptionError> {
            match perception.observed.iter().find(|spec| spec.predicate == *predicate) {
                Some(spec) => slots(domain, spec),
                None => Ok(Vec::new()),
            }
        };
        let supports = constraints.support.iter();
        let parts = supports.clone().map(|s| candidates(&s.predicate).map(|slots| slots.concat()));
        let parts: Vec<Vec<Name>> = parts.collect::<Result<_, _>>()?;
        let lessons = |deep: bool| -> Vec<Option<Lesson>> {
            let lesson = |(support, types): (&Support, &Vec<Name>)| {
                let is_part = |object: &ObjectBox| is_of(&domain.types, object, types);
                Lesson::learn(&support.predicate, exemplars, deep, is_part)
            };
            supports.clone().zip(&parts).map(lesson).collect()
        };
        let seen = Seen { types: &domain.types, exemplars, candidates: &candidates, s2s: &s2s };
        let is_numbered = |name: &&Name| {
            let supports = constraints.support.iter().any(|support| support.predicate == **name);
            !supports && !constraints.strict_order.contains(name)
        };
        Ok(Self {
            opinions: opinions(domain, perception, exemplars)?,
            numbered: perception.observed_predicates().filter(is_numbered).cloned().collect(),
            due: seen.due(&constraints)?,
            flat: lessons(false),
            deep: exemplars.have_volumes().then(|| lessons(true)),
            types: domain.types.clone(),
            parts,
            total: seen.total(&constraints)?,
            s2s,
            constraints,
        })
    }
}

impl Grounder for Joint {
    fn ground(&self, objects: &[ObjectBox]) -> Grounding {
        let with_depth = objects.iter().any(|object| object.volume.is_some());
        let lessons = self.deep.as_ref().filter(|_| with_depth);
        let (deep, lessons) = (lessons.is_some(), lessons.unwrap_or(&self.flat));
        let mut board = Board::new(objects, deep, self.s2s.ground(objects).judged);
        if let Some(opinions) = &self.opinions {
            board.add_opinions(&opinions.ground(objects).judged);
        }
        let numbered: Vec<&Name> = self.numbered.iter().filter(|p| board.judges(p)).collect();
        fixtures::decide(&mut board, &numbered, &self.constraints, &self.due);
        for (n, support) in self.constraints.support.iter().enumerate() {
            if let Some(lesson) = lessons[n] {
                let in_sight = objects.iter().filter(|o| !deep || o.volume.is_some());
                let parts = in_sight.filter(|o| is_of(&self.types, o, &self.parts[n]));
                let parts = board.numbers(parts.map(|object| &object.name));
                support::decide(&mut board, parts, (support, lesson), &self.constraints);
            }
        }
        for order in self.constraints.strict_order.iter().filter(|o| self.s2s_judges(o)) {
            let supports = self.constraints.support.iter();
            let agreeing: Vec<&Name> =
                supports.filter(|s| s.agrees_with.contains(order)).map(|s| &s.predicate).collect();
            order::decide(&mut board, order, self.total.contains(order), &agreeing);
        }
        board.finish()
    }
}

impl Joint {
    fn s2s_judges(&self, predicate: &Name) -> bool {
        self.s2s.judged_predicates().any(|judged| judged == predicate)
    }
}

/// The grounder by the further features, where the domain names any.
fn opinions(
    domain: &Domain,
    perception: &Perception,
    exemplars: &Exemplars,
) -> Result<Option<S2s>, PerceptionError> {
    let spec = |opinion: &SecondOpinion| {
        let own = perception.observed.iter().find(|spec| spec.predicate == opinion.predicate);
        ObservedSpec {
            predicate: opinion.predicate.clone(),
            feature: Some(opinion.feature.clone()),
            feature_with_masks: None,
            feature_with_volumes: opinion.feature_with_volumes.clone(),
            candidates: own.and_then(|spec| spec.candidates.clone()),
        }
    };
    let specs: Vec<ObservedSpec> = perception.constraints.second_opinion.iter().map(spec).collect();
    if specs.is_empty() {
        return Ok(None);
    }
    S2s::new(domain, &specs, exemplars).map(Some)
}

/// What the labelled examples bear out.
struct Seen<'a> {
    types: &'a Types,
    exemplars: &'a Exemplars,
    candidates: &'a dyn Fn(&Name) -> Result<Vec<Vec<Name>>, PerceptionError>,
    s2s: &'a S2s,
}

impl Seen<'_> {
    fn due(&self, constraints: &Constraints) -> Result<Due, PerceptionError> {
        let mut due = Due::default();
        for predicate in &constraints.exactly_one {
            let place = Place { predicate: predicate.clone(), argument: 0 };
            if self.has_exactly_one(&ExactlyOneOf { arguments: vec![place] })? {
                due.predicates.push(predicate.clone());
            }
        }
        for group in &constraints.exactly_one_of {
            due.groups.push(self.has_exactly_one(group)?);
        }
        Ok(due)
    }

    /// Whether every object of every example that may stand in these places stands in one, and
    /// every predicate of them is judged, so that it is seen where a scene's objects stand.
    fn has_exactly_one(&self, group: &ExactlyOneOf) -> Result<bool, PerceptionError> {
        for place in &group.arguments {
            if !self.s2s.judged_predicates().any(|judged| *judged == place.predicate) {
                return Ok(false);
            }
            let types = (self.candidates)(&place.predicate)?;
            let types = types.get(place.argument).cloned().unwrap_or_default();
            for example in self.exemplars.examples() {
                let parts = example.objects.iter().filter(|o| is_of(self.types, o, &types));
                for part in parts {
                    let stands = |atom: &Atom| {
                        let places =
                            group.arguments.iter().filter(|p| p.predicate == atom.predicate);
                        places.filter(|p| atom.args.get(p.argument) == Some(&part.name)).count()
                    };
                    if example.init.iter().map(stands).sum::<usize>() != 1 {
                        return Ok(false);
                    }
                }
            }
        }
        Ok(true)
    }

    /// The orders that relate any two objects of every example.
    fn total(&self, constraints: &Constraints) -> Result<Vec<Name>, PerceptionError> {
        let mut total = Vec::new();
        for order in &constraints.strict_order {
            let types = (self.candidates)(order)?.concat();
            let is_total = |example: &Exemplar| {
                let parts: Vec<&Name> = example
                    .objects
                    .iter()
                    .filter(|object| is_of(self.types, object, &types))
                    .map(|object| &object.name)
                    .collect();
                let holds = |a: &&Name, b: &&Name| {
                    let args = vec![(*a).clone(), (*b).clone()];
                    example.init.contains(&Atom { predicate: order.clone(), args })
                };
                let related = |(at, a): (usize, &&Name)| {
                    parts[at + 1..].iter().all(|b| holds(a, b) || holds(b, a))
                };
                parts.iter().enumerate().all(related)
            };
            if self.exemplars.examples().iter().all(is_total) {
                total.push(order.clone());
            }
        }
        Ok(total)
    }
}

fn is_of(types: &Types, object: &ObjectBox, wanted: &[Name]) -> bool {
    types.fits(std::slice::from_ref(&object.type_name), wanted)
}
