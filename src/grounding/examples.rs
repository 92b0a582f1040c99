//! Labelled tuples as vectors, and the search for the nearest one.

use std::sync::Arc;

use super::features::{FEATURE_LENGTH_MAX, FeatureVector};
use super::judged::Evidence;

/// One labelled tuple.
#[derive(Debug, Clone)]
pub(super) struct Example {
    pub(super) vector: FeatureVector,
    pub(super) evidence: Arc<Evidence>,
}

/// Labelled tuples, sorted by the number of their vectors in which they differ most: a search begins
/// where that number is the searched one's and ends where it alone is farther off than the nearest.
#[derive(Debug, Clone)]
pub(super) struct Examples {
    /// Which of the vectors' numbers.
    key: usize,
    vectors: Vec<FeatureVector>,
    /// Of each vector its place in `evidence`.
    ranks: Vec<u32>,
    /// In its own order.
    evidence: Vec<Arc<Evidence>>,
}

/// Squared distances that differ by less than this share may have the same root, or be sums of the
/// same squares in another order.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

impl Examples {
    pub(super) fn new(mut examples: Vec<Example>) -> Self {
        examples.sort_by(|a, b| a.evidence.cmp(&b.evidence));
        let spread = |i: usize| {
            let numbers = || examples.iter().map(|e| e.vector[i]);
            numbers().fold(f64::MIN, f64::max) - numbers().fold(f64::MAX, f64::min)
        };
        let key = (0..FEATURE_LENGTH_MAX).max_by(|&a, &b| spread(a).total_cmp(&spread(b)));
        let key = key.unwrap_or(0);
        let mut ranked: Vec<(FeatureVector, u32)> =
            examples.iter().map(|e| e.vector).zip(0..).collect();
        ranked.sort_by(|a, b| a.0[key].total_cmp(&b.0[key]));
        let (vectors, ranks) = ranked.into_iter().unzip();
        Self { key, vectors, ranks, evidence: examples.into_iter().map(|e| e.evidence).collect() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// The distance to the nearest example; of several equally near, the first by name, so that
    /// order is no matter.
    pub(super) fn nearest(&self, vector: &FeatureVector) -> Option<(f64, &Arc<Evidence>)> {
        let mut best = Best { distance: f64::INFINITY, rank: u32::MAX, bound: f64::INFINITY };
        let key = vector[self.key];
        let middle = self.vectors.partition_point(|example| example[self.key] < key);
        // A sum of squares is no less than one of them, also as floats are rounded.
        let far = |example: &FeatureVector, best: &Best| {
            let apart = example[self.key] - key;
            apart * apart > best.bound
        };
        for i in middle..self.vectors.len() {
            if far(&self.vectors[i], &best) {
                break;
            }
            best.offer(&self.vectors[i], vector, self.ranks[i]);
        }
        for i in (0..middle).rev() {
            if far(&self.vectors[i], &best) {
                break;
            }
            best.offer(&self.vectors[i], vector, self.ranks[i]);
        }
        Some((best.distance, self.evidence.get(best.rank as usize)?))
    }
}

/// The nearest example so far.
struct Best {
    distance: f64,
    rank: u32,
    /// Squared distances above this are farther.
    bound: f64,
}

impl Best {
    fn offer(&mut self, example: &FeatureVector, vector: &FeatureVector, rank: u32) {
        let squares = squared_differences(example, vector);
        let [a, b, c, d, e, f, g, h] = squares;
        // Added in this order, most of the work is done two or four numbers at a time.
        if ((a + e) + (c + g)) + ((b + f) + (d + h)) > self.bound {
            return;
        }
        // Added one after the other, as everywhere else, the sum is exactly the same everywhere.
        let squared: f64 = squares.into_iter().sum();
        let distance = squared.sqrt();
        if distance < self.distance || (distance == self.distance && rank < self.rank) {
            *self = Self { distance, rank, bound: squared * (1.0 + ROUNDING) };
        }
    }
}

fn squared_differences(a: &FeatureVector, b: &FeatureVector) -> FeatureVector {
    std::array::from_fn(|i| (a[i] - b[i]) * (a[i] - b[i]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::pddl::Atom;

    proptest! {
        /// The search agrees with looking at every example, ties included.
        #[test]
        fn the_nearest_is_the_nearest_of_all(
            numbers in proptest::collection::vec([-9..9_i8, -3..3, -3..3], 1..40),
            sought in [-9..9_i8, -3..3, -3..3],
            scale in prop_oneof![Just(1.0), Just(0.1), Just(1e-160), Just(1e160)],
        ) {
            let vector = |n: [i8; 3]| {
                let mut vector = FeatureVector::default();
                vector[2..5].copy_from_slice(&n.map(|n| f64::from(n) * scale));
                vector
            };
            let example = |(i, n): (usize, &[i8; 3])| {
                let atom = Atom::new("p", &[&format!("{}", (7 * i + 3) % 41)]);
                let evidence = Arc::new(Evidence { exemplar: "e".to_owned(), atom });
                Example { vector: vector(*n), evidence }
            };
            let examples: Vec<Example> = numbers.iter().enumerate().map(example).collect();
            let sought = vector(sought);
            let distance = |e: &Example| -> f64 {
                let squares = e.vector.iter().zip(&sought).map(|(a, b)| (a - b) * (a - b));
                squares.sum::<f64>().sqrt()
            };
            let plain = examples.iter().map(|e| (distance(e), &e.evidence));
            let (distance, evidence) =
                plain.min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(b.1))).unwrap();
            let pruned = Examples::new(examples.clone());
            let found = pruned.nearest(&sought).unwrap();
            prop_assert_eq!(found, (distance, evidence));
        }
    }
}
