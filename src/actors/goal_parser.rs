//! Goal parser actor: asks the goal source until it answers, once per episode; and again, a bounded number of
//! times, when its service is not there.

use std::sync::Arc;

use super::{ActorError, Checkpoint, Fatal, Handling, Monitor};
use crate::goals::{GoalError, GoalObject, GoalSource, GoalView, ParsedGoal};
use crate::logic::Facts;
use crate::messages::{GoalMessage, GoalUpdate, PlanVerdict};
use crate::parts::PartError;
use crate::perception::model::Perception;
use crate::scene::Scene;
use crate::transport::convert::{WireContext, goal_to_wire, plan_from_wire, scene_from_wire};
use crate::transport::topics::{GOAL, PLAN, SCENE};
use crate::transport::wire::{SceneRecord, StepRecord, TaskHeader};
use crate::transport::{Bus, Depth, Publisher, Received, Subscriber};

/// What the actor is started with; shared by all its incarnations.
#[derive(Debug)]
pub struct GoalParserArgs {
    /// The bus.
    pub bus: Bus,
    /// Both ends of the topics agree on this.
    pub context: Arc<WireContext>,
    /// Where the goal comes from.
    pub source: Arc<dyn GoalSource>,
    /// Tells colours in names.
    pub perception: Perception,
    /// How often a source that is not there is asked again.
    pub retries_max: u32,
    /// Memory that outlives the actor, so that the goal is asked for once.
    pub checkpoint: Checkpoint<GoalParserMemory>,
    /// Counts its messages, and lets faults happen on purpose.
    pub monitor: Monitor,
}

/// Memory that outlives the actor.
#[derive(Debug, Clone, Default)]
pub struct GoalParserMemory {
    goal: Option<GoalMessage>,
    /// How often the source was not there.
    n_absent: u32,
}

/// Publishes the goal, as soon as the scenes allow it to be understood; "not yet" before that, for
/// every scene, so that nobody waits in vain. The goal is said again with each scene until a plan shows that it
/// was heard.
///
/// # Errors
/// [`Fatal`] when no scene can make the goal understood, or what reads it is missing or gives up.
pub async fn serve(args: Arc<GoalParserArgs>) -> Result<(), ActorError> {
    let goals: Publisher<TaskHeader, u8> = args.bus.publisher(&GOAL)?;
    let mut scenes: Subscriber<TaskHeader, SceneRecord> =
        args.bus.subscriber(&SCENE, Depth::newest())?;
    let mut plans: Subscriber<TaskHeader, StepRecord> =
        args.bus.subscriber(&PLAN, Depth::newest())?;
    let mut memory = args.checkpoint.load();
    let publish = |update: &GoalUpdate| {
        let (header, text) = goal_to_wire(update, &args.context);
        goals.publish(header, &text)
    };
    if let Some(goal) = &memory.goal {
        publish(&GoalUpdate::Known(goal.clone()))?;
    }
    loop {
        let read = |m: Received<_, _>| scene_from_wire(m.header(), m.records(), &args.context);
        let scene = scenes.newest_of(read).await?;
        if memory.goal.is_none() {
            let handling = args.monitor.message("goal_parser").await;
            memory.goal = memory.ask(&args, &scene, handling).await?;
            args.checkpoint.store(memory.clone());
        } else if is_heard(&mut plans, &args.context)? {
            // The goal is constant. The port stays open for late joiners.
            return std::future::pending().await;
        }
        let pending = || GoalUpdate::Pending { cycle: scene.cause.cycle };
        publish(&memory.goal.clone().map_or_else(pending, GoalUpdate::Known))?;
    }
}

/// Whether the newest plan rests on the goal.
fn is_heard(
    plans: &mut Subscriber<TaskHeader, StepRecord>,
    context: &WireContext,
) -> Result<bool, ActorError> {
    let read = |m: Received<_, _>| plan_from_wire(m.header(), m.records(), context);
    let plan = plans.drain_newest_of(read)?;
    let knows_goal = |verdict: &PlanVerdict| !matches!(verdict, PlanVerdict::Missing { objects } if objects.is_empty());
    Ok(plan.is_some_and(|plan| knows_goal(&plan.verdict)))
}

impl GoalParserMemory {
    /// Asks the source; `None` when another look may help, or another time.
    async fn ask(
        &mut self,
        args: &GoalParserArgs,
        scene: &Scene,
        handling: Handling,
    ) -> Result<Option<GoalMessage>, ActorError> {
        let asked = match handling {
            Handling::SourceDown => Err(source_down()),
            Handling::Usual | Handling::DeadlineMissed => ask(args, scene).await?,
        };
        match asked {
            Ok(goal) => Ok(goal),
            Err(error) if error.may_resolve_later() => {
                tracing::debug!(%error, "the goal waits for another look");
                Ok(None)
            }
            Err(error) if error.is_absent() && self.n_absent < args.retries_max => {
                self.n_absent += 1;
                let (n, n_max) = (self.n_absent, args.retries_max);
                tracing::warn!(%error, "the goal is asked for again, {n} of {n_max} times (goal.retries_max)");
                Ok(None)
            }
            Err(error) => Err(Fatal::Goal { why: Box::new(error.into()) }.into()),
        }
    }
}

/// What a source says whose service does not answer.
fn source_down() -> GoalError {
    let how = "a [[fault]] of the run file keeps it away (source_down)";
    GoalError::Part(PartError::missing("the goal source", how))
}

/// Asks the source; `None` while the scene has not settled.
async fn ask(
    args: &GoalParserArgs,
    scene: &Scene,
) -> Result<Result<Option<GoalMessage>, GoalError>, ActorError> {
    let objects = GoalObject::of_scene(&args.perception, scene);
    // An answer before the scene has settled could mistake objects for missing ones.
    let settled = scene.unsettled == 0 && objects.iter().any(|o| o.pixel_box.is_some());
    let read = if args.source.is_quick() {
        let view = GoalView { objects: &objects, facts: Some(&scene.confirmed()) };
        args.source.read_in(&args.context.domain, view)
    } else if settled {
        read_apart(args, objects, scene.confirmed()).await?
    } else {
        return Ok(Ok(None));
    };
    if !settled && read.as_ref().err().is_some_and(GoalError::depends_on_facts) {
        return Ok(Ok(None));
    }
    Ok(read.map(|parsed| {
        if !settled {
            return None;
        }
        for note in &parsed.notes {
            tracing::warn!(note, "goal");
        }
        let ParsedGoal { goal, expected, said, .. } = parsed;
        Some(GoalMessage { said, ..GoalMessage::new(goal, expected, &scene.typed_objects()) })
    }))
}

/// Reads on a thread of its own. When the actor is stopped meanwhile, the thread is left behind: it
/// ends at its own deadline, or with the process, and nobody waits for it.
async fn read_apart(
    args: &GoalParserArgs,
    objects: Vec<GoalObject>,
    facts: Facts,
) -> Result<Result<ParsedGoal, GoalError>, ActorError> {
    let (sender, receiver) = tokio::sync::oneshot::channel();
    let (source, context) = (Arc::clone(&args.source), Arc::clone(&args.context));
    let work = move || {
        let view = GoalView { objects: &objects, facts: Some(&facts) };
        if sender.send(source.read_in(&context.domain, view)).is_err() {
            tracing::debug!("nobody waits for the goal any more");
        }
    };
    let part = |reason: String| ActorError::Part { reason };
    let thread = std::thread::Builder::new().name("goal".to_owned()).spawn(work);
    thread.map_err(|e| part(e.to_string()))?;
    receiver.await.map_err(|e| part(format!("reading the goal: {e}")))
}
