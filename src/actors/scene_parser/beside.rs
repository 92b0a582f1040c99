//! Detector and grounder beside the loop: no frame waits for them.
//!
//! They get the newest frame whenever they are free, with what belongs to it (depth, robot state,
//! commands and statuses heard until then), so the scene says when the picture was taken that it
//! rests on. For the frames in between the loop carries that
//! scene forward as it is, with its stamps: nothing new is believed, nothing is confirmed by the
//! same picture twice, and the executor starts no step on a scene that is too old.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::Instant;

use super::frames::{Cameras, Moment, Refusal};
use super::frozen::{Stillness, check_frozen};
use super::missing::{Refusals, no_frame, nothing_usable, unusable};
use super::thread::{Answer, Job, OwnedShot, PerceptionThread};
use super::{NAME, Ports, Rejection, SceneParserArgs, SceneParserMemory};
use crate::actors::ActorError;
use crate::actors::patience::{Waited, waited};

/// Pause after a first failure of the detector, milliseconds; doubles with each one in a row.
const RETRY_MS_MIN: u64 = 100;
/// Longest such pause, milliseconds: a service that is back is noticed within it.
const RETRY_MS_MAX: u64 = 5_000;

/// What one incarnation works with.
struct Tools {
    thread: PerceptionThread,
    /// Frames that came to nothing, and answers that did.
    bad_frames: Refusals,
    bad_answers: Refusals,
    /// What each camera has shown last.
    stillness: Vec<Stillness>,
    /// Failures of the detector in a row.
    n_failures: u32,
    /// When the detector may be asked again.
    next_try: Instant,
    /// When frames have been missing for too long.
    frame_deadline: Instant,
    /// When an answer has; `None` before a frame has been given to the detector.
    answer_deadline: Option<Instant>,
}

pub(super) async fn serve(args: &SceneParserArgs, mut ports: Ports) -> Result<(), ActorError> {
    let now = Instant::now();
    let mut tools = Tools {
        thread: PerceptionThread::start(args.cameras.clone(), Arc::clone(&args.config))?,
        bad_frames: Refusals::default(),
        bad_answers: Refusals::default(),
        stillness: Vec::new(),
        n_failures: 0,
        next_try: now,
        frame_deadline: now + args.wait,
        answer_deadline: None,
    };
    let mut memory = args.checkpoint.load();
    loop {
        let deadline = tools.answer_deadline.into_iter().fold(tools.frame_deadline, Instant::min);
        let bad_frames = &mut tools.bad_frames;
        let refused = |refusal: &Refusal| bad_frames.unreadable(args, refusal);
        tokio::select! {
            biased;
            event = ports.events.next() => {
                let was_paused = memory.is_paused;
                memory.hear_event(&event?, &args.context);
                if memory.is_paused != was_paused {
                    tools.wait_anew(args.wait);
                    ports.cameras.wait_anew();
                }
            }
            answer = tools.thread.answer() => {
                take_answer(args, &mut memory, &mut tools, &ports, answer?)?;
            }
            moment = ports.cameras.next(refused) => {
                take_frame(args, &mut memory, &mut tools, &mut ports, moment?).await?;
            }
            waited = waited(deadline, args.wait) => {
                if waited == Waited::Out && !memory.is_paused {
                    return Err(tools.too_late(args, &mut ports.cameras));
                }
                tools.wait_anew(args.wait);
                ports.cameras.wait_anew();
            }
        }
        args.checkpoint.store(memory.clone());
    }
}

/// A frame has come: it goes to the detector if that is free, and the loop goes on with what it
/// has.
async fn take_frame(
    args: &SceneParserArgs,
    memory: &mut SceneParserMemory,
    tools: &mut Tools,
    ports: &mut Ports,
    moment: Moment,
) -> Result<(), ActorError> {
    if let Some(lost) = ports.cameras.lost(args.wait).filter(|_| !memory.is_paused) {
        return Err(no_frame(args, &mut ports.cameras, lost));
    }
    let header = moment.frame.header();
    if tools.bad_frames.is_repeat(args, memory.last_frame, header.sequence) {
        return Ok(());
    }
    tools.bad_frames.last = None;
    args.monitor.message(NAME).await;
    memory.hear(ports, &args.context)?;
    memory.last_frame = Some(header.sequence);
    args.monitor.missed(NAME, ports.cameras.missed());
    let now = Instant::now();
    tools.frame_deadline = now + args.wait;
    if !tools.thread.is_busy() && now >= tools.next_try {
        match job(args, memory, (&mut ports.cameras, &mut tools.stillness), &moment) {
            Ok(job) => {
                tools.thread.offer(job)?;
                tools.answer_deadline.get_or_insert(now + args.wait);
            }
            Err(rejection) => {
                tools.bad_answers.rejected(args, rejection);
                tools.answer_deadline.get_or_insert(now + args.wait);
            }
        }
    }
    if let Some(scene) = &mut memory.last_scene {
        scene.cause.cycle = memory.cycle;
        (scene.detect_us, scene.ground_us) = (0, 0);
        memory.cycle += 1;
        ports.publish(args, scene)?;
    }
    Ok(())
}

/// A frame with all that belongs to it, for the thread.
fn job(
    args: &SceneParserArgs,
    memory: &SceneParserMemory,
    (cameras, stillness): (&mut Cameras, &mut Vec<Stillness>),
    moment: &Moment,
) -> Result<Job, Rejection> {
    let mut depths = Vec::new();
    let has_depth = cameras.read_depth(moment, &mut depths)?;
    let shots = cameras.shots(moment, &depths, &has_depth);
    check_frozen(stillness, (&args.cameras, &shots), memory.robot.as_ref())?;
    Ok(Job {
        heard: memory.heard(moment.frame.header().into()),
        parser: memory.parser.clone(),
        shots: shots.iter().map(OwnedShot::of).collect(),
        phrases: memory.phrases(&args.config),
    })
}

/// The thread has answered: the scene of its frame, or a pause before it is asked again.
fn take_answer(
    args: &SceneParserArgs,
    memory: &mut SceneParserMemory,
    tools: &mut Tools,
    ports: &Ports,
    Answer { n_frames, parsed }: Answer,
) -> Result<(), ActorError> {
    let now = Instant::now();
    let (parser, mut scene) = match parsed {
        Ok(parsed) => parsed,
        Err(rejection) => {
            let pause_ms = RETRY_MS_MIN << tools.n_failures.min(16);
            tools.next_try = now + Duration::from_millis(pause_ms.min(RETRY_MS_MAX));
            tools.n_failures += 1;
            tools.bad_answers.rejected(args, rejection);
            return Ok(());
        }
    };
    tools.n_failures = 0;
    (tools.answer_deadline, tools.bad_answers.last) = (None, None);
    memory.parser = parser;
    memory.parsed(&args.config, &mut scene, n_frames);
    ports.publish(args, &scene)?;
    memory.last_scene = Some(scene);
    Ok(())
}

impl Tools {
    /// A paused loop waits for nothing.
    fn wait_anew(&mut self, wait: Duration) {
        let deadline = Instant::now() + wait;
        self.frame_deadline = deadline;
        self.answer_deadline = self.answer_deadline.map(|_| deadline);
    }

    /// Why nothing came in time: no frames, or no answers.
    fn too_late(&self, args: &SceneParserArgs, cameras: &mut Cameras) -> ActorError {
        let is_silent = self.answer_deadline.is_some_and(|deadline| deadline < self.frame_deadline);
        if !is_silent {
            return nothing_usable(args, cameras, self.bad_frames.last.clone());
        }
        let silent = || Rejection {
            reason: "it has not answered one frame; wait longer, or give it less to do".to_owned(),
            is_missing: true,
        };
        unusable(args, self.bad_answers.last.clone().unwrap_or_else(silent)).into()
    }
}
