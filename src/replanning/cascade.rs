//! The cascade itself: what it remembers, and the order in which its sources are asked.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::CascadeSettings;
use super::distance_table::{DistanceTable, TableEnd, TableJob};
use super::observed_task::{ObservedTask, PackedState, statics_of};
use super::reply::{CascadeEnd, CascadeReply, CascadeResult, PlanSuffix, SourceCounts};
use super::task_memo::TaskMemo;
use crate::logic::Truth;
use crate::messages::PlanSource;
use crate::pddl::{Atom, Condition, Domain, Name, Step, Typed};
use crate::planning::{Outcome, PlanAnswer, TaskError};

/// Most tasks that are remembered: one for each set of objects and static facts. Objects that come
/// and go must not make the same task be grounded again and again.
const MEMOS_MAX: usize = 4;

/// Answers the same question again and again, for changing states. A clone is a checkpoint: all
/// that is large is shared.
#[derive(Debug, Clone)]
pub struct Cascade {
    settings: Arc<CascadeSettings>,
    domain: Arc<Domain>,
    goal: Arc<Condition>,
    /// What is known for each of the last few sets of objects and static facts, newest first. Empty
    /// before the first observation, and when the first of them could not be grounded.
    memos: Vec<TaskMemo>,
    /// Why the observed objects and facts could not be grounded.
    ungrounded: Option<Ungrounded>,
    /// Names and types of the objects as they were observed last, in that order.
    objects: Vec<(Name, Name)>,
    observed: PackedState,
    /// The last question and its answer.
    last: Option<Last>,
    counters: SourceCounts,
}

#[derive(Debug, Clone)]
struct Ungrounded {
    objects: Vec<Typed>,
    statics: BTreeSet<Atom>,
    error: TaskError,
}

#[derive(Debug, Clone)]
struct Last {
    packed: PackedState,
    failures: BTreeMap<Step, u32>,
    reply: CascadeReply,
}

impl Cascade {
    /// A cascade that knows nothing yet.
    pub fn new(domain: Arc<Domain>, goal: Condition, settings: Arc<CascadeSettings>) -> Self {
        Self {
            settings,
            domain,
            goal: Arc::new(goal),
            memos: Vec::new(),
            ungrounded: None,
            objects: Vec::new(),
            observed: PackedState::default(),
            last: None,
            counters: SourceCounts::default(),
        }
    }

    /// What every plan leads to; another goal needs another cascade.
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
            && let Some(memo) = self.memos.first()
            && self.ungrounded.is_none()
            && memo.observed_task.pack(facts.clone(), &mut self.observed)
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
        if let Some(memo) = self.memos.first() {
            memo.observed_task.pack(facts, &mut self.observed);
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
        let before = self.memos.first_mut().map(TaskMemo::hand_over);
        let known = self.memos.iter().position(|memo| {
            memo.observed_task.objects == objects && memo.observed_task.statics.iter().eq(&statics)
        });
        let mut memo = if let Some(idx) = known {
            self.memos.remove(idx)
        } else {
            let (goal, settings) = (&self.goal, &self.settings);
            match ObservedTask::new(&self.domain, objects.clone(), &statics, goal, settings) {
                Ok(observed_task) => TaskMemo::new(observed_task),
                Err(error) => {
                    self.ungrounded = Some(Ungrounded { objects, statics, error });
                    return;
                }
            }
        };
        if let Some((failures, steps)) = before {
            memo.penalise(&failures, self.settings.failure_penalty);
            memo.follow(&steps);
        }
        self.memos.insert(0, memo);
        self.memos.truncate(MEMOS_MAX);
    }

    /// Whether anything observed is not known.
    pub fn has_unknowns(&self) -> bool {
        self.observed.unknowns
    }

    /// The task with the observed state; `None` when there is no task.
    pub fn grounded(&self) -> Option<(&Arc<ObservedTask>, &[u64])> {
        let memo = self.memos.first().filter(|_| self.ungrounded.is_none())?;
        Some((&memo.observed_task, &self.observed.state))
    }

    /// The distance table of the observed objects, when there is one.
    pub fn table(&self) -> Option<&Arc<DistanceTable>> {
        self.memos.first()?.table.as_ref()
    }

    /// How often each source has answered.
    pub fn counters(&self) -> SourceCounts {
        self.counters
    }

    /// The operators of a suffix, as steps.
    pub fn steps(&self, suffix: &PlanSuffix) -> Vec<Step> {
        let memo = self.memos.first();
        memo.map(|memo| memo.observed_task.steps_of(&suffix.operators[suffix.at..]))
            .unwrap_or_default()
    }

    /// Asks the sources, in order. `failures` says how often each step has failed.
    pub fn query(&mut self, failures: &BTreeMap<Step, u32>) -> CascadeResult {
        let Some(memo) = self.memos.first_mut().filter(|_| self.ungrounded.is_none()) else {
            return CascadeResult::Search;
        };
        let asked = self.last.as_ref().filter(|last| last.failures == *failures);
        if let Some(last) =
            asked.filter(|last| last.packed == self.observed && !last.reply.is_late())
        {
            let reply = CascadeReply {
                source: PlanSource::Unchanged,
                expansions: 0,
                end: last.reply.end.clone(),
            };
            self.counters.count(PlanSource::Unchanged);
            return CascadeResult::Reply(reply);
        }
        memo.prepare();
        memo.penalise(failures, self.settings.failure_penalty);
        let state = &self.observed.state;
        let found = if self.observed.inconsistent {
            Some((
                PlanSource::Mutex,
                CascadeEnd::Inconsistent(memo.observed_task.violations(state)),
            ))
        } else if memo.observed_task.task().is_goal(state) {
            Some((PlanSource::Goal, CascadeEnd::Plan(PlanSuffix::none())))
        } else {
            memo.keep(state, &self.settings).or_else(|| memo.look_up(state, &self.settings))
        };
        match found {
            None => CascadeResult::Search,
            Some((source, end)) => CascadeResult::Reply(self.reply(source, end, 0, failures)),
        }
    }

    /// Hears what a search from the observed state has found.
    ///
    /// A plan that does not lead to the goal is refused. When a search finds nothing within its
    /// budget, or nothing cheaper, a suffix of the current plan that still works is better.
    pub fn accept(&mut self, answer: PlanAnswer, failures: &BTreeMap<Step, u32>) -> CascadeReply {
        let expansions = answer.statistics.expanded();
        let source =
            if answer.statistics.improved() { PlanSource::Improve } else { PlanSource::Search };
        let Some(memo) = self.memos.first_mut().filter(|_| self.ungrounded.is_none()) else {
            return CascadeReply { source, end: CascadeEnd::NoPlan(answer.outcome), expansions };
        };
        let state = &self.observed.state;
        let kept = memo.valid_suffix(state, &self.settings);
        let end = match (answer.outcome, kept) {
            (Outcome::Solved(plan), kept) => match memo.checked(&plan.steps, state) {
                Ok((operators, penalised_cost)) => match kept {
                    Some((_, at)) if memo.price(at) <= penalised_cost => {
                        memo.adopt_suffix(state, at, plan.proven_optimal)
                    }
                    Some(_) | None => memo.adopt(state, operators.into(), plan.proven_optimal),
                },
                Err(reason) => CascadeEnd::NoPlan(Outcome::BadInput { reason }),
            },
            (Outcome::OutOfBudget { .. } | Outcome::Interrupted, Some((_, at))) => {
                memo.adopt_suffix(state, at, false)
            }
            (
                outcome @ (Outcome::Unsolvable { .. }
                | Outcome::OutOfBudget { .. }
                | Outcome::Interrupted
                | Outcome::Unsupported { .. }
                | Outcome::BadInput { .. }),
                _,
            ) => CascadeEnd::NoPlan(outcome),
        };
        self.reply(source, end, expansions, failures)
    }

    fn reply(
        &mut self,
        source: PlanSource,
        end: CascadeEnd,
        expansions: u64,
        failures: &BTreeMap<Step, u32>,
    ) -> CascadeReply {
        self.counters.count(source);
        let reply = CascadeReply { source, end, expansions };
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

    /// Makes ready for the next query what a new plan needs; a query that finds it undone does it.
    pub fn prepare(&mut self) {
        if let Some(memo) = self.memos.first_mut() {
            memo.prepare();
        }
    }

    /// The table that would help with the observed state, when there is none that does.
    pub fn wanted_table(&self) -> Option<TableJob> {
        let memo = self.memos.first().filter(|_| self.ungrounded.is_none())?;
        let state = &self.observed.state;
        let reply = &self.last.as_ref()?.reply;
        let open = match &reply.end {
            CascadeEnd::Plan(suffix) => suffix.at < suffix.operators.len(),
            CascadeEnd::NoPlan(outcome) => {
                matches!(outcome, Outcome::OutOfBudget { .. } | Outcome::Interrupted)
            }
            CascadeEnd::Inconsistent(_) => false,
        };
        let table = memo.current_table();
        let known = table.is_some_and(|table| table.distance(state).is_some());
        if !self.settings.sources.contains(&PlanSource::Table)
            || memo.table_is_full
            || known
            || !open
        {
            return None;
        }
        Some(TableJob {
            observed_task: Arc::clone(&memo.observed_task),
            costs: Arc::clone(&memo.penalised.costs),
            start: state.clone(),
            base: table.map(Arc::clone),
            limits: self.settings.table,
        })
    }

    /// Takes over a table that was wanted. Older tables go when all together are too large.
    pub fn adopt_table(&mut self, job: &TableJob, end: TableEnd) {
        let is_its = |memo: &TaskMemo| Arc::ptr_eq(&memo.observed_task, &job.observed_task);
        let Some(idx) = self.memos.iter().position(is_its) else { return };
        let memo = &mut self.memos[idx];
        match end {
            TableEnd::Built(table) => memo.table = Some(table),
            TableEnd::TooLarge(..) | TableEnd::CostsTooLarge => memo.table_is_full = true,
            TableEnd::Interrupted => {}
        }
        let mut bytes = 0;
        for memo in &mut self.memos {
            bytes += memo.table.as_ref().map_or(0, |table| table.bytes());
            if bytes > self.settings.table.bytes_max {
                memo.table = None;
            }
        }
        self.last = None;
    }
}
