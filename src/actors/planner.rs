//! Planner actor: newest scene in, plan out, every cycle.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use super::table_thread::TableThread;
use super::{ActorError, Checkpoint, Handling, Monitor};
use crate::clock::{monotonic_ns, thread_cpu_ns};
use crate::messages::{GoalMessage, GoalUpdate, PlanMessage, PlanVerdict, Spent};
use crate::pddl::Step;
use crate::planners::Deadlines;
use crate::replanning::{ReplanQuery, Replanner, TableBuilder};
use crate::scene::Scene;
use crate::transport::convert::{
    WireContext, goal_from_wire, outcome_from_wire, plan_to_wire, scene_from_wire,
};
use crate::transport::topics::{GOAL, OUTCOME, PLAN, RELIABLE_DEPTH, SCENE};
use crate::transport::wire::{OutcomeRecord, SceneRecord, StepRecord, TaskHeader};
use crate::transport::{Bus, Depth, Publisher, Received, Subscriber, TransportError};

/// The bound that a plan in realtime is late by, as the plan message names it.
const DEADLINE_KEY: &str = "planner.deadline_ms";

/// What the actor is started with; shared by all its incarnations.
#[derive(Debug)]
pub struct PlannerArgs {
    /// The bus.
    pub bus: Bus,
    /// Both ends of the topics agree on this.
    pub context: Arc<WireContext>,
    /// How long one call may search, wall-clock time; `None`: as long as its counts allow.
    pub deadline: Option<Duration>,
    /// Memory that outlives the actor.
    pub checkpoint: Checkpoint<PlannerMemory>,
    /// Counts its messages, and lets faults happen on purpose.
    pub monitor: Monitor,
}

/// Memory that outlives the actor.
#[derive(Debug, Clone)]
pub struct PlannerMemory {
    replanner: Replanner,
    goal: Option<GoalMessage>,
    failures: BTreeMap<Step, u32>,
    last_outcome: Option<u64>,
    last_cycle: Option<u64>,
}

impl PlannerMemory {
    /// Nothing has been planned yet.
    pub fn new(replanner: Replanner) -> Self {
        let (goal, failures) = (None, BTreeMap::new());
        Self { replanner, goal, failures, last_outcome: None, last_cycle: None }
    }
}

/// Plans from every newest scene to the constant goal.
///
/// # Errors
/// [`ActorError`] when the bus fails.
pub async fn serve(args: Arc<PlannerArgs>) -> Result<(), ActorError> {
    let mut scenes: Subscriber<TaskHeader, SceneRecord> =
        args.bus.subscriber(&SCENE, Depth::newest())?;
    let mut goals: Subscriber<TaskHeader, u8> = args.bus.subscriber(&GOAL, Depth::newest())?;
    let mut outcomes: Subscriber<TaskHeader, OutcomeRecord> =
        args.bus.subscriber(&OUTCOME, Depth::all(RELIABLE_DEPTH))?;
    let plans: Publisher<TaskHeader, StepRecord> = args.bus.publisher(&PLAN)?;
    let mut memory = args.checkpoint.load();
    let mut tables = TableThread::default();
    loop {
        let read = |m: Received<_, _>| scene_from_wire(m.header(), m.records(), &args.context);
        let mut scene = scenes.newest_of(read).await?;
        if memory.last_cycle == Some(scene.cause.cycle) {
            continue; // a restarted scene parser's history
        }
        let handling = args.monitor.message("planner").await;
        memory.hear(&mut outcomes, &args.context)?;
        if memory.goal.is_none() {
            memory.hear_goal(&mut goals, scene.cause.cycle, &args.context).await?;
            // Where the answer to that scene was lost, the world has gone on meanwhile.
            scene = scenes.drain_newest_of(read)?.unwrap_or(scene);
        }
        let plan = match handling {
            Handling::DeadlineMissed => {
                let limit = DEADLINE_KEY.to_owned();
                PlanMessage::new(scene.cause, PlanVerdict::OutOfBudget { limit })
            }
            Handling::Usual | Handling::SourceDown => {
                tokio::task::block_in_place(|| memory.plan(&scene, args.deadline, &mut tables))
            }
        };
        let (header, records) = plan_to_wire(&plan, &args.context)?;
        plans.publish(header, &records)?;
        memory.replanner.prepare(&mut tables);
        memory.last_cycle = Some(scene.cause.cycle);
        args.checkpoint.store(memory.clone());
    }
}

impl PlannerMemory {
    /// Waits until the goal parser has answered a scene: with the goal, or with "not yet".
    async fn hear_goal(
        &mut self,
        goals: &mut Subscriber<TaskHeader, u8>,
        scene_cycle: u64,
        context: &WireContext,
    ) -> Result<(), TransportError> {
        loop {
            // Oldest first: a foreign message must not shadow the goal.
            let message = goals.next().await?;
            match goal_from_wire(message.header(), message.records(), context) {
                Ok(GoalUpdate::Known(goal)) => {
                    self.goal = Some(goal);
                    return Ok(());
                }
                Ok(GoalUpdate::Pending { cycle }) if cycle >= scene_cycle => return Ok(()),
                Ok(GoalUpdate::Pending { .. }) => {}
                Err(error) => tracing::warn!(%error, "goal"),
            }
        }
    }

    fn hear(
        &mut self,
        outcomes: &mut Subscriber<TaskHeader, OutcomeRecord>,
        context: &WireContext,
    ) -> Result<(), TransportError> {
        while let Some(message) = outcomes.poll_next()? {
            match outcome_from_wire(message.header(), message.records(), context) {
                Ok(outcome) if self.last_outcome.is_none_or(|last| last < outcome.sequence) => {
                    self.last_outcome = Some(outcome.sequence);
                    self.failures.insert(outcome.step, outcome.failures);
                }
                Ok(_) => {}
                Err(error) => tracing::warn!(%error, "outcome"),
            }
        }
        Ok(())
    }

    fn plan(
        &mut self,
        scene: &Scene,
        deadline: Option<Duration>,
        tables: &mut dyn TableBuilder,
    ) -> PlanMessage {
        let Some(goal) = &self.goal else {
            let verdict = PlanVerdict::Missing { objects: Vec::new() };
            return PlanMessage::new(scene.cause, verdict);
        };
        let start_ns = monotonic_ns();
        let passed = |part: u32| {
            let due = deadline.map(|deadline| (deadline / part).as_nanos());
            due.is_some_and(|due| u128::from(monotonic_ns() - start_ns) > due)
        };
        // A cheapest plan is worth half of the time, any plan the rest of it.
        let deadlines = Deadlines { soft: &|| passed(2), hard: &|| passed(1) };
        let query = ReplanQuery { scene, goal, failures: &self.failures };
        self.replanner.plan(query, deadlines, &spent, tables)
    }
}

/// The time that this thread has spent so far.
fn spent() -> Spent {
    Spent { cpu_ns: thread_cpu_ns(), wall_ns: monotonic_ns() }
}
