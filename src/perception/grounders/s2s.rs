//! S2S, the paper's grounder: a tuple is judged as its nearest labelled example tuple.

use std::sync::Arc;

use super::candidates::{CandidateSlots, for_tuples, slots};
use super::judged::{Basis, Evidence, Grounding, Judged};
use super::nearest_index::{Example, NearestIndex};
use super::{Grounder, GrounderError, GrounderInputs};
use crate::logic::Truth;
use crate::mismatch::Mismatch;
use crate::parts::{Part, PartContext, PartError, no_options};
use crate::pddl::{Atom, Domain, Name, Types};
use crate::perception::Observation;
use crate::perception::model::features::{
    Feature, FeatureVector, Needs, default_feature, feature_by_name,
};
use crate::perception::model::{Exemplars, ObjectBox, ObservedSpec, PerceptionError};

/// The nearest-neighbour grounder, with the features of its examples computed once.
#[derive(Debug, Clone)]
pub struct S2s {
    types: Types,
    /// For objects in an image.
    flat: Vec<PredicateModel>,
    /// For objects with masks, where the examples have them too.
    masked: Option<Vec<PredicateModel>>,
    /// For objects with volumes, where the examples have them too.
    deep: Option<Vec<PredicateModel>>,
}

/// The examples of one predicate.
#[derive(Debug, Clone)]
struct PredicateModel {
    predicate: Name,
    slots: CandidateSlots,
    feature: &'static Feature,
    positives: NearestIndex,
    negatives: NearestIndex,
}

/// The entry of the table of grounders.
pub(super) const PART: Part<dyn Grounder> = Part {
    name: "s2s",
    help: "each fact as in the nearest labelled example (S2S, the paper's)",
    options: no_options,
    build,
};

fn build(context: &PartContext<'_, dyn Grounder>) -> Result<Box<dyn Grounder>, PartError> {
    let GrounderInputs { domain, perception, exemplars } = context.inputs;
    Ok(Box::new(S2s::new(domain, &perception.observed, exemplars)?))
}

impl S2s {
    /// Computes the features of every example tuple of the observed predicates.
    ///
    /// A predicate without an example that holds, or without one that does not, is left out:
    /// nothing is said of it. Where the examples have volumes, objects that have volumes are
    /// judged by them; else where the examples have masks, objects that have masks by these; and
    /// all others by their boxes.
    ///
    /// # Errors
    /// [`PerceptionError::Value`] for a predicate or feature that does not exist.
    pub fn new(
        domain: &Domain,
        observed: &[ObservedSpec],
        exemplars: &Exemplars,
    ) -> Result<Self, PerceptionError> {
        let models = |needs: Needs| -> Result<Vec<PredicateModel>, PerceptionError> {
            let mut models = Vec::new();
            for spec in observed {
                let model = PredicateModel::new(domain, spec, needs, exemplars)?;
                if !model.positives.is_empty() && !model.negatives.is_empty() {
                    models.push(model);
                }
            }
            // In the order of the judgements.
            models.sort_by(|a, b| a.predicate.cmp(&b.predicate));
            Ok(models)
        };
        let uses_masks = observed.iter().any(|spec| spec.feature_with_masks.is_some());
        let masked = (uses_masks && exemplars.have_masks()).then(|| models(Needs::Masks));
        let deep = exemplars.have_volumes().then(|| models(Needs::Volumes));
        Ok(Self {
            types: domain.types.clone(),
            flat: models(Needs::Boxes)?,
            masked: masked.transpose()?,
            deep: deep.transpose()?,
        })
    }

    /// The predicates that can be judged from these examples, in alphabetical order.
    pub fn judged_predicates(&self) -> impl Iterator<Item = &Name> {
        let models = self.deep.as_ref().or(self.masked.as_ref()).unwrap_or(&self.flat);
        models.iter().map(|t| &t.predicate)
    }

    /// The models for these objects.
    fn models(&self, objects: &[ObjectBox]) -> &[PredicateModel] {
        let with_depth = objects.iter().any(|object| object.volume.is_some());
        let with_masks = objects.iter().any(|object| object.mask.is_some());
        let deep = self.deep.as_ref().filter(|_| with_depth);
        let masked = self.masked.as_ref().filter(|_| with_masks);
        deep.or(masked).unwrap_or(&self.flat)
    }
}

impl Grounder for S2s {
    fn ground(&self, observation: &Observation<'_>) -> Result<Grounding, GrounderError> {
        Ok(self.judge(observation.objects))
    }
}

impl S2s {
    /// Judges every type-valid tuple of objects, in the order of the atoms.
    pub fn judge(&self, objects: &[ObjectBox]) -> Grounding {
        // With models and objects in order of their names, the judgements come in order.
        let mut order: Vec<usize> = (0..objects.len()).collect();
        order.sort_by(|&a, &b| objects[a].name.cmp(&objects[b].name));
        let mut judged = Vec::new();
        for model in self.models(objects) {
            for_tuples(&self.types, &model.slots, objects, &order, |tuple| {
                judged.extend(model.judge(objects, tuple));
            });
        }
        Grounding { judged, anomalies: Vec::new() }
    }
}

impl PredicateModel {
    fn new(
        domain: &Domain,
        spec: &ObservedSpec,
        needs: Needs,
        exemplars: &Exemplars,
    ) -> Result<Self, PerceptionError> {
        let slots = slots(domain, spec)?;
        let feature = choose_feature(spec, needs, slots.len())?;
        let predicate = spec.predicate.clone();
        let (mut positives, mut negatives) = (Vec::new(), Vec::new());
        for exemplar in exemplars.examples() {
            let objects = &exemplar.objects;
            let order: Vec<usize> = (0..objects.len()).collect();
            for_tuples(&domain.types, &slots, objects, &order, |tuple| {
                let Some(vector) = describe(feature, objects, tuple) else { return };
                let atom = atom(&predicate, objects, tuple);
                let holds = exemplar.init.contains(&atom);
                let evidence = Arc::new(Evidence { exemplar: exemplar.name.clone(), atom });
                let side = if holds { &mut positives } else { &mut negatives };
                side.push(Example { vector, evidence });
            });
        }
        let [positives, negatives] =
            [positives, negatives].map(|side| NearestIndex::new(side, feature.length));
        Ok(Self { predicate, slots, feature, positives, negatives })
    }

    fn judge(&self, objects: &[ObjectBox], tuple: &[usize]) -> Option<Judged> {
        let vector = describe(self.feature, objects, tuple)?;
        let (d_pos, nearest_pos) = self.positives.nearest(&vector)?;
        let (d_neg, nearest_neg) = self.negatives.nearest(&vector)?;
        Some(Judged {
            atom: atom(&self.predicate, objects, tuple),
            // A tie does not hold, as in the reference.
            truth: Truth::from(d_pos < d_neg),
            basis: Basis::Observed,
            d_pos,
            d_neg,
            nearest_pos: Arc::clone(nearest_pos),
            nearest_neg: Arc::clone(nearest_neg),
        })
    }
}

/// A tuple as a vector; `None` when the feature needs what an object lacks.
fn describe(feature: &Feature, objects: &[ObjectBox], tuple: &[usize]) -> Option<FeatureVector> {
    match tuple {
        [i] => (feature.compute)(&[&objects[*i]]),
        [i, j] => (feature.compute)(&[&objects[*i], &objects[*j]]),
        _ => None,
    }
}

fn atom(predicate: &Name, objects: &[ObjectBox], tuple: &[usize]) -> Atom {
    let args = tuple.iter().map(|&i| objects[i].name.clone()).collect();
    Atom { predicate: predicate.clone(), args }
}

/// The feature that a predicate names for objects of which so much is known, or the usual one.
fn choose_feature(
    spec: &ObservedSpec,
    needs: Needs,
    arity: usize,
) -> Result<&'static Feature, PerceptionError> {
    let special = match needs {
        Needs::Boxes => &None,
        Needs::Masks => &spec.feature_with_masks,
        Needs::Volumes => &spec.feature_with_volumes,
    };
    let name = special.as_ref().or(spec.feature.as_ref());
    let feature = match name {
        Some(name) => feature_by_name(name),
        None => default_feature(arity),
    };
    feature.filter(|f| f.arity == arity).ok_or_else(|| {
        let at = format!("observed.{}.feature", spec.predicate);
        let got = name.map_or("none", String::as_str);
        Mismatch::new(at, format!("a feature of {arity} objects"), got).into()
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;
    use crate::geometry::PixelBox;
    use crate::pddl::{SourceText, Typed, parse_domain};
    use crate::perception::model::Exemplar;

    fn domain() -> Domain {
        let text = include_str!("../../../domains/blocksworld/domain.pddl");
        parse_domain(&SourceText::new("domain.pddl", text)).unwrap().value
    }

    fn on() -> Vec<ObservedSpec> {
        vec![ObservedSpec {
            predicate: "on".into(),
            feature: None,
            feature_with_masks: None,
            feature_with_volumes: None,
            candidates: None,
        }]
    }

    fn boxes(list: &[(&str, [f64; 4])]) -> Vec<ObjectBox> {
        let object = |(name, edges): &(&str, [f64; 4])| {
            ObjectBox::new((*name).into(), "block".into(), PixelBox::from(*edges))
        };
        list.iter().map(object).collect()
    }

    fn exemplars(list: &[(&str, [f64; 4])], on: &[(&str, &str)]) -> Exemplars {
        let objects: Vec<Typed> = list.iter().map(|(n, _)| Typed::new(*n, "block")).collect();
        let init: BTreeSet<Atom> = on.iter().map(|(a, b)| Atom::new("on", &[a, b])).collect();
        let boxes: Vec<_> = list.iter().map(|(n, e)| ((*n).into(), PixelBox::from(*e))).collect();
        let exemplar = Exemplar::new("boxes.json", [100, 100], &boxes, (&objects, init)).unwrap();
        Exemplars::new(vec![exemplar]).unwrap()
    }

    /// `a` stands on `b`, `c` beside them.
    fn tower() -> Exemplars {
        let list = [
            ("a", [10.0, 40.0, 20.0, 50.0]),
            ("b", [10.0, 50.0, 20.0, 60.0]),
            ("c", [40.0, 50.0, 50.0, 60.0]),
        ];
        exemplars(&list, &[("a", "b")])
    }

    #[test]
    fn a_tuple_is_judged_as_its_nearest_example() {
        let s2s = S2s::new(&domain(), &on(), &tower()).unwrap();
        let scene = boxes(&[("x", [70.0, 20.0, 80.0, 30.0]), ("y", [71.0, 30.0, 81.0, 40.0])]);
        let judged = s2s.judge(&scene).judged;
        assert_eq!(judged.len(), 2);
        assert_eq!(judged[0].atom, Atom::new("on", &["x", "y"]));
        assert!(judged[0].truth == Truth::True && judged[0].confidence() > 0.5);
        assert_eq!(judged[0].nearest_pos.atom, Atom::new("on", &["a", "b"]));
        assert!(judged[1].truth == Truth::False && judged[1].confidence() < 0.0);
    }

    #[test]
    fn without_a_positive_or_a_negative_example_nothing_is_said() {
        let apart = [("a", [10.0, 40.0, 20.0, 50.0]), ("b", [40.0, 50.0, 50.0, 60.0])];
        for on_pairs in [&[][..], &[("a", "b"), ("b", "a")][..]] {
            let s2s = S2s::new(&domain(), &on(), &exemplars(&apart, on_pairs)).unwrap();
            assert_eq!(s2s.judged_predicates().count(), 0);
            assert_eq!(s2s.judge(&boxes(&apart)), Grounding::default());
        }
    }

    /// One box twice: the pair and its reverse have the same feature, one holds and one does not.
    #[test]
    fn a_tie_does_not_hold() {
        let same = [("a", [10.0, 40.0, 20.0, 50.0]), ("b", [10.0, 40.0, 20.0, 50.0])];
        let s2s = S2s::new(&domain(), &on(), &exemplars(&same, &[("a", "b")])).unwrap();
        let judged = s2s.judge(&boxes(&same)).judged;
        assert!(
            judged.iter().all(|j| j.truth == Truth::False && j.confidence() == 0.0),
            "{judged:?}"
        );
    }

    proptest! {
        #[test]
        fn the_order_of_objects_does_not_matter(
            corners in proptest::collection::vec((0.0..80.0_f64, 0.0..80.0_f64), 2..7),
            seed in any::<u64>(),
        ) {
            let s2s = S2s::new(&domain(), &on(), &tower()).unwrap();
            let objects: Vec<ObjectBox> = corners
                .iter()
                .enumerate()
                .map(|(i, (x, y))| ObjectBox::new(Name::new(format!("o{i}")), "block".into(), PixelBox::from([*x, *y, x + 10.0, y + 10.0])))
                .collect();
            let mut shuffled = objects.clone();
            shuffled.rotate_left((seed % objects.len() as u64) as usize);
            shuffled.swap(0, (seed / 7 % objects.len() as u64) as usize);
            prop_assert_eq!(s2s.judge(&objects), s2s.judge(&shuffled));
        }
    }
}
