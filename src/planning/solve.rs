//! A task that is planned for again and again: from any of its states, at any prices.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::answer::{COST, Interrupts, SearchAnswer, SearchEnd};
use super::call::{Call, CallAnswer};
use super::solver::Solver;
use super::task::Formula;
use super::{Budget, Outcome, Plan, PlanAnswer, Proof, Statistics};
use crate::pddl::{Atom, Step};

impl Solver {
    /// Plans from `init` within the task; see [`super::plan()`].
    ///
    /// `interrupt` is polled; once it says yes, the call ends with the plan that it has, or with
    /// [`Outcome::Interrupted`].
    pub fn solve(
        &self,
        init: &BTreeSet<Atom>,
        penalties: &BTreeMap<Step, u32>,
        budget: &Budget,
        interrupt: &dyn Fn() -> bool,
    ) -> PlanAnswer {
        let interrupts = Interrupts { proof: interrupt, all: interrupt };
        self.solve_until(init, penalties, budget, interrupts)
    }

    /// As [`Self::solve`], with an interrupt of the search for a cheapest plan of its own.
    pub fn solve_until(
        &self,
        init: &BTreeSet<Atom>,
        penalties: &BTreeMap<Step, u32>,
        budget: &Budget,
        interrupts: Interrupts<'_>,
    ) -> PlanAnswer {
        let task = self.task();
        let penalties = self.penalties(penalties);
        let costs = self.costs(&penalties);
        let answer = self.search_from(&task.state(init), &costs, budget, interrupts);
        let statistics = Statistics {
            n_atoms: task.n_atoms(),
            n_actions: task.n_actions(),
            lower_bound: answer.lower_bound,
            unproven: answer.unproven,
            phases: answer.phases,
            process_cpu_ns: 0,
        };
        let outcome = match answer.end {
            SearchEnd::Exhausted { proof } => Outcome::Unsolvable { proof },
            SearchEnd::OutOfBudget { limit, value } => Outcome::OutOfBudget { limit, value },
            SearchEnd::Interrupted => Outcome::Interrupted,
            SearchEnd::Found { operators, proven_optimal, .. } => {
                let sum = |value: &dyn Fn(u32) -> u64| {
                    operators.iter().fold(0, |sum: u64, &a| sum.saturating_add(value(a)))
                };
                Outcome::Solved(Plan {
                    steps: operators
                        .iter()
                        .map(|&a| task.operators[a as usize].step.clone())
                        .collect(),
                    cost: sum(&|a| task.operators[a as usize].cost),
                    cost_unit: task.cost_unit,
                    penalty: sum(&|a| penalties[a as usize]),
                    lower_bound: answer.lower_bound,
                    proven_optimal,
                })
            }
        };
        PlanAnswer { outcome, statistics }
    }

    /// The penalty of each operator, in units of cost.
    pub(crate) fn penalties(&self, penalties: &BTreeMap<Step, u32>) -> Vec<u64> {
        let penalty = |step: &Step| self.task().penalty(penalties.get(step).copied().unwrap_or(0));
        self.task().operators.iter().map(|o| penalty(&o.step)).collect()
    }

    /// What each operator costs, penalty included.
    pub(crate) fn costs(&self, penalties: &[u64]) -> Vec<u64> {
        let operators = self.task().operators.iter().zip(penalties);
        operators.map(|(o, p)| o.cost.saturating_add(*p)).collect()
    }

    /// Plans from a packed state, completed by the axioms, with the given cost of each operator.
    ///
    /// The searches see costs in lowest terms, so that plans do not depend on the unit of cost.
    pub(crate) fn search_from(
        &self,
        state: &[u64],
        costs: &[u64],
        budget: &Budget,
        interrupts: Interrupts<'_>,
    ) -> SearchAnswer {
        let (costs, unit) = in_lowest_terms(costs);
        let call = Call { solver: self, state, costs: &costs, unit, budget, interrupts };
        let settled =
            |end, lower_bound| CallAnswer { end, lower_bound, unproven: None, phases: Vec::new() };
        let answer = if self.task().goal == Formula::False {
            settled(SearchEnd::Exhausted { proof: Proof::GoalFalse }, u64::MAX)
        } else if self.task().is_goal(state) {
            let proven_optimal = true;
            settled(SearchEnd::Found { operators: Vec::new(), cost: 0, proven_optimal }, 0)
        } else {
            call.answer()
        };
        let CallAnswer { end, lower_bound, unproven, phases } = answer;
        let lower_bound = lower_bound.saturating_mul(unit);
        SearchAnswer { end: in_full(end, unit), lower_bound, unproven, phases }
    }
}

/// Costs divided by their greatest common divisor, and that divisor.
fn in_lowest_terms(costs: &[u64]) -> (Cow<'_, [u64]>, u64) {
    let gcd = |a: u64, b: u64| {
        let (mut a, mut b) = (a, b);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    match costs.iter().fold(0, |a, &b| gcd(a, b)) {
        0 | 1 => (Cow::Borrowed(costs), 1),
        unit => (Cow::Owned(costs.iter().map(|cost| cost / unit).collect()), unit),
    }
}

/// The end of a search over costs that were divided by `unit`.
fn in_full(end: SearchEnd, unit: u64) -> SearchEnd {
    match end {
        SearchEnd::Found { operators, cost, proven_optimal } => match cost.checked_mul(unit) {
            Some(cost) => SearchEnd::Found { operators, cost, proven_optimal },
            None => SearchEnd::OutOfBudget { limit: COST, value: u64::MAX },
        },
        other @ (SearchEnd::Exhausted { .. }
        | SearchEnd::OutOfBudget { .. }
        | SearchEnd::Interrupted) => other,
    }
}
