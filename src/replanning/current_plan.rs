//! The current plan: which states it passes, and from which others a suffix of it works.

use std::sync::Arc;

use crate::planning::{LiteralMask, Operator, StateRegistry, Task};

/// Most operators applied on trial while one state is looked at. Regression needs none; a suffix that
/// has to be tried costs its length, and there are as many rests as steps.
const TRIALS_MAX: usize = 20_000;

/// A plan with what is needed to tell in no time whether a state lies on it.
#[derive(Debug)]
pub(super) struct CurrentPlan {
    pub(super) operators: Arc<[u32]>,
    /// Penalised costs of the operators when the plan was made.
    pub(super) costs: Arc<[u64]>,
    /// Whether no plan from the first state costs less, penalties included.
    pub(super) proven_optimal: bool,
    /// Cost of each suffix, without penalties and with them; one more than operators.
    pub(super) suffix_costs: Vec<(u64, u64)>,
    trajectory: Option<Trajectory>,
    suffixes: Suffixes,
}

/// The states that the plan passes.
#[derive(Debug)]
struct Trajectory {
    states: StateRegistry,
    /// Where the plan passes each of them for the last time.
    memos: Vec<u32>,
}

/// What must hold for a suffix of the plan to lead to the goal, as far back as that is a conjunction.
#[derive(Debug)]
struct Suffixes {
    words: usize,
    /// The first suffix that has a condition.
    first: usize,
    /// (bits that matter, their wanted values) of each word, suffix by suffix, from the last one on.
    conditions: Vec<(u64, u64)>,
}

/// Whether a suffix of the plan works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SuffixFound {
    /// The one that starts with this step: the shortest of all.
    At(usize),
    /// None does.
    None,
    /// To tell would take too many trials.
    Unsupported,
}

impl CurrentPlan {
    /// A plan; `start` is the state that it was made for, where it is known.
    pub(super) fn new(
        task: &Task,
        start: Option<&[u64]>,
        operators: Arc<[u32]>,
        costs: Arc<[u64]>,
        proven_optimal: bool,
    ) -> Self {
        let mut suffix_costs = vec![(0_u64, 0_u64); operators.len() + 1];
        for (idx, &operator) in operators.iter().enumerate().rev() {
            let (plain, penalised) = suffix_costs[idx + 1];
            let operator = operator as usize;
            suffix_costs[idx] = (
                plain.saturating_add(task.operators()[operator].cost()),
                penalised.saturating_add(costs[operator]),
            );
        }
        let trajectory = start.map(|start| Trajectory::new(task, start, &operators));
        let suffixes = Suffixes::new(task, &operators);
        Self { operators, costs, proven_optimal, suffix_costs, trajectory, suffixes }
    }

    /// The step that is next in this state, when the plan passes it.
    pub(super) fn on_trajectory(&self, state: &[u64]) -> Option<usize> {
        let trajectory = self.trajectory.as_ref()?;
        let number = trajectory.states.find(state)?;
        Some(trajectory.memos[number as usize] as usize)
    }

    /// The shortest suffix that leads from this state to the goal.
    pub(super) fn valid_suffix(&self, task: &Task, state: &[u64]) -> SuffixFound {
        let n_steps = self.operators.len();
        let first = self.suffixes.first.min(n_steps);
        if let Some(at) = (first..n_steps).rev().find(|&at| self.suffixes.hold(at, state)) {
            return SuffixFound::At(at);
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
                    return SuffixFound::At(at);
                }
                if step >= first || !self.operator(task, step).applicable(&now) {
                    break;
                }
                trials += 1;
                if trials > TRIALS_MAX {
                    return SuffixFound::Unsupported;
                }
                task.apply(self.operator(task, step), &now, &mut after);
                std::mem::swap(&mut now, &mut after);
            }
        }
        SuffixFound::None
    }

    fn operator<'t>(&self, task: &'t Task, step: usize) -> &'t Operator {
        &task.operators()[self.operators[step] as usize]
    }
}

/// Whether operators lead from a state to the goal; if not, the first step that is not applicable,
/// or how many steps there are when the goal is missed.
pub(super) fn leads_to_goal(task: &Task, start: &[u64], operators: &[u32]) -> Result<(), usize> {
    let (mut now, mut after) = (start.to_vec(), Vec::new());
    for (idx, &operator) in operators.iter().enumerate() {
        let operator = &task.operators()[operator as usize];
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
        let mut states = StateRegistry::new(task.words());
        let mut memos = Vec::with_capacity(operators.len() + 1);
        let (mut now, mut after) = (start.to_vec(), Vec::new());
        for memo in 0..=operators.len() {
            let (number, is_new) = states.insert(&now);
            if is_new {
                memos.push(memo as u32);
            } else {
                memos[number as usize] = memo as u32;
            }
            if let Some(&operator) = operators.get(memo) {
                task.apply(&task.operators()[operator as usize], &now, &mut after);
                std::mem::swap(&mut now, &mut after);
            }
        }
        Self { states, memos }
    }
}

impl Suffixes {
    /// Regresses the goal through the plan, from its end, up to the first operator whose condition
    /// or effect is more than a conjunction.
    fn new(task: &Task, operators: &[u32]) -> Self {
        let n_steps = operators.len();
        let mut suffixes = Self { words: task.words(), first: n_steps + 1, conditions: Vec::new() };
        let Some(goal) = task.goal_literals() else { return suffixes };
        let mut condition = vec![(0, 0); task.words()];
        require(&mut condition, goal);
        suffixes.conditions.reserve((n_steps + 1) * task.words());
        suffixes.conditions.extend_from_slice(&condition);
        suffixes.first = n_steps;
        for (idx, &operator) in operators.iter().enumerate().rev() {
            if !regress(&mut condition, &task.operators()[operator as usize]) {
                break;
            }
            suffixes.conditions.extend_from_slice(&condition);
            suffixes.first = idx;
        }
        suffixes
    }

    /// Whether the suffix that starts with step `at` leads from a state to the goal.
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
    let Some(precondition) = operator.literals() else { return false };
    let Some((set, clear)) = operator.unconditional_changes() else { return false };
    for (word, bits) in set {
        let (care, value) = &mut condition[word as usize];
        if *value & bits != *care & bits {
            return false;
        }
        *care &= !bits;
        *value &= !bits;
    }
    // What is added as well was taken out above: adding wins.
    for (word, bits) in clear {
        let (care, value) = &mut condition[word as usize];
        if *value & bits != 0 {
            return false;
        }
        *care &= !bits;
    }
    require(condition, precondition)
}

/// Adds literals to a condition; `false` when they contradict it.
fn require(condition: &mut [(u64, u64)], literals: &[LiteralMask]) -> bool {
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
