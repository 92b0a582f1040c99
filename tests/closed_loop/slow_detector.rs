//! A detector that takes its time beside the loop: the loop goes on with what it said last.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the test")]

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::common::{TestRun, project, runtime};
use groundloop::actors::scene_parser::{CameraArgs, MakeDetector, SceneParserArgs, serve};
use groundloop::actors::{ActorError, Checkpoint, Fatal, Monitor};
use groundloop::geometry::PixelBox;
use groundloop::parts::{PartChoice, PartError};
use groundloop::perception::detectors::{Detector, DetectorError};
use groundloop::perception::model::ObjectBox;
use groundloop::perception::tracking::{BeliefConfig, ParserConfig};
use groundloop::perception::{Detection, Detections, ImageView};
use groundloop::run::{DomainFolder, ExemplarConfig};
use groundloop::scene::Scene;
use groundloop::transport::convert::{WireContext, scene_from_wire};
use groundloop::transport::topics::{CAMERA_RGB, SCENE};
use groundloop::transport::wire::{FrameHeader, SCHEMA, SceneRecord, TaskHeader};
use groundloop::transport::{Bus, Depth, Publisher, Subscriber};
use tokio::sync::mpsc;
use tokio::task::JoinHandle;

const WIDTH: usize = 320;
const HEIGHT: usize = 240;

/// What the test lets the detector do with the frame that it has.
enum Go {
    /// It sees a red block with this left edge.
    See(f64),
    Fail,
    Panic,
}

/// Tells which frame it was given (its pixels all have the frame's number), then waits at a gate.
struct Gated {
    started: mpsc::Sender<u8>,
    gate: Arc<Mutex<Receiver<Go>>>,
}

impl Detector for Gated {
    fn learn(&mut self, _: &ImageView<'_>, _: &[ObjectBox]) -> Result<(), DetectorError> {
        Ok(())
    }

    fn detect(&mut self, image: &ImageView<'_>, _: &[String]) -> Result<Detections, DetectorError> {
        self.started.blocking_send(image.rgb()[0]).unwrap();
        let go = self.gate.lock().unwrap().recv().unwrap();
        match go {
            Go::See(x) => {
                let red = Detection::new(
                    "block".into(),
                    "red".into(),
                    PixelBox::from([x, 100.0, x + 20.0, 120.0]),
                );
                Ok(Detections { objects: vec![red], ..Detections::default() })
            }
            Go::Fail => {
                let (what, how) = ("the eye".to_owned(), "buy one".to_owned());
                Err(PartError::missing(what, how).into())
            }
            Go::Panic => panic!("as told"),
        }
    }
}

/// A scene parser on a bus of its own, its camera and its detector.
struct Rig {
    frames: Publisher<FrameHeader, u8>,
    scenes: Subscriber<TaskHeader, SceneRecord>,
    context: Arc<WireContext>,
    started: mpsc::Receiver<u8>,
    gate: Sender<Go>,
    actor: JoinHandle<Result<(), ActorError>>,
}

impl Rig {
    fn start(run: &TestRun, wait: Duration) -> Self {
        let folder = DomainFolder::read(&project("domains/blocksworld")).unwrap();
        let exemplar = ExemplarConfig {
            folder: Some("sim_320x240".to_owned()),
            image: None,
            boxes: None,
            state: None,
            number: None,
        };
        let examples = exemplar.read(&folder, None).unwrap();
        let grounder = folder.grounder(&PartChoice::new("test", "s2s"), &examples).unwrap();
        let context = Arc::new(WireContext::new(1, folder.hash, folder.domain.clone()));
        let belief = BeliefConfig { confirm_s: 0.0, hidden_s_max: 0.3, grasp_reach_m: 0.05 };
        let config = ParserConfig {
            domain: folder.domain,
            perception: folder.perception,
            rules: folder.rules,
            skills: folder.skills.unwrap(),
            grounder,
            belief,
            self_filter: None,
        };
        let bus = Bus::open(&run.bus("slow")).unwrap();
        let (gate, waiting) = channel();
        let (telling, started) = mpsc::channel(8);
        let waiting = Arc::new(Mutex::new(waiting));
        let detector: MakeDetector = Arc::new(move || {
            Ok(Box::new(Gated { started: telling.clone(), gate: Arc::clone(&waiting) }))
        });
        let image_size = [WIDTH as u32, HEIGHT as u32];
        let main = CameraArgs { name: "main".to_owned(), detector, image_size, disturb: None };
        let args = SceneParserArgs {
            bus: bus.clone(),
            context: Arc::clone(&context),
            config: Arc::new(config),
            cameras: vec![main],
            skew: None,
            detector_name: "gated".to_owned(),
            beside: true,
            awaits_robot: false,
            wait,
            checkpoint: Checkpoint::default(),
            monitor: Monitor::default(),
        };
        let scenes = bus.subscriber(&SCENE, Depth::newest()).unwrap();
        let frames = bus.publisher(&CAMERA_RGB).unwrap();
        let actor = tokio::spawn(serve(Arc::new(args)));
        Self { frames, scenes, context, started, gate, actor }
    }

    /// Shows a frame, captured at its number of microseconds.
    fn show(&self, number: u64) {
        let header = FrameHeader {
            schema: SCHEMA,
            sequence: number,
            capture_ns: number * 1_000,
            width: WIDTH as u32,
            height: HEIGHT as u32,
            stride: 3 * WIDTH as u32,
            ..FrameHeader::default()
        };
        self.frames.publish(header, &vec![number as u8; 3 * WIDTH * HEIGHT]).unwrap();
    }

    async fn scene(&mut self) -> Scene {
        let message = self.scenes.next().await.unwrap();
        scene_from_wire(message.header(), message.records(), &self.context).unwrap()
    }

    /// Waits until the detector has a frame; which one.
    async fn given(&mut self) -> u8 {
        self.started.recv().await.unwrap()
    }
}

/// The picture that a scene rests on, when it was taken, and what it shows of the red block.
#[track_caller]
fn check(scene: &Scene, cycle: u64, frame: u64, left_edge: f64) {
    let cause = scene.cause;
    assert_eq!(
        (cause.cycle, cause.frame_sequence, cause.capture_ns),
        (cycle, frame, frame * 1_000)
    );
    let red = scene.object("red_block").unwrap();
    assert_eq!((red.pixel_box.unwrap().x1, red.seen_ns), (left_edge, frame * 1_000));
}

#[test]
fn the_loop_goes_on_with_the_last_answer_at_its_own_age() {
    let run = TestRun::new();
    runtime().block_on(async {
        let mut rig = Rig::start(&run, Duration::from_secs(600));
        rig.show(1);
        assert_eq!(rig.given().await, 1);
        rig.gate.send(Go::See(30.0)).unwrap();
        check(&rig.scene().await, 0, 1, 30.0);
        // The second frame goes to the detector; meanwhile every frame has a scene.
        rig.show(2);
        assert_eq!(rig.given().await, 2);
        check(&rig.scene().await, 1, 1, 30.0);
        for (number, cycle) in [(3, 2), (4, 3)] {
            rig.show(number);
            check(&rig.scene().await, cycle, 1, 30.0);
        }
        rig.gate.send(Go::See(34.0)).unwrap();
        check(&rig.scene().await, 4, 2, 34.0);
        // Then the newest frame, not those that came in between.
        rig.show(5);
        assert_eq!(rig.given().await, 5);
        check(&rig.scene().await, 5, 2, 34.0);
        // A failure and a panic end nothing; after a pause the detector is asked again.
        let (mut number, mut given) = (5, 5);
        for go in [Go::Fail, Go::Panic] {
            rig.gate.send(go).unwrap();
            given = loop {
                number += 1;
                rig.show(number);
                assert_eq!(rig.scene().await.cause.frame_sequence, 2);
                if let Ok(given) = rig.started.try_recv() {
                    break given;
                }
            };
        }
        rig.gate.send(Go::See(38.0)).unwrap();
        let scene = rig.scene().await;
        let frame = scene.cause.frame_sequence;
        assert!(frame as u8 == given && frame <= number, "{frame} for {given}, {number} shown");
        check(&scene, scene.cause.cycle, frame, 38.0);
        rig.actor.abort();
    });
}

#[test]
fn a_detector_that_does_not_answer_is_missing_by_its_name() {
    for (go, expect) in
        [(None, "it has not answered one frame"), (Some(Go::Fail), "the eye is missing: buy one")]
    {
        let run = TestRun::new();
        runtime().block_on(async {
            let mut rig = Rig::start(&run, Duration::from_millis(300));
            rig.show(1);
            assert_eq!(rig.given().await, 1);
            rig.show(2);
            if let Some(go) = go {
                rig.gate.send(go).unwrap();
            }
            let ended = (&mut rig.actor).await.unwrap();
            let Err(ActorError::Fatal(fatal @ Fatal::Missing { .. })) = ended else {
                panic!("{ended:?}")
            };
            let message = fatal.to_string();
            let what = "an answer of the detector gated for 0.3 s (camera.wait_s)";
            assert!(message.starts_with(what) && message.contains(expect), "{message}");
            drop(rig.gate);
        });
    }
}
