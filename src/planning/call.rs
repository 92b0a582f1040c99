//! One planning call: which searches run, and how they take turns.
//!
//! A first plan is wanted soon, and a proof is wanted too. Small tasks are proven at once: a blind A*
//! goes first, for as long as nobody notices. Then a greedy search takes turns with it until one of
//! them has a plan, which is then proven to be cheapest, or made cheaper. All turns are counted.

use super::answer::{COST, Interrupts, SearchEnd};
use super::budget::{Budget, OptimalHeuristic};
use super::heuristics::{
    Blind, FastForward, Heuristic, Landmarks, LmCut, Max, Patterns, RelaxedTask,
};
use super::outcome::{Phase, Proof};
use super::search::{self, AStar, End, Greedy, Limit, Limits};
use super::solver::Solver;

/// Name of the limit of the optimal searches.
const OPTIMAL: &str = "optimal_expansions_max";
/// Name of the limit of the search for any plan.
const GREEDY: &str = "greedy_expansions_max";
/// How many states the blind search may expand, and how many elementary steps it may take, before a
/// greedy one is tried too: some 3 ms.
const BLIND_ALONE: u64 = 4_000;
const BLIND_ALONE_WORK: u64 = 400_000;
/// How many states it may expand before LM-cut is tried too: some 50 ms. What it finds until then is
/// taken even where the greedy plan is as cheap: of such plans it is the one with the actions that
/// the domain declares first.
const BLIND_FIRST: u64 = 64_000;
/// How many elementary steps it may take until then.
const BLIND_FIRST_WORK: u64 = 16 * BLIND_ALONE_WORK;
/// About how many expansions of the blind search take as long as one with LM-cut.
const BLIND_PER_CUT: u64 = 32;
/// How many states the greedy search may expand in its first turn.
const GREEDY_FIRST: u64 = 500;

/// One planning call: what it is asked, and what its searches have done so far.
pub(super) struct Call<'a> {
    pub(super) solver: &'a Solver,
    pub(super) state: &'a [u64],
    /// Of each operator, without a common divisor.
    pub(super) costs: &'a [u64],
    /// How many units of the task's costs make 1 of these.
    pub(super) unit: u64,
    pub(super) budget: &'a Budget,
    pub(super) interrupts: Interrupts<'a>,
}

/// What a call comes to, in units of its own costs.
pub(super) struct CallAnswer {
    pub(super) end: SearchEnd,
    pub(super) lower_bound: u64,
    pub(super) unproven: Option<(&'static str, u64)>,
    pub(super) phases: Vec<Phase>,
}

impl<'a> Call<'a> {
    /// A plan, or why there is none.
    pub(super) fn answer(&self) -> CallAnswer {
        let mut proof = Proving::new(self);
        let mut greedy = None;
        let mut improvement = None;
        let end = match self.first(&mut proof, &mut greedy) {
            First::End(end) => end,
            First::Plan(plan) => {
                let plan = search::shorten(self.solver.task(), self.state, plan);
                self.settled(plan, &mut proof, &mut improvement)
            }
        };
        let lower_bound = match end {
            SearchEnd::Exhausted { .. } => u64::MAX,
            SearchEnd::Found { .. } | SearchEnd::OutOfBudget { .. } | SearchEnd::Interrupted => {
                proof.lower_bound()
            }
        };
        let mut phases = proof.phases();
        phases.extend(greedy.map(|greedy: Greedy<'_>| greedy.phase()));
        phases.extend(improvement);
        let proven = matches!(end, SearchEnd::Found { proven_optimal: true, .. });
        let unproven =
            proof.stopped.filter(|_| !proven).and_then(|stop| self.limit_of(stop, OPTIMAL));
        CallAnswer { end, lower_bound, unproven, phases }
    }

    /// Takes turns until there is a plan, or certainty that there is none.
    fn first(&self, proof: &mut Proving<'a>, greedy: &mut Option<Greedy<'a>>) -> First {
        let Budget { optimal_expansions_max, greedy_expansions_max, .. } = *self.budget;
        let alone_max = if greedy_expansions_max == 0 { u64::MAX } else { BLIND_ALONE };
        let alone_work = if greedy_expansions_max == 0 { u64::MAX } else { BLIND_ALONE_WORK };
        if let Some(end) = proof.run(self, alone_max, alone_work) {
            return First::End(end);
        }
        let mut greedy_stopped = None;
        let mut share = GREEDY_FIRST;
        while greedy_expansions_max > 0 && greedy_stopped.is_none() {
            let search = greedy.get_or_insert_with(|| self.greedy());
            match search.run(share.min(greedy_expansions_max)) {
                End::Found(plan) => return First::Plan(plan),
                End::Exhausted(n) => return First::End(exhausted(n, &search.phase())),
                End::Interrupted => return First::End(SearchEnd::Interrupted),
                End::Enough => {}
                End::Limit(Limit::Expansions) if share < greedy_expansions_max => {}
                End::Limit(limit) => {
                    greedy_stopped = Some(Stop::Limit(limit));
                    share = u64::MAX;
                }
            }
            // As much work as the other search.
            let work = if share < u64::MAX { search.work().max(alone_work) } else { u64::MAX };
            if let Some(end) = proof.run(self, optimal_expansions_max, work) {
                return First::End(end);
            }
            share = share.saturating_mul(2);
        }
        let (stop, name) = match greedy_stopped {
            Some(stop) => (stop, GREEDY),
            None => (proof.stopped.unwrap_or(Stop::Limit(Limit::Expansions)), OPTIMAL),
        };
        First::End(match self.limit_of(stop, name) {
            Some((limit, value)) => SearchEnd::OutOfBudget { limit, value },
            None => SearchEnd::Interrupted,
        })
    }

    /// What becomes of a first plan: proven, made cheaper, or both.
    fn settled(
        &self,
        plan: Vec<u32>,
        proof: &mut Proving<'a>,
        improvement: &mut Option<Phase>,
    ) -> SearchEnd {
        let Some(cost) = self.cost(&plan) else {
            return SearchEnd::OutOfBudget { limit: COST, value: u64::MAX };
        };
        if let Some(end) = proof.run(self, BLIND_FIRST, BLIND_FIRST_WORK) {
            return end;
        }
        proof.known(cost);
        let mut plan = plan;
        if self.budget.improve_expansions_max > 0 && !(self.interrupts.all)() {
            let cut = LmCut::new(self.solver.relaxed(), self.costs).estimate(self.state);
            proof.root_bound = cut.unwrap_or(0);
            if !proof.is_enough() {
                let limits = self.limits(self.interrupts.all);
                let expansions_max = self.budget.improve_expansions_max;
                let limits = Limits { expansions_max, ..limits };
                let task = (self.solver.task(), self.solver.relaxed());
                let (better, phase) = search::improve(task, self.state, self.costs, plan, limits);
                plan = better;
                *improvement = Some(phase);
                proof.enough = self.cost(&plan).unwrap_or(cost);
            }
        }
        if let Some(end) = proof.run(self, self.budget.optimal_expansions_max, u64::MAX) {
            return end;
        }
        let proven_optimal = proof.is_enough();
        SearchEnd::Found { operators: plan, cost: proof.enough, proven_optimal }
    }

    fn greedy(&self) -> Greedy<'a> {
        // One more for each step, so that free actions are not free to pile up.
        let costs = self.costs.iter().map(|c| c.saturating_add(1)).collect();
        let (task, relaxed): (_, &'a RelaxedTask) = (self.solver.task(), self.solver.relaxed());
        let heuristic = FastForward::new(task, relaxed, costs);
        let landmarks = Landmarks::new(relaxed, self.state);
        Greedy::new(task, self.state, heuristic, landmarks, self.limits(self.interrupts.all))
    }

    fn limits(&self, interrupt: &'a dyn Fn() -> bool) -> Limits<'a> {
        let Budget { states_max, bytes_max, .. } = *self.budget;
        Limits { expansions_max: 0, work_max: u64::MAX, states_max, bytes_max, interrupt }
    }

    /// What a plan costs; `None` when that is more than can be said.
    fn cost(&self, plan: &[u32]) -> Option<u64> {
        let mut costs = plan.iter().map(|&action| self.costs[action as usize]);
        costs.try_fold(0_u64, u64::checked_add)
    }

    /// Key and value of what stopped a search; `None` for an interrupt.
    fn limit_of(&self, stop: Stop, expansions: &'static str) -> Option<(&'static str, u64)> {
        let limit = match stop {
            Stop::Interrupt => return None,
            Stop::Limit(limit) => limit,
        };
        let budget = self.budget;
        let n_expansions = if expansions == OPTIMAL {
            budget.optimal_expansions_max
        } else {
            budget.greedy_expansions_max
        };
        Some(match limit {
            Limit::Expansions => (expansions, n_expansions),
            Limit::States => ("states_max", budget.states_max as u64),
            Limit::Bytes => ("bytes_max", budget.bytes_max as u64),
            Limit::Cost | Limit::Work => (COST, u64::MAX),
        })
    }
}

/// What the first turns come to.
enum First {
    /// A plan of the greedy search.
    Plan(Vec<u32>),
    /// A cheapest plan, a proof that there is none, or a limit.
    End(SearchEnd),
}

/// Why a search will not go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stop {
    Limit(Limit),
    Interrupt,
}

/// Builds a heuristic for a call.
type Build = for<'a> fn(&Call<'a>) -> Box<dyn Heuristic + 'a>;

const BLIND: (&str, Build) =
    ("astar blind", |call| Box::new(Blind::new(call.solver.task(), call.costs)));
const MAX: (&str, Build) =
    ("astar max", |call| Box::new(Max::new(call.solver.relaxed(), call.costs)));
const LM_CUT: (&str, Build) =
    ("astar lm-cut", |call| Box::new(LmCut::new(call.solver.relaxed(), call.costs)));
const PATTERNS: (&str, Build) = ("astar patterns", |call| match call.solver.databases() {
    Some(databases) => Box::new(Patterns { databases, unit: call.unit }),
    None => Box::new(Blind::new(call.solver.task(), call.costs)),
});

/// The searches for a cheapest plan: one, or a blind one and, when it takes long, LM-cut beside it. All
/// keep what they have done from turn to turn.
struct Proving<'a> {
    searches: Vec<AStar<'a>>,
    /// The blind search goes so far before it is LM-cut's turn.
    blind_max: u64,
    /// What LM-cut was allowed so far.
    cut_max: u64,
    /// Why there will be no further turns.
    stopped: Option<Stop>,
    /// A lower bound from elsewhere.
    root_bound: u64,
    /// What the best plan known costs: once no plan is cheaper, that is proven. `u64::MAX` for none.
    enough: u64,
}

impl<'a> Proving<'a> {
    fn new(call: &Call<'a>) -> Self {
        let (mut searches, mut stopped) = (Vec::new(), None);
        if call.budget.optimal_expansions_max == 0 {
            stopped = Some(Stop::Limit(Limit::Expansions));
        } else {
            searches.push(Self::astar(
                call,
                match call.budget.optimal_heuristic {
                    OptimalHeuristic::Max => &MAX,
                    OptimalHeuristic::LmCut => &LM_CUT,
                    OptimalHeuristic::Patterns if call.solver.databases().is_some() => &PATTERNS,
                    OptimalHeuristic::Auto
                    | OptimalHeuristic::Blind
                    | OptimalHeuristic::Patterns => &BLIND,
                },
            ));
        }
        let (blind_max, cut_max, root_bound, enough) = (BLIND_FIRST, 0, 0, u64::MAX);
        Self { searches, blind_max, cut_max, stopped, root_bound, enough }
    }

    fn astar(call: &Call<'a>, (name, build): &(&'static str, Build)) -> AStar<'a> {
        let heuristic = (*name, build(call));
        let limits = call.limits(call.interrupts.proof);
        AStar::new(call.solver.task(), call.state, call.costs, heuristic, limits)
    }

    /// No plan is cheaper than this.
    fn lower_bound(&self) -> u64 {
        let bounds = self.searches.iter().map(AStar::lower_bound);
        bounds.max().unwrap_or(0).max(self.root_bound)
    }

    /// Whether no plan is cheaper than the best one known.
    fn is_enough(&self) -> bool {
        self.enough < u64::MAX && self.lower_bound() >= self.enough
    }

    fn phases(&self) -> Vec<Phase> {
        self.searches.iter().map(AStar::phase).collect()
    }

    /// Takes note of a plan: proving that no other is cheaper is enough from now on, and LM-cut may help.
    fn known(&mut self, cost: u64) {
        self.enough = cost;
        let expanded = self.searches.first().map_or(0, |blind| blind.phase().expanded);
        self.blind_max = self.blind_max.min(expanded.max(BLIND_PER_CUT));
    }

    /// Goes on until all searches together have expanded so many states, or one has done so much work;
    /// `None` when nothing is decided.
    fn run(&mut self, call: &Call<'a>, expansions_max: u64, work_max: u64) -> Option<SearchEnd> {
        let whole = call.budget.optimal_expansions_max;
        if self.stopped.is_some() || self.is_enough() {
            return None;
        }
        let end = if call.budget.optimal_heuristic == OptimalHeuristic::Auto {
            self.take_turns(call, expansions_max.min(whole), work_max)
        } else {
            self.searches[0].enough = self.enough;
            self.searches[0].run(expansions_max.min(whole), work_max)
        };
        match end {
            End::Found(operators) => {
                // A* has looked whether it can be said.
                let cost = call.cost(&operators).unwrap_or(u64::MAX);
                return Some(SearchEnd::Found { operators, cost, proven_optimal: true });
            }
            End::Exhausted(n) => {
                return Some(exhausted(n, &self.searches[self.searches.len() - 1].phase()));
            }
            End::Interrupted => self.stopped = Some(Stop::Interrupt),
            End::Limit(Limit::Work) | End::Enough => {}
            End::Limit(Limit::Expansions) if expansions_max < whole => {}
            End::Limit(limit) => self.stopped = Some(Stop::Limit(limit)),
        }
        None
    }

    fn take_turns(&mut self, call: &Call<'a>, expansions_max: u64, work_max: u64) -> End {
        loop {
            let blind_max = self.blind_max.min(expansions_max.saturating_sub(self.cut_max));
            self.searches[0].enough = self.enough;
            let end = self.searches[0].run(blind_max, work_max);
            if end != End::Limit(Limit::Expansions) || blind_max < self.blind_max {
                return end;
            }
            if blind_max + self.cut_max >= expansions_max {
                return end;
            }
            if self.searches.len() == 1 {
                self.searches.push(Self::astar(call, &LM_CUT));
            }
            let wanted = blind_max / BLIND_PER_CUT;
            self.cut_max = wanted.min(expansions_max - blind_max).max(self.cut_max);
            self.searches[1].enough = self.enough;
            let end = self.searches[1].run(self.cut_max, work_max);
            let is_pause = end == End::Limit(Limit::Expansions);
            if !is_pause || blind_max + self.cut_max >= expansions_max {
                return end;
            }
            self.blind_max = blind_max * 2;
        }
    }
}

fn exhausted(n_states: usize, phase: &Phase) -> SearchEnd {
    // The first state was not even expanded.
    let proof = if n_states == 1 && phase.expanded == 0 {
        Proof::RelaxedUnreachable
    } else {
        Proof::Exhausted { n_states }
    };
    SearchEnd::Exhausted { proof }
}
