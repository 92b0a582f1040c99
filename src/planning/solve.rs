//! Which searches answer a planning call, and in which order.

use std::collections::{BTreeMap, BTreeSet};

use super::heuristics::{Blind, FastForward, Heuristic, Landmarks, LmCut, Max, Patterns, Prepared};
use super::search::{self, AStar, End, Limits};
use super::task::Task;
use super::task::formula::Formula;
use super::{Answer, Budget, OptimalHeuristic, Outcome, Phase, Plan, Proof, Statistics};
use crate::pddl::{Atom, Step};

/// Name of the limit when a search was interrupted from outside.
pub(crate) const INTERRUPTED: &str = "deadline_ms";

/// The answer of the searches over packed states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SearchAnswer {
    /// How it ended.
    pub(crate) end: SearchEnd,
    /// No plan is cheaper than this; 0 when nothing is known.
    pub(crate) lower_bound: u64,
    /// One entry for each search that ran.
    pub(crate) phases: Vec<Phase>,
}

/// How the searches over packed states ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum SearchEnd {
    /// A plan.
    Found {
        /// Numbers of the operators, in order.
        operators: Vec<u32>,
        /// Sum of the costs that were handed in.
        cost: u64,
        /// Whether no plan is cheaper.
        proven_optimal: bool,
    },
    /// There is no plan.
    Exhausted {
        /// Why that is certain.
        proof: Proof,
    },
    /// A limit was met, or the search was interrupted ([`INTERRUPTED`]).
    OutOfBudget {
        /// Name of the limit.
        limit: &'static str,
        /// Its value.
        value: u64,
    },
}

impl Task {
    /// Plans from `init` within the task; see [`super::plan()`].
    ///
    /// `interrupt` is asked now and then; once it says yes, the call ends with the plan that it
    /// has, or out of budget.
    pub fn solve(
        &self,
        init: &BTreeSet<Atom>,
        penalties: &BTreeMap<Step, u32>,
        budget: &Budget,
        interrupt: &dyn Fn() -> bool,
    ) -> Answer {
        let penalties = self.penalties(penalties);
        let costs = self.costs(&penalties);
        let answer = self.search_from(&self.state(init), &costs, budget, interrupt);
        let statistics = Statistics {
            n_atoms: self.n_atoms(),
            n_actions: self.n_actions(),
            lower_bound: answer.lower_bound,
            phases: answer.phases,
        };
        let outcome = match answer.end {
            SearchEnd::Exhausted { proof } => Outcome::Unsolvable { proof },
            SearchEnd::OutOfBudget { limit, value } => Outcome::OutOfBudget { limit, value },
            SearchEnd::Found { operators, proven_optimal, .. } => {
                let sum = |value: &dyn Fn(u32) -> u64| {
                    operators.iter().fold(0, |sum: u64, &a| sum.saturating_add(value(a)))
                };
                Outcome::Solved(Plan {
                    steps: operators
                        .iter()
                        .map(|&a| self.operators[a as usize].step.clone())
                        .collect(),
                    cost: sum(&|a| self.operators[a as usize].cost),
                    cost_scale: self.cost_scale,
                    penalty: sum(&|a| penalties[a as usize]),
                    lower_bound: answer.lower_bound,
                    proven_optimal,
                })
            }
        };
        Answer { outcome, statistics }
    }

    /// The penalty of each operator, in units of cost.
    pub(crate) fn penalties(&self, penalties: &BTreeMap<Step, u32>) -> Vec<u64> {
        let penalty = |step: &Step| {
            u64::from(penalties.get(step).copied().unwrap_or(0)).saturating_mul(self.cost_scale)
        };
        self.operators.iter().map(|o| penalty(&o.step)).collect()
    }

    /// What each operator costs, penalty included.
    pub(crate) fn costs(&self, penalties: &[u64]) -> Vec<u64> {
        let operators = self.operators.iter().zip(penalties);
        operators.map(|(o, p)| o.cost.saturating_add(*p)).collect()
    }

    /// Plans from a packed state, completed by the axioms, with the given cost of each operator.
    pub(crate) fn search_from(
        &self,
        state: &[u64],
        costs: &[u64],
        budget: &Budget,
        interrupt: &dyn Fn() -> bool,
    ) -> SearchAnswer {
        let mut call = Call { task: self, state, costs, budget, interrupt, phases: Vec::new() };
        let (end, lower_bound) = if self.goal == Formula::False {
            (SearchEnd::Exhausted { proof: Proof::GoalFalse }, u64::MAX)
        } else if self.is_goal(state) {
            (SearchEnd::Found { operators: Vec::new(), cost: 0, proven_optimal: true }, 0)
        } else {
            let (end, lower_bound) = if budget.optimal_expansions_max > 0 {
                call.optimal()
            } else {
                (SearchEnd::OutOfBudget { limit: OPTIMAL, value: 0 }, 0)
            };
            match end {
                SearchEnd::OutOfBudget { limit, .. }
                    if limit != INTERRUPTED && budget.greedy_expansions_max > 0 =>
                {
                    call.satisficing(lower_bound)
                }
                SearchEnd::Found { .. }
                | SearchEnd::Exhausted { .. }
                | SearchEnd::OutOfBudget { .. } => (end, lower_bound),
            }
        };
        let mut end = end;
        if let SearchEnd::Found { cost, proven_optimal, .. } = &mut end {
            *proven_optimal |= *cost <= lower_bound;
        }
        SearchAnswer { end, lower_bound, phases: call.phases }
    }
}

/// Name of the limit of the optimal searches.
const OPTIMAL: &str = "optimal_expansions_max";
/// How many states the blind search may expand before LM-cut is tried too: some 50 ms.
const BLIND_FIRST: u64 = 64_000;
/// About how many expansions of the blind search take as long as one with LM-cut.
const BLIND_PER_CUT: u64 = 32;

/// Builds a heuristic from a task and the actions' costs.
type Build = for<'a> fn(&'a Task, &[u64]) -> Box<dyn Heuristic + 'a>;

const BLIND: (&str, Build) = ("astar blind", |task, costs| Box::new(Blind::new(task, costs)));
const MAX: (&str, Build) = ("astar max", |task, costs| Box::new(Max::new(task, costs)));
const LM_CUT: (&str, Build) = ("astar lm-cut", |task, costs| Box::new(LmCut::new(task, costs)));
const PATTERNS: (&str, Build) = ("astar patterns", |task, costs| match Prepared::databases(task) {
    Some(databases) => Box::new(Patterns(databases)),
    None => Box::new(Blind::new(task, costs)),
});

/// One planning call.
struct Call<'a> {
    task: &'a Task,
    state: &'a [u64],
    costs: &'a [u64],
    budget: &'a Budget,
    interrupt: &'a dyn Fn() -> bool,
    phases: Vec<Phase>,
}

impl<'a> Call<'a> {
    fn limits(&self, expansions_name: &'static str, expansions_max: u64) -> Limits<'a> {
        let Budget { states_max, bytes_max, .. } = *self.budget;
        let interrupt = self.interrupt;
        Limits { expansions_name, expansions_max, states_max, bytes_max, interrupt }
    }

    /// A cheapest plan, and a lower bound.
    fn optimal(&mut self) -> (SearchEnd, u64) {
        let expansions_max = self.budget.optimal_expansions_max;
        let mut searches = match self.budget.optimal_heuristic {
            OptimalHeuristic::Auto | OptimalHeuristic::Blind => vec![self.astar(&BLIND)],
            OptimalHeuristic::Max => vec![self.astar(&MAX)],
            OptimalHeuristic::LmCut => vec![self.astar(&LM_CUT)],
            OptimalHeuristic::Patterns => match Prepared::databases(self.task) {
                Some(_) => vec![self.astar(&PATTERNS)],
                None => vec![self.astar(&BLIND)],
            },
        };
        let end = if self.budget.optimal_heuristic == OptimalHeuristic::Auto {
            self.take_turns(&mut searches, expansions_max)
        } else {
            searches[0].run(expansions_max)
        };
        let end = match end {
            End::Limit(OPTIMAL, _) => End::Limit(OPTIMAL, expansions_max),
            other @ (End::Found(_) | End::Exhausted(_) | End::Limit(..)) => other,
        };
        let lower_bound = searches.iter().map(AStar::lower_bound).max().unwrap_or(0);
        // The one that ends the call comes last.
        self.phases.extend(searches.iter().map(AStar::phase));
        (self.end(end, true), lower_bound)
    }

    /// The blind search and, when it takes long, LM-cut beside it. Both keep what they have done.
    fn take_turns(&self, searches: &mut Vec<AStar<'a>>, expansions_max: u64) -> End {
        let mut blind_max = BLIND_FIRST.min(expansions_max);
        let mut cut_max = 0;
        loop {
            let end = searches[0].run(blind_max);
            let is_pause = matches!(end, End::Limit(OPTIMAL, _));
            if !is_pause || blind_max + cut_max >= expansions_max {
                return end;
            }
            if searches.len() == 1 {
                searches.push(self.astar(&LM_CUT));
            }
            cut_max = (blind_max / BLIND_PER_CUT).min(expansions_max - blind_max);
            let end = searches[1].run(cut_max);
            let is_pause = matches!(end, End::Limit(OPTIMAL, _));
            if !is_pause || blind_max + cut_max >= expansions_max {
                return end;
            }
            blind_max = (blind_max * 2).min(expansions_max - cut_max);
        }
    }

    fn astar(&self, (name, build): &(&'static str, Build)) -> AStar<'a> {
        let limits = self.limits(OPTIMAL, self.budget.optimal_expansions_max);
        let heuristic = (*name, build(self.task, self.costs));
        AStar::new(self.task, self.state, self.costs, heuristic, limits)
    }

    /// Any plan.
    fn satisficing(&mut self, mut lower_bound: u64) -> (SearchEnd, u64) {
        let limits = self.limits("greedy_expansions_max", self.budget.greedy_expansions_max);
        // One more for each step, so that free actions are not free to pile up.
        let costs = self.costs.iter().map(|c| c.saturating_add(1)).collect();
        let mut heuristic = FastForward::new(self.task, costs);
        let landmarks = Landmarks::new(self.task, self.state);
        let (end, phase) = search::greedy(self.task, self.state, &mut heuristic, landmarks, limits);
        self.phases.push(phase);
        let end = match end {
            End::Found(plan) => {
                let plan = search::shorten(self.task, self.state, plan);
                End::Found(self.improved(plan, &mut lower_bound))
            }
            other @ (End::Exhausted(_) | End::Limit(..)) => other,
        };
        (self.end(end, false), lower_bound)
    }

    /// The plan or a cheaper one, unless it is known to be cheapest.
    fn improved(&mut self, plan: Vec<u32>, lower_bound: &mut u64) -> Vec<u32> {
        let expansions_max = self.budget.improve_expansions_max;
        if expansions_max == 0 || (self.interrupt)() {
            return plan;
        }
        let estimate = LmCut::new(self.task, self.costs).estimate(self.state);
        *lower_bound = estimate.unwrap_or(0).max(*lower_bound);
        if self.cost(&plan) <= *lower_bound {
            return plan;
        }
        let limits = self.limits("improve_expansions_max", expansions_max);
        let (plan, phase) = search::improve(self.task, self.state, self.costs, plan, limits);
        self.phases.push(phase);
        plan
    }

    fn cost(&self, plan: &[u32]) -> u64 {
        plan.iter().fold(0, |sum, &action| sum.saturating_add(self.costs[action as usize]))
    }

    fn end(&self, end: End, proven_optimal: bool) -> SearchEnd {
        match end {
            // The first state was not even expanded.
            End::Exhausted(1) if self.phases.last().is_some_and(|p| p.expanded == 0) => {
                SearchEnd::Exhausted { proof: Proof::RelaxedUnreachable }
            }
            End::Exhausted(n_states) => {
                SearchEnd::Exhausted { proof: Proof::Exhausted { n_states } }
            }
            End::Limit(limit, value) => SearchEnd::OutOfBudget { limit, value },
            End::Found(operators) => {
                let cost = self.cost(&operators);
                SearchEnd::Found { operators, cost, proven_optimal }
            }
        }
    }
}
