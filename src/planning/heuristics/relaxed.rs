//! The delete relaxation as an and/or graph: what has become possible stays possible.
//!
//! Nodes are literals and parts of conditions; an edge reaches its head once all of its tail is
//! reached. Conditional effects, disjunctions, negative conditions and rules are edges like others.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use crate::planning::formula::{Formula, bit};
use crate::planning::task::Task;

/// Cost of a node that is not reached.
pub(super) const UNREACHED: u64 = u64::MAX;
/// Edge that belongs to no action.
const NO_ACTION: u32 = u32::MAX;

/// How the costs of an edge's tail are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Combine {
    /// The sum, as if the parts had nothing in common.
    Sum,
    /// The largest: never more than the true cost.
    Max,
}

/// A way to reach a node.
#[derive(Debug, Clone)]
struct Edge {
    head: u32,
    tail: Vec<u32>,
    /// The action, or [`NO_ACTION`].
    action: u32,
    cost: u64,
}

/// The graph of a task and the costs of its nodes for the state looked at last.
pub(super) struct Relaxation<'a> {
    task: &'a Task,
    combine: Combine,
    edges: Vec<Edge>,
    /// Edges that wait for node `n`, at `[n]`.
    waiting: Vec<Vec<u32>>,
    /// Edges without a tail.
    free: Vec<u32>,
    goal: u32,
    /// Cost of each node.
    pub(super) cost: Vec<u64>,
    /// The edge that gave each node its cost; `u32::MAX` for those that hold in the state.
    supporter: Vec<u32>,
    /// Per edge: parts of the tail not yet reached, and the tail's cost so far.
    pending: Vec<(u32, u64)>,
    queue: BinaryHeap<Reverse<(u64, u32)>>,
}

/// Builds the graph; parts of conditions that occur twice become one node.
struct Builder {
    edges: Vec<Edge>,
    n_nodes: u32,
    known: BTreeMap<Formula, u32>,
}

fn literal_node(atom: u32, wanted: bool) -> u32 {
    atom * 2 + u32::from(!wanted)
}

impl Builder {
    fn edge(&mut self, head: u32, tail: Vec<u32>, action: u32, cost: u64) {
        self.edges.push(Edge { head, tail, action, cost });
    }

    /// The node of a condition, or none when it holds always. A condition that never holds gets a
    /// node that no edge reaches.
    fn node(&mut self, formula: &Formula) -> Option<u32> {
        match formula {
            Formula::True => return None,
            Formula::Holds(atom) => return Some(literal_node(*atom, true)),
            Formula::Fails(atom) => return Some(literal_node(*atom, false)),
            Formula::False | Formula::And(_) | Formula::Or(_) => {}
        }
        if let Some(&node) = self.known.get(formula) {
            return Some(node);
        }
        let node = self.n_nodes;
        self.n_nodes += 1;
        self.known.insert(formula.clone(), node);
        match formula {
            Formula::And(parts) => {
                let tail = parts.iter().filter_map(|p| self.node(p)).collect();
                self.edge(node, tail, NO_ACTION, 0);
            }
            Formula::Or(parts) => {
                for part in parts {
                    let tail = self.node(part).into_iter().collect();
                    self.edge(node, tail, NO_ACTION, 0);
                }
            }
            Formula::True | Formula::False | Formula::Holds(_) | Formula::Fails(_) => {}
        }
        Some(node)
    }

    fn actions(&mut self, task: &Task, costs: &[u64]) {
        for (idx, (operator, &cost)) in (0..).zip(task.operators.iter().zip(costs)) {
            let precondition = self.node(&operator.precondition);
            for effect in &operator.effects {
                let condition = self.node(&effect.condition);
                let tail: Vec<u32> = precondition.into_iter().chain(condition).collect();
                for &(atom, added) in &effect.changes {
                    self.edge(literal_node(atom, added), tail.clone(), idx, cost);
                }
            }
        }
    }

    fn rules(&mut self, task: &Task) {
        let mut negated: BTreeMap<u32, Vec<Formula>> = BTreeMap::new();
        for (head, body) in &task.rules {
            let tail = self.node(body).into_iter().collect();
            self.edge(literal_node(*head, true), tail, NO_ACTION, 0);
            negated.entry(*head).or_default().push(body.negate());
        }
        for (head, bodies) in negated {
            // A recursive rule's negation has no such simple form; it counts as always possible.
            let recursive = task.recursive.contains(&head);
            let all = if recursive { Formula::True } else { Formula::and(bodies) };
            let tail = self.node(&all).into_iter().collect();
            self.edge(literal_node(head, false), tail, NO_ACTION, 0);
        }
    }
}

impl<'a> Relaxation<'a> {
    /// `costs` are the actions' costs.
    pub(super) fn new(task: &'a Task, costs: &[u64], combine: Combine) -> Self {
        let n_literals = task.n_atoms() as u32 * 2;
        let mut builder =
            Builder { edges: Vec::new(), n_nodes: n_literals + 1, known: BTreeMap::new() };
        builder.actions(task, costs);
        builder.rules(task);
        let goal = n_literals;
        let tail = builder.node(&task.goal).into_iter().collect();
        builder.edge(goal, tail, NO_ACTION, 0);
        let Builder { edges, n_nodes, .. } = builder;
        let n_nodes = n_nodes as usize;
        let mut waiting = vec![Vec::new(); n_nodes];
        let mut free = Vec::new();
        for (idx, edge) in (0..).zip(&edges) {
            edge.tail.iter().for_each(|&node| waiting[node as usize].push(idx));
            if edge.tail.is_empty() {
                free.push(idx);
            }
        }
        let pending = vec![(0, 0); edges.len()];
        let (cost, supporter) = (vec![UNREACHED; n_nodes], vec![u32::MAX; n_nodes]);
        let queue = BinaryHeap::new();
        Self { task, combine, edges, waiting, free, goal, cost, supporter, pending, queue }
    }

    /// Computes all costs for a state; returns that of the goal.
    pub(super) fn explore(&mut self, state: &[u64]) -> Option<u64> {
        self.cost.fill(UNREACHED);
        for (pending, edge) in self.pending.iter_mut().zip(&self.edges) {
            *pending = (edge.tail.len() as u32, 0);
        }
        for atom in 0..self.task.n_atoms() as u32 {
            self.reach(literal_node(atom, bit(state, atom)), 0, u32::MAX);
        }
        for idx in 0..self.free.len() {
            let edge = self.free[idx];
            let Edge { head, cost, .. } = self.edges[edge as usize];
            self.reach(head, cost, edge);
        }
        while let Some(Reverse((cost, node))) = self.queue.pop() {
            if cost > self.cost[node as usize] {
                continue;
            }
            if node == self.goal {
                break;
            }
            for idx in 0..self.waiting[node as usize].len() {
                self.advance(self.waiting[node as usize][idx], cost);
            }
        }
        self.queue.clear();
        let cost = self.cost[self.goal as usize];
        (cost != UNREACHED).then_some(cost)
    }

    fn reach(&mut self, node: u32, cost: u64, supporter: u32) {
        if cost < self.cost[node as usize] {
            self.cost[node as usize] = cost;
            self.supporter[node as usize] = supporter;
            self.queue.push(Reverse((cost, node)));
        }
    }

    /// One more part of the edge's tail has been reached, at the given cost.
    fn advance(&mut self, edge_idx: u32, cost: u64) {
        let (missing, tail_cost) = &mut self.pending[edge_idx as usize];
        *missing -= 1;
        *tail_cost = match self.combine {
            Combine::Sum => tail_cost.saturating_add(cost),
            Combine::Max => cost.max(*tail_cost),
        };
        if *missing == 0 {
            let edge = &self.edges[edge_idx as usize];
            // One below the mark for "not reached".
            let total = tail_cost.saturating_add(edge.cost).min(UNREACHED - 1);
            let head = edge.head;
            self.reach(head, total, edge_idx);
        }
    }

    /// The actions of a relaxed plan for the state looked at last, each once, in rising order.
    pub(super) fn relaxed_plan(&self, marks: &mut [bool], plan: &mut Vec<u32>) {
        plan.clear();
        marks.fill(false);
        let mut open = vec![self.goal];
        while let Some(node) = open.pop() {
            let supporter = self.supporter[node as usize];
            if std::mem::replace(&mut marks[node as usize], true)
                || supporter == u32::MAX
                || self.cost[node as usize] == UNREACHED
            {
                continue;
            }
            let edge = &self.edges[supporter as usize];
            open.extend(&edge.tail);
            if edge.action != NO_ACTION {
                plan.push(edge.action);
            }
        }
        plan.sort_unstable();
        plan.dedup();
    }
}
