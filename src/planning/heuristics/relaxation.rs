//! Costs in the delete relaxation: of every node, for one state.
//!
//! They are 32 bits wide, for speed, and saturate: never more than they should be. Dear actions are
//! counted in larger units, rounded down, or up where nothing is to be free that is not.

use super::coarse_unit;
use super::queue::Queue;
use super::relaxed_task::{GOAL, NONE, RelaxedTask};

/// Cost of a node that is not reached.
const UNREACHED: u32 = u32::MAX;

/// Largest cost of a node that is reached.
const COST_MAX: u32 = UNREACHED - 1;

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
    /// Cost of the reached part of its tail.
    cost: u32,
    /// Parts of the tail that are not reached.
    n_missing: u32,
}

/// The costs of all nodes for the state looked at last.
pub(super) struct Relaxation<'a> {
    pub(super) graph: &'a RelaxedTask,
    combine: Combine,
    edge_costs: Vec<u32>,
    /// How many units of the actions' costs make 1 of these.
    pub(super) unit: u64,
    cost: Vec<u32>,
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
    pub(super) fn new(graph: &'a RelaxedTask, costs: &[u64], combine: Combine) -> Self {
        let tails = (0..graph.n_edges() as u32).map(|edge| graph.tails.get(edge));
        let fresh: Vec<Pending> =
            tails.map(|tail| Pending { cost: 0, n_missing: tail.len() as u32 }).collect();
        let unit = coarse_unit(costs);
        let coarse = |cost: u64| match combine {
            Combine::Sum => cost.div_ceil(unit),
            Combine::Max => cost / unit,
        };
        let edge_costs = graph.edge_costs(costs).into_iter();
        Self {
            graph,
            combine,
            edge_costs: edge_costs.map(|cost| coarse(cost) as u32).collect(),
            unit,
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
        match self.combine {
            Combine::Sum => self.explore_by(state, u32::saturating_add),
            // The part reached last is the dearest.
            Combine::Max => self.explore_by(state, |_, last| last),
        }
    }

    fn explore_by(&mut self, state: &[u64], combine: impl Fn(u32, u32) -> u32) -> Option<u64> {
        let Self { graph, queue, .. } = self;
        let edge_costs = self.edge_costs.as_slice();
        let costs = self.cost.as_mut_slice();
        let supporter = self.supporter.as_mut_slice();
        let pending = self.pending.as_mut_slice();
        costs.fill(UNREACHED);
        pending.copy_from_slice(&self.fresh);
        graph.each_holding(state, |node| {
            costs[node as usize] = 0;
            supporter[node as usize] = NONE;
            queue.push(0, node);
        });
        // One edge alone reaches the goal; nothing later can make it cheaper.
        let last = graph.reached_by.get(GOAL)[0];
        'nodes: while let Some((cost, node)) = queue.pop() {
            if cost > costs[node as usize] {
                continue;
            }
            for &edge in graph.waiting.get(node) {
                let Pending { cost: total, n_missing } = &mut pending[edge as usize];
                *n_missing -= 1;
                *total = combine(*total, cost);
                if *n_missing > 0 {
                    continue;
                }
                let total = total.saturating_add(edge_costs[edge as usize]).min(COST_MAX);
                lower(graph.heads.get(edge), (edge, total), costs, supporter, queue);
                if edge == last {
                    break 'nodes;
                }
            }
        }
        queue.clear();
        let cost = costs[GOAL as usize];
        (cost != UNREACHED).then_some(u64::from(cost))
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

/// Edge `edge` reaches its heads at this cost.
#[inline]
fn lower(
    heads: &[u32],
    (edge, total): (u32, u32),
    costs: &mut [u32],
    supporter: &mut [u32],
    queue: &mut Queue,
) {
    for &head in heads {
        let known = &mut costs[head as usize];
        if total < *known {
            *known = total;
            supporter[head as usize] = edge;
            queue.push(total, head);
        }
    }
}
