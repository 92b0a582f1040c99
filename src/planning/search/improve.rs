//! Makes a plan cheaper: parts of it are searched for anew, with few actions to choose from.
//!
//! A part may be replaced by anything cheaper after which the rest of the plan still reaches the
//! goal. The search for it uses the plan's own actions and those that relaxed plans along it
//! propose: most detours of a greedy search are steps in an unlucky order, and it makes a search
//! many times as fast.
//!
//! Source: Nakhost, Müller: Action elimination and plan neighborhood graph search, 2010 (the
//! neighbourhood); Siddiqui, Haslum: Continuing plan quality optimisation, 2015 (windows).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::regress::{Target, targets};
use super::{INTERRUPT_EVERY, Limits, WORK_PER_EXPANSION, shorten};
use crate::planning::heuristics::{FastForward, Heuristic as _, Part, RelaxedTask};
use crate::planning::outcome::Phase;
use crate::planning::task::{Formula, StateRegistry, Task};

/// Lengths of the parts that are searched anew, in order; the last is longer than any plan.
const LENGTHS: [usize; 5] = [12, 24, 48, 96, usize::MAX];
/// Expansions for one part.
const PART_EXPANSIONS_MAX: u64 = 2000;
/// Weights of the estimates, over [`WEIGHT_UNIT`]: the next when one gives nothing any more.
const WEIGHTS: [u64; 4] = [6, 4, 3, 2];
/// A weight of one.
const WEIGHT_UNIT: u64 = 2;

/// The plan or a cheaper one; `relaxed` is the task's own relaxation.
pub(in crate::planning) fn improve(
    (task, relaxed): (&Task, &RelaxedTask),
    initial: &[u64],
    costs: &[u64],
    plan: Vec<u32>,
    limits: Limits<'_>,
) -> (Vec<u32>, Phase) {
    let phase = Phase { name: Phase::IMPROVE, expanded: 0, generated: 0, evaluated: 0 };
    // None is free, so that short plans are preferred.
    let step_costs: Vec<u64> = costs.iter().map(|&cost| cost.max(1)).collect();
    let guide = FastForward::new(task, relaxed, step_costs.clone());
    let (seen, proposed) = (StateRegistry::new(task.words), Vec::new());
    let mut improver = Improver {
        task,
        initial,
        costs,
        limits,
        phase,
        work: 0,
        step_costs,
        guide,
        seen,
        proposed,
    };
    let plan = improver.run(plan);
    (plan, improver.phase)
}

struct Improver<'a> {
    task: &'a Task,
    initial: &'a [u64],
    costs: &'a [u64],
    limits: Limits<'a>,
    phase: Phase,
    /// Elementary steps of the estimates for the whole task.
    work: u64,
    step_costs: Vec<u64>,
    /// Estimates of the cost to the goal.
    guide: FastForward<'a>,
    /// The states that plans visited, with the relaxed plan from each.
    seen: StateRegistry,
    proposed: Vec<Vec<u32>>,
}

/// A search for a cheaper part.
struct Window<'a> {
    start: &'a [u64],
    target: &'a Target,
    actions: &'a [u32],
    /// The plan must cost less.
    bound: u64,
    weight: u64,
}

impl Improver<'_> {
    fn run(&mut self, mut plan: Vec<u32>) -> Vec<u32> {
        for weight in WEIGHTS {
            let mut before = u64::MAX;
            while self.cost(&plan) < before && !self.is_over() {
                before = self.cost(&plan);
                plan = self.sweeps(plan, weight);
            }
        }
        plan
    }

    /// Tries to replace parts of all lengths, from short ones to the whole plan.
    fn sweeps(&mut self, mut plan: Vec<u32>, weight: u64) -> Vec<u32> {
        for length in LENGTHS {
            plan = self.sweep(plan, length, weight);
            if length >= plan.len() {
                break;
            }
        }
        plan
    }

    fn is_over(&self) -> bool {
        self.phase.expanded.max(self.work / WORK_PER_EXPANSION) >= self.limits.expansions_max
            || (self.limits.interrupt)()
    }

    fn cost(&self, plan: &[u32]) -> u64 {
        plan.iter().fold(0, |sum, &action| sum.saturating_add(self.costs[action as usize]))
    }

    /// The states that a plan visits.
    fn states(&self, plan: &[u32]) -> Vec<Vec<u64>> {
        let mut states = vec![self.initial.to_vec()];
        for &action in plan {
            let mut after = Vec::new();
            let operator = &self.task.operators[action as usize];
            self.task.apply(operator, &states[states.len() - 1], &mut after);
            states.push(after);
        }
        states
    }

    /// Tries to replace each part of that length once, from the front; parts overlap by half.
    fn sweep(&mut self, mut plan: Vec<u32>, length: usize, weight: u64) -> Vec<u32> {
        let mut from = 0;
        let mut states = self.states(&plan);
        let mut wanted = targets(self.task, &states, &plan);
        while from < plan.len() && !self.is_over() {
            let to = from.saturating_add(length).min(plan.len());
            let part = &plan[from..to];
            let actions = self.neighbourhood(part, &states[from..to]);
            let (start, target) = (&states[from], &wanted[to]);
            let bound = self.cost(part);
            let window = Window { start, target, actions: &actions, bound, weight };
            if let Some(better) = self.search(&window) {
                plan.splice(from..to, better);
                plan = shorten(self.task, self.initial, plan);
                states = self.states(&plan);
                wanted = targets(self.task, &states, &plan);
            }
            if to == plan.len() {
                break;
            }
            from += (length / 2).max(1);
        }
        plan
    }

    /// The actions of a part of a plan, and those that relaxed plans propose along it, in order.
    fn neighbourhood(&mut self, part: &[u32], states: &[Vec<u64>]) -> Vec<u32> {
        let mut actions = part.to_vec();
        for state in states {
            if self.is_over() {
                break;
            }
            let (number, new) = self.seen.insert(state);
            if new {
                self.guide.estimate(state);
                self.work += self.guide.work();
                self.proposed.push(self.guide.relaxed_plan().to_vec());
            }
            actions.extend_from_slice(&self.proposed[number as usize]);
        }
        actions.sort_unstable();
        actions.dedup();
        actions
    }

    /// A cheaper way from the start of a window to its target, if one is found soon.
    fn search(&mut self, window: &Window<'_>) -> Option<Vec<u32>> {
        let goal: Formula = window.target.formula(self.task);
        let graph = Part::new(self.task, window.actions, &goal);
        let mut estimates = graph.estimates(self.task, self.step_costs.clone());
        let expansions_max =
            (self.phase.expanded + PART_EXPANSIONS_MAX).min(self.limits.expansions_max);
        let mut open = Open::new(self.task.words);
        open.reach(window, &mut estimates, window.start, (u32::MAX, u32::MAX), 0);
        let (mut state, mut after) = (Vec::new(), Vec::new());
        while let Some((number, path_cost)) = open.pop() {
            state.clear();
            state.extend_from_slice(open.store.get(number));
            if window.target.holds(&state) {
                return Some(open.path(number));
            }
            if self.phase.expanded >= expansions_max
                || open.store.len() >= self.limits.states_max
                || self.phase.expanded.is_multiple_of(INTERRUPT_EVERY) && (self.limits.interrupt)()
            {
                return None;
            }
            self.phase.expanded += 1;
            for &action in window.actions {
                let operator = &self.task.operators[action as usize];
                if operator.applicable(&state) {
                    self.phase.generated += 1;
                    self.task.apply(operator, &state, &mut after);
                    let cost = path_cost.saturating_add(self.costs[action as usize]);
                    open.reach(window, &mut estimates, &after, (number, action), cost);
                }
            }
        }
        None
    }
}

/// The states of a window's search.
struct Open {
    store: StateRegistry,
    known: Vec<Known>,
    queue: BinaryHeap<Entry>,
}

/// What a window's search knows of a state.
struct Known {
    /// Parent and action.
    reached_by: (u32, u32),
    path_cost: u64,
    estimate: Option<u64>,
}

/// (weighted total, estimate, state, path cost); among equals the state found last comes first.
type Entry = Reverse<(u64, u64, Reverse<u32>, u64)>;

impl Open {
    fn new(words: usize) -> Self {
        Self { store: StateRegistry::new(words), known: Vec::new(), queue: BinaryHeap::new() }
    }

    /// Takes in a state unless it was reached as cheaply before, or looks too dear.
    fn reach(
        &mut self,
        window: &Window<'_>,
        estimates: &mut FastForward<'_>,
        state: &[u64],
        from: (u32, u32),
        cost: u64,
    ) {
        if cost >= window.bound {
            return;
        }
        let (number, new) = self.store.insert(state);
        if new {
            let estimate = estimates.estimate(state);
            self.known.push(Known { reached_by: from, path_cost: cost, estimate });
        } else {
            let known = &mut self.known[number as usize];
            if known.path_cost <= cost {
                return;
            }
            (known.reached_by, known.path_cost) = (from, cost);
        }
        if let Some(estimate) = self.known[number as usize].estimate
            && cost.saturating_add(estimate) <= window.bound
        {
            let weighted = estimate.saturating_mul(window.weight) / WEIGHT_UNIT;
            let total = cost.saturating_add(weighted);
            self.queue.push(Reverse((total, estimate, Reverse(number), cost)));
        }
    }

    fn pop(&mut self) -> Option<(u32, u64)> {
        loop {
            let Reverse((_, _, Reverse(number), cost)) = self.queue.pop()?;
            if self.known[number as usize].path_cost == cost {
                return Some((number, cost));
            }
        }
    }

    fn path(&self, number: u32) -> Vec<u32> {
        let mut path = Vec::new();
        let mut at = number;
        while let (parent, action) = self.known[at as usize].reached_by
            && parent != u32::MAX
        {
            path.push(action);
            at = parent;
        }
        path.reverse();
        path
    }
}
