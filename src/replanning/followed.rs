//! The plan that is followed: which states it passes, and from which others a rest of it works.

use std::sync::Arc;

use crate::planning::task::state::StateStore;
use crate::planning::task::{Operator, Task};

/// Most operators applied on trial while one state is looked at. Regression needs none; a rest that
/// has to be tried costs its length, and there are as many rests as steps.
const TRIALS_MAX: usize = 20_000;

/// A plan with what is needed to tell in no time whether a state lies on it.
#[derive(Debug)]
pub(super) struct Followed {
    pub(super) operators: Arc<[u32]>,
    /// Penalised costs of the operators when the plan was made.
    pub(super) costs: Arc<[u64]>,
    /// Whether no plan from the first state costs less, penalties included.
    pub(super) proven_optimal: bool,
    /// Cost of each rest, without penalties and with them; one more than operators.
    pub(super) rest_costs: Vec<(u64, u64)>,
    trajectory: Option<Trajectory>,
    suffixes: Suffixes,
}

/// The states that the plan passes.
#[derive(Debug)]
struct Trajectory {
    states: StateStore,
    /// Where the plan passes each of them for the last time.
    places: Vec<u32>,
}

/// What must hold for a rest of the plan to lead to the goal, as far back as that is a conjunction.
#[derive(Debug)]
struct Suffixes {
    words: usize,
    /// The first rest that has a condition.
    first: usize,
    /// (bits that matter, their wanted values) of each word, rest by rest, from the last one on.
    conditions: Vec<(u64, u64)>,
}

/// Whether a rest of the plan works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RestFound {
    /// The one that starts with this step: the shortest of all.
    At(usize),
    /// None does.
    None,
    /// To tell would take too many trials.
    Unsupported,
}

impl Followed {
    /// A plan; `start` is the state that it was made for, where it is known.
    pub(super) fn new(
        task: &Task,
        start: Option<&[u64]>,
        operators: Arc<[u32]>,
        costs: Arc<[u64]>,
        proven_optimal: bool,
    ) -> Self {
        let mut rest_costs = vec![(0_u64, 0_u64); operators.len() + 1];
        for (idx, &operator) in operators.iter().enumerate().rev() {
            let (plain, penalised) = rest_costs[idx + 1];
            let operator = operator as usize;
            rest_costs[idx] = (
                plain.saturating_add(task.operators[operator].cost),
                penalised.saturating_add(costs[operator]),
            );
        }
        let trajectory = start.map(|start| Trajectory::new(task, start, &operators));
        let suffixes = Suffixes::new(task, &operators);
        Self { operators, costs, proven_optimal, rest_costs, trajectory, suffixes }
    }

    /// The step that is next in this state, when the plan passes it.
    pub(super) fn on_trajectory(&self, state: &[u64]) -> Option<usize> {
        let trajectory = self.trajectory.as_ref()?;
        let number = trajectory.states.find(state)?;
        Some(trajectory.places[number as usize] as usize)
    }

    /// The shortest rest that leads from this state to the goal.
    pub(super) fn valid_rest(&self, task: &Task, state: &[u64]) -> RestFound {
        let n_steps = self.operators.len();
        let first = self.suffixes.first.min(n_steps);
        if let Some(at) = (first..n_steps).rev().find(|&at| self.suffixes.hold(at, state)) {
            return RestFound::At(at);
        }
        let mut trials = 0;
        let (mut now, mut after) = (Vec::new(), Vec::new());
        for at in (0..first).rev() {
            if !self.operator(task, at).applicable(state) {
                continue;
            }
            now.clear();
            now.extend_from_slice(state);
            for step in at..=n_steps {
                if step >= self.suffixes.first && self.suffixes.hold(step, &now)
                    || step == n_steps && task.is_goal(&now)
                {
                    return RestFound::At(at);
                }
                if step >= first || !self.operator(task, step).applicable(&now) {
                    break;
                }
                trials += 1;
                if trials > TRIALS_MAX {
                    return RestFound::Unsupported;
                }
                task.apply(self.operator(task, step), &now, &mut after);
                std::mem::swap(&mut now, &mut after);
            }
        }
        RestFound::None
    }

    fn operator<'t>(&self, task: &'t Task, step: usize) -> &'t Operator {
        &task.operators[self.operators[step] as usize]
    }
}

/// Whether operators lead from a state to the goal; if not, the first step that is not applicable,
/// or how many steps there are when the goal is missed.
pub(super) fn leads_to_goal(task: &Task, start: &[u64], operators: &[u32]) -> Result<(), usize> {
    let (mut now, mut after) = (start.to_vec(), Vec::new());
    for (idx, &operator) in operators.iter().enumerate() {
        let operator = &task.operators[operator as usize];
        if !operator.applicable(&now) {
            return Err(idx);
        }
        task.apply(operator, &now, &mut after);
        std::mem::swap(&mut now, &mut after);
    }
    if task.is_goal(&now) { Ok(()) } else { Err(operators.len()) }
}

impl Trajectory {
    fn new(task: &Task, start: &[u64], operators: &[u32]) -> Self {
        let mut states = StateStore::new(task.words);
        let mut places = Vec::with_capacity(operators.len() + 1);
        let (mut now, mut after) = (start.to_vec(), Vec::new());
        for place in 0..=operators.len() {
            let (number, is_new) = states.insert(&now);
            if is_new {
                places.push(place as u32);
            } else {
                places[number as usize] = place as u32;
            }
            if let Some(&operator) = operators.get(place) {
                task.apply(&task.operators[operator as usize], &now, &mut after);
                std::mem::swap(&mut now, &mut after);
            }
        }
        Self { states, places }
    }
}

impl Suffixes {
    /// Regresses the goal through the plan, from its end, up to the first operator whose condition
    /// or effect is more than a conjunction.
    fn new(task: &Task, operators: &[u32]) -> Self {
        let n_steps = operators.len();
        let mut suffixes = Self { words: task.words, first: n_steps + 1, conditions: Vec::new() };
        let goal = if task.axioms.is_empty() { task.goal_test.literals() } else { None };
        let Some(goal) = goal else { return suffixes };
        let mut condition = vec![(0, 0); task.words];
        require(&mut condition, goal);
        suffixes.conditions.reserve((n_steps + 1) * task.words);
        suffixes.conditions.extend_from_slice(&condition);
        suffixes.first = n_steps;
        for (idx, &operator) in operators.iter().enumerate().rev() {
            if !regress(&mut condition, &task.operators[operator as usize]) {
                break;
            }
            suffixes.conditions.extend_from_slice(&condition);
            suffixes.first = idx;
        }
        suffixes
    }

    /// Whether the rest that starts with step `at` leads from a state to the goal.
    fn hold(&self, at: usize, state: &[u64]) -> bool {
        let n_steps = self.first + self.conditions.len() / self.words - 1;
        let from = (n_steps - at) * self.words;
        let conditions = &self.conditions[from..from + self.words];
        conditions.iter().zip(state).all(|(&(care, value), &word)| word & care == value)
    }
}

/// What must hold before an operator for `condition` to hold after it; `false` when that is not
/// known to be a conjunction, or cannot be.
fn regress(condition: &mut [(u64, u64)], operator: &Operator) -> bool {
    let Some(precondition) = operator.test.literals() else { return false };
    if operator.changes.iter().any(|effect| !effect.test.is_empty()) {
        return false;
    }
    let set = operator.changes.iter().flat_map(|effect| &effect.set);
    for &(word, bits) in set {
        let (care, value) = &mut condition[word as usize];
        if *value & bits != *care & bits {
            return false;
        }
        *care &= !bits;
        *value &= !bits;
    }
    // What is added as well was taken out above: adding wins.
    let clear = operator.changes.iter().flat_map(|effect| &effect.clear);
    for &(word, bits) in clear {
        let (care, value) = &mut condition[word as usize];
        if *value & bits != 0 {
            return false;
        }
        *care &= !bits;
    }
    require(condition, precondition)
}

/// Adds literals to a condition; `false` when they contradict it.
fn require(condition: &mut [(u64, u64)], literals: &[(u32, u64, u64)]) -> bool {
    for &(word, new_care, new_value) in literals {
        let (care, value) = &mut condition[word as usize];
        if (*value ^ new_value) & *care & new_care != 0 {
            return false;
        }
        *care |= new_care;
        *value |= new_value;
    }
    true
}
