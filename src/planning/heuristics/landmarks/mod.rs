//! Landmarks: literals that every plan from a state makes true, and how many are left to reach.
//!
//! Supports costs (each landmark counts as one), conditional effects and axioms. Not admissible.
//!
//! Source: Richter, Westphal: The LAMA planner, 2010.

mod bits;
mod find;
mod orders;

use super::relaxed_task::{NONE, RelaxedTask};
use crate::planning::task::bit;
use find::NodeLandmarks;
use orders::Orders;

/// The landmarks of a planning call.
pub(in crate::planning) struct Landmarks {
    /// (atom, value) that every plan brings about.
    literals: Vec<(u32, bool)>,
    orders: Orders,
    /// (action, landmark that it can reach), sorted.
    achievers: Vec<(u32, u32)>,
    words: usize,
    holding: Vec<u64>,
}

impl Landmarks {
    /// The landmarks of plans from a state; none where the fixpoint would take too long or the
    /// goal is out of reach.
    pub(in crate::planning) fn new(graph: &RelaxedTask, state: &[u64]) -> Option<Self> {
        let found = NodeLandmarks::find(graph, state)?;
        let nodes = found.of_goal(graph);
        let orders = orders::orders(graph, &found, &nodes);
        let literals: Vec<(u32, bool)> =
            nodes.iter().filter_map(|&node| graph.literals[node as usize]).collect();
        let mut achievers = Vec::new();
        for (idx, &node) in (0..).zip(&nodes) {
            let edges = graph.reached_by.get(node).iter();
            let actions = edges.map(|&edge| graph.actions[edge as usize]);
            achievers.extend(actions.filter(|&a| a != NONE).map(|action| (action, idx)));
        }
        achievers.sort_unstable();
        achievers.dedup();
        let words = bits::n_words(literals.len());
        Some(Self { literals, orders, achievers, words, holding: vec![0; words] })
    }

    /// Words of a set of landmarks.
    pub(in crate::planning) fn words(&self) -> usize {
        self.words
    }

    /// The landmarks as (atom, value).
    #[cfg(test)]
    pub(in crate::planning) fn literals(&self) -> &[(u32, bool)] {
        &self.literals
    }

    /// Adds to the landmarks that a path has reached those that its last state reaches, and counts
    /// what is left: landmarks not reached, and those that are needed once more.
    ///
    /// One that holds counts as reached only if all that is to come before it was reached before.
    pub(in crate::planning) fn count(&mut self, state: &[u64], reached: &mut [u64]) -> u64 {
        self.holding.fill(0);
        for (idx, &(atom, wanted)) in self.literals.iter().enumerate() {
            if bit(state, atom) == wanted {
                bits::insert(&mut self.holding, idx);
            }
        }
        let Self { holding, orders, .. } = &*self;
        let new: Vec<u64> = holding.iter().zip(&*reached).map(|(h, r)| h & !r).collect();
        let timely =
            bits::members(&new).filter(|&i| bits::is_subset(orders.before.get(i), reached));
        let timely: Vec<usize> = timely.collect();
        for idx in timely {
            bits::insert(reached, idx);
        }
        let mut left = self.literals.len() as u64;
        for idx in bits::members(reached) {
            let lost = !bits::contains(holding, idx);
            let needed = || {
                let needing = orders.needing.get(idx).iter().zip(&*reached);
                let unreached =
                    needing.fold(0, |bits, (needing, reached)| bits | needing & !reached);
                bits::contains(&orders.goals, idx) || unreached != 0
            };
            left -= u64::from(!(lost && needed()));
        }
        left
    }

    /// Of some actions, in rising order, those that reach a landmark whose turn it is.
    pub(in crate::planning) fn preferred(
        &self,
        reached: &[u64],
        applicable: &[u32],
        preferred: &mut Vec<u32>,
    ) {
        let mut at = 0;
        for &action in applicable {
            at += self.achievers[at..].partition_point(|&(a, _)| a < action);
            let landmarks = self.achievers[at..].iter().take_while(|(a, _)| *a == action);
            let timely = |&(_, idx): &(u32, u32)| {
                !bits::contains(reached, idx as usize)
                    && bits::is_subset(self.orders.before.get(idx as usize), reached)
            };
            if landmarks.into_iter().any(timely) {
                preferred.push(action);
            }
        }
    }
}
