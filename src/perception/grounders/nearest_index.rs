//! Labelled tuples as vectors, and the search for the nearest one.

use std::sync::Arc;

use super::judged::Evidence;
use crate::perception::model::{FEATURE_LENGTH_MAX, FeatureVector};

/// One labelled tuple.
#[derive(Debug, Clone)]
pub(super) struct Example {
    pub(super) vector: FeatureVector,
    pub(super) evidence: Arc<Evidence>,
}

/// How many examples are looked at together: their numbers lie side by side, so that the processor
/// works on several at a time.
const LANES: usize = 8;

/// Squared distances that differ by less than this share may have the same root.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Labelled tuples, sorted by the number of their vectors in which they differ most: a search begins
/// where that number is the searched one's and ends where it alone is farther off than the nearest.
#[derive(Debug, Clone)]
pub(super) struct NearestIndex {
    /// Which of the vectors' numbers.
    key: usize,
    /// How many of the vectors' numbers are in use.
    length: usize,
    blocks: Vec<Block>,
    /// In its own order.
    evidence: Vec<Arc<Evidence>>,
}

/// A few examples; places that are left over are infinitely far from everything.
#[derive(Debug, Clone)]
struct Block {
    /// The least and the greatest key.
    keys: [f64; 2],
    numbers: [[f64; LANES]; FEATURE_LENGTH_MAX],
    /// Places in the list of evidence.
    ranks: [u32; LANES],
}

impl NearestIndex {
    /// `length` is how many of the vectors' numbers are in use.
    pub(super) fn new(mut examples: Vec<Example>, length: usize) -> Self {
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
        Self {
            key,
            length,
            blocks: ranked.chunks(LANES).map(|examples| Block::new(examples, key)).collect(),
            evidence: examples.into_iter().map(|e| e.evidence).collect(),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.evidence.is_empty()
    }

    /// The distance to the nearest example; of several equally near, the first by name, so that
    /// order is no matter.
    pub(super) fn nearest(&self, vector: &FeatureVector) -> Option<(f64, &Arc<Evidence>)> {
        let mut best = Best { distance: f64::INFINITY, rank: u32::MAX, bound: f64::INFINITY };
        let key = vector[self.key];
        let middle = self.blocks.partition_point(|block| block.keys[1] < key);
        let (below, above) = self.blocks.split_at(middle);
        // Whether the block, and with it all that lie beyond, is too far off to be looked at.
        let mut is_far = |apart: f64, block: &Block| {
            // A sum of squares is no less than one of them, also as floats are rounded.
            let is_far = apart * apart > best.bound;
            if !is_far {
                best.offer(&block.squared_distances(&vector[..self.length]), &block.ranks);
            }
            is_far
        };
        let _above = above.iter().find(|block| is_far((block.keys[0] - key).max(0.0), block));
        let _below = below.iter().rfind(|block| is_far(key - block.keys[1], block));
        Some((best.distance, self.evidence.get(best.rank as usize)?))
    }
}

impl Block {
    /// From at least one example and at most as many as there are lanes, sorted by their keys.
    fn new(examples: &[(FeatureVector, u32)], key: usize) -> Self {
        let mut block = Self {
            keys: [f64::INFINITY, f64::NEG_INFINITY],
            numbers: [[f64::INFINITY; LANES]; FEATURE_LENGTH_MAX],
            ranks: [u32::MAX; LANES],
        };
        for (lane, (vector, rank)) in examples.iter().enumerate() {
            let [low, high] = block.keys;
            block.keys = [low.min(vector[key]), high.max(vector[key])];
            block.ranks[lane] = *rank;
            for (numbers, number) in block.numbers.iter_mut().zip(vector) {
                numbers[lane] = *number;
            }
        }
        block
    }

    /// Squares are added in the order of the vector's numbers: the sums are the same wherever an
    /// example lies.
    fn squared_distances(&self, vector: &[f64]) -> [f64; LANES] {
        let mut sums = [0.0; LANES];
        for (numbers, number) in self.numbers.iter().zip(vector) {
            for (sum, other) in sums.iter_mut().zip(numbers) {
                *sum += (other - number) * (other - number);
            }
        }
        sums
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
    fn offer(&mut self, squared: &[f64; LANES], ranks: &[u32; LANES]) {
        for (squared, rank) in squared.iter().zip(ranks) {
            if *squared > self.bound {
                continue;
            }
            let distance = squared.sqrt();
            if distance < self.distance || (distance == self.distance && *rank < self.rank) {
                let bound = squared * (1.0 + ROUNDING);
                *self = Self { distance, rank: *rank, bound };
            }
        }
    }
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
            let pruned = NearestIndex::new(examples.clone(), FEATURE_LENGTH_MAX);
            let found = pruned.nearest(&sought).unwrap();
            prop_assert_eq!(found, (distance, evidence));
        }
    }
}
