//! S2S, the paper's grounder: a tuple is judged as its nearest labelled example tuple.

use super::candidates::{CandidateSlots, slots, tuples};
use super::features::{Feature, default_feature, distance, feature_by_name};
use super::{Exemplars, Grounder, ObjectBox, ObservedSpec, Perception, PerceptionError};
use crate::geometry::PixelBox;
use crate::pddl::{Atom, Domain, Name, Types};

/// A judged tuple with what the judgement rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// The tuple.
    pub atom: Atom,
    /// Whether it was judged to hold.
    pub truth: bool,
    /// Distance to the nearest example that holds, in the feature's unit (pixels).
    pub d_pos: f64,
    /// Distance to the nearest example that does not hold, likewise.
    pub d_neg: f64,
    /// The nearest example that holds.
    pub nearest_pos: Evidence,
    /// The nearest example that does not hold.
    pub nearest_neg: Evidence,
}

/// One example tuple that a judgement rests on.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Evidence {
    /// Which labelled example it is from.
    pub exemplar: String,
    /// The tuple, with the example's object names.
    pub atom: Atom,
}

impl Judged {
    /// How clear the judgement is, from -1 (like an example that does not hold) to 1 (like one
    /// that does); 0 is undecided.
    pub fn confidence(&self) -> f64 {
        let sum = self.d_neg + self.d_pos;
        if sum > 0.0 { (self.d_neg - self.d_pos) / sum } else { 0.0 }
    }
}

/// The nearest-neighbour grounder, with the features of its examples computed once.
#[derive(Debug, Clone)]
pub struct S2s {
    types: Types,
    predicates: Vec<Table>,
}

#[derive(Debug, Clone)]
struct Table {
    predicate: Name,
    slots: CandidateSlots,
    feature: &'static Feature,
    positives: Vec<Example>,
    negatives: Vec<Example>,
}

#[derive(Debug, Clone)]
struct Example {
    vector: Vec<f64>,
    evidence: Evidence,
}

/// The entry for the table of grounders.
pub(super) fn build(
    domain: &Domain,
    perception: &Perception,
    exemplars: &Exemplars,
) -> Result<Box<dyn Grounder>, PerceptionError> {
    Ok(Box::new(S2s::new(domain, &perception.observed, exemplars)?))
}

impl S2s {
    /// Computes the features of every example tuple of the observed predicates.
    ///
    /// A predicate without an example that holds, or without one that does not, is left out:
    /// nothing is said of it.
    ///
    /// # Errors
    /// [`PerceptionError::Value`] for a predicate or feature that does not exist.
    pub fn new(
        domain: &Domain,
        observed: &[ObservedSpec],
        exemplars: &Exemplars,
    ) -> Result<Self, PerceptionError> {
        let mut predicates = Vec::new();
        for spec in observed {
            let table = Table::new(domain, spec, exemplars)?;
            if !table.positives.is_empty() && !table.negatives.is_empty() {
                predicates.push(table);
            }
        }
        Ok(Self { types: domain.types.clone(), predicates })
    }

    /// The predicates that can be judged from these examples.
    pub fn judged_predicates(&self) -> impl Iterator<Item = &Name> {
        self.predicates.iter().map(|t| &t.predicate)
    }
}

impl Grounder for S2s {
    fn ground(&self, objects: &[ObjectBox]) -> Vec<Judged> {
        let mut judged: Vec<_> = self
            .predicates
            .iter()
            .flat_map(|table| {
                let tuples = tuples(&self.types, &table.slots, objects);
                tuples.into_iter().filter_map(|tuple| table.judge(objects, &tuple))
            })
            .collect();
        judged.sort_by(|a, b| a.atom.cmp(&b.atom));
        judged
    }
}

impl Table {
    fn new(
        domain: &Domain,
        spec: &ObservedSpec,
        exemplars: &Exemplars,
    ) -> Result<Self, PerceptionError> {
        let slots = slots(domain, spec)?;
        let feature = match &spec.feature {
            Some(name) => feature_by_name(name),
            None => default_feature(slots.len()),
        };
        let Some(feature) = feature.filter(|f| f.arity == slots.len()) else {
            return Err(PerceptionError::Value {
                field: format!("observed.{}.feature", spec.predicate),
                expected: format!("a feature of {} objects", slots.len()),
                got: spec.feature.clone().unwrap_or_else(|| "none".to_owned()),
            });
        };
        let predicate = spec.predicate.clone();
        let (positives, negatives) = (Vec::new(), Vec::new());
        let mut table = Self { predicate, slots, feature, positives, negatives };
        for exemplar in exemplars.examples() {
            for tuple in tuples(&domain.types, &table.slots, &exemplar.objects) {
                let (atom, vector) = table.describe(&exemplar.objects, &tuple);
                let holds = exemplar.init.contains(&atom);
                let evidence = Evidence { exemplar: exemplar.name.clone(), atom };
                let side = if holds { &mut table.positives } else { &mut table.negatives };
                side.push(Example { vector, evidence });
            }
        }
        Ok(table)
    }

    fn describe(&self, objects: &[ObjectBox], tuple: &[usize]) -> (Atom, Vec<f64>) {
        let args = tuple.iter().map(|&i| objects[i].name.clone()).collect();
        let boxes: Vec<PixelBox> = tuple.iter().map(|&i| objects[i].pixel_box).collect();
        (Atom { predicate: self.predicate.clone(), args }, (self.feature.compute)(&boxes))
    }

    fn judge(&self, objects: &[ObjectBox], tuple: &[usize]) -> Option<Judged> {
        let (atom, vector) = self.describe(objects, tuple);
        let (d_pos, nearest_pos) = nearest(&self.positives, &vector)?;
        let (d_neg, nearest_neg) = nearest(&self.negatives, &vector)?;
        Some(Judged {
            atom,
            truth: d_pos < d_neg, // a tie does not hold, as in the reference
            d_pos,
            d_neg,
            nearest_pos: nearest_pos.clone(),
            nearest_neg: nearest_neg.clone(),
        })
    }
}

/// The nearest example; of several equally near, the first by name, so that order is no matter.
fn nearest<'a>(examples: &'a [Example], vector: &[f64]) -> Option<(f64, &'a Evidence)> {
    let distances = examples.iter().map(|e| (distance(&e.vector, vector), &e.evidence));
    distances.min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(b.1)))
}
