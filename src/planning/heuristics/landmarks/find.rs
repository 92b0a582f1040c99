//! Which literals every plan makes true: landmarks of the delete relaxation, by a fixpoint.
//!
//! Source: Keyder, Richter, Helmert: Sound and complete landmarks for and/or graphs, 2010.

use std::collections::VecDeque;

use super::bits::{self, Rows};
use crate::planning::heuristics::relaxed_task::{GOAL, RelaxedTask, TRUE};

/// Most words that the fixpoint may touch; tasks that need more are searched without landmarks.
const WORDS_MAX: u64 = 50_000_000;

/// For every node of the graph, the nodes that each way to reach it from a state goes through.
pub(super) struct NodeLandmarks {
    rows: Rows,
    reached: Vec<bool>,
}

impl NodeLandmarks {
    /// Those of a state; none when the goal is out of reach or too much would have to be looked at.
    pub(super) fn find(graph: &RelaxedTask, state: &[u64]) -> Option<Self> {
        let n = graph.n_nodes;
        let words = bits::n_words(n) as u64;
        if words * n as u64 > WORDS_MAX {
            return None;
        }
        let mut found = Self { rows: Rows::new(n, n), reached: vec![false; n] };
        let mut n_missing: Vec<u32> =
            (0..graph.n_edges() as u32).map(|edge| graph.tails.get(edge).len() as u32).collect();
        let mut queue = VecDeque::new();
        let mut queued = vec![false; graph.n_edges()];
        // A node that is reached for the first time may complete tails; later only sets shrink.
        let mut announce =
            |node: u32, first: bool, queue: &mut VecDeque<u32>, queued: &mut [bool]| {
                for &edge in graph.waiting.get(node) {
                    n_missing[edge as usize] -= u32::from(first);
                    if n_missing[edge as usize] == 0
                        && !std::mem::replace(&mut queued[edge as usize], true)
                    {
                        queue.push_back(edge);
                    }
                }
            };
        graph.each_holding(state, |node| {
            bits::insert(found.rows.get_mut(node as usize), node as usize);
            found.reached[node as usize] = true;
        });
        graph.each_holding(state, |node| announce(node, true, &mut queue, &mut queued));
        let mut on_the_way = vec![0_u64; words as usize];
        let mut n_touched = 0;
        while let Some(edge) = queue.pop_front() {
            queued[edge as usize] = false;
            let (tail, heads) = (graph.tails.get(edge), graph.heads.get(edge));
            n_touched += words * (tail.len() + heads.len()) as u64;
            if n_touched > WORDS_MAX {
                return None;
            }
            found.union(tail, &mut on_the_way);
            for &head in heads {
                if let Some(first) = found.narrow(head, &on_the_way) {
                    announce(head, first, &mut queue, &mut queued);
                }
            }
        }
        found.reached[GOAL as usize].then_some(found)
    }

    /// What must be reached on the way to all of these nodes.
    pub(super) fn union(&self, nodes: &[u32], out: &mut [u64]) {
        out.fill(0);
        for &node in nodes {
            let row = self.rows.get(node as usize);
            out.iter_mut().zip(row).for_each(|(out, bits)| *out |= bits);
        }
    }

    /// Learns of one more way to a node; says whether that changed anything, and if so whether it
    /// is the first way.
    fn narrow(&mut self, node: u32, way: &[u64]) -> Option<bool> {
        let row = self.rows.get_mut(node as usize);
        if !std::mem::replace(&mut self.reached[node as usize], true) {
            row.copy_from_slice(way);
            bits::insert(row, node as usize);
            return Some(true);
        }
        let mut changed = false;
        for (word, (bits, way)) in row.iter_mut().zip(way).enumerate() {
            let own = if word == node as usize / 64 { 1 << (node % 64) } else { 0 };
            let kept = *bits & (way | own);
            changed |= kept != *bits;
            *bits = kept;
        }
        changed.then_some(false)
    }

    /// Whether a node can be reached at all.
    pub(super) fn is_reached(&self, node: u32) -> bool {
        self.reached[node as usize]
    }

    /// The literals that every plan makes true, as nodes in rising order.
    pub(super) fn of_goal(&self, graph: &RelaxedTask) -> Vec<u32> {
        let nodes = bits::members(self.rows.get(GOAL as usize)).map(|node| node as u32);
        nodes.filter(|&n| n != TRUE && graph.literals[n as usize].is_some()).collect()
    }

    /// What comes before a node, itself included.
    pub(super) fn of(&self, node: u32) -> &[u64] {
        self.rows.get(node as usize)
    }
}
