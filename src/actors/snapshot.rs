//! Snapshot actor: a viewer like any other. It reads pixels, scene, plan and goal from the bus and
//! draws one cycle.

use std::path::PathBuf;
use std::sync::Arc;

use image::RgbImage;
use tokio::sync::Mutex;

use super::ActorError;
use crate::logic::{Bindings, Facts, Universe, evaluate};
use crate::messages::{GoalMessage, GoalUpdate, PlanMessage, PlanVerdict};
use crate::pddl::Condition;
use crate::perception::label_of;
use crate::perception::model::Perception;
use crate::picture::{EdgeKind, EdgeMark, GoalMark, ObjectMark, PictureInput, draw, view_around};
use crate::scene::Scene;
use crate::transport::convert::{
    WireContext, frame_from_wire, goal_from_wire, plan_from_wire, scene_from_wire,
};
use crate::transport::topics::{CAMERA_RGB, GOAL, PLAN, SCENE};
use crate::transport::wire::{FrameHeader, SceneRecord, StepRecord, TaskHeader};
use crate::transport::{Bus, Depth, Subscriber};

/// A picture of one cycle, asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SnapshotRequest {
    /// The PNG file.
    pub path: PathBuf,
    /// The first cycle that it may show.
    pub from_cycle: u64,
    /// Which cycle from there on it shows.
    pub moment: SnapshotMoment,
}

/// Which cycle a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SnapshotMoment {
    /// The first settled one with a plan.
    Planned,
    /// The first one, whatever is known.
    First,
}

impl SnapshotRequest {
    /// Whether it shows this cycle.
    fn wants(&self, scene: &Scene, plan: &PlanMessage) -> bool {
        let has_plan =
            matches!(&plan.verdict, PlanVerdict::Plan { steps, .. } if !steps.is_empty());
        plan.cause.cycle >= self.from_cycle
            && match self.moment {
                SnapshotMoment::Planned => scene.unsettled == 0 && has_plan,
                SnapshotMoment::First => true,
            }
    }
}

/// What the actor is started with.
#[derive(Debug)]
pub struct SnapshotArgs {
    /// The bus.
    pub bus: Bus,
    /// Both ends of the topics agree on this.
    pub context: Arc<WireContext>,
    /// Tells colours, and which predicates order rather than relate.
    pub perception: Perception,
    /// The goal in the user's words.
    pub instruction: String,
    /// What is wanted.
    pub request: SnapshotRequest,
    /// Held while the picture is drawn and written: who has stopped the actor waits for it. Then it says why
    /// there is no picture, if there is none.
    pub drawing: Arc<Mutex<Option<String>>>,
}

/// Draws the cycle that is asked for.
///
/// # Errors
/// [`ActorError`] when the bus fails. A picture that cannot be written ends nothing.
pub async fn serve(args: Arc<SnapshotArgs>) -> Result<(), ActorError> {
    let mut frames: Subscriber<FrameHeader, u8> =
        args.bus.subscriber(&CAMERA_RGB, Depth::newest())?;
    let mut scenes: Subscriber<TaskHeader, SceneRecord> =
        args.bus.subscriber(&SCENE, Depth::newest())?;
    let mut plans: Subscriber<TaskHeader, StepRecord> =
        args.bus.subscriber(&PLAN, Depth::newest())?;
    let mut goals: Subscriber<TaskHeader, u8> = args.bus.subscriber(&GOAL, Depth::newest())?;
    let mut pictures: Vec<(u64, RgbImage)> = Vec::new();
    let mut known: Vec<Scene> = Vec::new();
    let mut goal = None;
    loop {
        let frame = frames.next().await?;
        pictures.extend(picture_of(frame.header(), frame.records()));
        drop(frame);
        while let Some(message) = scenes.poll_next()? {
            known.extend(scene_from_wire(message.header(), message.records(), &args.context));
        }
        while let Some(message) = goals.poll_next()? {
            let text = message.records();
            if let Ok(GoalUpdate::Known(known)) =
                goal_from_wire(message.header(), text, &args.context)
            {
                goal = Some(known);
            }
        }
        while let Some(message) = plans.poll_next()? {
            let plan = plan_from_wire(message.header(), message.records(), &args.context);
            let (Ok(plan), Some(goal)) = (plan, &goal) else { continue };
            let (cycle, sequence) = (plan.cause.cycle, plan.cause.frame_sequence);
            let scene = known.iter().find(|s| s.cause.cycle == cycle);
            let picture = pictures.iter().find(|(s, _)| *s == sequence);
            if let (Some(scene), Some((_, picture))) = (scene, picture)
                && args.request.wants(scene, &plan)
            {
                let mut fault = args.drawing.lock().await;
                *fault = write(&args, picture, scene, &plan, goal).err();
                return Ok(());
            }
        }
        pictures.drain(..pictures.len().saturating_sub(KEPT));
        known.drain(..known.len().saturating_sub(KEPT));
    }
}

/// Frames and scenes that are kept until the plan that rests on them has come.
const KEPT: usize = 4;

fn picture_of(header: &FrameHeader, payload: &[u8]) -> Option<(u64, RgbImage)> {
    let view = frame_from_wire(header, payload).ok()?;
    let image = RgbImage::from_raw(view.width, view.height, view.rgb.to_vec())?;
    Some((header.sequence, image))
}

fn write(
    args: &SnapshotArgs,
    picture: &RgbImage,
    scene: &Scene,
    plan: &PlanMessage,
    goal: &GoalMessage,
) -> Result<(), String> {
    let facts = scene.confirmed();
    let objects = objects(args, scene, &facts);
    let edges = edges(args, &facts);
    let goals = goal_marks(args, scene, &facts, goal);
    let steps: Vec<String> = if let PlanVerdict::Plan { steps, .. } = &plan.verdict {
        steps.iter().map(ToString::to_string).collect()
    } else {
        Vec::new()
    };
    let seconds = scene.cause.capture_ns as f64 / 1e9;
    let caption = [
        ("cycle".to_owned(), scene.cause.cycle.to_string()),
        ("time".to_owned(), format!("{seconds:.1} s")),
        ("plan".to_owned(), format!("{} steps", steps.len())),
    ];
    let input = PictureInput {
        view: view_around(&objects, picture.width(), picture.height()),
        title: args.context.domain.name.as_str(),
        instruction: &args.instruction,
        caption: &caption,
        goal: &goals,
        plan: &steps,
        step_idx: Some(0),
        remarks: &[],
        objects: &objects,
        edges: &edges,
    };
    let drawn = draw(picture, &input).map_err(|e| e.to_string())?;
    let path = &args.request.path;
    drawn.save(path).map_err(|e| format!("{}: {e}", path.display()))
}

fn objects(args: &SnapshotArgs, scene: &Scene, facts: &Facts) -> Vec<ObjectMark> {
    let marks = scene.objects.iter().map(|object| {
        let spec = args.perception.type_spec(&object.type_name);
        let label = spec.and_then(|spec| label_of(spec, &object.name));
        let shades = label.and_then(|label| args.perception.colours.get(label));
        let unary = facts.known.iter().filter(|a| a.args.len() == 1 && a.args[0] == object.name);
        ObjectMark {
            name: object.name.clone(),
            pixel_box: object.pixel_box,
            colour: shades.and_then(|shades| shades.first()).map(|shade| shade.0),
            visibility: object.visibility,
            facts: unary.map(|atom| atom.predicate.to_string()).collect(),
        }
    });
    marks.collect()
}

/// Binary facts, without those that only order things: they would hide everything else.
fn edges(args: &SnapshotArgs, facts: &Facts) -> Vec<EdgeMark> {
    let orders = &args.perception.constraints.strict_order;
    let binary = facts.known.iter().filter(|atom| !orders.contains(&atom.predicate));
    let edges = binary.filter_map(|atom| {
        let [from, to] = atom.args.as_slice() else { return None };
        let (predicate, from, to) = (atom.predicate.clone(), from.clone(), to.clone());
        Some(EdgeMark { predicate, from, to, kind: EdgeKind::Seen })
    });
    edges.collect()
}

fn goal_marks(
    args: &SnapshotArgs,
    scene: &Scene,
    facts: &Facts,
    goal: &GoalMessage,
) -> Vec<GoalMark> {
    let parts = if let Condition::And(parts) = &goal.goal {
        parts.clone()
    } else {
        vec![goal.goal.clone()]
    };
    let objects = scene.typed_objects();
    let universe = Universe { types: &args.context.domain.types, objects: &objects };
    let marks = parts.iter().map(|part| GoalMark {
        text: part.to_string(),
        holds: evaluate(part, &Bindings::new(), &universe, &|atom| facts.truth(atom)),
    });
    marks.collect()
}
