//! Costs in the delete relaxation: of every node, for one state.

use super::graph::{GOAL, Graph, NONE};
use super::queue::Queue;

/// Cost of a node that is not reached.
pub(super) const UNREACHED: u64 = u64::MAX;

/// How the costs of an edge's tail are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Combine {
    /// The sum, as if the parts had nothing in common.
    Sum,
    /// The largest: never more than the true cost.
    Max,
}

/// What is known of an edge while costs are computed.
#[derive(Debug, Clone, Copy)]
struct Pending {
    /// The edge's cost and, for sums, that of the reached part of its tail.
    cost: u64,
    /// Parts of the tail that are not reached.
    n_missing: u32,
}

/// The costs of all nodes for the state looked at last.
pub(super) struct Relaxation<'a> {
    pub(super) graph: &'a Graph,
    combine: Combine,
    cost: Vec<u64>,
    /// The edge that gave each node its cost; [`NONE`] for those that hold in the state.
    supporter: Vec<u32>,
    pending: Vec<Pending>,
    /// `pending` before anything is reached.
    fresh: Vec<Pending>,
    queue: Queue,
    /// The number of the relaxed plan that a node was last looked at for.
    visited: Vec<u32>,
    n_plans: u32,
    open: Vec<u32>,
}

impl<'a> Relaxation<'a> {
    /// `costs` are the actions' costs.
    pub(super) fn new(graph: &'a Graph, costs: &[u64], combine: Combine) -> Self {
        let n_missing = (0..graph.n_edges() as u32).map(|edge| graph.tails.get(edge).len() as u32);
        let fresh = graph.edge_costs(costs).into_iter().zip(n_missing);
        let fresh: Vec<Pending> =
            fresh.map(|(cost, n_missing)| Pending { cost, n_missing }).collect();
        Self {
            graph,
            combine,
            cost: vec![UNREACHED; graph.n_nodes],
            supporter: vec![NONE; graph.n_nodes],
            pending: fresh.clone(),
            fresh,
            queue: Queue::default(),
            visited: vec![0; graph.n_nodes],
            n_plans: 0,
            open: Vec::new(),
        }
    }

    /// Computes costs for a state until that of the goal is known; returns it.
    pub(super) fn explore(&mut self, state: &[u64]) -> Option<u64> {
        let Self { graph, cost: costs, supporter, pending, queue, .. } = self;
        costs.fill(UNREACHED);
        pending.copy_from_slice(&self.fresh);
        graph.each_holding(state, |node| {
            costs[node as usize] = 0;
            supporter[node as usize] = NONE;
            queue.push(0, node);
        });
        while let Some((cost, node)) = queue.pop() {
            if cost > costs[node as usize] {
                continue;
            }
            if node == GOAL {
                break;
            }
            for &edge in graph.waiting.get(node) {
                let Pending { cost: total, n_missing } = &mut pending[edge as usize];
                *n_missing -= 1;
                match self.combine {
                    Combine::Sum => *total = total.saturating_add(cost),
                    Combine::Max if *n_missing == 0 => *total = total.saturating_add(cost),
                    Combine::Max => {}
                }
                if *n_missing > 0 {
                    continue;
                }
                // One below the mark for "not reached".
                let total = (*total).min(UNREACHED - 1);
                for &head in graph.heads.get(edge) {
                    if total < costs[head as usize] {
                        costs[head as usize] = total;
                        supporter[head as usize] = edge;
                        queue.push(total, head);
                    }
                }
            }
        }
        queue.clear();
        let cost = costs[GOAL as usize];
        (cost != UNREACHED).then_some(cost)
    }

    /// The actions of a relaxed plan for the state looked at last, each once, in rising order.
    pub(super) fn relaxed_plan(&mut self, plan: &mut Vec<u32>) {
        plan.clear();
        self.n_plans += 1;
        self.open.push(GOAL);
        while let Some(node) = self.open.pop() {
            let supporter = self.supporter[node as usize];
            let visited = std::mem::replace(&mut self.visited[node as usize], self.n_plans);
            if supporter == NONE || visited == self.n_plans {
                continue;
            }
            self.open.extend(self.graph.tails.get(supporter));
            let action = self.graph.actions[supporter as usize];
            if action != NONE {
                plan.push(action);
            }
        }
        plan.sort_unstable();
        plan.dedup();
    }
}
