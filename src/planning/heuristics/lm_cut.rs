//! Sums of disjunctive action landmarks, found as cuts in the delete relaxation (LM-cut).
//!
//! Supports costs, conditional effects and axioms: every edge of an action shares its cost, so an
//! action pays for at most what it costs, whichever of its effects are used. Admissible, safe; not
//! consistent.
//!
//! Source: Helmert, Domshlak: Landmarks, critical paths and abstractions: what's the difference
//! anyway?, 2009; Röger, Pommerening, Helmert: Optimal planning in the presence of conditional
//! effects, 2014.

use super::queue::Queue;
use super::relaxed_task::{GOAL, NONE, RelaxedTask};
use super::{Heuristic, coarse_unit};

const UNREACHED: u32 = u32::MAX;
/// Largest cost of a node that is reached.
const COST_MAX: u32 = UNREACHED - 1;

/// Where a node stands when a cut is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Zone {
    Unknown,
    /// Reached from the state without entering the goal zone.
    Before,
    /// Leads to the goal at no cost.
    Goal,
}

/// The LM-cut heuristic.
pub(in crate::planning) struct LmCut<'a> {
    graph: &'a RelaxedTask,
    /// The edges of each action: where they begin in `edges`, and the list.
    edges_of: Vec<(u32, u32)>,
    edges: Vec<u32>,
    /// How many units of the actions' costs make 1 here.
    unit: u64,
    /// Cuts of the last estimate.
    n_cuts: u64,
    /// What actions cost, rounded down, and what is left of it.
    action_costs: Vec<u32>,
    left: Vec<u32>,
    /// Max cost of each node.
    cost: Vec<u32>,
    /// For each edge: parts of the tail not reached, its dearest part.
    n_missing: Vec<u32>,
    dearest: Vec<u32>,
    zone: Vec<Zone>,
    queue: Queue,
    open: Vec<u32>,
    cut: Vec<u32>,
}

impl<'a> LmCut<'a> {
    /// `costs` are the actions' costs.
    pub(in crate::planning) fn new(graph: &'a RelaxedTask, costs: &[u64]) -> Self {
        let mut by_action: Vec<(u32, u32)> =
            (0..).zip(&graph.actions).map(|(e, &a)| (a, e)).collect();
        by_action.retain(|(action, _)| *action != NONE);
        by_action.sort_unstable();
        let mut edges_of = vec![(0, 0); costs.len()];
        for (at, &(action, _)) in (0..).zip(&by_action) {
            let range = &mut edges_of[action as usize];
            if range.1 == 0 {
                range.0 = at;
            }
            range.1 = at + 1;
        }
        let unit = coarse_unit(costs);
        let action_costs: Vec<u32> = costs.iter().map(|cost| (cost / unit) as u32).collect();
        Self {
            graph,
            edges_of,
            edges: by_action.into_iter().map(|(_, edge)| edge).collect(),
            unit,
            n_cuts: 0,
            left: action_costs.clone(),
            action_costs,
            cost: vec![UNREACHED; graph.n_nodes],
            n_missing: vec![0; graph.n_edges()],
            dearest: vec![NONE; graph.n_edges()],
            zone: vec![Zone::Unknown; graph.n_nodes],
            queue: Queue::default(),
            open: Vec::new(),
            cut: Vec::new(),
        }
    }

    fn edge_cost(&self, edge: u32) -> u32 {
        let action = self.graph.actions[edge as usize];
        if action == NONE { 0 } else { self.left[action as usize] }
    }

    /// Max costs of all nodes, with the dearest part of each edge's tail.
    fn explore(&mut self, state: &[u64]) {
        let graph = self.graph;
        self.cost.fill(UNREACHED);
        for (edge, n_missing) in (0..).zip(&mut self.n_missing) {
            *n_missing = graph.tails.get(edge).len() as u32;
        }
        let (cost, queue) = (&mut self.cost, &mut self.queue);
        graph.each_holding(state, |node| {
            cost[node as usize] = 0;
            queue.push(0, node);
        });
        while let Some((cost, node)) = self.queue.pop() {
            if cost > self.cost[node as usize] {
                continue;
            }
            for &edge in graph.waiting.get(node) {
                self.n_missing[edge as usize] -= 1;
                if self.n_missing[edge as usize] == 0 {
                    self.dearest[edge as usize] = node;
                    self.reach(edge, cost);
                }
            }
        }
    }

    /// An edge's tail costs this much.
    fn reach(&mut self, edge: u32, tail_cost: u32) {
        let total = tail_cost.saturating_add(self.edge_cost(edge)).min(COST_MAX);
        for &head in self.graph.heads.get(edge) {
            let known = &mut self.cost[head as usize];
            if total < *known {
                *known = total;
                self.queue.push(total, head);
            }
        }
    }

    /// Updates costs and dearest parts after the edges of `cut` have become cheaper.
    fn explore_again(&mut self) {
        let graph = self.graph;
        let mut changed = std::mem::take(&mut self.open);
        changed.clear();
        for &action in &self.cut {
            let (from, to) = self.edges_of[action as usize];
            changed.extend_from_slice(&self.edges[from as usize..to as usize]);
        }
        changed.retain(|&edge| self.n_missing[edge as usize] == 0);
        for &edge in &changed {
            // Heads are queued from the cheapest cost there is, in any order.
            let tail_cost = self.cost[self.dearest[edge as usize] as usize];
            self.reach(edge, tail_cost);
        }
        self.open = changed;
        while let Some((cost, node)) = self.queue.pop() {
            if cost > self.cost[node as usize] {
                continue;
            }
            for &edge in graph.waiting.get(node) {
                if self.n_missing[edge as usize] > 0 || self.dearest[edge as usize] != node {
                    continue;
                }
                let tail = graph.tails.get(edge);
                let dearest = tail.iter().copied().max_by_key(|&part| self.cost[part as usize]);
                let dearest = dearest.unwrap_or(node);
                self.dearest[edge as usize] = dearest;
                self.reach(edge, self.cost[dearest as usize]);
            }
        }
    }

    /// Marks the nodes from which the goal is reached at no cost.
    fn mark_goal_zone(&mut self) {
        self.zone.fill(Zone::Unknown);
        self.zone[GOAL as usize] = Zone::Goal;
        self.open.clear();
        self.open.push(GOAL);
        while let Some(node) = self.open.pop() {
            for &edge in self.graph.reached_by.get(node) {
                if self.n_missing[edge as usize] > 0 || self.edge_cost(edge) > 0 {
                    continue;
                }
                let part = self.dearest[edge as usize];
                if self.zone[part as usize] == Zone::Unknown {
                    self.zone[part as usize] = Zone::Goal;
                    self.open.push(part);
                }
            }
        }
    }

    /// The actions of the cut in front of the goal zone: every plan has one of them.
    fn find_cut(&mut self, state: &[u64]) {
        let graph = self.graph;
        self.cut.clear();
        let (zone, open) = (&mut self.zone, &mut self.open);
        graph.each_holding(state, |node| {
            if zone[node as usize] == Zone::Unknown {
                zone[node as usize] = Zone::Before;
                open.push(node);
            }
        });
        while let Some(node) = self.open.pop() {
            for &edge in graph.waiting.get(node) {
                if self.n_missing[edge as usize] > 0 || self.dearest[edge as usize] != node {
                    continue;
                }
                let heads = graph.heads.get(edge);
                if heads.iter().any(|&head| self.zone[head as usize] == Zone::Goal) {
                    self.cut.push(graph.actions[edge as usize]);
                    continue;
                }
                let (zone, open) = (&mut self.zone, &mut self.open);
                let new = |head: &u32| zone[*head as usize] == Zone::Unknown;
                let old_len = open.len();
                open.extend(heads.iter().copied().filter(new));
                open[old_len..].iter().for_each(|&head| zone[head as usize] = Zone::Before);
            }
        }
        self.cut.sort_unstable();
        self.cut.dedup();
    }
}

impl Heuristic for LmCut<'_> {
    fn estimate(&mut self, state: &[u64]) -> Option<u64> {
        self.left.copy_from_slice(&self.action_costs);
        self.explore(state);
        if self.cost[GOAL as usize] == UNREACHED {
            return None;
        }
        // With conditional effects the cuts can sum to less than the first max cost.
        let max = u64::from(self.cost[GOAL as usize]);
        let mut sum = 0;
        self.n_cuts = 1;
        while self.cost[GOAL as usize] > 0 {
            self.mark_goal_zone();
            self.find_cut(state);
            let cheapest = self.cut.iter().map(|&action| self.left[action as usize]).min();
            // A cut is never empty, and never free, while the goal costs something.
            let Some(cheapest) = cheapest.filter(|&cost| cost > 0) else {
                break;
            };
            sum += u64::from(cheapest);
            self.n_cuts += 1;
            for &action in &self.cut {
                self.left[action as usize] -= cheapest;
            }
            self.explore_again();
        }
        Some(sum.max(max).saturating_mul(self.unit))
    }

    fn work(&self) -> u64 {
        self.n_cuts * self.graph.n_edges() as u64
    }
}
