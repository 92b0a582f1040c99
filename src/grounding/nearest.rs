//! S2S, the paper's grounder: a tuple is judged as its nearest labelled example tuple.

use super::candidates::{CandidateSlots, slots, tuples};
use super::features::{Feature, default_feature, distance, feature_by_name};
use super::judged::{Basis, Evidence, Grounding, Judged};
use super::{Exemplars, Grounder, ObjectBox, ObservedSpec, Perception, PerceptionError};
use crate::pddl::{Atom, Domain, Name, Types};
use crate::scene::Truth;

/// The nearest-neighbour grounder, with the features of its examples computed once.
#[derive(Debug, Clone)]
pub struct S2s {
    types: Types,
    /// For objects in an image.
    flat: Vec<Table>,
    /// For objects with volumes, where the examples have them too.
    deep: Option<Vec<Table>>,
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
    /// nothing is said of it. Where the examples have volumes, objects that have volumes are
    /// judged by them, and objects of a camera without depth by the image.
    ///
    /// # Errors
    /// [`PerceptionError::Value`] for a predicate or feature that does not exist.
    pub fn new(
        domain: &Domain,
        observed: &[ObservedSpec],
        exemplars: &Exemplars,
    ) -> Result<Self, PerceptionError> {
        let tables = |feature_of: fn(&ObservedSpec) -> Option<&str>| {
            let mut tables = Vec::new();
            for spec in observed {
                let table = Table::new(domain, spec, feature_of(spec), exemplars)?;
                if !table.positives.is_empty() && !table.negatives.is_empty() {
                    tables.push(table);
                }
            }
            Ok(tables)
        };
        let flat = tables(|spec| spec.feature.as_deref())?;
        let deep = exemplars.have_volumes().then(|| tables(deep_feature)).transpose()?;
        Ok(Self { types: domain.types.clone(), flat, deep })
    }

    /// The predicates that can be judged from these examples.
    pub fn judged_predicates(&self) -> impl Iterator<Item = &Name> {
        self.deep.as_ref().unwrap_or(&self.flat).iter().map(|t| &t.predicate)
    }
}

impl Grounder for S2s {
    fn ground(&self, objects: &[ObjectBox]) -> Grounding {
        let with_depth = objects.iter().any(|object| object.volume.is_some());
        let tables = self.deep.as_ref().filter(|_| with_depth).unwrap_or(&self.flat);
        let mut judged: Vec<_> = tables
            .iter()
            .flat_map(|table| {
                let tuples = tuples(&self.types, &table.slots, objects);
                tuples.into_iter().filter_map(|tuple| table.judge(objects, &tuple))
            })
            .collect();
        judged.sort_by(|a, b| a.atom.cmp(&b.atom));
        Grounding { judged, doubts: Vec::new() }
    }
}

impl Table {
    fn new(
        domain: &Domain,
        spec: &ObservedSpec,
        feature: Option<&str>,
        exemplars: &Exemplars,
    ) -> Result<Self, PerceptionError> {
        let slots = slots(domain, spec)?;
        let feature = choose_feature(spec, feature, slots.len())?;
        let predicate = spec.predicate.clone();
        let (positives, negatives) = (Vec::new(), Vec::new());
        let mut table = Self { predicate, slots, feature, positives, negatives };
        for exemplar in exemplars.examples() {
            for tuple in tuples(&domain.types, &table.slots, &exemplar.objects) {
                let Some((atom, vector)) = table.describe(&exemplar.objects, &tuple) else {
                    continue;
                };
                let holds = exemplar.init.contains(&atom);
                let evidence = Evidence { exemplar: exemplar.name.clone(), atom };
                let side = if holds { &mut table.positives } else { &mut table.negatives };
                side.push(Example { vector, evidence });
            }
        }
        Ok(table)
    }

    /// A tuple as an atom and a vector; `None` when the feature needs what an object lacks.
    fn describe(&self, objects: &[ObjectBox], tuple: &[usize]) -> Option<(Atom, Vec<f64>)> {
        let objects: Vec<&ObjectBox> = tuple.iter().map(|&i| &objects[i]).collect();
        let args = objects.iter().map(|object| object.name.clone()).collect();
        let vector = (self.feature.compute)(&objects)?;
        Some((Atom { predicate: self.predicate.clone(), args }, vector))
    }

    fn judge(&self, objects: &[ObjectBox], tuple: &[usize]) -> Option<Judged> {
        let (atom, vector) = self.describe(objects, tuple)?;
        let (d_pos, nearest_pos) = nearest(&self.positives, &vector)?;
        let (d_neg, nearest_neg) = nearest(&self.negatives, &vector)?;
        Some(Judged {
            atom,
            // A tie does not hold, as in the reference.
            truth: Truth::from(d_pos < d_neg),
            basis: Basis::Observed,
            d_pos,
            d_neg,
            nearest_pos: nearest_pos.clone(),
            nearest_neg: nearest_neg.clone(),
        })
    }
}

/// The feature for objects with volumes: the one that uses them, where there is one.
fn deep_feature(spec: &ObservedSpec) -> Option<&str> {
    spec.feature_with_volumes.as_deref().or(spec.feature.as_deref())
}

/// The feature of that name, or the usual one for so many objects.
fn choose_feature(
    spec: &ObservedSpec,
    name: Option<&str>,
    arity: usize,
) -> Result<&'static Feature, PerceptionError> {
    let feature = match name {
        Some(name) => feature_by_name(name),
        None => default_feature(arity),
    };
    feature.filter(|f| f.arity == arity).ok_or_else(|| PerceptionError::Value {
        field: format!("observed.{}.feature", spec.predicate),
        expected: format!("a feature of {arity} objects"),
        got: name.unwrap_or("none").to_owned(),
    })
}

/// The nearest example; of several equally near, the first by name, so that order is no matter.
fn nearest<'a>(examples: &'a [Example], vector: &[f64]) -> Option<(f64, &'a Evidence)> {
    let distances = examples.iter().map(|e| (distance(&e.vector, vector), &e.evidence));
    distances.min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(b.1)))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;
    use crate::geometry::PixelBox;
    use crate::grounding::Exemplar;
    use crate::pddl::{SourceText, Typed, parse_domain};

    fn domain() -> Domain {
        let text = include_str!("../../domains/blocksworld/domain.pddl");
        parse_domain(&SourceText::new("domain.pddl", text)).unwrap().value
    }

    fn on() -> Vec<ObservedSpec> {
        vec![ObservedSpec {
            predicate: "on".into(),
            feature: None,
            feature_with_volumes: None,
            candidates: None,
        }]
    }

    fn boxes(list: &[(&str, [f64; 4])]) -> Vec<ObjectBox> {
        let object = |(name, edges): &(&str, [f64; 4])| ObjectBox {
            name: (*name).into(),
            type_name: "block".into(),
            pixel_box: PixelBox::from(*edges),
            volume: None,
            mask: None,
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
        let judged = s2s.ground(&scene).judged;
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
            assert_eq!(s2s.ground(&boxes(&apart)), Grounding::default());
        }
    }

    /// One box twice: the pair and its reverse have the same feature, one holds and one does not.
    #[test]
    fn a_tie_does_not_hold() {
        let same = [("a", [10.0, 40.0, 20.0, 50.0]), ("b", [10.0, 40.0, 20.0, 50.0])];
        let s2s = S2s::new(&domain(), &on(), &exemplars(&same, &[("a", "b")])).unwrap();
        let judged = s2s.ground(&boxes(&same)).judged;
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
                .map(|(i, (x, y))| ObjectBox {
                    name: Name::new(format!("o{i}")),
                    type_name: "block".into(),
                    pixel_box: PixelBox::from([*x, *y, x + 10.0, y + 10.0]),
                    volume: None,
                    mask: None,
                })
                .collect();
            let mut shuffled = objects.clone();
            shuffled.rotate_left((seed % objects.len() as u64) as usize);
            shuffled.swap(0, (seed / 7 % objects.len() as u64) as usize);
            prop_assert_eq!(s2s.ground(&objects), s2s.ground(&shuffled));
        }
    }
}
