//! In which order landmarks are to be reached.
//!
//! Source: Hoffmann, Porteous, Sebastia: Ordered landmarks in planning, 2004; Richter, Westphal:
//! The LAMA planner, 2010, section 4.

use super::bits::{self, Rows};
use super::find::NodeLandmarks;
use crate::planning::heuristics::graph::{GOAL, Graph, NONE};

/// Orders between landmarks, by their numbers.
pub(super) struct Orders {
    /// What comes before each landmark, by necessity or because the other order would be undone.
    pub(super) before: Rows,
    /// For each landmark, those that need it to hold right before they first hold.
    pub(super) needing: Rows,
    /// The landmarks that the goal asks for.
    pub(super) goals: Vec<u64>,
}

/// Finds the orders of landmarks, given as nodes; `groups` are atoms of which at most one can hold.
pub(super) fn orders(
    graph: &Graph,
    found: &NodeLandmarks,
    landmarks: &[u32],
    groups: &[Vec<u32>],
) -> Orders {
    let n = landmarks.len();
    let mut number = vec![NONE; graph.n_nodes];
    for (idx, &node) in (0..).zip(landmarks) {
        number[node as usize] = idx;
    }
    let mut before = Rows::new(n, n);
    let mut needing = Rows::new(n, n);
    let mut needs = Rows::new(n, n);
    let mut goals = vec![0; bits::n_words(n)];
    let mut scratch = Scratch::new(graph);
    for node in scratch.asked_by_all(graph, found, GOAL) {
        if number[node as usize] != NONE {
            bits::insert(&mut goals, number[node as usize] as usize);
        }
    }
    for (idx, &node) in landmarks.iter().enumerate() {
        for other in bits::members(found.of(node)) {
            if other != node as usize && number[other] != NONE {
                bits::insert(before.get_mut(idx), number[other] as usize);
            }
        }
        for other in scratch.asked_by_all(graph, found, node) {
            let other = number[other as usize];
            if other != NONE {
                bits::insert(needing.get_mut(other as usize), idx);
                bits::insert(needs.get_mut(idx), other as usize);
            }
        }
    }
    let exclusive = exclusive(graph, landmarks, groups);
    let mut orders = Orders { before, needing, goals };
    orders.add_reasonable(&needs, &exclusive);
    orders
}

/// Which landmarks cannot hold together.
fn exclusive(graph: &Graph, landmarks: &[u32], groups: &[Vec<u32>]) -> Rows {
    let n = landmarks.len();
    let mut rows = Rows::new(n, n);
    let mut number = std::collections::BTreeMap::new();
    for (idx, &node) in landmarks.iter().enumerate() {
        if let Some((atom, true)) = graph.literals[node as usize] {
            number.insert(atom, idx);
        }
    }
    for group in groups {
        let members: Vec<usize> = group.iter().filter_map(|a| number.get(a).copied()).collect();
        for &one in &members {
            for &other in members.iter().filter(|&&other| other != one) {
                bits::insert(rows.get_mut(one), other);
            }
        }
    }
    rows
}

impl Orders {
    /// One landmark is to come before another if reaching it would undo the other.
    fn add_reasonable(&mut self, needs: &Rows, exclusive: &Rows) {
        let n = self.before.n_rows();
        let mut wanted = Vec::new();
        for later in 0..n {
            let rivals: Vec<usize> = if bits::contains(&self.goals, later) {
                bits::members(&self.goals).collect()
            } else {
                let mut rivals = vec![0; self.goals.len()];
                for child in bits::members(self.needing.get(later)) {
                    let before = self.before.get(child);
                    rivals.iter_mut().zip(before).for_each(|(rivals, bits)| *rivals |= bits);
                }
                bits::members(&rivals).collect()
            };
            for earlier in rivals.into_iter().filter(|&r| r != later) {
                let clash = exclusive.get(later);
                let undone = bits::contains(clash, earlier)
                    || bits::members(needs.get(earlier))
                        .any(|x| x != later && bits::contains(clash, x));
                if undone {
                    wanted.push((earlier, later));
                }
            }
        }
        for (earlier, later) in wanted {
            if !self.comes_before(later, earlier) {
                bits::insert(self.before.get_mut(later), earlier);
            }
        }
    }

    /// Whether the orders put one landmark before another, directly or not.
    fn comes_before(&self, earlier: usize, later: usize) -> bool {
        let mut seen = vec![0; self.goals.len()];
        let mut open = vec![later];
        while let Some(at) = open.pop() {
            if at == earlier {
                return true;
            }
            for next in bits::members(self.before.get(at)) {
                if !bits::contains(&seen, next) {
                    bits::insert(&mut seen, next);
                    open.push(next);
                }
            }
        }
        false
    }
}

/// Finds what all first ways to a node ask for.
struct Scratch {
    /// How many ways asked for each node.
    n_asking: Vec<u32>,
    on_the_way: Vec<u64>,
}

impl Scratch {
    fn new(graph: &Graph) -> Self {
        let n = graph.n_nodes;
        Self { n_asking: vec![0; n], on_the_way: vec![0; bits::n_words(n)] }
    }

    /// The nodes in the tail of every edge that can be the first to reach `node`.
    fn asked_by_all(&mut self, graph: &Graph, found: &NodeLandmarks, node: u32) -> Vec<u32> {
        let mut n_ways = 0;
        let mut seen = Vec::new();
        for &edge in graph.reached_by.get(node) {
            let tail = graph.tails.get(edge);
            if !tail.iter().all(|&part| found.is_reached(part)) {
                continue;
            }
            found.union(tail, &mut self.on_the_way);
            if bits::contains(&self.on_the_way, node as usize) {
                continue;
            }
            n_ways += 1;
            let mut asked = Vec::new();
            literals(graph, tail, &mut asked);
            asked.sort_unstable();
            asked.dedup();
            for part in asked {
                self.n_asking[part as usize] += 1;
                seen.push(part);
            }
        }
        let mut all = Vec::new();
        for part in seen {
            if std::mem::take(&mut self.n_asking[part as usize]) == n_ways {
                all.push(part);
            }
        }
        all
    }
}

/// The literals that must hold for all of these nodes to be reached, as nodes.
fn literals(graph: &Graph, nodes: &[u32], out: &mut Vec<u32>) {
    for &node in nodes {
        if graph.literals[node as usize].is_some() {
            out.push(node);
        } else if let [edge] = graph.reached_by.get(node)
            && graph.actions[*edge as usize] == NONE
        {
            literals(graph, graph.tails.get(*edge), out);
        }
    }
}
