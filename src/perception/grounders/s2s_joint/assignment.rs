//! The judged tuples of one scene, addressed by object numbers, with what is decided of them so far.

use std::collections::BTreeMap;

use super::extent::Extent;
use crate::logic::Truth;
use crate::pddl::Name;
use crate::perception::grounders::{Basis, Grounding, Judged};
use crate::perception::model::ObjectBox;
use crate::scene::Anomaly;

/// Evidence nearer to 0 than this says nothing: the distances to the nearest example that holds and
/// to the nearest that does not differ by less than a tenth, no more than another box of the same
/// object would change them.
pub(super) const BAND: f64 = 0.05;

/// One scene while it is being decided.
#[derive(Debug)]
pub(super) struct Assignment {
    /// The names of the objects, in order; an object's number is its place here.
    pub(super) names: Vec<Name>,
    /// Where they are.
    pub(super) extents: Vec<Extent>,
    /// The judged tuples, in order of their atoms. `truth` is what has been decided.
    pub(super) judged: Vec<Judged>,
    /// Evidence for each of them, from -1 to 1.
    pub(super) weights: Vec<f64>,
    /// What the facts cannot explain.
    pub(super) anomalies: Vec<Anomaly>,
    relations: BTreeMap<Name, Relation>,
}

/// The judged tuples of one predicate.
#[derive(Debug, Default)]
struct Relation {
    /// Arguments and place in `judged`, in order.
    tuples: Vec<(Vec<usize>, usize)>,
    /// Index in `judged` by first and second argument.
    cells: Vec<Option<usize>>,
}

impl Assignment {
    pub(super) fn new(objects: &[ObjectBox], deep: bool, judged: Vec<Judged>) -> Self {
        let sorted: BTreeMap<&Name, &ObjectBox> = objects.iter().map(|o| (&o.name, o)).collect();
        let numbers: BTreeMap<&Name, usize> =
            sorted.keys().enumerate().map(|(number, name)| (*name, number)).collect();
        let n = sorted.len();
        let mut relations: BTreeMap<Name, Relation> = BTreeMap::new();
        for (place, judged) in judged.iter().enumerate() {
            let args: Option<Vec<usize>> =
                judged.atom.args.iter().map(|arg| numbers.get(arg).copied()).collect();
            let Some(args) = args else { continue };
            let relation = relations.entry(judged.atom.predicate.clone()).or_default();
            if let [first, second] = args[..] {
                relation.cells.resize(n * n, None);
                relation.cells[first * n + second] = Some(place);
            }
            relation.tuples.push((args, place));
        }
        let weights = judged.iter().map(vote).collect();
        Self {
            names: sorted.keys().map(|name| (*name).clone()).collect(),
            extents: sorted.values().map(|object| Extent::of(object, deep)).collect(),
            judged,
            weights,
            anomalies: Vec::new(),
            relations,
        }
    }

    /// Further votes on some of the tuples: all votes on a tuple count alike.
    pub(super) fn add_feature_votes(&mut self, feature_votes: &[Judged]) {
        let mut counts = vec![1.0; self.weights.len()];
        for further in feature_votes {
            if let Ok(place) = self.judged.binary_search_by(|j| j.atom.cmp(&further.atom)) {
                self.weights[place] += vote(further);
                counts[place] += 1.0;
            }
        }
        self.weights.iter_mut().zip(counts).for_each(|(weight, count)| *weight /= count);
    }

    /// Whether anything is said of the predicate.
    pub(super) fn judges(&self, predicate: &Name) -> bool {
        self.relations.contains_key(predicate)
    }

    /// The judged tuples of a predicate: object numbers and place in `judged`, in order.
    pub(super) fn tuples(&self, predicate: &Name) -> &[(Vec<usize>, usize)] {
        self.relations.get(predicate).map(|relation| &relation.tuples[..]).unwrap_or_default()
    }

    /// The place in `judged` of one tuple of a binary predicate.
    pub(super) fn place(&self, predicate: &Name, first: usize, second: usize) -> Option<usize> {
        let cells = &self.relations.get(predicate)?.cells;
        cells.get(first * self.names.len() + second).copied().flatten()
    }

    /// Whether a tuple of a binary predicate is decided to hold.
    pub(super) fn holds(&self, predicate: &Name, first: usize, second: usize) -> bool {
        let place = self.place(predicate, first, second);
        place.is_some_and(|place| self.judged[place].truth == Truth::True)
    }

    /// The objects that stand anywhere in the judged tuples of a predicate, in order.
    pub(super) fn objects_of(&self, predicate: &Name) -> Vec<usize> {
        let mut objects: Vec<usize> =
            self.tuples(predicate).iter().flat_map(|(args, _)| args.iter().copied()).collect();
        objects.sort_unstable();
        objects.dedup();
        objects
    }

    /// The numbers of named objects, in order.
    pub(super) fn numbers<'a>(&self, names: impl Iterator<Item = &'a Name>) -> Vec<usize> {
        let mut numbers: Vec<usize> =
            names.filter_map(|name| self.names.binary_search(name).ok()).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    }

    pub(super) fn decide(&mut self, place: usize, truth: Truth) {
        self.judged[place].truth = truth;
    }

    pub(super) fn anomaly(&mut self, reason: impl Into<String>, objects: &[usize]) {
        let objects = objects.iter().map(|&object| self.names[object].clone()).collect();
        self.anomalies.push(Anomaly::about(objects, reason));
    }

    /// The decided scene. A judgement that differs from what its own feature says rests on a
    /// constraint.
    pub(super) fn finish(mut self) -> Grounding {
        for judged in &mut self.judged {
            let own = match vote(judged) {
                value if value.abs() < BAND => Truth::Unknown,
                value => Truth::from(value > 0.0),
            };
            judged.basis = if judged.truth == own { Basis::Observed } else { Basis::Constrained };
        }
        self.anomalies.sort();
        self.anomalies.dedup();
        Grounding { judged: self.judged, anomalies: self.anomalies }
    }
}

/// How clear a judgement is; nothing where the distances are no numbers.
fn vote(judged: &Judged) -> f64 {
    let confidence = judged.confidence();
    if confidence.is_finite() { confidence } else { 0.0 }
}
