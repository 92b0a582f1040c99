//! Leaves out steps that a plan does not need.
//!
//! Source: Nakhost, Müller: Action elimination and plan neighborhood graph search, 2010.

use crate::planning::task::Task;

/// Longest plan that is looked at; the effort grows with the square of the length.
const STEPS_MAX: usize = 400;

/// The plan without the steps that can go together with all steps that depend on them.
pub(in crate::planning) fn shorten(task: &Task, initial: &[u64], plan: Vec<u32>) -> Vec<u32> {
    if plan.len() > STEPS_MAX {
        return plan;
    }
    let mut plan = plan;
    let (mut state, mut scratch) = (initial.to_vec(), Vec::new());
    let mut at = 0;
    while at < plan.len() {
        if let Some(shorter) = without(task, &state, &plan, at) {
            plan = shorter;
        } else {
            task.apply(&task.operators[plan[at] as usize], &state, &mut scratch);
            std::mem::swap(&mut state, &mut scratch);
            at += 1;
        }
    }
    plan
}

/// The plan without step `at` and the later steps that are then not applicable, if it still reaches
/// the goal; `state` is the one before step `at`.
fn without(task: &Task, state: &[u64], plan: &[u32], at: usize) -> Option<Vec<u32>> {
    let mut kept = plan[..at].to_vec();
    let (mut state, mut scratch) = (state.to_vec(), Vec::new());
    for &action in &plan[at + 1..] {
        let operator = &task.operators[action as usize];
        if operator.applicable(&state) {
            task.apply(operator, &state, &mut scratch);
            std::mem::swap(&mut state, &mut scratch);
            kept.push(action);
        }
    }
    task.is_goal(&state).then_some(kept)
}
