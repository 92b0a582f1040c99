//! The ladder itself: what it remembers, and the order in which its rungs are asked.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::ground::{Ground, Packed, statics_of};
use super::place::Place;
use super::reply::{Climbed, Counters, End, Reply, Rest};
use super::table::{Table, TableEnd, TableJob, TableLimits};
use crate::logic::Truth;
use crate::messages::{Reuse, Rung};
use crate::pddl::{Atom, Condition, Domain, Name, Step, Typed};
use crate::planning::{Answer, GroundingLimits, Outcome, TaskError};

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
    pub fn has_objects<'f>(&self, objects: impl Iterator<Item = (&'f Name, &'f Name)>) -> bool {
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
        let before = self.places.first_mut().map(Place::hand_on);
        let known = self.places.iter().position(|place| {
            place.ground.objects == objects && place.ground.statics.iter().eq(&statics)
        });
        let mut place = if let Some(idx) = known {
            self.places.remove(idx)
        } else {
            let (goal, settings) = (&self.goal, &self.settings);
            match Ground::new(&self.domain, objects.clone(), &statics, goal, settings) {
                Ok(ground) => Place::new(ground),
                Err(error) => {
                    self.ungrounded = Some(Ungrounded { objects, statics, error });
                    return;
                }
            }
        };
        if let Some((failures, steps)) = before {
            place.penalise(&failures, self.settings.failure_penalty);
            place.follow(&steps);
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
        if let Some(last) =
            asked.filter(|last| last.packed == self.observed && !last.reply.is_late())
        {
            let reply = Reply { rung: Rung::Unchanged, expansions: 0, end: last.reply.end.clone() };
            self.counters.count(Rung::Unchanged);
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
        self.counters.count(rung);
        let reply = Reply { rung, end, expansions };
        if let Some(last) = &mut self.last {
            last.packed.clone_from(&self.observed);
            last.reply = reply.clone();
            if last.failures != *failures {
                last.failures.clone_from(failures);
            }
        } else {
            let (packed, failures) = (self.observed.clone(), failures.clone());
            self.last = Some(Last { packed, failures, reply: reply.clone() });
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
