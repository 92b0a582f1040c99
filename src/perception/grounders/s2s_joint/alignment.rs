//! What stands upright in the middle of what: how near to the middle the labelled examples have it.

use std::collections::BTreeMap;

use super::extent::Extent;
use crate::pddl::{Atom, Name};
use crate::perception::model::{Exemplar, Exemplars, ObjectBox};

/// Less than this of the way from an edge to the middle says nothing of where the middle is.
const SHARE_MIN: f64 = 0.2;

/// For each `aligned` predicate, how near to the middle the second object is in the examples at least:
/// 1 in the middle, 0 at an edge.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Alignment(BTreeMap<Name, f64>);

impl Alignment {
    /// From the facts of all examples; `deep` as for [`Extent::of`].
    pub(super) fn learn(aligned: &[Name], exemplars: &Exemplars, deep: bool) -> Self {
        let least = |predicate: &Name| {
            let shares = exemplars.examples().iter().flat_map(|e| shares(e, predicate, deep));
            (predicate.clone(), shares.fold(1.0, f64::min).max(SHARE_MIN))
        };
        Self(aligned.iter().map(least).collect())
    }

    /// Whether `second` stands in the middle of `first`: 1 where the examples have it, 0 half of the way
    /// from there to an edge, -1 at an edge and beyond. `None` for a predicate that asks for nothing.
    pub(super) fn evidence(
        &self,
        predicate: &Name,
        first: &Extent,
        second: &Extent,
    ) -> Option<f64> {
        let least = self.0.get(predicate)?;
        Some((2.0 * second.is_over(first) / least - 1.0).clamp(-1.0, 1.0))
    }
}

/// How near to the middle it is in each fact of one example.
fn shares(example: &Exemplar, predicate: &Name, deep: bool) -> Vec<f64> {
    let extent = |name: &Name| {
        let object: Option<&ObjectBox> = example.objects.iter().find(|o| o.name == *name);
        object.filter(|object| !deep || object.volume.is_some()).map(|o| Extent::of(o, deep))
    };
    let facts = example.init.iter().filter(|atom| atom.predicate == *predicate);
    let share = |atom: &Atom| match &atom.args[..] {
        [first, second] => Some(extent(second)?.is_over(&extent(first)?)),
        _ => None,
    };
    facts.filter_map(share).collect()
}
