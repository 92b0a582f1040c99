//! Goal parser actor: asks the goal source until it answers, once per episode.

use std::sync::Arc;

use super::{ActorError, Checkpoint, Fatal, Monitor};
use crate::goals::{GoalError, GoalObject, GoalSource, ParsedGoal};
use crate::messages::{GoalMessage, GoalUpdate};
use crate::perception::model::Perception;
use crate::scene::Scene;
use crate::transport::convert::{WireContext, goal_to_wire, scene_from_wire};
use crate::transport::topics::{GOAL, SCENE};
use crate::transport::wire::{SceneRecord, TaskHeader};
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
    /// The answer; it outlives the actor, so that the goal is asked for once.
    pub checkpoint: Checkpoint<Option<GoalMessage>>,
    /// Panics on purpose.
    pub monitor: Monitor,
}

/// Publishes the goal, as soon as the scenes allow it to be understood; "not yet" before that, for
/// every scene, so that nobody waits in vain.
///
/// # Errors
/// [`Fatal`] when no scene can make the goal understood, or what reads it is missing or gives up.
pub async fn serve(args: Arc<GoalParserArgs>) -> Result<(), ActorError> {
    let goals: Publisher<TaskHeader, u8> = args.bus.publisher(&GOAL)?;
    let mut scenes: Subscriber<TaskHeader, SceneRecord> =
        args.bus.subscriber(&SCENE, Depth::newest())?;
    let mut goal = args.checkpoint.load();
    loop {
        if let Some(goal) = &goal {
            let update = GoalUpdate::Known(goal.clone());
            let (header, text) = goal_to_wire(&update, &args.context);
            goals.publish(header, &text)?;
            // The goal is constant. The port stays open for late joiners.
            return std::future::pending().await;
        }
        let read = |m: Received<_, _>| scene_from_wire(m.header(), m.records(), &args.context);
        let scene = scenes.newest_of(read).await?;
        args.monitor.message("goal_parser");
        if let Some(answer) = ask(&args, &scene).await? {
            args.checkpoint.store(Some(answer.clone()));
            goal = Some(answer);
        } else {
            let update = GoalUpdate::Pending { cycle: scene.cause.cycle };
            let (header, text) = goal_to_wire(&update, &args.context);
            goals.publish(header, &text)?;
        }
    }
}

/// Asks the source; `None` when another look may help.
async fn ask(args: &GoalParserArgs, scene: &Scene) -> Result<Option<GoalMessage>, ActorError> {
    let objects = GoalObject::of_scene(&args.perception, scene);
    // An answer before the scene has settled could mistake objects for missing ones.
    let settled = scene.unsettled == 0 && objects.iter().any(|o| o.pixel_box.is_some());
    let read = if args.source.is_quick() {
        args.source.read(&args.context.domain, &objects)
    } else if settled {
        read_apart(args, objects).await?
    } else {
        return Ok(None);
    };
    match read {
        Ok(_) if !settled => Ok(None),
        Ok(parsed) => {
            for note in &parsed.notes {
                tracing::info!(note, "goal");
            }
            Ok(Some(GoalMessage::new(parsed.goal, parsed.expected, &scene.typed_objects())))
        }
        Err(error) if error.may_resolve_later() => {
            tracing::debug!(%error, "the goal waits for another look");
            Ok(None)
        }
        Err(error) => Err(Fatal::from(error).into()),
    }
}

/// Reads on a thread of its own. When the actor is stopped meanwhile, the thread is left behind: it
/// ends at its own deadline, or with the process, and nobody waits for it.
async fn read_apart(
    args: &GoalParserArgs,
    objects: Vec<GoalObject>,
) -> Result<Result<ParsedGoal, GoalError>, ActorError> {
    let (sender, receiver) = tokio::sync::oneshot::channel();
    let (source, context) = (Arc::clone(&args.source), Arc::clone(&args.context));
    let work = move || {
        if sender.send(source.read(&context.domain, &objects)).is_err() {
            tracing::debug!("nobody waits for the goal any more");
        }
    };
    let part = |reason: String| ActorError::Part { reason };
    let thread = std::thread::Builder::new().name("goal".to_owned()).spawn(work);
    thread.map_err(|e| part(e.to_string()))?;
    receiver.await.map_err(|e| part(format!("reading the goal: {e}")))
}
