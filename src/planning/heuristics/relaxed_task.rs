//! The delete relaxation as an and/or graph: what has become possible stays possible.
//!
//! Nodes are literals and parts of conditions; an edge reaches its heads once all of its tail is
//! reached. Conditional effects, disjunctions, negative conditions and rules are edges like others.
//! Only nodes that the goal can depend on are kept. The graph does not depend on costs.

use std::collections::BTreeMap;

use crate::planning::task::{Formula, Task, bit};

/// Stands for no node, no action, no edge.
pub(super) const NONE: u32 = u32::MAX;
/// The node that is always reached.
pub(super) const TRUE: u32 = 0;
/// The node of the goal.
pub(super) const GOAL: u32 = 1;

/// Lists of numbers, stored one after the other.
#[derive(Debug, Clone, Default)]
pub(super) struct Lists {
    /// Where each list begins, and where the last one ends.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    fn collect<'a>(lists: impl Iterator<Item = &'a Vec<u32>>) -> Self {
        let (mut starts, mut items) = (vec![0], Vec::new());
        for list in lists {
            items.extend_from_slice(list);
            starts.push(items.len() as u32);
        }
        Self { starts, items }
    }

    /// The list of that number.
    pub(super) fn get(&self, number: u32) -> &[u32] {
        let at = number as usize;
        &self.items[self.starts[at] as usize..self.starts[at + 1] as usize]
    }

    /// Turns the lists around: list `i` of the result has the lists that contain `i`.
    fn inverted(&self, n_lists: usize) -> Self {
        let mut lists = vec![Vec::new(); n_lists];
        for list in 0..self.starts.len() as u32 - 1 {
            self.get(list).iter().for_each(|&item| lists[item as usize].push(list));
        }
        Self::collect(lists.iter())
    }
}

/// The delete relaxation of a task.
#[derive(Debug, Clone)]
pub(in crate::planning) struct RelaxedTask {
    pub(super) n_nodes: usize,
    /// What must be reached before an edge, never empty.
    pub(super) tails: Lists,
    /// What an edge reaches, never empty.
    pub(super) heads: Lists,
    /// The action of an edge, or [`NONE`] for edges that cost nothing.
    pub(super) actions: Vec<u32>,
    /// Edges with a node in their tail.
    pub(super) waiting: Lists,
    /// Edges with a node among their heads.
    pub(super) reached_by: Lists,
    /// The node of each atom, or [`NONE`] when nothing asks for it.
    positive: Vec<u32>,
    /// (atom, node) of the atoms that something wants to be false.
    negative: Vec<(u32, u32)>,
    /// The literals, by node; nodes that are parts of conditions have none.
    pub(super) literals: Vec<Option<(u32, bool)>>,
}

/// An edge while the graph is built.
struct Edge {
    tail: Vec<u32>,
    heads: Vec<u32>,
    action: u32,
}

/// Builds the graph; parts of conditions that occur twice become one node.
struct Builder {
    edges: Vec<Edge>,
    n_nodes: u32,
    known: BTreeMap<Formula, u32>,
}

fn literal_node(atom: u32, wanted: bool) -> u32 {
    2 + atom * 2 + u32::from(!wanted)
}

impl Builder {
    fn edge(&mut self, mut tail: Vec<u32>, heads: Vec<u32>, action: u32) {
        tail.sort_unstable();
        tail.dedup();
        if tail.is_empty() {
            tail.push(TRUE);
        }
        self.edges.push(Edge { tail, heads, action });
    }

    /// Adds the nodes that together make a condition; none when it holds always.
    fn parts(&mut self, formula: &Formula, tail: &mut Vec<u32>) {
        match formula {
            Formula::And(parts) => parts.iter().for_each(|p| tail.extend(self.node(p))),
            Formula::True
            | Formula::False
            | Formula::Holds(_)
            | Formula::Fails(_)
            | Formula::Or(_) => tail.extend(self.node(formula)),
        }
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
            Formula::And(_) => {
                let mut tail = Vec::new();
                self.parts(formula, &mut tail);
                self.edge(tail, vec![node], NONE);
            }
            Formula::Or(parts) => {
                for part in parts {
                    let mut tail = Vec::new();
                    self.parts(part, &mut tail);
                    self.edge(tail, vec![node], NONE);
                }
            }
            Formula::True | Formula::False | Formula::Holds(_) | Formula::Fails(_) => {}
        }
        Some(node)
    }

    fn actions(&mut self, task: &Task, actions: impl Iterator<Item = u32>) {
        for idx in actions {
            let operator = &task.operators[idx as usize];
            let mut precondition = Vec::new();
            // Many effects share a precondition as one node.
            if operator.effects.len() > 1 {
                precondition.extend(self.node(&operator.precondition));
            } else {
                self.parts(&operator.precondition, &mut precondition);
            }
            for effect in &operator.effects {
                let mut tail = precondition.clone();
                self.parts(&effect.condition, &mut tail);
                let heads = effect.changes.iter().map(|&(atom, added)| literal_node(atom, added));
                self.edge(tail, heads.collect(), idx);
            }
        }
    }

    fn rules(&mut self, task: &Task) {
        let mut negated: BTreeMap<u32, Vec<Formula>> = BTreeMap::new();
        for (head, body) in &task.rules {
            let mut tail = Vec::new();
            self.parts(body, &mut tail);
            self.edge(tail, vec![literal_node(*head, true)], NONE);
            negated.entry(*head).or_default().push(body.negate());
        }
        for (head, bodies) in negated {
            // A recursive rule's negation has no such simple form; it counts as always possible.
            let recursive = task.recursive.contains(&head);
            let all = if recursive { Formula::True } else { Formula::and(bodies) };
            let mut tail = Vec::new();
            self.parts(&all, &mut tail);
            self.edge(tail, vec![literal_node(head, false)], NONE);
        }
    }

    /// Which nodes the goal can depend on; drops the others from the edges.
    fn keep_relevant(&mut self) -> Vec<bool> {
        let mut reached_by = vec![Vec::new(); self.n_nodes as usize];
        for (idx, edge) in (0_u32..).zip(&self.edges) {
            edge.heads.iter().for_each(|&h| reached_by[h as usize].push(idx));
        }
        let mut relevant = vec![false; self.n_nodes as usize];
        relevant[TRUE as usize] = true;
        relevant[GOAL as usize] = true;
        let mut open = vec![GOAL];
        while let Some(node) = open.pop() {
            for &edge in &reached_by[node as usize] {
                let tail = self.edges[edge as usize].tail.iter().copied();
                open.extend(tail.filter(|&t| !std::mem::replace(&mut relevant[t as usize], true)));
            }
        }
        for edge in &mut self.edges {
            // What is in the tail already need not be reached.
            let Edge { tail, heads, .. } = edge;
            heads.retain(|h| relevant[*h as usize] && !tail.contains(h));
        }
        self.edges.retain(|edge| !edge.heads.is_empty());
        relevant
    }
}

impl RelaxedTask {
    /// The graph of a task.
    pub(in crate::planning) fn new(task: &Task) -> Self {
        Self::restricted(task, 0..task.operators.len() as u32, &task.goal)
    }

    /// The graph of a task that has these actions and this goal only.
    pub(super) fn restricted(
        task: &Task,
        actions: impl Iterator<Item = u32>,
        goal: &Formula,
    ) -> Self {
        let n_atoms = task.n_atoms() as u32;
        let mut builder = Builder {
            edges: Vec::new(),
            n_nodes: literal_node(n_atoms, true),
            known: BTreeMap::new(),
        };
        builder.actions(task, actions);
        builder.rules(task);
        let mut tail = Vec::new();
        builder.parts(goal, &mut tail);
        builder.edge(tail, vec![GOAL], NONE);
        let relevant = builder.keep_relevant();
        let mut n_nodes = 0;
        let mut number = vec![NONE; relevant.len()];
        for (number, _) in number.iter_mut().zip(&relevant).filter(|(_, relevant)| **relevant) {
            *number = n_nodes;
            n_nodes += 1;
        }
        for edge in &mut builder.edges {
            let Edge { tail, heads, .. } = edge;
            tail.iter_mut().chain(heads).for_each(|node| *node = number[*node as usize]);
        }
        let node = |atom, wanted| number[literal_node(atom, wanted) as usize];
        let positive: Vec<u32> = (0..n_atoms).map(|atom| node(atom, true)).collect();
        let negative = (0..n_atoms).map(|atom| (atom, node(atom, false)));
        let negative: Vec<(u32, u32)> = negative.filter(|(_, node)| *node != NONE).collect();
        let mut literals = vec![None; n_nodes as usize];
        for (atom, &node) in (0..).zip(&positive).filter(|(_, node)| **node != NONE) {
            literals[node as usize] = Some((atom, true));
        }
        for &(atom, node) in &negative {
            literals[node as usize] = Some((atom, false));
        }
        let edges = builder.edges;
        let tails = Lists::collect(edges.iter().map(|e| &e.tail));
        let heads = Lists::collect(edges.iter().map(|e| &e.heads));
        Self {
            n_nodes: n_nodes as usize,
            waiting: tails.inverted(n_nodes as usize),
            reached_by: heads.inverted(n_nodes as usize),
            tails,
            heads,
            actions: edges.iter().map(|e| e.action).collect(),
            positive,
            negative,
            literals,
        }
    }

    /// How many edges there are.
    pub(super) fn n_edges(&self) -> usize {
        self.actions.len()
    }

    /// What each edge costs.
    pub(super) fn edge_costs(&self, costs: &[u64]) -> Vec<u64> {
        let cost = |&action: &u32| if action == NONE { 0 } else { costs[action as usize] };
        self.actions.iter().map(cost).collect()
    }

    /// Calls `visit` with every node that holds in a state, [`TRUE`] first.
    pub(super) fn each_holding(&self, state: &[u64], mut visit: impl FnMut(u32)) {
        visit(TRUE);
        for (word, &bits) in state.iter().enumerate() {
            let mut open = bits;
            while open != 0 {
                let node = self.positive[word * 64 + open.trailing_zeros() as usize];
                open &= open - 1;
                if node != NONE {
                    visit(node);
                }
            }
        }
        for &(atom, node) in &self.negative {
            if !bit(state, atom) {
                visit(node);
            }
        }
    }
}
