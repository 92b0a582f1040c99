//! What rests on what: an object lies on the one directly beneath it, and nothing hangs in the air.

use std::collections::BTreeMap;

use super::assignment::{Assignment, BAND};
use super::branch_and_bound::{Choice, Row, choose};
use super::exemplar_evidence::holds;
use super::extent::Extent;
use crate::logic::Truth;
use crate::pddl::Name;
use crate::perception::model::constraints::{Constraints, Support};
use crate::perception::model::{Exemplars, ObjectBox};

/// How much of its own height an object must be over the ground to count as hanging: an unseen object
/// of its kind beneath it would lift it by about its height, and the ground's place is only known from
/// where the labelled boxes happen to end.
const LIFTED_MIN: f64 = 0.75;

/// What the labelled examples show of a support predicate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SupportModel {
    /// By which share of their width the boxes of touching objects overlap.
    sunk: f64,
    /// The greatest height at which an object stood on the ground.
    ground: Option<f64>,
}

impl SupportModel {
    /// From the examples; `None` if none shows an object on another. `is_part` says which objects
    /// the predicate may hold of.
    pub(super) fn learn(
        predicate: &Name,
        exemplars: &Exemplars,
        deep: bool,
        is_part: impl Fn(&ObjectBox) -> bool,
    ) -> Option<Self> {
        let (mut sunk, mut ground) = (Vec::new(), None);
        for example in exemplars.examples() {
            let parts: Vec<&ObjectBox> = example.objects.iter().filter(|o| is_part(o)).collect();
            for upper in &parts {
                let own = Extent::of(upper, deep);
                let below = parts
                    .iter()
                    .filter(|lower| holds(example, predicate, [&upper.name, &lower.name]));
                let depths: Vec<f64> =
                    below.map(|lower| own.sunk(&Extent::of(lower, deep))).collect();
                if depths.is_empty() {
                    ground = Some(ground.map_or(own.bottom(), |g: f64| g.max(own.bottom())));
                }
                sunk.extend(depths);
            }
        }
        sunk.sort_by(f64::total_cmp);
        let middle = *sunk.get(sunk.len() / 2)?;
        Some(Self { sunk: middle, ground })
    }
}

/// One support predicate of one scene.
struct SupportSolver<'a> {
    support: &'a Support,
    model: SupportModel,
    /// The objects that may rest on each other, the highest first.
    parts: Vec<usize>,
    /// Where each stands, if that is known.
    places: Vec<Option<usize>>,
    /// The next object below in the same stack.
    next: BTreeMap<usize, usize>,
}

/// A pair that may hold, with the evidence for it.
struct Pair {
    upper: usize,
    lower: usize,
    place: usize,
    weight: f64,
}

/// Decides a support predicate between `parts`, the objects that it may hold of.
pub(super) fn decide(
    assignment: &mut Assignment,
    parts: Vec<usize>,
    (support, model): (&Support, SupportModel),
    constraints: &Constraints,
) {
    let solver = SupportSolver::new(assignment, parts, support, model);
    let pairs = solver.pairs(assignment);
    for &(_, place) in &assignment.tuples(&support.predicate).to_vec() {
        assignment.decide(place, Truth::False);
    }
    let below = solver.choose(assignment, &pairs, constraints);
    solver.find_gaps(assignment, &pairs, &below);
    solver.find_hanging(assignment, &below);
}

impl<'a> SupportSolver<'a> {
    fn new(
        assignment: &Assignment,
        mut parts: Vec<usize>,
        support: &'a Support,
        model: SupportModel,
    ) -> Self {
        parts.sort_by(|&a, &b| {
            assignment.extents[b].level().total_cmp(&assignment.extents[a].level()).then(a.cmp(&b))
        });
        let mut places = vec![None; assignment.names.len()];
        for (args, place) in support.stack_at.iter().flat_map(|name| assignment.tuples(name)) {
            if assignment.judged[*place].truth == Truth::True {
                places[args[0]] = Some(args[1]);
            }
        }
        let mut next = BTreeMap::new();
        let mut last: BTreeMap<usize, usize> = BTreeMap::new();
        for &part in &parts {
            if let Some(place) = places[part]
                && let Some(above) = last.insert(place, part)
            {
                next.insert(above, part);
            }
        }
        Self { support, model, parts, places, next }
    }

    /// Every pair that the heights and stacks allow. In a stack, touching speaks for a pair; anywhere
    /// else a gap only speaks against it, since what is behind may look as if it were on top.
    fn pairs(&self, assignment: &Assignment) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for (at, &upper) in self.parts.iter().enumerate() {
            for &lower in &self.parts[at + 1..] {
                let (Some(place), Some(fit)) = (
                    assignment.place(&self.support.predicate, upper, lower),
                    self.fit(upper, lower),
                ) else {
                    continue;
                };
                let (above, below) = (&assignment.extents[upper], &assignment.extents[lower]);
                let geometry = above.touches(below, self.model.sunk).min(above.is_over(below));
                pairs.push(Pair {
                    upper,
                    lower,
                    place,
                    weight: assignment.weights[place] + geometry.min(fit),
                });
            }
        }
        pairs
    }

    /// The most that the geometry of a pair may add; `None` where the stacks exclude the pair.
    fn fit(&self, upper: usize, lower: usize) -> Option<f64> {
        match (self.places[upper], self.places[lower]) {
            (Some(_), Some(_)) => (self.next.get(&upper) == Some(&lower)).then_some(1.0),
            (Some(_) | None, None) | (None, Some(_)) => Some(0.0),
        }
    }

    /// Accepts pairs; returns what each object rests on.
    fn choose(
        &self,
        assignment: &mut Assignment,
        pairs: &[Pair],
        constraints: &Constraints,
    ) -> Vec<Option<usize>> {
        let n = assignment.names.len();
        let is_listed = |list: &[Name]| list.contains(&self.support.predicate);
        let functional = is_listed(&constraints.functional);
        let inverse = is_listed(&constraints.inverse_functional);
        let mut rows: Vec<Row> = Vec::new();
        let mut origins: Vec<Vec<usize>> = Vec::new();
        let mut last_upper = None;
        for (idx, pair) in pairs.iter().enumerate() {
            if !functional || last_upper.replace(pair.upper) != Some(pair.upper) {
                rows.push(Row::default());
                origins.push(Vec::new());
            }
            let columns = if inverse { vec![pair.lower] } else { Vec::new() };
            let (Some(row), Some(origin)) = (rows.last_mut(), origins.last_mut()) else { continue };
            row.choices.push(Choice { weight: pair.weight, columns });
            origin.push(idx);
        }
        let mut below = vec![None; n];
        for (chosen, origin) in choose(&rows, n).into_iter().zip(&origins) {
            let Some(choice) = chosen else { continue };
            let pair = &pairs[origin[choice]];
            below[pair.upper] = Some(pair.lower);
            let clear = pair.weight >= BAND;
            assignment.decide(pair.place, if clear { Truth::True } else { Truth::Unknown });
        }
        below
    }

    /// Neighbours in a stack that do not touch: something unseen is between them.
    fn find_gaps(&self, assignment: &mut Assignment, pairs: &[Pair], below: &[Option<usize>]) {
        for pair in pairs {
            let free = below[pair.upper].is_none() && !below.contains(&Some(pair.lower));
            if self.next.get(&pair.upper) == Some(&pair.lower) && free {
                assignment.decide(pair.place, Truth::Unknown);
                assignment.anomaly("a gap between", &[pair.upper, pair.lower]);
            } else if free && pair.weight > -BAND {
                assignment.decide(pair.place, Truth::Unknown);
            }
        }
    }

    /// Objects over the ground that rest on nothing seen.
    fn find_hanging(&self, assignment: &mut Assignment, below: &[Option<usize>]) {
        let Some(ground) = self.model.ground else { return };
        for &part in &self.parts {
            let extent = assignment.extents[part];
            let lifted = extent.bottom() - ground > LIFTED_MIN * extent.height();
            if below[part].is_some() || self.next.contains_key(&part) || !lifted {
                continue;
            }
            let beneath = |&&other: &&usize| {
                let other_extent = &assignment.extents[other];
                other_extent.level() < extent.level() && extent.is_over(other_extent) > 0.0
            };
            // `parts` goes downwards: the first is the nearest.
            let nearest = self.parts.iter().find(beneath).copied();
            let free = nearest.filter(|&other| !below.contains(&Some(other)));
            if let Some(place) =
                free.and_then(|other| assignment.place(&self.support.predicate, part, other))
            {
                assignment.decide(place, Truth::Unknown);
            }
            assignment.anomaly("nothing under", &[part]);
        }
    }
}
