//! Scene parser actor: newest frame and robot state in, scene graph out.

use std::sync::Arc;
use std::time::Duration;

use super::goal_parser::GOAL_PENDING;
use super::{ActorError, Chaos, Fatal, Keep};
use crate::detectors::{DepthView, Detector, ImageView, phrase_of_name};
use crate::messages::{Cause, Command, RobotState, Scene, Status};
use crate::pddl::Typed;
use crate::scene_parser::{FrameContext, ParserConfig, SceneParser};
use crate::telemetry::monotonic_ns;
use crate::transport::convert::{
    Vocabulary, WireError, command_from_wire, depth_from_wire, frame_from_wire, goal_from_wire,
    robot_state_from_wire, scene_to_wire, status_from_wire,
};
use crate::transport::topics::{
    CAMERA_DEPTH, CAMERA_RGB, GOAL, ROBOT_COMMAND, ROBOT_STATE, ROBOT_STATUS, SCENE,
};
use crate::transport::wire::{
    CommandRecord, DeviceHeader, FrameHeader, RobotStateRecord, SceneRecord, StatusRecord,
    TaskHeader,
};
use crate::transport::{Bus, Inbox, Outbox, Received, Record, TransportError};
use tokio::time::{Instant, timeout_at};

/// What the actor is started with; shared by all its incarnations.
#[expect(missing_debug_implementations, reason = "parts are known by their names only")]
pub struct Args {
    /// The bus.
    pub bus: Bus,
    /// Both ends of the topics agree on this.
    pub vocabulary: Arc<Vocabulary>,
    /// What does not change.
    pub config: Arc<ParserConfig>,
    /// Makes the detector.
    pub detector: Arc<dyn Fn() -> Result<Box<dyn Detector>, String> + Send + Sync>,
    /// Size that frames must have: the labelled examples' width and height.
    pub image_size: [u32; 2],
    /// How long a frame may be missing.
    pub wait: Duration,
    /// Memory that outlives the actor.
    pub keep: Keep<Memory>,
    /// Panics on purpose.
    pub chaos: Chaos,
}

/// Memory that outlives the actor.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    parser: SceneParser,
    cycle: u64,
    last_frame: Option<u64>,
    last_command: Option<u64>,
    last_status: Option<u64>,
    /// Commands and statuses that no frame has been parsed with yet.
    commands: Vec<Command>,
    statuses: Vec<Status>,
    robot: Option<RobotState>,
    /// Objects that the goal names, once there is a goal.
    named: Vec<Typed>,
    /// Frames that were rejected, and frames that were overtaken.
    pub rejected: u64,
    /// Frames that were overtaken by newer ones.
    pub missed: u64,
}

struct Ports {
    rgb: Inbox<FrameHeader, u8>,
    depth: Inbox<FrameHeader, u8>,
    states: Inbox<DeviceHeader, RobotStateRecord>,
    commands: Inbox<DeviceHeader, CommandRecord>,
    statuses: Inbox<DeviceHeader, StatusRecord>,
    goals: Inbox<TaskHeader, u8>,
    scenes: Outbox<TaskHeader, SceneRecord>,
}

/// What one incarnation works with.
struct Tools {
    detector: Box<dyn Detector>,
    /// Depth of the present frame; kept, so that no frame needs new memory.
    depth_m: Vec<f32>,
}

/// Turns every newest frame into a scene graph.
///
/// # Errors
/// [`Fatal::Missing`] when no frame comes for `wait`; other [`ActorError`]s when the bus fails.
pub async fn serve(args: Arc<Args>) -> Result<(), ActorError> {
    let bus = &args.bus;
    let mut ports = Ports {
        rgb: bus.inbox(&CAMERA_RGB)?,
        depth: bus.inbox(&CAMERA_DEPTH)?,
        states: bus.inbox(&ROBOT_STATE)?,
        commands: bus.inbox(&ROBOT_COMMAND)?,
        statuses: bus.inbox(&ROBOT_STATUS)?,
        goals: bus.inbox(&GOAL)?,
        scenes: bus.outbox(&SCENE)?,
    };
    let detector = (args.detector)().map_err(|reason| ActorError::Part { reason })?;
    let mut tools = Tools { detector, depth_m: Vec::new() };
    let mut memory = args.keep.load();
    let mut depths: Option<Received<FrameHeader, u8>> = None;
    let mut rejection: Option<String> = None;
    let mut deadline = Instant::now() + args.wait;
    loop {
        let usable = |frame: Received<FrameHeader, u8>| match check(&args, &frame) {
            Ok(()) => Ok(frame),
            Err(reason) => {
                memory.rejected += 1;
                rejection = Some(reason.clone());
                Err(reason)
            }
        };
        let frame = match timeout_at(deadline, ports.rgb.newest_of(usable)).await {
            Ok(frame) => frame?,
            Err(_) => return Err(no_frames(&args, rejection).into()),
        };
        if let Some(newer) = ports.depth.drain_newest()? {
            depths = Some(newer);
        }
        if memory.last_frame == Some(frame.header().sequence) {
            continue; // a restarted camera shows the same frame again
        }
        args.chaos.message("scene_parser");
        memory.hear(&mut ports, &args.vocabulary)?;
        let depth = depths.as_ref().filter(|d| d.header().sequence == frame.header().sequence);
        let parsed =
            tokio::task::block_in_place(|| parse(&args, &mut memory, &mut tools, &frame, depth));
        memory.last_frame = Some(frame.header().sequence);
        memory.missed = ports.rgb.drops().missed;
        match parsed {
            Ok(scene) => {
                deadline = Instant::now() + args.wait;
                let (header, records) = scene_to_wire(&scene, &args.vocabulary)?;
                ports.scenes.publish(header, &records)?;
            }
            Err(reason) => {
                memory.rejected += 1;
                tracing::warn!(reason, "frame rejected");
                rejection = Some(reason);
            }
        }
        args.keep.store(memory.clone());
    }
}

/// No usable frame came in time: the camera is missing, or says what cannot be used.
fn no_frames(args: &Args, rejection: Option<String>) -> Fatal {
    let seconds = args.wait.as_secs_f64();
    let what = format!("a frame on {} for {seconds} s (camera.wait_s)", CAMERA_RGB.name);
    match rejection {
        Some(reason) => {
            Fatal::BadInput { message: format!("no usable frame for {seconds} s: {reason}") }
        }
        None => Fatal::Missing {
            what,
            how: format!(
                "start a camera, such as `groundloop camera images DIR --fps 5 --run {}`",
                args.bus.run()
            ),
        },
    }
}

/// Whether a frame can be worked on; why, if not.
fn check(args: &Args, frame: &Received<FrameHeader, u8>) -> Result<(), String> {
    let view = frame_from_wire(frame.header(), frame.records()).map_err(|e| e.to_string())?;
    let [width, height] = args.image_size;
    if (view.width, view.height) == (width, height) {
        return Ok(());
    }
    let got = format!("{}x{}", view.width, view.height);
    Err(format!("the labelled examples are {width}x{height} pixels, the frame is {got}"))
}

fn parse(
    args: &Args,
    memory: &mut Memory,
    tools: &mut Tools,
    frame: &Received<FrameHeader, u8>,
    depth: Option<&Received<FrameHeader, u8>>,
) -> Result<Scene, String> {
    let started_ns = monotonic_ns();
    let header = frame.header();
    let view = frame_from_wire(header, frame.records()).map_err(|e| e.to_string())?;
    let (columns, rows) = (view.width as usize, view.height as usize);
    let image = ImageView::new(columns, rows, view.rgb).map_err(|e| e.to_string())?;
    let depth_m = &mut tools.depth_m;
    let mut read =
        |d: &Received<FrameHeader, u8>| depth_from_wire(d.header(), d.records(), depth_m);
    let has_depth = depth.is_some_and(|d| match read(d) {
        Ok(()) => true,
        Err(error) => {
            tracing::warn!(%error, "depth");
            false
        }
    });
    let depth = has_depth.then(|| DepthView::new(columns, rows, &tools.depth_m).ok()).flatten();
    let unseen = memory.parser.unseen(&args.config, &memory.named);
    let phrases: Vec<String> = unseen.iter().map(phrase_of_name).collect();
    let sighted = tools.detector.detect(&image, &phrases).map_err(|e| e.to_string())?;
    let detected_ns = monotonic_ns();
    let cause = Cause {
        cycle: memory.cycle,
        frame_sequence: header.sequence,
        capture_ns: header.capture_ns,
        frame_send_ns: header.send_ns,
    };
    let (commands, statuses) =
        (std::mem::take(&mut memory.commands), std::mem::take(&mut memory.statuses));
    let context = FrameContext {
        cause,
        depth,
        model: view.model.as_ref(),
        robot: memory.robot.as_ref(),
        commands: &commands,
        statuses: &statuses,
    };
    let mut scene = memory.parser.parse(&args.config, &context, sighted);
    memory.cycle += 1;
    let microseconds = |ns: u64| u32::try_from(ns / 1000).unwrap_or(u32::MAX);
    scene.detect_us = microseconds(detected_ns - started_ns);
    scene.ground_us = microseconds(monotonic_ns() - detected_ns);
    Ok(scene)
}

impl Memory {
    /// Takes in what robot, executor and goal parser have said since the last frame. In lockstep
    /// the goal parser answers every scene before the next frame is captured.
    fn hear(&mut self, ports: &mut Ports, vocabulary: &Vocabulary) -> Result<(), TransportError> {
        while let Some(message) = ports.goals.poll_next()? {
            if message.header().verdict == GOAL_PENDING {
                continue;
            }
            match goal_from_wire(message.header(), message.records(), vocabulary) {
                Ok(goal) => self.named = goal.named,
                Err(error) => tracing::warn!(%error, "goal"),
            }
        }
        self.commands.extend(fresh(
            &mut ports.commands,
            &mut self.last_command,
            command_from_wire,
        )?);
        self.statuses.extend(fresh(&mut ports.statuses, &mut self.last_status, status_from_wire)?);
        let read = |m: Received<_, _>| robot_state_from_wire(m.header(), m.records());
        self.robot = ports.states.drain_newest_of(read)?.or(self.robot.take());
        Ok(())
    }
}

/// All waiting messages of a reliable topic that were not handled before: after a restart, the
/// topic's history comes again. What does not convert is reported and left out.
pub(super) fn fresh<R: Record, T>(
    inbox: &mut Inbox<DeviceHeader, R>,
    last: &mut Option<u64>,
    convert: fn(&DeviceHeader, &[R]) -> Result<T, WireError>,
) -> Result<Vec<T>, TransportError> {
    let mut messages = Vec::new();
    while let Some(message) = inbox.poll_next()? {
        let sequence = message.header().sequence;
        if last.is_none_or(|last| last < sequence) {
            *last = Some(sequence);
            match convert(message.header(), message.records()) {
                Ok(message) => messages.push(message),
                Err(error) => tracing::warn!(%error, "device message"),
            }
        }
    }
    Ok(messages)
}
