//! The detector in the loop: every frame waits for it.

use tokio::time::{Instant, sleep_until};

use super::{
    NAME, Ports, Rejection, SceneParserArgs, SceneParserMemory, Seen, check, nothing_usable,
    read_depth, scene_of,
};
use crate::actors::ActorError;
use crate::clock::monotonic_ns;
use crate::perception::detectors::Detector;
use crate::perception::{DepthView, FrameView, ImageView};
use crate::scene::Scene;
use crate::transport::Received;
use crate::transport::convert::RgbFrame;
use crate::transport::wire::FrameHeader;

/// What one incarnation works with.
struct Tools {
    detector: Box<dyn Detector>,
    /// Depth of the present frame; kept, so that no frame needs new memory.
    depth_m: Vec<f32>,
}

pub(super) async fn serve(args: &SceneParserArgs, mut ports: Ports) -> Result<(), ActorError> {
    let detector = (args.detector)().map_err(|reason| ActorError::Part { reason })?;
    let mut tools = Tools { detector, depth_m: Vec::new() };
    let mut memory = args.checkpoint.load();
    let mut depths: Option<Received<FrameHeader, u8>> = None;
    let mut rejection: Option<Rejection> = None;
    let mut deadline = Instant::now() + args.wait;
    loop {
        let usable = |message: Received<FrameHeader, u8>| {
            check(args, message).inspect_err(|reason| {
                args.monitor.rejected(NAME, reason);
                rejection = Some(Rejection::unusable(reason));
            })
        };
        let frame = tokio::select! {
            biased;
            event = ports.events.next() => {
                let was_paused = memory.is_paused;
                memory.hear_event(&event?, &args.context);
                if memory.is_paused != was_paused {
                    args.checkpoint.store(memory.clone());
                    deadline = Instant::now() + args.wait;
                }
                continue;
            }
            frame = ports.rgb.newest_of(usable) => frame?,
            () = sleep_until(deadline) => {
                if !memory.is_paused {
                    return Err(nothing_usable(args, rejection).into());
                }
                deadline = Instant::now() + args.wait;
                continue;
            }
        };
        if let Some(newer) = ports.depth.drain_newest()? {
            depths = Some(newer);
        }
        if memory.last_frame == Some(frame.header().sequence) {
            continue; // a restarted camera shows the same frame again
        }
        args.monitor.message(NAME);
        memory.hear(&mut ports, &args.context)?;
        let parsed = tokio::task::block_in_place(|| {
            parse(args, &mut memory, &mut tools, &frame, depths.as_ref())
        });
        memory.last_frame = Some(frame.header().sequence);
        args.monitor.missed(NAME, ports.rgb.drops().missed);
        match parsed {
            Ok(scene) => {
                deadline = Instant::now() + args.wait;
                ports.publish(args, &scene)?;
            }
            Err(rejected) => {
                args.reject(&rejected);
                rejection = Some(rejected);
            }
        }
        args.checkpoint.store(memory.clone());
    }
}

fn parse(
    args: &SceneParserArgs,
    memory: &mut SceneParserMemory,
    tools: &mut Tools,
    frame: &RgbFrame,
    depth: Option<&Received<FrameHeader, u8>>,
) -> Result<Scene, Rejection> {
    let started_ns = monotonic_ns();
    let header = frame.header();
    let [columns, rows] = frame.size().map(|side| side as usize);
    let image = ImageView::new(columns, rows, frame.rgb()).map_err(|e| Rejection::unusable(&e))?;
    let has_depth = read_depth(depth, header, &mut tools.depth_m);
    let depth = has_depth.then(|| DepthView::new(columns, rows, &tools.depth_m).ok()).flatten();
    let detections = tools.detector.detect(&image, &memory.phrases(&args.config))?;
    let seen = Seen {
        view: FrameView { image: Some(image), depth, camera: frame.model() },
        detections,
        detect_ns: monotonic_ns() - started_ns,
    };
    let heard = memory.heard(header.into());
    let mut scene = scene_of(&mut memory.parser, &args.config, &heard, seen)?;
    memory.parsed(&mut scene, heard.n_frames);
    Ok(scene)
}
