//! What is known for one set of objects and static facts.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::LadderSettings;
use super::followed::{Followed, RestFound, leads_to_goal};
use super::ground::Ground;
use super::reply::{End, Rest};
use super::table::{Distance, Table};
use crate::messages::{Reuse, Rung};
use crate::pddl::Step;
use crate::planning::{Outcome, Proof};

/// What is known for one set of objects and static facts.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) ground: Arc<Ground>,
    pub(super) penalised: Penalised,
    pub(super) followed: Option<Arc<Followed>>,
    /// A plan that is to be followed from a state; its trajectory is not made yet.
    fresh: Option<Fresh>,
    pub(super) table: Option<Arc<Table>>,
    /// A table was too large: nothing is added any more.
    pub(super) table_is_full: bool,
}

/// Costs of operators, with penalties for what has failed.
#[derive(Debug, Clone)]
pub(super) struct Penalised {
    failures: BTreeMap<Step, u32>,
    pub(super) costs: Arc<[u64]>,
}

#[derive(Debug, Clone)]
struct Fresh {
    start: Vec<u64>,
    operators: Arc<[u32]>,
    proven_optimal: bool,
}

impl Place {
    pub(super) fn new(ground: Ground) -> Self {
        let costs = ground.task.operators.iter().map(|operator| operator.cost).collect();
        Self {
            ground: Arc::new(ground),
            penalised: Penalised { failures: BTreeMap::new(), costs },
            followed: None,
            fresh: None,
            table: None,
            table_is_full: false,
        }
    }

    /// What another place needs to go on: failures and the steps of the followed plan.
    pub(super) fn hand_on(&mut self) -> (BTreeMap<Step, u32>, Vec<Step>) {
        self.prepare();
        let followed = self.followed.as_ref().filter(|f| self.is_priced_by(&f.costs));
        let steps = followed.map(|followed| self.ground.steps_of(&followed.operators));
        (self.penalised.failures.clone(), steps.unwrap_or_default())
    }

    /// Follows a plan of another place, if all its steps exist here, too.
    pub(super) fn follow(&mut self, steps: &[Step]) {
        self.prepare();
        if steps.is_empty() {
            return;
        }
        let operators = steps.iter().map(|step| self.ground.operator(step));
        let Some(operators) = operators.collect::<Option<Arc<[u32]>>>() else { return };
        let is_own =
            |own: &Arc<Followed>| own.operators == operators && self.is_priced_by(&own.costs);
        if !self.followed.as_ref().is_some_and(is_own) {
            let costs = Arc::clone(&self.penalised.costs);
            let followed = Followed::new(&self.ground.task, None, operators, costs, false);
            self.followed = Some(Arc::new(followed));
        }
    }

    /// Prices the operators.
    pub(super) fn penalise(&mut self, failures: &BTreeMap<Step, u32>, penalty: u32) {
        if self.penalised.failures == *failures {
            return;
        }
        let task = &self.ground.task;
        let mut costs: Vec<u64> = task.operators.iter().map(|operator| operator.cost).collect();
        for (step, &n) in failures {
            if let Some(operator) = self.ground.operator(step) {
                let penalty = u64::from(n) * u64::from(penalty);
                let penalty = penalty.saturating_mul(task.cost_scale);
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
        let Some(Fresh { start, operators, proven_optimal }) = self.fresh.take() else { return };
        let costs = Arc::clone(&self.penalised.costs);
        let task = &self.ground.task;
        let followed = Followed::new(task, Some(&start), operators, costs, proven_optimal);
        self.followed = Some(Arc::new(followed));
    }

    /// The table, when it was built with the present costs.
    pub(super) fn current_table(&self) -> Option<&Arc<Table>> {
        self.table.as_ref().filter(|table| self.is_priced_by(&table.costs))
    }

    /// The rest of the followed plan that the settings allow to keep. Once a step has failed, a
    /// plan that was made before is not kept.
    pub(super) fn keep(&self, state: &[u64], settings: &LadderSettings) -> Option<(Rung, End)> {
        let followed = self.followed.as_ref()?;
        if !self.is_priced_by(&followed.costs) {
            return None;
        }
        let (rung, at) = self.valid_rest(state, settings)?;
        let (cost, penalised) = followed.rest_costs[at];
        let on_optimal = followed.proven_optimal && rung == Rung::Trajectory;
        let proven_optimal = on_optimal || {
            let table = self.current_table().filter(|_| settings.rungs.contains(&Rung::Table));
            let distance = table.and_then(|table| table.distance(state));
            distance == Some(Distance::Cost(penalised))
        };
        let operators = Arc::clone(&followed.operators);
        let rest = Rest { operators, at, cost, proven_optimal };
        (settings.reuse == Reuse::Valid || proven_optimal).then_some((rung, End::Plan(rest)))
    }

    /// Whether these are the present costs.
    pub(super) fn is_priced_by(&self, costs: &Arc<[u64]>) -> bool {
        Arc::ptr_eq(costs, &self.penalised.costs) || *costs == self.penalised.costs
    }

    /// A rest of the followed plan that leads from the state to the goal.
    pub(super) fn valid_rest(
        &self,
        state: &[u64],
        settings: &LadderSettings,
    ) -> Option<(Rung, usize)> {
        let followed = self.followed.as_ref()?;
        let on = |rung: Rung| settings.rungs.contains(&rung);
        if on(Rung::Trajectory)
            && let Some(at) = followed.on_trajectory(state)
        {
            return Some((Rung::Trajectory, at));
        }
        if !on(Rung::Suffix) {
            return None;
        }
        match followed.valid_rest(&self.ground.task, state) {
            RestFound::At(at) => Some((Rung::Suffix, at)),
            RestFound::None | RestFound::Unsupported => None,
        }
    }

    /// Penalised cost of a rest of the followed plan at present prices.
    pub(super) fn price(&self, at: usize) -> u64 {
        let operators = self.followed.iter().flat_map(|followed| &followed.operators[at..]);
        let costs = operators.map(|&operator| self.penalised.costs[operator as usize]);
        costs.fold(0, u64::saturating_add)
    }

    /// Follows a rest of the followed plan, at present prices.
    pub(super) fn set_out_again(&mut self, state: &[u64], at: usize, proven_optimal: bool) -> End {
        let rest = self.followed.as_ref().map(|followed| Arc::from(&followed.operators[at..]));
        self.set_out(state, rest.unwrap_or_default(), proven_optimal)
    }

    /// What the distance table says.
    pub(super) fn look_up(
        &mut self,
        state: &[u64],
        settings: &LadderSettings,
    ) -> Option<(Rung, End)> {
        let table = self.current_table().filter(|_| settings.rungs.contains(&Rung::Table))?;
        let end = match table.plan(state)? {
            (Distance::Cost(_), operators) => self.set_out(state, operators.into(), true),
            (Distance::Dead, _) => {
                let proof = Proof::Exhausted { n_states: table.n_states() };
                End::NoPlan(Outcome::Unsolvable { proof })
            }
        };
        Some((Rung::Table, end))
    }

    /// Follows a new plan from a state.
    pub(super) fn set_out(
        &mut self,
        state: &[u64],
        operators: Arc<[u32]>,
        proven_optimal: bool,
    ) -> End {
        let start = state.to_vec();
        self.fresh = Some(Fresh { start, operators: Arc::clone(&operators), proven_optimal });
        let costs = operators.iter().map(|&o| self.ground.task.operators[o as usize].cost);
        let cost = costs.fold(0, u64::saturating_add);
        End::Plan(Rest { operators, at: 0, cost, proven_optimal })
    }

    /// The operators of a plan that somebody has found, and their penalised cost.
    pub(super) fn accept(&self, steps: &[Step], state: &[u64]) -> Result<(Vec<u32>, u64), String> {
        let operator = |step: &Step| {
            self.ground.operator(step).ok_or_else(|| format!("{step} is no step of this task"))
        };
        let operators = steps.iter().map(operator).collect::<Result<Vec<u32>, _>>()?;
        match leads_to_goal(&self.ground.task, state, &operators) {
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
