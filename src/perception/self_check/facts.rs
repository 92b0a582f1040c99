//! The labelled state against what is read: from the labelled boxes, and from the detected ones.

use std::collections::BTreeSet;

use super::finding::{BoxOrigin, FindingKind};
use super::{LabelledImage, SelfCheck};
use crate::logic::Truth;
use crate::pddl::{Atom, Domain, Name};
use crate::perception::grounders::{slots, tuples};
use crate::perception::model::{Exemplar, ObjectBox, Perception, When};
use crate::perception::{
    Detections, FrameView, GripperContent, Observation, Pipeline, State, StillError, Unexplained,
};

impl SelfCheck<'_> {
    /// Facts that are read otherwise than labelled, each once: off the labelled boxes, which the
    /// grounder has learnt from, else off those of the objects that were `seen`.
    pub(super) fn compare_facts(
        &self,
        example: &LabelledImage<'_>,
        seen: Option<(&Detections, &[ObjectBox])>,
    ) -> Result<Vec<FindingKind>, StillError> {
        let labels = &example.exemplar.objects;
        let mut kinds = Vec::new();
        let mut told: BTreeSet<Atom> = BTreeSet::new();
        let labelled = (BoxOrigin::Labelled, labels.as_slice(), [].as_slice());
        let seen = seen.map(|(detections, objects)| {
            (BoxOrigin::Detected, objects, detections.unexplained.as_slice())
        });
        for (boxes, objects, unexplained) in std::iter::once(labelled).chain(seen) {
            let state = self.state(example, objects, unexplained)?;
            let differing = differing(&self.pipeline, example.exemplar, &state);
            for (atom, is_labelled, read) in differing {
                if told.insert(atom.clone()) {
                    kinds.push(FindingKind::OtherFact { atom, is_labelled, read, boxes });
                }
            }
        }
        Ok(kinds)
    }

    fn state(
        &self,
        example: &LabelledImage<'_>,
        objects: &[ObjectBox],
        unexplained: &[Unexplained],
    ) -> Result<State, StillError> {
        let mut objects = objects.to_vec();
        if !self.has_depth {
            for object in &mut objects {
                object.volume = None;
            }
        }
        let frame = FrameView { image: Some(example.image), ..FrameView::default() };
        let observation = Observation { frame, objects: &objects, unexplained };
        Ok(self.pipeline.state(&observation, &GripperContent::Empty)?)
    }
}

/// The facts of which labels and reading differ: whether each is labelled, and how it is read.
///
/// Observed facts are compared where the grounder judges them. If they agree, so are completed ones
/// of predicates that the labelled state speaks of, unless something is held there.
fn differing(
    pipeline: &Pipeline<'_>,
    exemplar: &Exemplar,
    state: &State,
) -> Vec<(Atom, bool, Truth)> {
    let Pipeline { perception, .. } = pipeline;
    let is_observed = |name: &Name| perception.observed_predicates().any(|p| p == name);
    let judged = state.grounding.judged.iter().filter(|j| is_observed(&j.atom.predicate));
    let read = judged.map(|j| (&j.atom, j.truth));
    let observed = unlike(exemplar, read);
    let mut held = perception.proprioceptive.iter().filter(|spec| spec.when == When::Holding);
    let labelled = |name: &Name| exemplar.init.iter().any(|atom| atom.predicate == *name);
    if !observed.is_empty() || held.any(|spec| labelled(&spec.predicate)) {
        return observed;
    }
    let has_box = |name: &Name| exemplar.objects.iter().any(|object| object.name == *name);
    let in_question = |atom: &&Atom| {
        perception.completed.contains(&atom.predicate)
            && labelled(&atom.predicate)
            && atom.args.iter().all(has_box)
    };
    let facts = &state.facts;
    let atoms = facts.known.iter().chain(&facts.unknown).chain(&exemplar.init);
    let atoms: BTreeSet<&Atom> = atoms.filter(in_question).collect();
    unlike(exemplar, atoms.into_iter().map(|atom| (atom, facts.truth(atom))))
}

/// Of what is read, that which is labelled otherwise.
fn unlike<'a>(
    exemplar: &Exemplar,
    read: impl Iterator<Item = (&'a Atom, Truth)>,
) -> Vec<(Atom, bool, Truth)> {
    let compared = read.map(|(atom, truth)| (atom, exemplar.init.contains(atom), truth));
    let unlike = compared.filter(|(_, is_labelled, truth)| {
        *truth != if *is_labelled { Truth::True } else { Truth::False }
    });
    unlike.map(|(atom, is_labelled, truth)| (atom.clone(), is_labelled, truth)).collect()
}

/// How often labelled examples show an observed predicate.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaughtPredicate {
    /// The predicate.
    pub predicate: Name,
    /// Tuples of labelled objects of which it holds.
    pub n_positive: usize,
    /// Tuples of which it does not.
    pub n_negative: usize,
}

/// How often the examples show each observed predicate to hold, and not to hold.
pub fn taught(
    domain: &Domain,
    perception: &Perception,
    exemplars: &[&Exemplar],
) -> Vec<TaughtPredicate> {
    let mut found = Vec::new();
    for spec in &perception.observed {
        // A predicate that the domain does not have was refused when the grounder was made.
        let Ok(slots) = slots(domain, spec) else { continue };
        let predicate = spec.predicate.clone();
        let mut taught = TaughtPredicate { predicate, n_positive: 0, n_negative: 0 };
        for exemplar in exemplars {
            for tuple in tuples(&domain.types, &slots, &exemplar.objects) {
                let args = tuple.iter().map(|&at| exemplar.objects[at].name.clone()).collect();
                let atom = Atom { predicate: spec.predicate.clone(), args };
                let holds = exemplar.init.contains(&atom);
                *(if holds { &mut taught.n_positive } else { &mut taught.n_negative }) += 1;
            }
        }
        found.push(taught);
    }
    found
}

/// Observed predicates that no example shows to hold, or none not to hold.
pub(super) fn untaught(pipeline: &Pipeline<'_>, exemplars: &[&Exemplar]) -> Vec<FindingKind> {
    let Pipeline { domain, perception, grounder, .. } = *pipeline;
    let told_by_grounder = grounder.untaught();
    let mut kinds = Vec::new();
    for TaughtPredicate { predicate, n_positive, n_negative } in
        taught(domain, perception, exemplars)
    {
        let unknown_where_touching = told_by_grounder.contains(&&predicate);
        for (n, holds) in [(n_positive, true), (n_negative, false)] {
            if n == 0 {
                let predicate = predicate.clone();
                kinds.push(FindingKind::Untaught { predicate, holds, unknown_where_touching });
            }
        }
    }
    kinds
}
