//! Replanning every cycle: owns the cascade, asks the planner where no source knows the answer.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::table_builder::Due;
use super::{
    Adoption, Cascade, CascadeEnd, CascadeReply, CascadeResult, CascadeSettings, TableBuilder,
    TableEnd, TableLimits, TableRequest,
};
use crate::logic::{Bindings, Facts, Truth, Universe, derive, evaluate, speaks_of_all};
use crate::messages::{GoalMessage, PlanMessage, PlanSource, PlanVerdict, Spent};
use crate::pddl::{Domain, Name, Step, Typed};
use crate::planners::{Deadlines, Grounded, NO_COSTS, PlanQuery, Planner, PlannerConfig};
use crate::planning::{Outcome, PlanAnswer};
use crate::scene::{Origin, Scene};

/// Remembers what has been planned. A clone is a checkpoint.
#[derive(Debug, Clone)]
pub struct Replanner {
    domain: Arc<Domain>,
    planner: Arc<dyn Planner>,
    settings: Arc<CascadeSettings>,
    adoption: Adoption,
    /// Made when the goal is known.
    cascade: Option<Cascade>,
    /// Objects that the goal names and nobody has seen.
    missing: Vec<Name>,
    /// The last question that could not be packed, with its answer.
    loose: Option<(UngroundedQuery, CascadeReply)>,
    /// How many tables have been asked for.
    requests: u64,
    pending: Option<TableRequest>,
    /// The cycle of the last scene.
    cycle: u64,
}

/// A question over objects for which no task could be grounded.
#[derive(Debug, Clone, PartialEq)]
struct UngroundedQuery {
    objects: Vec<Typed>,
    facts: Facts,
    failures: BTreeMap<Step, u32>,
}

impl UngroundedQuery {
    fn new(scene: &Scene, failures: &BTreeMap<Step, u32>) -> Self {
        let (objects, facts) = (scene.typed_objects(), scene.confirmed());
        Self { objects, facts, failures: failures.clone() }
    }
}

/// One question: from this scene to this goal.
#[derive(Debug, Clone, Copy)]
pub struct ReplanQuery<'a> {
    /// The newest one; its confirmed facts are planned from.
    pub scene: &'a Scene,
    /// The goal; a new one makes the replanner forget everything.
    pub goal: &'a GoalMessage,
    /// How often each step has failed so far in this episode.
    pub failures: &'a BTreeMap<Step, u32>,
}

/// What a decision comes to, before it is put into names.
#[derive(Debug, Clone, PartialEq)]
struct Decided {
    /// The answer; none while objects are missing.
    end: Option<CascadeEnd>,
    /// Which source gave it; none when the question could not be put.
    source: Option<PlanSource>,
    /// States expanded for it.
    expansions: u64,
}

impl Replanner {
    /// A replanner without a plan.
    ///
    /// `reference_states` are right: exclusions that the actions suggest count if they hold there.
    pub fn new(
        domain: Arc<Domain>,
        planner: Arc<dyn Planner>,
        config: &PlannerConfig,
        reference_states: Vec<Facts>,
    ) -> Self {
        let size = |value: u64| usize::try_from(value).unwrap_or(usize::MAX);
        let settings = CascadeSettings {
            reuse: config.reuse,
            sources: config.rungs.iter().copied().collect(),
            failure_penalty: config.failure_penalty,
            table: TableLimits {
                states_max: size(config.table.states_max),
                bytes_max: size(config.table.bytes_max),
            },
            grounding: config.grounding.limits(),
            reference_states: reference_states.into_iter().map(|facts| facts.known).collect(),
        };
        Self {
            domain,
            planner,
            settings: Arc::new(settings),
            adoption: Adoption::AfterCycles(config.table.adopt_after_cycles),
            cascade: None,
            missing: Vec::new(),
            loose: None,
            requests: 0,
            pending: None,
            cycle: 0,
        }
    }

    /// The same, but with tables taken over otherwise.
    pub fn adopting(self, adoption: Adoption) -> Self {
        Self { adoption, ..self }
    }

    /// The cascade, once a goal is known.
    pub fn cascade(&self) -> Option<&Cascade> {
        self.cascade.as_ref()
    }

    /// The plan from a scene to the goal.
    ///
    /// A pending distance table that is due is taken over first. `spent` tells the time that the
    /// caller's thread has spent so far; it is copied into the message and decides nothing. Once
    /// the hard deadline has passed, what the planner has then is the answer. Call
    /// [`Self::prepare`] when the message is on its way.
    pub fn plan(
        &mut self,
        query: ReplanQuery<'_>,
        deadlines: Deadlines<'_>,
        spent: &dyn Fn() -> Spent,
        tables: &mut dyn TableBuilder,
    ) -> PlanMessage {
        let (cause, of_all) = (query.scene.cause, speaks_of_all(&query.goal.goal));
        self.cycle = cause.cycle;
        self.adopt_what_is_due(tables);
        let start = spent();
        self.observe(query.scene, query.goal);
        let observed = spent();
        let Decided { end, source, expansions } = self.decide(query, deadlines);
        let decided = spent();
        let verdict = self.verdict(end);
        let is_predicted = verdict.is_goal() && !self.is_goal_seen(query.scene, query.goal);
        let is_doubted = verdict.is_goal() && doubts(query.scene, query.goal, of_all);
        let plan_us = (spent() - start).wall_ns / 1000;
        PlanMessage {
            cause,
            verdict,
            of_all,
            is_predicted,
            is_doubted,
            source,
            expansions,
            plan_us: u32::try_from(plan_us).unwrap_or(u32::MAX),
            observe: observed - start,
            decide: decided - observed,
        }
    }

    /// Does what can be done before the next scene comes: makes the next answer fast, and starts a
    /// distance table where none helps.
    pub fn prepare(&mut self, tables: &mut dyn TableBuilder) {
        if let Some(cascade) = self.cascade.as_mut().filter(|_| self.missing.is_empty()) {
            cascade.prepare();
            if self.pending.is_none()
                && let Some(job) = cascade.wanted_table()
            {
                self.requests += 1;
                let (number, cycle) = (self.requests, self.cycle);
                self.pending = Some(TableRequest { number, cycle, job: Arc::new(job) });
            }
        }
        if let Some(request) = &self.pending {
            tables.start(request);
        }
    }

    /// The table that was asked for and has not been taken over yet.
    pub fn pending(&self) -> Option<&TableRequest> {
        self.pending.as_ref()
    }

    /// The first half of [`Self::plan`]: takes in what is believed.
    pub fn observe(&mut self, scene: &Scene, goal: &GoalMessage) {
        let objects = scene.objects.iter().map(|object| (&object.name, &object.type_name));
        let known = self.cascade.take_if(|cascade| *cascade.goal() == goal.goal);
        let as_before = known.as_ref().is_some_and(|cascade| cascade.has_objects(objects.clone()));
        if !(as_before && self.missing.is_empty()) {
            let seen = |name: &Name| scene.objects.iter().any(|object| object.name == *name);
            let unseen = goal.named.iter().filter(|named| !seen(&named.name));
            self.missing = unseen.map(|named| named.name.clone()).collect();
        }
        if known.is_none() {
            (self.pending, self.loose) = (None, None);
        }
        let cascade = self.cascade.insert(known.unwrap_or_else(|| {
            let (domain, settings) = (Arc::clone(&self.domain), Arc::clone(&self.settings));
            Cascade::new(domain, goal.goal.clone(), settings)
        }));
        if !self.missing.is_empty() {
            return;
        }
        let facts = scene.facts.iter().map(|fact| (&fact.atom, fact.confirmed));
        if let Err(error) = cascade.observe(objects, facts) {
            tracing::debug!(%error, "no task for every state");
        }
    }

    /// The answer for what was observed. `query.scene` is the observed one.
    fn decide(&mut self, query: ReplanQuery<'_>, deadlines: Deadlines<'_>) -> Decided {
        let ReplanQuery { scene, failures, .. } = query;
        let Some(cascade) = self.cascade.as_mut().filter(|_| self.missing.is_empty()) else {
            return Decided { end: None, source: None, expansions: 0 };
        };
        let reply = match cascade.query(failures) {
            CascadeResult::Reply(reply) => reply,
            CascadeResult::Search => {
                let loose =
                    cascade.grounded().is_none().then(|| UngroundedQuery::new(scene, failures));
                if let (Some(asked), Some((question, reply))) = (&loose, &self.loose)
                    && asked == question
                {
                    let CascadeReply { end, .. } = reply.clone();
                    return Decided {
                        end: Some(end),
                        source: Some(PlanSource::Unchanged),
                        expansions: 0,
                    };
                }
                let search = Search {
                    planner: &*self.planner,
                    domain: &self.domain,
                    failure_penalty: self.settings.failure_penalty,
                    deadlines,
                };
                let answer = search.answer(cascade, query);
                let reply = cascade.accept(answer, failures);
                let settled = loose.filter(|_| !reply.is_late());
                self.loose = settled.map(|question| (question, reply.clone()));
                reply
            }
        };
        let CascadeReply { source, end, expansions } = reply;
        Decided { end: Some(end), source: Some(source), expansions }
    }

    /// Whether the goal holds even if nothing is so that was only predicted.
    fn is_goal_seen(&self, scene: &Scene, goal: &GoalMessage) -> bool {
        let predicted = || scene.facts.iter().filter(|fact| fact.origin == Origin::Predicted);
        if predicted().next().is_none() {
            return true;
        }
        let mut facts = scene.confirmed();
        predicted().for_each(|fact| facts.set(fact.atom.clone(), Truth::Unknown));
        let (types, objects) = (&self.domain.types, &scene.typed_objects());
        let universe = Universe { types, objects };
        let facts = derive(&self.domain.axioms, &universe, &facts);
        evaluate(&goal.goal, &Bindings::new(), &universe, &|atom| facts.truth(atom)).is_true()
    }

    /// A decision with names in place of numbers.
    fn verdict(&self, end: Option<CascadeEnd>) -> PlanVerdict {
        let Some(end) = end else {
            return PlanVerdict::Missing { objects: self.missing.clone() };
        };
        match end {
            CascadeEnd::Plan(suffix) => {
                let steps = self.cascade.as_ref().map(|cascade| cascade.steps(&suffix));
                PlanVerdict::Plan { cost: suffix.cost, steps: steps.unwrap_or_default() }
            }
            CascadeEnd::Inconsistent(atoms) => PlanVerdict::Inconsistent { atoms },
            CascadeEnd::NoPlan(outcome) => match outcome {
                Outcome::Solved(plan) => PlanVerdict::Plan { cost: plan.cost, steps: plan.steps },
                Outcome::Unsolvable { proof } => {
                    let unknowns = self.cascade.as_ref().is_some_and(Cascade::has_unknowns);
                    PlanVerdict::Unsolvable { proof: proof.to_string(), unknowns }
                }
                Outcome::OutOfBudget { limit, value } => {
                    PlanVerdict::OutOfBudget { limit: format!("{limit} = {value}") }
                }
                Outcome::Interrupted => {
                    PlanVerdict::OutOfBudget { limit: "planner.deadline_ms".to_owned() }
                }
                Outcome::Unsupported { feature } => PlanVerdict::Unsupported { feature },
                Outcome::BadInput { reason } => PlanVerdict::Unsupported { feature: reason },
            },
        }
    }

    fn adopt_what_is_due(&mut self, tables: &mut dyn TableBuilder) {
        let Some(request) = &self.pending else { return };
        let end = match self.adoption.due(request, self.cycle) {
            Due::No => None,
            Due::IfReady => tables.ready(request),
            Due::Now => Some(tables.wait(request)),
        };
        if let Some(end) = end {
            self.adopt_table(end);
        }
    }

    /// Takes over the pending table.
    fn adopt_table(&mut self, end: TableEnd) {
        let Some(TableRequest { job, .. }) = self.pending.take() else { return };
        match &end {
            TableEnd::Built(table) => {
                let (states, bytes) = (table.n_states(), table.bytes());
                tracing::debug!(states, bytes, "distance table");
            }
            TableEnd::TooLarge(limit, value) => {
                tracing::info!("no distance table: {limit} = {value} is used up");
            }
            TableEnd::CostsTooLarge => tracing::info!("no distance table: costs are too large"),
            TableEnd::Interrupted => {}
        }
        if let Some(cascade) = &mut self.cascade {
            cascade.adopt_table(&job, end);
        }
    }
}

/// How the planner is asked.
struct Search<'a> {
    planner: &'a dyn Planner,
    domain: &'a Domain,
    /// Cost that each failure adds to a step.
    failure_penalty: u32,
    deadlines: Deadlines<'a>,
}

impl Search<'_> {
    fn answer(&self, cascade: &Cascade, query: ReplanQuery<'_>) -> PlanAnswer {
        let failed = query.failures.iter().filter(|(_, n)| **n > 0);
        let penalty = |n: &u32| n.saturating_mul(self.failure_penalty);
        let penalties: BTreeMap<Step, u32> =
            failed.map(|(step, n)| (step.clone(), penalty(n))).collect();
        let query = PlanQuery {
            domain: self.domain,
            objects: &query.scene.typed_objects(),
            init: &query.scene.confirmed().known,
            goal: &query.goal.goal,
            costs: &NO_COSTS,
            minimise_cost: false,
            penalties: &penalties,
            grounded: cascade
                .grounded()
                .map(|(observed_task, state)| Grounded { solver: &observed_task.solver, state }),
            deadlines: self.deadlines,
        };
        self.planner.plan(&query)
    }
}

/// Whether an anomaly says of an object that the goal speaks of what cannot be. What is strange in a place
/// beside an object says nothing against what is seen of the object.
fn doubts(scene: &Scene, goal: &GoalMessage, of_all: bool) -> bool {
    let is_named = |object: &Name| goal.named.iter().any(|named| named.name == *object);
    let mut structural = scene.anomalies.iter().filter(|anomaly| anomaly.place.is_none());
    structural.any(|anomaly| anomaly.objects.iter().any(|object| of_all || is_named(object)))
}
