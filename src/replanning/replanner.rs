//! Replanning every cycle: owns the ladder, asks the planner where no rung knows the answer.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use super::{Climbed, Ladder, LadderEnd, LadderSettings, Reply, TableEnd, TableJob, TableLimits};
use crate::logic::Facts;
use crate::messages::{GoalMessage, PlanVerdict, Rung};
use crate::pddl::{Domain, Name, Step, Typed};
use crate::planners::{Grounded, PlanQuery, Planner, PlannerConfig};
use crate::planning::{Answer, GroundingLimits, Outcome};
use crate::scene::Scene;

/// When a table that was made beside the loop is taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Adoption {
    /// So many cycles after it was asked for, whenever it is ready: decisions do not depend on how
    /// fast the machine is.
    AfterCycles(u64),
    /// As soon as it is ready.
    WhenReady,
}

/// Remembers what has been planned. A clone is a checkpoint.
#[derive(Debug, Clone)]
pub struct Replanner {
    domain: Arc<Domain>,
    planner: Arc<dyn Planner>,
    settings: Arc<LadderSettings>,
    adoption: Adoption,
    /// Made when the goal is known.
    ladder: Option<Ladder>,
    /// Objects that the goal names and nobody has seen.
    missing: Vec<Name>,
    /// The last question that could not be packed, with its answer.
    loose: Option<(Loose, Reply)>,
    requests: u64,
    pending: Option<TableRequest>,
}

/// A question over objects for which no task could be grounded.
#[derive(Debug, Clone, PartialEq)]
struct Loose {
    objects: Vec<Typed>,
    facts: Facts,
    failures: BTreeMap<Step, u32>,
}

impl Loose {
    fn new(scene: &Scene, failures: &BTreeMap<Step, u32>) -> Self {
        let (objects, facts) = (scene.typed_objects(), scene.confirmed());
        Self { objects, facts, failures: failures.clone() }
    }
}

/// A table that was asked for and has not been taken over yet.
#[derive(Debug, Clone)]
pub struct TableRequest {
    /// Number of the request.
    pub number: u64,
    /// The cycle in which it was made.
    pub cycle: u64,
    /// What is to be done.
    pub job: Arc<TableJob>,
}

/// How long an answer is waited for; both are asked from time to time.
#[derive(Clone, Copy)]
pub struct Patience<'a> {
    /// Whether it is time to be content with any plan.
    pub hurry: &'a dyn Fn() -> bool,
    /// Whether nobody waits any more.
    pub interrupt: &'a dyn Fn() -> bool,
}

impl Patience<'_> {
    /// As long as it takes.
    pub const ENDLESS: Patience<'static> = Patience { hurry: &|| false, interrupt: &|| false };
}

impl fmt::Debug for Patience<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Patience").finish_non_exhaustive()
    }
}

/// What a decision comes to, before it is put into names.
#[derive(Debug, Clone, PartialEq)]
pub struct Decided {
    /// The answer; none while objects are missing.
    pub end: Option<LadderEnd>,
    /// Which rung gave it; none when the question could not be put.
    pub rung: Option<Rung>,
    /// States expanded for it.
    pub expansions: u64,
}

/// The answer to one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Replan {
    /// The answer.
    pub verdict: PlanVerdict,
    /// Which rung gave it; none when the question could not be put.
    pub rung: Option<Rung>,
    /// States expanded for it.
    pub expansions: u64,
}

impl Replanner {
    /// A replanner without a plan.
    ///
    /// `known_right` are states in which exclusions that the actions suggest must hold to count.
    pub fn new(
        domain: Arc<Domain>,
        planner: Arc<dyn Planner>,
        config: &PlannerConfig,
        known_right: Vec<Facts>,
    ) -> Self {
        let size = |value: u64| usize::try_from(value).unwrap_or(usize::MAX);
        let settings = LadderSettings {
            reuse: config.reuse,
            rungs: config.rungs.iter().copied().collect(),
            failure_penalty: config.failure_penalty,
            table: TableLimits {
                states_max: size(config.table.states_max),
                bytes_max: size(config.table.bytes_max),
            },
            grounding: GroundingLimits::standard(),
            known_right: known_right.into_iter().map(|facts| facts.known).collect(),
        };
        Self {
            domain,
            planner,
            settings: Arc::new(settings),
            adoption: Adoption::AfterCycles(config.table.adopt_after_cycles),
            ladder: None,
            missing: Vec::new(),
            loose: None,
            requests: 0,
            pending: None,
        }
    }

    /// The same, but with tables taken over otherwise.
    pub fn adopting(self, adoption: Adoption) -> Self {
        Self { adoption, ..self }
    }

    /// The ladder, once a goal is known.
    pub fn ladder(&self) -> Option<&Ladder> {
        self.ladder.as_ref()
    }

    /// Observes and decides in one go, without any deadline.
    pub fn replan(
        &mut self,
        scene: &Scene,
        goal: &GoalMessage,
        failures: &BTreeMap<Step, u32>,
    ) -> Replan {
        self.observe(scene, goal);
        let Decided { end, rung, expansions } =
            self.decide(scene, goal, failures, Patience::ENDLESS);
        Replan { verdict: self.verdict(end), rung, expansions }
    }

    /// Takes in what is believed.
    pub fn observe(&mut self, scene: &Scene, goal: &GoalMessage) {
        let objects = scene.objects.iter().map(|object| (&object.name, &object.type_name));
        let known = self.ladder.take_if(|ladder| *ladder.goal() == goal.goal);
        let as_before = known.as_ref().is_some_and(|ladder| ladder.has_objects(objects.clone()));
        if !(as_before && self.missing.is_empty()) {
            let seen = |name: &Name| scene.objects.iter().any(|object| object.name == *name);
            let unseen = goal.named.iter().filter(|named| !seen(&named.name));
            self.missing = unseen.map(|named| named.name.clone()).collect();
        }
        if known.is_none() {
            (self.pending, self.loose) = (None, None);
        }
        let ladder = self.ladder.insert(known.unwrap_or_else(|| {
            let (domain, settings) = (Arc::clone(&self.domain), Arc::clone(&self.settings));
            Ladder::new(domain, goal.goal.clone(), settings)
        }));
        if !self.missing.is_empty() {
            return;
        }
        let facts = scene.facts.iter().map(|fact| (&fact.atom, fact.confirmed));
        if let Err(error) = ladder.observe(objects, facts) {
            tracing::debug!(%error, "no task for every state");
        }
    }

    /// The plan from what was observed to the goal. `scene` is the observed one.
    ///
    /// When nobody waits any more, what the planner has then is the answer.
    pub fn decide(
        &mut self,
        scene: &Scene,
        goal: &GoalMessage,
        failures: &BTreeMap<Step, u32>,
        patience: Patience<'_>,
    ) -> Decided {
        let Some(ladder) = self.ladder.as_mut().filter(|_| self.missing.is_empty()) else {
            return Decided { end: None, rung: None, expansions: 0 };
        };
        let reply = match ladder.climb(failures) {
            Climbed::Reply(reply) => reply,
            Climbed::Search => {
                let loose = ladder.grounded().is_none().then(|| Loose::new(scene, failures));
                if let (Some(asked), Some((question, reply))) = (&loose, &self.loose)
                    && asked == question
                {
                    let Reply { end, .. } = reply.clone();
                    return Decided { end: Some(end), rung: Some(Rung::Unchanged), expansions: 0 };
                }
                let question = (&*self.domain, scene, goal, failures);
                let penalty = self.settings.failure_penalty;
                let answer = search(&*self.planner, ladder, question, penalty, patience);
                let reply = ladder.take(answer, failures);
                let settled = loose.filter(|_| !reply.is_late());
                self.loose = settled.map(|question| (question, reply.clone()));
                reply
            }
        };
        let Reply { rung, end, expansions } = reply;
        Decided { end: Some(end), rung: Some(rung), expansions }
    }

    /// A decision by names.
    pub fn verdict(&self, end: Option<LadderEnd>) -> PlanVerdict {
        let Some(end) = end else {
            return PlanVerdict::Missing { objects: self.missing.clone() };
        };
        match end {
            LadderEnd::Plan(rest) => {
                let steps = self.ladder.as_ref().map(|ladder| ladder.steps(&rest));
                PlanVerdict::Plan { cost: rest.cost, steps: steps.unwrap_or_default() }
            }
            LadderEnd::Inconsistent(atoms) => PlanVerdict::Inconsistent { atoms },
            LadderEnd::NoPlan(outcome) => match outcome {
                Outcome::Solved(plan) => PlanVerdict::Plan { cost: plan.cost, steps: plan.steps },
                Outcome::Unsolvable { proof } => {
                    let unknowns = self.ladder.as_ref().is_some_and(Ladder::has_unknowns);
                    PlanVerdict::Unsolvable { proof: proof.to_string(), unknowns }
                }
                Outcome::OutOfBudget { limit, value } => {
                    PlanVerdict::OutOfBudget { limit: format!("{limit} = {value}") }
                }
                Outcome::Unsupported { feature } => PlanVerdict::Unsupported { feature },
                Outcome::BadInput { reason } => PlanVerdict::Unsupported { feature: reason },
            },
        }
    }

    /// Does what can be done before the next scene comes: makes the next climb fast, and asks for
    /// a table where none helps.
    pub fn prepare(&mut self, cycle: u64) {
        let Some(ladder) = self.ladder.as_mut().filter(|_| self.missing.is_empty()) else { return };
        ladder.prepare();
        if self.pending.is_none()
            && let Some(job) = ladder.wanted_table()
        {
            self.requests += 1;
            let number = self.requests;
            self.pending = Some(TableRequest { number, cycle, job: Arc::new(job) });
        }
    }

    /// The table that was asked for and has not been taken over yet.
    pub fn pending(&self) -> Option<&TableRequest> {
        self.pending.as_ref()
    }

    /// Whether the pending table is to be taken over in this cycle: `Some(true)` when it must be
    /// waited for, `Some(false)` when only if it is ready.
    pub fn is_table_due(&self, cycle: u64) -> Option<bool> {
        let pending = self.pending.as_ref()?;
        match self.adoption {
            Adoption::WhenReady => Some(false),
            Adoption::AfterCycles(n) => (cycle >= pending.cycle.saturating_add(n)).then_some(true),
        }
    }

    /// Takes over the pending table.
    pub fn adopt(&mut self, end: TableEnd) {
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
        if let Some(ladder) = &mut self.ladder {
            ladder.adopt(&job, end);
        }
    }
}

/// Asks the planner.
fn search(
    planner: &dyn Planner,
    ladder: &Ladder,
    (domain, scene, goal, failures): (&Domain, &Scene, &GoalMessage, &BTreeMap<Step, u32>),
    failure_penalty: u32,
    patience: Patience<'_>,
) -> Answer {
    let failed = failures.iter().filter(|(_, n)| **n > 0);
    let penalties: BTreeMap<Step, u32> =
        failed.map(|(step, n)| (step.clone(), n.saturating_mul(failure_penalty))).collect();
    let query = PlanQuery {
        domain,
        objects: &scene.typed_objects(),
        init: &scene.confirmed().known,
        goal: &goal.goal,
        penalties: &penalties,
        grounded: ladder.grounded().map(|(ground, state)| Grounded { task: &ground.task, state }),
        hurry: patience.hurry,
        interrupt: patience.interrupt,
    };
    planner.plan(&query)
}
