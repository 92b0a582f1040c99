//! The ladder itself: what it remembers, and the order in which its rungs are asked.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::followed::{Followed, RestFound, leads_to_goal};
use super::ground::{Ground, Packed, statics_of};
use super::table::{Distance, Table, TableEnd, TableJob, TableLimits};
use super::{Reuse, Rung};
use crate::pddl::{Atom, Condition, Domain, Name, Step, Typed};
use crate::planning::solve::INTERRUPTED;
use crate::planning::{Answer, GroundingLimits, Outcome, Proof, TaskError};
use crate::scene::Truth;

/// Most tasks that are remembered: one for each set of objects and static facts. Objects that come
/// and go must not make the same task be grounded again and again.
const PLACES_MAX: usize = 4;

/// What does not change while a ladder is used.
#[derive(Debug, Clone)]
pub struct LadderSettings {
    /// When the followed plan is kept.
    pub reuse: Reuse,
    /// The rungs that are switched on; *goal* and *unchanged* always are.
    pub rungs: BTreeSet<Rung>,
    /// Cost that each failure adds to a step.
    pub failure_penalty: u32,
    /// Bounds of all distance tables together.
    pub table: TableLimits,
    /// Bounds of grounding.
    pub grounding: GroundingLimits,
    /// States that are known to be right: what actions suggest to exclude each other counts only
    /// if it does in all of them. Without any, no observation is doubted.
    pub known_right: Vec<BTreeSet<Atom>>,
}

/// Answers the same question again and again, for changing states. A clone is a checkpoint: all
/// that is large is shared.
#[derive(Debug, Clone)]
pub struct Ladder {
    settings: Arc<LadderSettings>,
    domain: Arc<Domain>,
    goal: Arc<Condition>,
    /// What is known for each of the last few sets of objects and static facts, newest first. Empty
    /// before the first observation, and when the first of them could not be grounded.
    places: Vec<Place>,
    /// Why the observed objects and facts could not be grounded.
    ungrounded: Option<Ungrounded>,
    /// Names and types of the objects as they were observed last, in that order.
    objects: Vec<(Name, Name)>,
    observed: Packed,
    /// The last question and its answer.
    last: Option<Last>,
    counters: Counters,
}

/// What is known for one set of objects and static facts.
#[derive(Debug, Clone)]
struct Place {
    ground: Arc<Ground>,
    penalised: Penalised,
    followed: Option<Arc<Followed>>,
    /// A plan that is to be followed from a state; its trajectory is not made yet.
    fresh: Option<Fresh>,
    table: Option<Arc<Table>>,
    /// A table was too large: nothing is added any more.
    table_is_full: bool,
}

/// Costs of operators, with penalties for what has failed.
#[derive(Debug, Clone)]
struct Penalised {
    failures: BTreeMap<Step, u32>,
    costs: Arc<[u64]>,
}

#[derive(Debug, Clone)]
struct Fresh {
    start: Vec<u64>,
    operators: Arc<[u32]>,
    proven_optimal: bool,
}

#[derive(Debug, Clone)]
struct Ungrounded {
    objects: Vec<Typed>,
    statics: BTreeSet<Atom>,
    error: TaskError,
}

#[derive(Debug, Clone)]
struct Last {
    packed: Packed,
    failures: BTreeMap<Step, u32>,
    reply: Reply,
}

/// A rest of a plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rest {
    /// The whole plan, as operators of the task.
    pub operators: Arc<[u32]>,
    /// The step that is next.
    pub at: usize,
    /// Cost of the rest, without penalties.
    pub cost: u64,
    /// Whether no plan from the observed state costs less, penalties included.
    pub proven_optimal: bool,
}

/// How a question is answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// By a plan; by an empty one when the goal holds.
    Plan(Rest),
    /// By the reason why there is none.
    NoPlan(Outcome),
    /// Not at all: these facts exclude each other.
    Inconsistent(Vec<Atom>),
}

/// An answer with the rung that gave it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// Who answered.
    pub rung: Rung,
    /// The answer.
    pub end: End,
    /// States expanded for it.
    pub expansions: u64,
}

/// What a climb comes to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Climbed {
    /// An answer.
    Reply(Reply),
    /// No rung knows: a search has to tell. [`Ladder::take`] hears what it says.
    Search,
}

/// How often each rung has answered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counters([u64; Rung::ALL.len()]);

impl Counters {
    /// How often a rung has answered.
    pub fn of(&self, rung: Rung) -> u64 {
        self.0[rung as usize]
    }
}

impl Ladder {
    /// A ladder that knows nothing yet.
    pub fn new(domain: Arc<Domain>, goal: Condition, settings: Arc<LadderSettings>) -> Self {
        Self {
            settings,
            domain,
            goal: Arc::new(goal),
            places: Vec::new(),
            ungrounded: None,
            objects: Vec::new(),
            observed: Packed::default(),
            last: None,
            counters: Counters::default(),
        }
    }

    /// The goal.
    pub fn goal(&self) -> &Condition {
        &self.goal
    }

    /// Packs what is observed. Grounds a task first when the objects or the static facts are new.
    ///
    /// `objects` are (name, type); `facts` tell what is true or unknown, all else is false.
    ///
    /// # Errors
    /// [`TaskError`] when no task can be grounded over these objects; then only a planner that does
    /// its own grounding can help.
    pub fn observe<'f>(
        &mut self,
        objects: impl Iterator<Item = (&'f Name, &'f Name)> + Clone,
        facts: impl Iterator<Item = (&'f Atom, Truth)> + Clone,
    ) -> Result<(), &TaskError> {
        if self.has_objects(objects.clone())
            && let Some(place) = self.places.first()
            && self.ungrounded.is_none()
            && place.ground.pack(facts.clone(), &mut self.observed)
        {
            return Ok(());
        }
        self.objects = objects.map(|(name, type_)| (name.clone(), type_.clone())).collect();
        let typed =
            self.objects.iter().map(|(name, type_)| Typed::new(name.clone(), type_.clone()));
        let typed: BTreeSet<Typed> = typed.collect();
        self.go_to(typed.into_iter().collect(), statics_of(&self.domain, facts.clone()));
        if let Some(ungrounded) = &self.ungrounded {
            return Err(&ungrounded.error);
        }
        if let Some(place) = self.places.first() {
            place.ground.pack(facts, &mut self.observed);
        }
        Ok(())
    }

    /// Whether these are the objects that were observed last, in the same order.
    fn has_objects<'f>(&self, objects: impl Iterator<Item = (&'f Name, &'f Name)>) -> bool {
        let mut known = self.objects.iter();
        let mut objects = objects;
        objects.all(|now| known.next().is_some_and(|(n, t)| (n, t) == now)) && known.len() == 0
    }

    /// Makes the task of these objects and static facts the first one.
    fn go_to(&mut self, objects: Vec<Typed>, statics: BTreeSet<Atom>) {
        if let Some(known) = &self.ungrounded
            && known.objects == objects
            && known.statics == statics
        {
            return;
        }
        self.last = None;
        self.ungrounded = None;
        let before = self.places.first_mut().map(Place::to_hand_on);
        let known = self.places.iter().position(|place| {
            place.ground.objects == objects && place.ground.statics.iter().eq(&statics)
        });
        let mut place = match known {
            Some(idx) => self.places.remove(idx),
            None => {
                let settings = &self.settings;
                match Ground::new(&self.domain, objects.clone(), &statics, &self.goal, settings) {
                    Ok(ground) => Place::new(ground),
                    Err(error) => {
                        self.ungrounded = Some(Ungrounded { objects, statics, error });
                        return;
                    }
                }
            }
        };
        if let Some((failures, steps)) = before {
            place.penalise(&failures, self.settings.failure_penalty);
            place.follow(steps.as_deref());
        }
        self.places.insert(0, place);
        self.places.truncate(PLACES_MAX);
    }

    /// Whether anything observed is not known.
    pub fn has_unknowns(&self) -> bool {
        self.observed.unknowns
    }

    /// The task with the observed state; `None` when there is no task.
    pub fn grounded(&self) -> Option<(&Arc<Ground>, &[u64])> {
        let place = self.places.first().filter(|_| self.ungrounded.is_none())?;
        Some((&place.ground, &self.observed.state))
    }

    /// The distance table of the observed objects, when there is one.
    pub fn table(&self) -> Option<&Arc<Table>> {
        self.places.first()?.table.as_ref()
    }

    /// How often each rung has answered.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// The operators of a rest, as steps.
    pub fn steps(&self, rest: &Rest) -> Vec<Step> {
        let place = self.places.first();
        place.map(|place| place.ground.steps_of(&rest.operators[rest.at..])).unwrap_or_default()
    }

    /// Asks the rungs, in order. `failures` says how often each step has failed.
    pub fn climb(&mut self, failures: &BTreeMap<Step, u32>) -> Climbed {
        let Some(place) = self.places.first_mut().filter(|_| self.ungrounded.is_none()) else {
            return Climbed::Search;
        };
        let asked = self.last.as_ref().filter(|last| last.failures == *failures);
        if let Some(last) = asked.filter(|last| last.packed == self.observed && !last.is_late()) {
            let reply = Reply { rung: Rung::Unchanged, expansions: 0, end: last.reply.end.clone() };
            self.counters.0[Rung::Unchanged as usize] += 1;
            return Climbed::Reply(reply);
        }
        place.prepare();
        place.penalise(failures, self.settings.failure_penalty);
        let state = &self.observed.state;
        let found = if self.observed.inconsistent {
            Some((Rung::Mutex, End::Inconsistent(place.ground.violations(state))))
        } else if place.ground.task.is_goal(state) {
            Some((Rung::Goal, End::Plan(Rest::none())))
        } else {
            place.keep(state, &self.settings).or_else(|| place.look_up(state, &self.settings))
        };
        match found {
            None => Climbed::Search,
            Some((rung, end)) => Climbed::Reply(self.reply(rung, end, 0, failures)),
        }
    }

    /// Hears what a search from the observed state has found.
    ///
    /// A plan that does not lead to the goal is refused. When a search finds nothing within its
    /// budget, or nothing cheaper, a rest of the followed plan that still works is better.
    pub fn take(&mut self, answer: Answer, failures: &BTreeMap<Step, u32>) -> Reply {
        let expansions = answer.statistics.expanded();
        let rung = if answer.statistics.improved() { Rung::Improve } else { Rung::Search };
        let Some(place) = self.places.first_mut().filter(|_| self.ungrounded.is_none()) else {
            return Reply { rung, end: End::NoPlan(answer.outcome), expansions };
        };
        let state = &self.observed.state;
        let kept = place.valid_rest(state, &self.settings);
        let end = match (answer.outcome, kept) {
            (Outcome::Solved(plan), kept) => match place.accept(&plan.steps, state) {
                Ok((operators, penalised_cost)) => match kept {
                    Some((_, at)) if place.price(at) <= penalised_cost => {
                        place.set_out_again(state, at, plan.proven_optimal)
                    }
                    Some(_) | None => place.set_out(state, operators.into(), plan.proven_optimal),
                },
                Err(reason) => End::NoPlan(Outcome::BadInput { reason }),
            },
            (Outcome::OutOfBudget { .. }, Some((_, at))) => place.set_out_again(state, at, false),
            (
                outcome @ (Outcome::Unsolvable { .. }
                | Outcome::OutOfBudget { .. }
                | Outcome::Unsupported { .. }
                | Outcome::BadInput { .. }),
                _,
            ) => End::NoPlan(outcome),
        };
        self.reply(rung, end, expansions, failures)
    }

    fn reply(
        &mut self,
        rung: Rung,
        end: End,
        expansions: u64,
        failures: &BTreeMap<Step, u32>,
    ) -> Reply {
        self.counters.0[rung as usize] += 1;
        let reply = Reply { rung, end, expansions };
        match &mut self.last {
            Some(last) => {
                last.packed.clone_from(&self.observed);
                last.reply = reply.clone();
                if last.failures != *failures {
                    last.failures.clone_from(failures);
                }
            }
            None => {
                let (packed, failures) = (self.observed.clone(), failures.clone());
                self.last = Some(Last { packed, failures, reply: reply.clone() });
            }
        }
        reply
    }

    /// Makes ready for the next climb what a new plan needs; a climb that finds it undone does it.
    pub fn prepare(&mut self) {
        if let Some(place) = self.places.first_mut() {
            place.prepare();
        }
    }

    /// The table that would help with the observed state, when there is none that does.
    pub fn wanted_table(&self) -> Option<TableJob> {
        let place = self.places.first().filter(|_| self.ungrounded.is_none())?;
        let state = &self.observed.state;
        let reply = &self.last.as_ref()?.reply;
        let open = match &reply.end {
            End::Plan(rest) => rest.at < rest.operators.len(),
            End::NoPlan(outcome) => matches!(outcome, Outcome::OutOfBudget { .. }),
            End::Inconsistent(_) => false,
        };
        let table = place.current_table();
        let known = table.is_some_and(|table| table.distance(state).is_some());
        if !self.settings.rungs.contains(&Rung::Table) || place.table_is_full || known || !open {
            return None;
        }
        Some(TableJob {
            ground: Arc::clone(&place.ground),
            costs: Arc::clone(&place.penalised.costs),
            start: state.clone(),
            base: table.map(Arc::clone),
            limits: self.settings.table,
        })
    }

    /// Takes over a table that was wanted. Older tables go when all together are too large.
    pub fn adopt(&mut self, job: &TableJob, end: TableEnd) {
        let is_its = |place: &Place| Arc::ptr_eq(&place.ground, &job.ground);
        let Some(idx) = self.places.iter().position(is_its) else { return };
        let place = &mut self.places[idx];
        match end {
            TableEnd::Built(table) => place.table = Some(table),
            TableEnd::TooLarge(..) | TableEnd::CostsTooLarge => place.table_is_full = true,
            TableEnd::Interrupted => {}
        }
        let mut bytes = 0;
        for place in &mut self.places {
            bytes += place.table.as_ref().map_or(0, |table| table.bytes());
            if bytes > self.settings.table.bytes_max {
                place.table = None;
            }
        }
        self.last = None;
    }
}

impl Last {
    /// Whether nobody waited for the answer: then the question is still open.
    fn is_late(&self) -> bool {
        matches!(&self.reply.end, End::NoPlan(Outcome::OutOfBudget { limit, .. })
            if *limit == INTERRUPTED)
    }
}

impl Rest {
    /// Nothing is left to do.
    fn none() -> Self {
        Self { operators: Arc::new([]), at: 0, cost: 0, proven_optimal: true }
    }
}

impl Place {
    fn new(ground: Ground) -> Self {
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
    fn to_hand_on(&mut self) -> (BTreeMap<Step, u32>, Option<Vec<Step>>) {
        self.prepare();
        let followed = self.followed.as_ref().filter(|f| self.is_priced_by(&f.costs));
        let steps = followed.map(|followed| self.ground.steps_of(&followed.operators));
        (self.penalised.failures.clone(), steps)
    }

    /// Follows a plan of another place, if all its steps exist here, too.
    fn follow(&mut self, steps: Option<&[Step]>) {
        let operators = steps.and_then(|steps| {
            steps.iter().map(|step| self.ground.operator(step)).collect::<Option<Arc<[u32]>>>()
        });
        self.fresh = None;
        let costs = &self.penalised.costs;
        self.followed = operators.map(|operators| {
            let costs = Arc::clone(costs);
            Arc::new(Followed::new(&self.ground.task, None, operators, costs, false))
        });
    }

    /// Prices the operators.
    fn penalise(&mut self, failures: &BTreeMap<Step, u32>, penalty: u32) {
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

    fn prepare(&mut self) {
        let Some(Fresh { start, operators, proven_optimal }) = self.fresh.take() else { return };
        let costs = Arc::clone(&self.penalised.costs);
        let task = &self.ground.task;
        let followed = Followed::new(task, Some(&start), operators, costs, proven_optimal);
        self.followed = Some(Arc::new(followed));
    }

    /// The table, when it was built with the present costs.
    fn current_table(&self) -> Option<&Arc<Table>> {
        self.table.as_ref().filter(|table| self.is_priced_by(&table.costs))
    }

    /// The rest of the followed plan that the settings allow to keep. Once a step has failed, a
    /// plan that was made before is not kept.
    fn keep(&self, state: &[u64], settings: &LadderSettings) -> Option<(Rung, End)> {
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
    fn is_priced_by(&self, costs: &Arc<[u64]>) -> bool {
        Arc::ptr_eq(costs, &self.penalised.costs) || *costs == self.penalised.costs
    }

    /// A rest of the followed plan that leads from the state to the goal.
    fn valid_rest(&self, state: &[u64], settings: &LadderSettings) -> Option<(Rung, usize)> {
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
    fn price(&self, at: usize) -> u64 {
        let operators = self.followed.iter().flat_map(|followed| &followed.operators[at..]);
        let costs = operators.map(|&operator| self.penalised.costs[operator as usize]);
        costs.fold(0, u64::saturating_add)
    }

    /// Follows a rest of the followed plan, at present prices.
    fn set_out_again(&mut self, state: &[u64], at: usize, proven_optimal: bool) -> End {
        let rest = self.followed.as_ref().map(|followed| Arc::from(&followed.operators[at..]));
        self.set_out(state, rest.unwrap_or_default(), proven_optimal)
    }

    /// What the distance table says.
    fn look_up(&mut self, state: &[u64], settings: &LadderSettings) -> Option<(Rung, End)> {
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
    fn set_out(&mut self, state: &[u64], operators: Arc<[u32]>, proven_optimal: bool) -> End {
        let start = state.to_vec();
        self.fresh = Some(Fresh { start, operators: Arc::clone(&operators), proven_optimal });
        let costs = operators.iter().map(|&o| self.ground.task.operators[o as usize].cost);
        let cost = costs.fold(0, u64::saturating_add);
        End::Plan(Rest { operators, at: 0, cost, proven_optimal })
    }

    /// The operators of a plan that somebody has found, and their penalised cost.
    fn accept(&self, steps: &[Step], state: &[u64]) -> Result<(Vec<u32>, u64), String> {
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
