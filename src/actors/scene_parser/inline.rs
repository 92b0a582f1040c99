//! The detector in the loop: every frame waits for it.

use tokio::time::Instant;

use super::frames::{Moment, Refusal};
use super::frozen::{Stillness, check_frozen};
use super::missing::{Refusals, no_frame, nothing_usable};
use super::{NAME, Ports, Rejection, SceneParserArgs, SceneParserMemory, look, scene_of};
use crate::actors::ActorError;
use crate::actors::patience::{Waited, waited};
use crate::perception::detectors::Detector;
use crate::scene::Scene;

/// What one incarnation works with.
struct Tools {
    /// One for each camera.
    detectors: Vec<Box<dyn Detector>>,
    /// Depth of the present frames; kept, so that no frame needs new memory.
    depths: Vec<Vec<f32>>,
    /// What each camera has shown last.
    stillness: Vec<Stillness>,
}

pub(super) async fn serve(args: &SceneParserArgs, mut ports: Ports) -> Result<(), ActorError> {
    let detectors = args.cameras.iter().map(|camera| (camera.detector)());
    let detectors = detectors.collect::<Result<_, _>>();
    let detectors = detectors.map_err(|reason| ActorError::Part { reason })?;
    let mut tools = Tools { detectors, depths: Vec::new(), stillness: Vec::new() };
    let mut memory = args.checkpoint.load();
    let mut refusals = Refusals::default();
    let mut deadline = Instant::now() + args.wait;
    loop {
        let refused = |refusal: &Refusal| refusals.unreadable(args, refusal);
        let awaits_robot = args.awaits_robot && memory.robot.is_none();
        let moment = tokio::select! {
            biased;
            state = ports.states.next(), if awaits_robot => {
                memory.robot = Some(state?);
                deadline = Instant::now() + args.wait;
                continue;
            }
            event = ports.events.next() => {
                let was_paused = memory.is_paused;
                memory.hear_event(&event?, &args.context);
                if memory.is_paused != was_paused {
                    args.checkpoint.store(memory.clone());
                    deadline = Instant::now() + args.wait;
                    ports.cameras.wait_anew();
                }
                continue;
            }
            moment = ports.cameras.next(refused), if !awaits_robot => moment?,
            waited = waited(deadline, args.wait) => {
                if waited == Waited::Out && !memory.is_paused && !awaits_robot {
                    return Err(nothing_usable(args, &mut ports.cameras, refusals.last));
                }
                deadline = Instant::now() + args.wait;
                ports.cameras.wait_anew();
                continue;
            }
        };
        if let Some(lost) = ports.cameras.lost(args.wait).filter(|_| !memory.is_paused) {
            return Err(no_frame(args, &mut ports.cameras, lost));
        }
        let sequence = moment.frame.header().sequence;
        if refusals.is_repeat(args, memory.last_frame, sequence) {
            continue;
        }
        args.monitor.message(NAME).await;
        memory.hear(&mut ports, &args.context)?;
        let parsed = tokio::task::block_in_place(|| {
            parse(args, &mut memory, &mut tools, &moment, &mut ports)
        });
        memory.last_frame = Some(sequence);
        args.monitor.missed(NAME, ports.cameras.missed());
        match parsed {
            Ok(scene) => {
                deadline = Instant::now() + args.wait;
                refusals.last = None;
                ports.publish(args, &scene)?;
            }
            Err(rejected) => refusals.rejected(args, rejected),
        }
        args.checkpoint.store(memory.clone());
    }
}

fn parse(
    args: &SceneParserArgs,
    memory: &mut SceneParserMemory,
    tools: &mut Tools,
    moment: &Moment,
    ports: &mut Ports,
) -> Result<Scene, Rejection> {
    let has_depth = ports.cameras.read_depth(moment, &mut tools.depths)?;
    let shots = ports.cameras.shots(moment, &tools.depths, &has_depth);
    check_frozen(&mut tools.stillness, (&args.cameras, &shots), memory.robot.as_ref())?;
    let phrases = memory.phrases(&args.config);
    let seen = look((&args.cameras, &mut tools.detectors), &shots, &phrases)?;
    let heard = memory.heard(moment.frame.header().into());
    let mut scene = scene_of(&mut memory.parser, &args.config, &heard, seen)?;
    memory.parsed(&args.config, &mut scene, heard.n_frames);
    Ok(scene)
}
