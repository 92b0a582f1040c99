//! What is known for one set of objects and static facts.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::CascadeSettings;
use super::current_plan::{CurrentPlan, SuffixFound, leads_to_goal};
use super::distance_table::{Distance, DistanceTable};
use super::observed_task::ObservedTask;
use super::reply::{CascadeEnd, PlanSuffix};
use crate::messages::{PlanSource, Reuse};
use crate::pddl::Step;
use crate::planning::{Operator, Outcome, Proof};

/// What is known for one set of objects and static facts.
#[derive(Debug, Clone)]
pub(super) struct TaskMemo {
    pub(super) observed_task: Arc<ObservedTask>,
    pub(super) penalised: PenalisedCosts,
    pub(super) current_plan: Option<Arc<CurrentPlan>>,
    /// The plan that becomes the current one; its trajectory is not made yet.
    fresh: Option<NewPlan>,
    pub(super) table: Option<Arc<DistanceTable>>,
    /// A table was too large: nothing is added any more.
    pub(super) table_is_full: bool,
}

/// Costs of operators, with penalties for what has failed.
#[derive(Debug, Clone)]
pub(super) struct PenalisedCosts {
    failures: BTreeMap<Step, u32>,
    pub(super) costs: Arc<[u64]>,
}

#[derive(Debug, Clone)]
struct NewPlan {
    start: Vec<u64>,
    operators: Arc<[u32]>,
    proven_optimal: bool,
}

impl TaskMemo {
    pub(super) fn new(observed_task: ObservedTask) -> Self {
        let costs = observed_task.task().operators().iter().map(Operator::cost).collect();
        Self {
            observed_task: Arc::new(observed_task),
            penalised: PenalisedCosts { failures: BTreeMap::new(), costs },
            current_plan: None,
            fresh: None,
            table: None,
            table_is_full: false,
        }
    }

    /// What the memo of another task needs to go on: failures and the steps of the current plan.
    pub(super) fn hand_over(&mut self) -> (BTreeMap<Step, u32>, Vec<Step>) {
        self.prepare();
        let current_plan = self.current_plan.as_ref().filter(|f| self.is_priced_by(&f.costs));
        let steps =
            current_plan.map(|current_plan| self.observed_task.steps_of(&current_plan.operators));
        (self.penalised.failures.clone(), steps.unwrap_or_default())
    }

    /// Follows the plan of another task, if all its steps exist here, too.
    pub(super) fn follow(&mut self, steps: &[Step]) {
        self.prepare();
        if steps.is_empty() {
            return;
        }
        let operators = steps.iter().map(|step| self.observed_task.operator(step));
        let Some(operators) = operators.collect::<Option<Arc<[u32]>>>() else { return };
        let is_own =
            |own: &Arc<CurrentPlan>| own.operators == operators && self.is_priced_by(&own.costs);
        if !self.current_plan.as_ref().is_some_and(is_own) {
            let costs = Arc::clone(&self.penalised.costs);
            let current_plan =
                CurrentPlan::new(self.observed_task.task(), None, operators, costs, false);
            self.current_plan = Some(Arc::new(current_plan));
        }
    }

    /// Prices the operators.
    pub(super) fn penalise(&mut self, failures: &BTreeMap<Step, u32>, penalty: u32) {
        if self.penalised.failures == *failures {
            return;
        }
        let task = self.observed_task.task();
        let mut costs: Vec<u64> = task.operators().iter().map(Operator::cost).collect();
        for (step, &n) in failures {
            if let Some(operator) = self.observed_task.operator(step) {
                let penalty = u64::from(n) * u64::from(penalty);
                let penalty = penalty.saturating_mul(task.penalty(1));
                let cost = &mut costs[operator as usize];
                *cost = cost.saturating_add(penalty);
            }
        }
        if *costs != *self.penalised.costs {
            self.penalised.costs = costs.into();
        }
        self.penalised.failures.clone_from(failures);
    }

    pub(super) fn prepare(&mut self) {
        let Some(NewPlan { start, operators, proven_optimal }) = self.fresh.take() else { return };
        let costs = Arc::clone(&self.penalised.costs);
        let task = self.observed_task.task();
        let current_plan = CurrentPlan::new(task, Some(&start), operators, costs, proven_optimal);
        self.current_plan = Some(Arc::new(current_plan));
    }

    /// The table, when it was built with the present costs.
    pub(super) fn current_table(&self) -> Option<&Arc<DistanceTable>> {
        self.table.as_ref().filter(|table| self.is_priced_by(&table.costs))
    }

    /// The suffix of the current plan that the settings allow to keep. Once a step has failed, a
    /// plan that was made before is not kept.
    pub(super) fn keep(
        &self,
        state: &[u64],
        settings: &CascadeSettings,
    ) -> Option<(PlanSource, CascadeEnd)> {
        let current_plan = self.current_plan.as_ref()?;
        if !self.is_priced_by(&current_plan.costs) {
            return None;
        }
        let (source, at) = self.valid_suffix(state, settings)?;
        let (cost, penalised) = current_plan.suffix_costs[at];
        let on_optimal = current_plan.proven_optimal && source == PlanSource::Trajectory;
        let proven_optimal = on_optimal || {
            let table =
                self.current_table().filter(|_| settings.sources.contains(&PlanSource::Table));
            let distance = table.and_then(|table| table.distance(state));
            distance == Some(Distance::Cost(penalised))
        };
        let operators = Arc::clone(&current_plan.operators);
        let suffix = PlanSuffix { operators, at, cost, proven_optimal };
        (settings.reuse == Reuse::Valid || proven_optimal)
            .then_some((source, CascadeEnd::Plan(suffix)))
    }

    /// Whether these are the present costs.
    pub(super) fn is_priced_by(&self, costs: &Arc<[u64]>) -> bool {
        Arc::ptr_eq(costs, &self.penalised.costs) || *costs == self.penalised.costs
    }

    /// A suffix of the current plan that leads from the state to the goal.
    pub(super) fn valid_suffix(
        &self,
        state: &[u64],
        settings: &CascadeSettings,
    ) -> Option<(PlanSource, usize)> {
        let current_plan = self.current_plan.as_ref()?;
        let on = |source: PlanSource| settings.sources.contains(&source);
        if on(PlanSource::Trajectory)
            && let Some(at) = current_plan.on_trajectory(state)
        {
            return Some((PlanSource::Trajectory, at));
        }
        if !on(PlanSource::Suffix) {
            return None;
        }
        match current_plan.valid_suffix(self.observed_task.task(), state) {
            SuffixFound::At(at) => Some((PlanSource::Suffix, at)),
            SuffixFound::None | SuffixFound::Unsupported => None,
        }
    }

    /// Penalised cost of a suffix of the current plan at present prices.
    pub(super) fn price(&self, at: usize) -> u64 {
        let operators =
            self.current_plan.iter().flat_map(|current_plan| &current_plan.operators[at..]);
        let costs = operators.map(|&operator| self.penalised.costs[operator as usize]);
        costs.fold(0, u64::saturating_add)
    }

    /// Makes a suffix of the current plan the current plan, at present prices.
    pub(super) fn adopt_suffix(
        &mut self,
        state: &[u64],
        at: usize,
        proven_optimal: bool,
    ) -> CascadeEnd {
        let suffix =
            self.current_plan.as_ref().map(|current_plan| Arc::from(&current_plan.operators[at..]));
        self.adopt(state, suffix.unwrap_or_default(), proven_optimal)
    }

    /// What the distance table says.
    pub(super) fn look_up(
        &mut self,
        state: &[u64],
        settings: &CascadeSettings,
    ) -> Option<(PlanSource, CascadeEnd)> {
        let table =
            self.current_table().filter(|_| settings.sources.contains(&PlanSource::Table))?;
        let end = match table.plan(state)? {
            (Distance::Cost(_), operators) => self.adopt(state, operators.into(), true),
            (Distance::Dead, _) => {
                let proof = Proof::Exhausted { n_states: table.n_states() };
                CascadeEnd::NoPlan(Outcome::Unsolvable { proof })
            }
        };
        Some((PlanSource::Table, end))
    }

    /// Makes a new plan from this state the current plan.
    pub(super) fn adopt(
        &mut self,
        state: &[u64],
        operators: Arc<[u32]>,
        proven_optimal: bool,
    ) -> CascadeEnd {
        let start = state.to_vec();
        self.fresh = Some(NewPlan { start, operators: Arc::clone(&operators), proven_optimal });
        let costs =
            operators.iter().map(|&o| self.observed_task.task().operators()[o as usize].cost());
        let cost = costs.fold(0, u64::saturating_add);
        CascadeEnd::Plan(PlanSuffix { operators, at: 0, cost, proven_optimal })
    }

    /// The operators of a plan that somebody has found, and their penalised cost.
    pub(super) fn checked(&self, steps: &[Step], state: &[u64]) -> Result<(Vec<u32>, u64), String> {
        let operator = |step: &Step| {
            self.observed_task
                .operator(step)
                .ok_or_else(|| format!("{step} is no step of this task"))
        };
        let operators = steps.iter().map(operator).collect::<Result<Vec<u32>, _>>()?;
        match leads_to_goal(self.observed_task.task(), state, &operators) {
            Ok(()) => {
                let costs = operators.iter().map(|&o| self.penalised.costs[o as usize]);
                let cost = costs.fold(0, u64::saturating_add);
                Ok((operators, cost))
            }
            Err(idx) => Err(match steps.get(idx) {
                Some(step) => format!("step {} of the plan, {step}, is not possible", idx + 1),
                None => "the plan does not lead to the goal".to_owned(),
            }),
        }
    }
}
