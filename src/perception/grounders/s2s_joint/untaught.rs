//! Predicates that no example shows to hold: where objects touch as in no example, they are unknown.
//!
//! An example without a block on another teaches nothing of `on`. Blocks that stand apart from each
//! other look like its own, and are not on each other; blocks that touch look like nothing that it
//! shows, and nothing may be said of them.

use std::sync::Arc;

use crate::logic::Truth;
use crate::pddl::{Atom, Name, Types};
use crate::perception::grounders::candidates::{CandidateSlots, for_tuples};
use crate::perception::grounders::{Basis, Evidence, Judged};
use crate::perception::model::{Exemplars, ObjectBox};

/// Boxes touch when they are nearer than this share of the smaller one's shorter side.
const TOUCH_MAX: f64 = 0.1;

/// A predicate of two objects that no example shows.
#[derive(Debug, Clone)]
pub(super) struct Untaught {
    predicate: Name,
    slots: CandidateSlots,
    /// A tuple of an example that does not hold.
    negative: Arc<Evidence>,
}

impl Untaught {
    /// The predicate, where two objects of its types are in some example, none of them touch, and
    /// it holds of none.
    pub(super) fn learn(
        predicate: &Name,
        slots: &CandidateSlots,
        types: &Types,
        exemplars: &Exemplars,
    ) -> Option<Self> {
        let mut negative = None;
        let mut is_taught = false;
        for exemplar in exemplars.examples() {
            let order: Vec<usize> = (0..exemplar.objects.len()).collect();
            for_tuples(types, slots, &exemplar.objects, &order, |tuple| {
                let [first, second] = *tuple else { return };
                let pair = [first, second].map(|i| &exemplar.objects[i]);
                let atom = atom(predicate, pair);
                is_taught |= touch(pair) || exemplar.init.contains(&atom);
                negative.get_or_insert(Evidence { exemplar: exemplar.name.clone(), atom });
            });
        }
        let negative = Arc::new(negative.filter(|_| !is_taught)?);
        Some(Self { predicate: predicate.clone(), slots: slots.clone(), negative })
    }

    /// Its name.
    pub(super) fn predicate(&self) -> &Name {
        &self.predicate
    }

    /// The pairs that touch: unknown.
    pub(super) fn judge(&self, types: &Types, objects: &[ObjectBox]) -> Vec<Judged> {
        let order: Vec<usize> = (0..objects.len()).collect();
        let mut judged = Vec::new();
        for_tuples(types, &self.slots, objects, &order, |tuple| {
            let [first, second] = *tuple else { return };
            let pair = [first, second].map(|i| &objects[i]);
            if touch(pair) {
                judged.push(Judged {
                    atom: atom(&self.predicate, pair),
                    truth: Truth::Unknown,
                    basis: Basis::Observed,
                    d_pos: f64::MAX,
                    d_neg: f64::MAX,
                    nearest_pos: Arc::clone(&self.negative),
                    nearest_neg: Arc::clone(&self.negative),
                });
            }
        });
        judged
    }
}

fn atom(predicate: &Name, pair: [&ObjectBox; 2]) -> Atom {
    Atom { predicate: predicate.clone(), args: pair.map(|object| object.name.clone()).into() }
}

fn touch([a, b]: [&ObjectBox; 2]) -> bool {
    let sides = [a, b].map(|o| o.pixel_box.width().min(o.pixel_box.height()));
    a.pixel_box.gap(&b.pixel_box) < TOUCH_MAX * sides[0].min(sides[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PixelBox;
    use crate::perception::model::Exemplar;

    fn block(name: &str, edges: [f64; 4]) -> ObjectBox {
        ObjectBox::new(name.into(), "block".into(), PixelBox::from(edges))
    }

    fn untaught(objects: Vec<ObjectBox>, init: &[Atom]) -> Option<Untaught> {
        let init = init.iter().cloned().collect();
        let example =
            Exemplar { name: "example".to_owned(), image_size: [100, 100], objects, init };
        let exemplars = Exemplars::new(vec![example]).unwrap();
        let slots = vec![vec!["block".into()], vec!["block".into()]];
        Untaught::learn(&"on".into(), &slots, &Types::default(), &exemplars)
    }

    #[test]
    fn what_touches_as_in_no_example_is_unknown_and_what_stands_apart_is_not_told() {
        let apart = vec![block("a", [0.0, 0.0, 10.0, 10.0]), block("b", [20.0, 0.0, 30.0, 10.0])];
        let model = untaught(apart, &[]).unwrap();
        let stack = [
            block("x", [0.0, 0.0, 10.0, 10.0]),
            block("y", [0.0, 10.5, 10.0, 20.5]),
            block("z", [40.0, 0.0, 50.0, 10.0]),
        ];
        let judged = model.judge(&Types::default(), &stack);
        let atoms: Vec<String> = judged.iter().map(|j| j.atom.to_string()).collect();
        assert_eq!(atoms, ["(on x y)", "(on y x)"]);
        assert!(judged.iter().all(|j| j.truth == Truth::Unknown && j.confidence() == 0.0));
    }

    #[test]
    fn an_example_that_shows_it_or_shows_what_only_touches_teaches() {
        let stack =
            || vec![block("a", [0.0, 0.0, 10.0, 10.0]), block("b", [0.0, 10.0, 10.0, 20.0])];
        assert!(untaught(stack(), &[Atom::new("on", &["a", "b"])]).is_none());
        assert!(untaught(stack(), &[]).is_none());
        assert!(untaught(vec![block("a", [0.0, 0.0, 10.0, 10.0])], &[]).is_none());
    }
}
