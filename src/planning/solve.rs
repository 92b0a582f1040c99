//! Which searches answer a planning call, and in which order.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use super::heuristics::{
    Blind, Databases, FastForward, Heuristic, Landmarks, LmCut, Max, Patterns, RelaxedTask,
};
use super::search::{self, AStar, End, Limit, Limits};
use super::task::{Formula, Task};
use super::{Budget, OptimalHeuristic, Outcome, Phase, Plan, PlanAnswer, Proof, Statistics};
use crate::pddl::{Atom, Step};

/// Solves one task again and again, from changing states and at changing prices.
///
/// Owns what heuristics derive from the task: made when first asked for, kept as long as the task.
#[derive(Debug)]
pub struct Solver {
    task: Task,
    relaxed: OnceLock<RelaxedTask>,
    databases: OnceLock<Option<Databases>>,
}

/// The answer of the searches over packed states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SearchAnswer {
    /// A plan as operators, or why there is none.
    pub(crate) end: SearchEnd,
    /// No plan is cheaper than this; 0 when nothing is known.
    pub(crate) lower_bound: u64,
    /// One entry for each search that ran.
    pub(crate) phases: Vec<Phase>,
}

/// How the searches over packed states ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum SearchEnd {
    /// Operators that lead to the goal.
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
    /// A limit was met.
    OutOfBudget {
        /// Its key in [`Budget`].
        limit: &'static str,
        /// What it allows.
        value: u64,
    },
    /// The caller did not want to wait any longer.
    Interrupted,
}

impl Solver {
    /// Solves a task; nothing is computed yet.
    pub fn new(task: Task) -> Self {
        Self { task, relaxed: OnceLock::new(), databases: OnceLock::new() }
    }

    /// What is solved; its states are those that [`Self::solve`] packs.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// The task's delete relaxation.
    pub(super) fn relaxed(&self) -> &RelaxedTask {
        self.relaxed.get_or_init(|| RelaxedTask::new(&self.task))
    }

    /// The task's pattern databases; none where they do not apply.
    fn databases(&self) -> Option<&Databases> {
        self.databases.get_or_init(|| Databases::new(&self.task)).as_ref()
    }

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
        let task = &self.task;
        let penalties = self.penalties(penalties);
        let costs = self.costs(&penalties);
        let answer = self.search_from(&task.state(init), &costs, budget, interrupt);
        let statistics = Statistics {
            n_atoms: task.n_atoms(),
            n_actions: task.n_actions(),
            lower_bound: answer.lower_bound,
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
                    cost_scale: task.cost_scale,
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
        let penalty = |step: &Step| {
            u64::from(penalties.get(step).copied().unwrap_or(0))
                .saturating_mul(self.task.cost_scale)
        };
        self.task.operators.iter().map(|o| penalty(&o.step)).collect()
    }

    /// What each operator costs, penalty included.
    pub(crate) fn costs(&self, penalties: &[u64]) -> Vec<u64> {
        let operators = self.task.operators.iter().zip(penalties);
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
        let mut call = Call { solver: self, state, costs, budget, interrupt, phases: Vec::new() };
        let (end, lower_bound) = if self.task.goal == Formula::False {
            (SearchEnd::Exhausted { proof: Proof::GoalFalse }, u64::MAX)
        } else if self.task.is_goal(state) {
            (SearchEnd::Found { operators: Vec::new(), cost: 0, proven_optimal: true }, 0)
        } else {
            let (end, lower_bound) = if budget.optimal_expansions_max > 0 {
                call.optimal()
            } else {
                (SearchEnd::OutOfBudget { limit: OPTIMAL, value: 0 }, 0)
            };
            match end {
                SearchEnd::OutOfBudget { .. } if budget.greedy_expansions_max > 0 => {
                    call.satisficing(lower_bound)
                }
                SearchEnd::Found { .. }
                | SearchEnd::Exhausted { .. }
                | SearchEnd::OutOfBudget { .. }
                | SearchEnd::Interrupted => (end, lower_bound),
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

/// Builds a heuristic for a task and the actions' costs.
type Build = for<'a> fn(&'a Solver, &[u64]) -> Box<dyn Heuristic + 'a>;

const BLIND: (&str, Build) =
    ("astar blind", |solver, costs| Box::new(Blind::new(&solver.task, costs)));
const MAX: (&str, Build) =
    ("astar max", |solver, costs| Box::new(Max::new(solver.relaxed(), costs)));
const LM_CUT: (&str, Build) =
    ("astar lm-cut", |solver, costs| Box::new(LmCut::new(solver.relaxed(), costs)));
const PATTERNS: (&str, Build) = ("astar patterns", |solver, costs| match solver.databases() {
    Some(databases) => Box::new(Patterns(databases)),
    None => Box::new(Blind::new(&solver.task, costs)),
});

/// One planning call: what it is asked, and what its searches have done so far.
struct Call<'a> {
    solver: &'a Solver,
    state: &'a [u64],
    costs: &'a [u64],
    budget: &'a Budget,
    interrupt: &'a dyn Fn() -> bool,
    phases: Vec<Phase>,
}

impl<'a> Call<'a> {
    fn limits(&self, expansions_max: u64) -> Limits<'a> {
        let Budget { states_max, bytes_max, .. } = *self.budget;
        Limits { expansions_max, states_max, bytes_max, interrupt: self.interrupt }
    }

    /// A cheapest plan, and a lower bound.
    fn optimal(&mut self) -> (SearchEnd, u64) {
        let expansions_max = self.budget.optimal_expansions_max;
        let mut searches = match self.budget.optimal_heuristic {
            OptimalHeuristic::Auto | OptimalHeuristic::Blind => vec![self.astar(&BLIND)],
            OptimalHeuristic::Max => vec![self.astar(&MAX)],
            OptimalHeuristic::LmCut => vec![self.astar(&LM_CUT)],
            OptimalHeuristic::Patterns => match self.solver.databases() {
                Some(_) => vec![self.astar(&PATTERNS)],
                None => vec![self.astar(&BLIND)],
            },
        };
        let end = if self.budget.optimal_heuristic == OptimalHeuristic::Auto {
            self.take_turns(&mut searches, expansions_max)
        } else {
            searches[0].run(expansions_max)
        };
        let lower_bound = searches.iter().map(AStar::lower_bound).max().unwrap_or(0);
        // The one that ends the call comes last.
        self.phases.extend(searches.iter().map(AStar::phase));
        (self.end(end, Ended::Optimal), lower_bound)
    }

    /// The blind search and, when it takes long, LM-cut beside it. Both keep what they have done.
    fn take_turns(&self, searches: &mut Vec<AStar<'a>>, expansions_max: u64) -> End {
        let mut blind_max = BLIND_FIRST.min(expansions_max);
        let mut cut_max = 0;
        loop {
            let end = searches[0].run(blind_max);
            let is_pause = end == End::Limit(Limit::Expansions);
            if !is_pause || blind_max + cut_max >= expansions_max {
                return end;
            }
            if searches.len() == 1 {
                searches.push(self.astar(&LM_CUT));
            }
            cut_max = (blind_max / BLIND_PER_CUT).min(expansions_max - blind_max);
            let end = searches[1].run(cut_max);
            let is_pause = end == End::Limit(Limit::Expansions);
            if !is_pause || blind_max + cut_max >= expansions_max {
                return end;
            }
            blind_max = (blind_max * 2).min(expansions_max - cut_max);
        }
    }

    fn astar(&self, (name, build): &(&'static str, Build)) -> AStar<'a> {
        let limits = self.limits(self.budget.optimal_expansions_max);
        let heuristic = (*name, build(self.solver, self.costs));
        AStar::new(&self.solver.task, self.state, self.costs, heuristic, limits)
    }

    /// Any plan.
    fn satisficing(&mut self, mut lower_bound: u64) -> (SearchEnd, u64) {
        let Solver { task, .. } = self.solver;
        let limits = self.limits(self.budget.greedy_expansions_max);
        // One more for each step, so that free actions are not free to pile up.
        let costs = self.costs.iter().map(|c| c.saturating_add(1)).collect();
        let mut heuristic = FastForward::new(task, self.solver.relaxed(), costs);
        let landmarks = Landmarks::new(self.solver.relaxed(), self.state);
        let (end, phase) = search::greedy(task, self.state, &mut heuristic, landmarks, limits);
        self.phases.push(phase);
        let end = match end {
            End::Found(plan) => {
                let plan = search::shorten(task, self.state, plan);
                End::Found(self.improved(plan, &mut lower_bound))
            }
            other @ (End::Exhausted(_) | End::Limit(_) | End::Interrupted) => other,
        };
        (self.end(end, Ended::Satisficing), lower_bound)
    }

    /// The plan or a cheaper one, unless it is known to be cheapest.
    fn improved(&mut self, plan: Vec<u32>, lower_bound: &mut u64) -> Vec<u32> {
        let expansions_max = self.budget.improve_expansions_max;
        if expansions_max == 0 || (self.interrupt)() {
            return plan;
        }
        let estimate = LmCut::new(self.solver.relaxed(), self.costs).estimate(self.state);
        *lower_bound = estimate.unwrap_or(0).max(*lower_bound);
        if self.cost(&plan) <= *lower_bound {
            return plan;
        }
        let limits = self.limits(expansions_max);
        let task = (&self.solver.task, self.solver.relaxed());
        let (plan, phase) = search::improve(task, self.state, self.costs, plan, limits);
        self.phases.push(phase);
        plan
    }

    fn cost(&self, plan: &[u32]) -> u64 {
        plan.iter().fold(0, |sum, &action| sum.saturating_add(self.costs[action as usize]))
    }

    fn end(&self, end: End, ended: Ended) -> SearchEnd {
        match end {
            // The first state was not even expanded.
            End::Exhausted(1) if self.phases.last().is_some_and(|p| p.expanded == 0) => {
                SearchEnd::Exhausted { proof: Proof::RelaxedUnreachable }
            }
            End::Exhausted(n_states) => {
                SearchEnd::Exhausted { proof: Proof::Exhausted { n_states } }
            }
            End::Limit(limit) => {
                let (limit, value) = ended.limit(limit, self.budget);
                SearchEnd::OutOfBudget { limit, value }
            }
            End::Interrupted => SearchEnd::Interrupted,
            End::Found(operators) => {
                let cost = self.cost(&operators);
                SearchEnd::Found { operators, cost, proven_optimal: ended == Ended::Optimal }
            }
        }
    }
}

/// Which kind of search has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ended {
    Optimal,
    Satisficing,
}

impl Ended {
    /// Name and value of a limit that was met.
    fn limit(self, limit: Limit, budget: &Budget) -> (&'static str, u64) {
        match (limit, self) {
            (Limit::Expansions, Self::Optimal) => (OPTIMAL, budget.optimal_expansions_max),
            (Limit::Expansions, Self::Satisficing) => {
                ("greedy_expansions_max", budget.greedy_expansions_max)
            }
            (Limit::States, _) => ("states_max", budget.states_max as u64),
            (Limit::Bytes, _) => ("bytes_max", budget.bytes_max as u64),
        }
    }
}
