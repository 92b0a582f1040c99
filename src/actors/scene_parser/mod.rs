//! Scene parser actor: newest frame and robot state in, scene graph out.
//!
//! Detector and grounder are called in the loop (`inline`), or work on a thread of their own while
//! the loop goes on with what they said last (`beside`).

mod beside;
mod fitted;
mod frames;
mod frozen;
mod inline;
mod missing;
mod thread;

use std::sync::Arc;
use std::time::Duration;

use frames::{Cameras, Shot};

use super::robot_states::RobotStates;
use super::{ActorError, Checkpoint, Monitor};
use crate::clock::{ClockKind, monotonic_ns};
use crate::hardware::DisturbDetections;
use crate::messages::{Dispatch, Event, GoalUpdate, RobotState, Status};
use crate::pddl::Typed;
use crate::perception::detectors::{Detector, DetectorError};
use crate::perception::grounders::GrounderError;
use crate::perception::tracking::{FrameContext, OtherView, ParserConfig, SceneParser};
use crate::perception::{Detections, FrameView, phrase_of_name};
use crate::scene::{FrameRef, Scene};
use crate::transport::convert::{
    WireContext, WireError, dispatch_from_wire, event_from_wire, goal_from_wire, scene_to_wire,
    status_from_wire,
};
use crate::transport::topics::{DISPATCH, EVENT, GOAL, RELIABLE_DEPTH, ROBOT_STATUS, SCENE};
use crate::transport::wire::{
    DeviceHeader, DispatchRecord, FrameHeader, SceneRecord, StatusRecord, StreamHeader, TaskHeader,
    WireHeader,
};
use crate::transport::{Bus, Depth, Publisher, Received, Record, Subscriber, TransportError};

/// Its name in the supervision tree.
const NAME: &str = "scene_parser";

/// Makes a detector, or says why it cannot be made.
pub type MakeDetector = Arc<dyn Fn() -> Result<Box<dyn Detector>, String> + Send + Sync>;

/// What the actor is started with; shared by all its incarnations.
#[expect(missing_debug_implementations, reason = "parts are known by their names only")]
pub struct SceneParserArgs {
    /// The bus.
    pub bus: Bus,
    /// Both ends of the topics agree on this.
    pub context: Arc<WireContext>,
    /// What does not change.
    pub config: Arc<ParserConfig>,
    /// Every camera, `main` first.
    pub cameras: Vec<CameraArgs>,
    /// How far apart frames of one moment may be captured; `None` in lockstep.
    pub skew: Option<Duration>,
    /// The detector's name in the configuration.
    pub detector_name: String,
    /// Whether detector and grounder work beside the loop, on a thread of their own.
    pub beside: bool,
    /// Whether no frame is parsed before the robot has said where it is: in lockstep, where a run
    /// must come out the same each time. Who misses a robot is the executor.
    pub awaits_robot: bool,
    /// How long a frame, or an answer of the detector, may be missing.
    pub wait: Duration,
    /// Memory that outlives the actor.
    pub checkpoint: Checkpoint<SceneParserMemory>,
    /// Counts its messages, and lets faults happen on purpose.
    pub monitor: Monitor,
}

/// One camera of a run.
#[derive(Clone)]
#[expect(missing_debug_implementations, reason = "a detector is known by its name only")]
pub struct CameraArgs {
    /// Its name: `main`, or that of a `[cameras.NAME]`.
    pub name: String,
    /// Makes its detector, which its labelled examples have taught.
    pub detector: MakeDetector,
    /// Size that its frames must have: the labelled examples' width and height.
    pub image_size: [u32; 2],
    /// What disturbs the detector, where the run file says so.
    pub disturb: Option<DisturbDetections>,
}

/// Memory that outlives the actor.
#[derive(Debug, Clone, Default)]
pub struct SceneParserMemory {
    parser: SceneParser,
    cycle: u64,
    last_frame: Option<u64>,
    last_dispatch: Option<Handled>,
    last_status: Option<Handled>,
    /// Frames that have come.
    n_frames: u64,
    /// Dispatches and statuses that no frame has been parsed with yet, each with the number of
    /// frames that had come.
    dispatches: Vec<(u64, Dispatch)>,
    statuses: Vec<(u64, Status)>,
    robot: Option<RobotState>,
    /// Objects that the goal names, once there is a goal.
    named: Vec<Typed>,
    /// The scene of the frame that the detector answered last, while it works beside the loop.
    last_scene: Option<Scene>,
    /// Whether the loop is paused or at its end, so that no frame is awaited.
    is_paused: bool,
    /// Whether another episode came before.
    is_handed_over: bool,
    /// When the first frame was captured, once there is one.
    first_ns: Option<u64>,
}

struct Ports {
    cameras: Cameras,
    states: RobotStates,
    dispatches: Subscriber<StreamHeader, DispatchRecord>,
    statuses: Subscriber<DeviceHeader, StatusRecord>,
    goals: Subscriber<TaskHeader, u8>,
    events: Subscriber<StreamHeader, u8>,
    scenes: Publisher<TaskHeader, SceneRecord>,
}

/// Why a frame came to nothing.
#[derive(Debug, Clone)]
struct Rejection {
    reason: String,
    /// Something outside is missing that may be there another time.
    is_missing: bool,
}

impl Rejection {
    /// The frame itself cannot be used.
    fn unusable(reason: &impl std::fmt::Display) -> Self {
        Self { reason: reason.to_string(), is_missing: false }
    }
}

impl From<DetectorError> for Rejection {
    fn from(error: DetectorError) -> Self {
        Self { reason: error.to_string(), is_missing: error.is_missing() }
    }
}

impl From<GrounderError> for Rejection {
    fn from(error: GrounderError) -> Self {
        Self { reason: error.to_string(), is_missing: error.is_missing() }
    }
}

/// Turns every newest frame into a scene graph.
///
/// # Errors
/// [`Fatal::Missing`](crate::actors::Fatal::Missing) when no frame comes for `wait`, or no answer of the detector; other
/// [`ActorError`]s when the bus fails.
pub async fn serve(args: Arc<SceneParserArgs>) -> Result<(), ActorError> {
    let bus = &args.bus;
    let ports = Ports {
        cameras: Cameras::open(bus, &args.cameras, args.skew)?,
        states: RobotStates::open(bus, args.clock())?,
        dispatches: bus.subscriber(&DISPATCH, Depth::all(RELIABLE_DEPTH))?,
        statuses: bus.subscriber(&ROBOT_STATUS, Depth::all(RELIABLE_DEPTH))?,
        goals: bus.subscriber(&GOAL, Depth::newest())?,
        events: bus.subscriber(&EVENT, Depth::all(RELIABLE_DEPTH))?,
        scenes: bus.publisher(&SCENE)?,
    };
    if args.beside {
        Box::pin(beside::serve(&args, ports)).await
    } else {
        Box::pin(inline::serve(&args, ports)).await
    }
}

/// What belongs to a frame besides what the camera shows.
#[derive(Debug, Clone)]
struct Heard {
    frame: FrameStamp,
    /// What the robot said last before the frame.
    robot: Option<RobotState>,
    /// What was said since the last frame that was parsed.
    dispatches: Vec<Dispatch>,
    statuses: Vec<Status>,
    /// How many frames had come with it: what was said until then belongs to it.
    n_frames: u64,
}

/// What a detector sees in a frame, and how long it took.
struct Seen<'a> {
    view: FrameView<'a>,
    detections: Detections,
    /// What other cameras see.
    others: Vec<OtherView<'a>>,
    detect_ns: u64,
}

/// Looks at what the cameras show, each with the detector that knows it.
fn look<'a>(
    (cameras, detectors): (&'a [CameraArgs], &mut [Box<dyn Detector>]),
    shots: &[Shot<'a>],
    phrases: &[String],
) -> Result<Seen<'a>, Rejection> {
    let started_ns = monotonic_ns();
    let mut seen = Vec::new();
    for shot in shots {
        let detector = &mut detectors[shot.camera_idx];
        let mut detections = detector.detect(&shot.image()?, phrases)?;
        let CameraArgs { name, disturb, .. } = &cameras[shot.camera_idx];
        if let Some(disturb) = disturb {
            disturb(shot.sequence, &mut detections.objects);
        }
        let camera = name.as_str();
        seen.push(OtherView { camera, view: shot.view()?, detections });
    }
    let detect_ns = monotonic_ns() - started_ns;
    let others = seen.split_off(seen.len().min(1));
    let main = seen.pop().ok_or_else(|| Rejection::unusable(&"no frame"))?;
    Ok(Seen { view: main.view, detections: main.detections, others, detect_ns })
}

/// What is kept of a frame's header.
#[derive(Debug, Clone, Copy)]
struct FrameStamp {
    sequence: u64,
    capture_ns: u64,
    send_ns: u64,
}

impl From<&FrameHeader> for FrameStamp {
    fn from(header: &FrameHeader) -> Self {
        let FrameHeader { sequence, capture_ns, send_ns, .. } = *header;
        Self { sequence, capture_ns, send_ns }
    }
}

impl SceneParserMemory {
    /// The memory of the next episode: what the gripper holds, and that the frame that was answered last is no
    /// news.
    #[must_use]
    pub fn handed_over(&self, answered: Option<u64>) -> Self {
        let parser = self.parser.handed_over();
        Self { parser, last_frame: answered, is_handed_over: true, ..Self::default() }
    }

    /// What the detector is asked for beside the domain's types: what the goal names and nobody has
    /// seen.
    fn phrases(&self, config: &ParserConfig) -> Vec<String> {
        self.parser.unseen(config, &self.named).iter().map(phrase_of_name).collect()
    }

    /// What belongs to the frame that has just come.
    fn heard(&self, frame: FrameStamp) -> Heard {
        let dispatches = self.dispatches.iter().map(|(_, dispatch)| dispatch.clone()).collect();
        let statuses = self.statuses.iter().map(|(_, status)| status.clone()).collect();
        Heard { frame, robot: self.robot, dispatches, statuses, n_frames: self.n_frames }
    }

    /// A frame has become a scene: gives it its number, and forgets what belonged to it.
    fn parsed(&mut self, config: &ParserConfig, scene: &mut Scene, n_frames: u64) {
        let now_ns = scene.cause.capture_ns;
        let first_ns = *self.first_ns.get_or_insert(now_ns);
        if self.is_handed_over {
            // What is in the gripper is known at once, and is not all there is.
            let seconds = now_ns.saturating_sub(first_ns) as f64 / 1e9;
            scene.unsettled += u32::from(seconds <= config.belief.confirm_s);
        }
        scene.cause.cycle = self.cycle;
        self.cycle += 1;
        self.dispatches.retain(|(n, _)| *n > n_frames);
        self.statuses.retain(|(n, _)| *n > n_frames);
    }

    /// Takes in what robot, executor and goal parser have said since the last frame. In lockstep
    /// the goal parser answers every scene before the next frame is captured.
    fn hear(&mut self, ports: &mut Ports, context: &WireContext) -> Result<(), TransportError> {
        self.n_frames += 1;
        let n_frames = self.n_frames;
        while let Some(message) = ports.goals.poll_next()? {
            match goal_from_wire(message.header(), message.records(), context) {
                Ok(GoalUpdate::Known(goal)) => self.named = goal.named,
                Ok(GoalUpdate::Pending { .. }) => {}
                Err(error) => tracing::warn!(%error, "goal"),
            }
        }
        // The state first: a status that it rests on has come then.
        self.robot = ports.states.drain()?.or(self.robot.take());
        let read = |header: &_, records: &[_]| dispatch_from_wire(header, records, context);
        let dispatches = fresh(&mut ports.dispatches, &mut self.last_dispatch, read)?;
        self.dispatches.extend(dispatches.into_iter().map(|dispatch| (n_frames, dispatch)));
        let statuses = fresh(&mut ports.statuses, &mut self.last_status, status_from_wire)?;
        self.statuses.extend(statuses.into_iter().map(|status| (n_frames, status)));
        Ok(())
    }
}

impl SceneParserMemory {
    /// Hears from the executor whether it waits for frames. The request to pause is no witness: it is
    /// lost with whoever sent it.
    fn hear_event(&mut self, message: &Received<StreamHeader, u8>, context: &WireContext) {
        match event_from_wire(message.header(), message.records(), context).map(|m| m.event) {
            Ok(Event::Paused | Event::End(_)) => self.is_paused = true,
            Ok(Event::Resumed) => self.is_paused = false,
            Ok(_) => {}
            Err(error) => tracing::warn!(topic = EVENT.name, %error, "rejected"),
        }
    }
}

impl SceneParserArgs {
    fn clock(&self) -> ClockKind {
        if self.skew.is_some() { ClockKind::Realtime } else { ClockKind::Lockstep }
    }
}

/// The scene of one frame, without its number.
fn scene_of(
    parser: &mut SceneParser,
    config: &ParserConfig,
    heard: &Heard,
    seen: Seen<'_>,
) -> Result<Scene, Rejection> {
    let started_ns = monotonic_ns();
    let FrameStamp { sequence, capture_ns, send_ns } = heard.frame;
    let context = FrameContext {
        cause: FrameRef { cycle: 0, frame_sequence: sequence, capture_ns, frame_send_ns: send_ns },
        view: seen.view,
        others: &seen.others,
        robot: heard.robot.as_ref(),
        dispatches: &heard.dispatches,
        statuses: &heard.statuses,
    };
    let mut scene = parser.parse(config, &context, seen.detections)?;
    let microseconds = |ns: u64| u32::try_from(ns / 1000).unwrap_or(u32::MAX);
    scene.detect_us = microseconds(seen.detect_ns);
    scene.ground_us = microseconds(monotonic_ns() - started_ns);
    Ok(scene)
}

impl Ports {
    fn publish(&self, args: &SceneParserArgs, scene: &Scene) -> Result<(), ActorError> {
        let (header, records) = scene_to_wire(scene, &args.context)?;
        Ok(self.scenes.publish(header, &records)?)
    }
}

/// The last message of a stream that was handled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Handled {
    sequence: u64,
    capture_ns: u64,
}

/// All waiting messages of a stream that were not handled before: after a restart, the topic's
/// history comes again. A writer that has started anew counts from 0 again, at later times. What does not convert is reported and left out.
pub(super) fn fresh<H: WireHeader, R: Record, T>(
    subscriber: &mut Subscriber<H, R>,
    last: &mut Option<Handled>,
    convert: impl Fn(&H, &[R]) -> Result<T, WireError>,
) -> Result<Vec<T>, TransportError> {
    let mut messages = Vec::new();
    while let Some(message) = subscriber.poll_next()? {
        let (sequence, capture_ns) = (message.header().sequence(), message.header().capture_ns());
        let is_old = |last: Handled| sequence <= last.sequence && capture_ns <= last.capture_ns;
        match convert(message.header(), message.records()) {
            Ok(_) if last.is_some_and(is_old) => {}
            Ok(message) => {
                *last = Some(Handled { sequence, capture_ns });
                messages.push(message);
            }
            Err(error) => tracing::warn!(topic = subscriber.topic(), %error, "rejected"),
        }
    }
    Ok(messages)
}
