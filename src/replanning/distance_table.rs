//! The goal-rooted distance table: how far every state is from the goal, and where to go next.
//!
//! The goal of an episode is constant, so its distances are worth computing once: forward closure
//! of the states that can be reached, then uniform-cost search backwards from all goal states among
//! them. Because the closure is complete, a distance never changes when states are added later,
//! and a state without a distance is proven hopeless.

use std::collections::BTreeMap;
use std::mem::size_of;
use std::sync::Arc;

use super::TableLimits;
use super::observed_task::ObservedTask;
use crate::planning::StateRegistry;

/// Key of a state from which the goal cannot be reached; also "not known yet" while building.
const DEAD: u64 = u64::MAX;
/// No operator, no state.
const NONE: u32 = u32::MAX;
/// States expanded between two looks at the interrupt.
const INTERRUPT_EVERY: usize = 4096;

/// Distances to the goal of all states that can be reached from some states.
#[derive(Debug, Clone)]
pub struct DistanceTable {
    states: StateRegistry,
    /// Distance of each state, in keys: see [`Keys`].
    distances: Vec<u64>,
    /// The operator to take next and the state that it leads to.
    next: Vec<(u32, u32)>,
    /// Costs of the operators, penalties included.
    pub(super) costs: Arc<[u64]>,
    keys: Keys,
}

/// Costs as they are added up. Where some operators are free, the number of steps breaks ties:
/// going round in a circle of free steps is not as good as arriving.
#[derive(Debug, Clone, Copy)]
struct Keys {
    /// Key of cost 1.
    scale: u64,
    /// Added for each step: 1 where some operators are free, else 0.
    step: u64,
}

/// What is known of one state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Distance {
    /// Penalised cost to the goal: no plan costs less.
    Cost(u64),
    /// The goal cannot be reached; proven.
    Dead,
}

/// The order to build or extend a table: a value, so that it can be carried out anywhere.
#[derive(Debug, Clone)]
pub struct TableJob {
    pub(super) observed_task: Arc<ObservedTask>,
    pub(super) costs: Arc<[u64]>,
    /// A state that the table shall know.
    pub(super) start: Vec<u64>,
    /// The table to extend; left out where it was built at other costs.
    pub(super) base: Option<Arc<DistanceTable>>,
    pub(super) limits: TableLimits,
}

/// How building a table ends.
#[derive(Debug, Clone)]
pub enum TableEnd {
    /// With every state that can be reached from the start, and those of the table it extends.
    Built(Arc<DistanceTable>),
    /// It would not keep within a limit: which one, and its value.
    TooLarge(&'static str, usize),
    /// Costs add up to more than 64 bits hold.
    CostsTooLarge,
    /// Nobody wants it any more.
    Interrupted,
}

impl TableJob {
    /// Builds or extends the table. The same job has the same result, unless it is interrupted.
    pub fn run(&self, interrupt: &dyn Fn() -> bool) -> TableEnd {
        let Some(keys) = Keys::new(&self.costs, self.limits.states_max) else {
            return TableEnd::CostsTooLarge;
        };
        let base = self.base.as_deref().filter(|base| base.costs == self.costs);
        let table = base.cloned().unwrap_or_else(|| DistanceTable {
            states: StateRegistry::new(self.observed_task.task().words()),
            distances: Vec::new(),
            next: Vec::new(),
            costs: Arc::clone(&self.costs),
            keys,
        });
        let first = table.states.len();
        let mut build = Build { job: self, table, first, edges: Edges::default() };
        if let Some(end) = build.explore(interrupt) {
            return end;
        }
        build.measure();
        build.choose();
        let mut table = build.table;
        table.states.shrink();
        table.distances.shrink_to_fit();
        table.next.shrink_to_fit();
        TableEnd::Built(Arc::new(table))
    }

    /// The memory that the result may take.
    pub fn limits(&self) -> TableLimits {
        self.limits
    }
}

impl Keys {
    /// `None` when the dearest conceivable path does not fit.
    fn new(costs: &[u64], states_max: usize) -> Option<Self> {
        let states = u64::try_from(states_max).ok()?.checked_add(1)?;
        let some_free = costs.contains(&0);
        let keys =
            if some_free { Self { scale: states, step: 1 } } else { Self { scale: 1, step: 0 } };
        let dearest = costs.iter().max().copied().unwrap_or(0);
        let key = dearest.checked_mul(keys.scale)?.checked_add(keys.step)?;
        key.checked_mul(states).filter(|&longest| longest < DEAD).map(|_| keys)
    }

    fn of(self, cost: u64) -> u64 {
        cost * self.scale + self.step
    }
}

impl DistanceTable {
    /// How many states it knows.
    pub fn n_states(&self) -> usize {
        self.states.len()
    }

    /// Memory that it takes, bytes.
    pub fn bytes(&self) -> usize {
        self.states.bytes()
            + self.distances.capacity() * size_of::<u64>()
            + self.next.capacity() * size_of::<(u32, u32)>()
            + self.costs.len() * size_of::<u64>()
    }

    /// How far a packed state is from the goal; `None` when the table does not know it.
    pub fn distance(&self, state: &[u64]) -> Option<Distance> {
        self.states.find(state).map(|number| self.distance_of(number))
    }

    fn distance_of(&self, number: u32) -> Distance {
        match self.distances[number as usize] {
            DEAD => Distance::Dead,
            key => Distance::Cost(key / self.keys.scale),
        }
    }

    /// The operator to take next; `None` at the goal, without a way there, or off the table.
    pub fn next_action(&self, state: &[u64]) -> Option<u32> {
        let (operator, _) = self.next[self.states.find(state)? as usize];
        (operator != NONE).then_some(operator)
    }

    /// What is known of a state, with the operators of a cheapest way to the goal.
    pub fn plan(&self, state: &[u64]) -> Option<(Distance, Vec<u32>)> {
        let mut at = self.states.find(state)?;
        let distance = self.distance_of(at);
        let mut operators = Vec::with_capacity(32);
        loop {
            let (operator, next) = self.next[at as usize];
            if operator == NONE {
                return Some((distance, operators));
            }
            operators.push(operator);
            at = next;
        }
    }
}

/// The edges between new states, and from new states to known ones.
#[derive(Default)]
struct Edges {
    /// Where the edges of each new state begin in `targets`; one more than states.
    first: Vec<u32>,
    /// The states that they lead to, in the order of the applicable operators.
    targets: Vec<u32>,
    /// Their operators, unless all cost the same.
    operators: Vec<u32>,
}

/// A table in the making.
struct Build<'a> {
    job: &'a TableJob,
    table: DistanceTable,
    /// The first new state.
    first: usize,
    edges: Edges,
}

impl Build<'_> {
    fn uniform(&self) -> bool {
        self.job.costs.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Adds every state that can be reached from the start.
    fn explore(&mut self, interrupt: &dyn Fn() -> bool) -> Option<TableEnd> {
        let (task, uniform) = (self.job.observed_task.task(), self.uniform());
        self.table.states.insert(&self.job.start);
        let (mut applicable, mut before, mut after) = (Vec::new(), Vec::new(), Vec::new());
        let mut number = self.first;
        while number < self.table.states.len() {
            if let Some((limit, value)) = self.over_limit() {
                return Some(TableEnd::TooLarge(limit, value));
            }
            if number.is_multiple_of(INTERRUPT_EVERY) && interrupt() {
                return Some(TableEnd::Interrupted);
            }
            self.edges.first.push(self.edges.targets.len() as u32);
            before.clear();
            before.extend_from_slice(self.table.states.get(number as u32));
            task.applicable(&before, &mut applicable);
            for &operator in &applicable {
                task.apply(&task.operators()[operator as usize], &before, &mut after);
                let (target, _) = self.table.states.insert(&after);
                self.edges.targets.push(target);
            }
            if !uniform {
                self.edges.operators.extend_from_slice(&applicable);
            }
            number += 1;
        }
        self.edges.first.push(self.edges.targets.len() as u32);
        None
    }

    /// The limit that is not kept. What is still to come is counted, too: the edges backwards,
    /// distances and next steps, a queue. So is the table that is extended: somebody uses it.
    fn over_limit(&self) -> Option<(&'static str, usize)> {
        let TableLimits { states_max, bytes_max } = self.job.limits;
        let (states, Edges { first, targets, operators }) = (&self.table.states, &self.edges);
        let per_state = size_of::<u64>() + size_of::<(u32, u32)>() + 3 * size_of::<u32>();
        let per_edge = size_of::<u32>() * if operators.is_empty() { 1 } else { 2 };
        let edges =
            (first.capacity() + targets.capacity() + operators.capacity()) * size_of::<u32>();
        let base = self.job.base.as_ref().map_or(0, |base| base.bytes());
        let to_come = states.len() * per_state + targets.len() * per_edge;
        let bytes = base + states.bytes() + edges + to_come;
        if states.len() > states_max.min(NONE as usize - 1) {
            Some(("planner.table.states_max", states_max))
        } else if bytes > bytes_max || targets.len() >= NONE as usize {
            Some(("planner.table.bytes_max", bytes_max))
        } else {
            None
        }
    }

    /// Uniform-cost search backwards from the goal states and the known distances.
    fn measure(&mut self) {
        let (first, n_states) = (self.first, self.table.states.len());
        self.table.distances.reserve_exact(n_states - first);
        self.table.distances.resize(n_states, DEAD);
        let backwards = Backwards::new(&self.edges, first, n_states);
        let mut open: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
        for number in first..n_states {
            let distance = self.seed(number);
            if distance < DEAD {
                self.table.distances[number] = distance;
                open.entry(distance).or_default().push(number as u32);
            }
        }
        while let Some((distance, layer)) = open.pop_first() {
            for number in layer {
                if self.table.distances[number as usize] == distance {
                    self.relax(backwards.of(number as usize - first), distance, &mut open);
                }
            }
        }
    }

    /// Takes the edges into a state at this distance.
    fn relax(
        &mut self,
        edges: impl Iterator<Item = (u32, Option<u32>)>,
        distance: u64,
        open: &mut BTreeMap<u64, Vec<u32>>,
    ) {
        for (source, operator) in edges {
            let through = distance + self.key(operator);
            let known = &mut self.table.distances[source as usize];
            if through < *known {
                *known = through;
                open.entry(through).or_default().push(source);
            }
        }
    }

    /// The distance of a new state as far as no other new state is needed to tell.
    fn seed(&self, number: usize) -> u64 {
        let task = self.job.observed_task.task();
        if task.is_goal(self.table.states.get(number as u32)) {
            return 0;
        }
        let edges = self.edges.of(number - self.first);
        let known = edges.filter(|(target, _)| (*target as usize) < self.first);
        let through = known.filter_map(|(target, operator)| {
            let distance = self.table.distances[target as usize];
            (distance < DEAD).then(|| distance + self.key(operator))
        });
        through.min().unwrap_or(DEAD)
    }

    /// Key of one step; without an operator, where all cost the same.
    fn key(&self, operator: Option<u32>) -> u64 {
        let cost = self.job.costs.get(operator.unwrap_or(0) as usize).copied().unwrap_or(0);
        self.table.keys.of(cost)
    }

    /// Notes for each new state the first operator that lies on a cheapest way.
    fn choose(&mut self) {
        let task = self.job.observed_task.task();
        let n_states = self.table.states.len();
        self.table.next.reserve_exact(n_states - self.first);
        let mut applicable = Vec::new();
        for number in self.first..n_states {
            let distance = self.table.distances[number];
            let mut next = (NONE, NONE);
            if distance != 0 && distance != DEAD {
                task.applicable(self.table.states.get(number as u32), &mut applicable);
                let edges = self.edges.of(number - self.first).map(|(target, _)| target);
                let mut edges = applicable.iter().copied().zip(edges);
                let on_way = |&(operator, target): &(u32, u32)| {
                    let suffix = self.table.distances[target as usize];
                    suffix < DEAD && suffix + self.key(Some(operator)) == distance
                };
                next = edges.find(on_way).unwrap_or(next);
            }
            self.table.next.push(next);
        }
    }
}

impl Edges {
    /// (target, operator unless all cost the same) of each edge of a new state.
    fn of(&self, idx: usize) -> impl Iterator<Item = (u32, Option<u32>)> {
        let range = self.first[idx] as usize..self.first[idx + 1] as usize;
        range.map(|edge| (self.targets[edge], self.operators.get(edge).copied()))
    }
}

/// The edges between new states, by target.
struct Backwards {
    /// Where the edges into each new state begin; one more than states.
    first: Vec<u32>,
    sources: Vec<u32>,
    operators: Vec<u32>,
}

impl Backwards {
    fn new(edges: &Edges, first_state: usize, n_states: usize) -> Self {
        let n_new = n_states - first_state;
        let mut first = vec![0_u32; n_new + 1];
        let new = |target: u32| (target as usize).checked_sub(first_state);
        for target in edges.targets.iter().filter_map(|&target| new(target)) {
            first[target] += 1;
        }
        let mut sum = 0;
        for count in &mut first {
            sum += *count;
            *count = sum;
        }
        // `first[i]` is now the end of the edges into `i`; filling from the back makes it the start.
        let n_edges = first.last().copied().unwrap_or(0) as usize;
        let mut sources = vec![0; n_edges];
        let mut operators = vec![0; if edges.operators.is_empty() { 0 } else { n_edges }];
        for idx in (0..n_new).rev() {
            for (target, operator) in edges.of(idx) {
                let Some(target) = new(target) else { continue };
                first[target] -= 1;
                let at = first[target] as usize;
                sources[at] = (first_state + idx) as u32;
                if let Some(operator) = operator {
                    operators[at] = operator;
                }
            }
        }
        Self { first, sources, operators }
    }

    /// Source and, unless all cost the same, operator of each edge into a new state.
    fn of(&self, idx: usize) -> impl Iterator<Item = (u32, Option<u32>)> {
        let range = self.first[idx] as usize..self.first[idx + 1] as usize;
        range.map(|edge| (self.sources[edge], self.operators.get(edge).copied()))
    }
}
