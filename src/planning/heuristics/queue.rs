//! A queue of nodes by cost, for searches whose costs do not fall.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Costs below this have a bucket each; the rest goes to a heap.
const BUCKETS_MAX: u32 = 4096;

/// Cheapest first; among equals, last in, first out for small costs.
#[derive(Debug, Clone, Default)]
pub(super) struct Queue {
    buckets: Vec<Vec<u32>>,
    /// No bucket before this one has an entry.
    first: usize,
    n_in_buckets: usize,
    far: BinaryHeap<Reverse<(u32, u32)>>,
}

impl Queue {
    /// Adds a node; `cost` must not be below that of the last one taken out.
    pub(super) fn push(&mut self, cost: u32, node: u32) {
        if cost < BUCKETS_MAX {
            let cost = cost as usize;
            if cost >= self.buckets.len() {
                self.buckets.resize_with(cost + 1, Vec::new);
            }
            self.buckets[cost].push(node);
            self.n_in_buckets += 1;
            self.first = self.first.min(cost);
        } else {
            self.far.push(Reverse((cost, node)));
        }
    }

    /// The cheapest node with its cost.
    pub(super) fn pop(&mut self) -> Option<(u32, u32)> {
        if self.n_in_buckets == 0 {
            return self.far.pop().map(|Reverse(entry)| entry);
        }
        loop {
            if let Some(node) = self.buckets[self.first].pop() {
                self.n_in_buckets -= 1;
                return Some((self.first as u32, node));
            }
            self.first += 1;
        }
    }

    /// Takes everything out.
    pub(super) fn clear(&mut self) {
        if self.n_in_buckets > 0 {
            self.buckets[self.first..].iter_mut().for_each(Vec::clear);
        }
        self.n_in_buckets = 0;
        self.first = 0;
        self.far.clear();
    }
}
