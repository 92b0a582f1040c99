//! Nothing usable comes: the run ends and says why, as far as it can be told.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::time::Duration;

use crate::common::{Process, TestRun, external, project, runtime, unique_run};
use groundloop::actors::Fatal;
use groundloop::run::{PreparedRun, RunConfig, RunError, load_run, read_image};
use groundloop::transport::topics::{CAMERA_RGB, ROBOT_STATE, SCENE};
use groundloop::transport::wire::{
    DeviceHeader, FrameHeader, RobotStateRecord, SCHEMA, SceneRecord, TaskHeader,
};
use groundloop::transport::{Bus, BusConfig, Depth, Publisher, Subscriber};
use iceoryx2::prelude::*;
use rustix::process::Signal;

/// How often a test's camera shows a frame: a rate like a camera's.
const FRAME_PERIOD: Duration = Duration::from_millis(20);
const IMAGE: &str = "domains/blocksworld/exemplar/sim_320x240/a_tower_and_singles.png";

/// A run that looks through an external camera, and waits for a second at most.
fn looking() -> RunConfig {
    let sets = ["perception.exemplar={folder=\"sim_320x240\"}", "camera.wait_s=1.0"];
    let sets = sets.map(str::to_owned);
    load_run(&project("configs/photo_blocksworld.toml"), &sets).unwrap()
}

/// What the run ends with while `play` does something on its bus.
fn ends_with(play: impl AsyncFnOnce(Bus)) -> Fatal {
    let run = TestRun::new();
    let prepared = PreparedRun::read(looking(), None).unwrap();
    let ended = runtime().block_on(async {
        let bus = Bus::open(&run.bus("test")).unwrap();
        let own = Bus::open(&run.bus("test")).unwrap();
        let options = groundloop::run::EpisodeOptions { bus: own, snapshot: None };
        tokio::select! {
            ended = groundloop::run::run_episode(&prepared, options) => ended,
            () = async { play(bus).await; std::future::pending().await } => unreachable!(),
        }
    });
    let Err(RunError::Fatal(fatal)) = ended else { unreachable!("{ended:?}") };
    fatal
}

#[track_caller]
fn is_bad_input(fatal: &Fatal, expect: &[&str]) {
    assert!(matches!(fatal, Fatal::BadInput { .. }), "{fatal:?}");
    says(fatal, expect);
}

#[track_caller]
fn says(fatal: &Fatal, expect: &[&str]) {
    let said = fatal.to_string();
    for text in expect {
        assert!(said.contains(text), "{said}");
    }
}

/// A frame as the labelled examples are, and its pixels.
fn frame() -> (FrameHeader, Vec<u8>) {
    let pixels = read_image(&project(IMAGE)).unwrap().into_raw();
    let (width, height, stride) = (320, 240, 320 * 3);
    (FrameHeader { schema: SCHEMA, width, height, stride, ..FrameHeader::default() }, pixels)
}

#[test]
fn a_camera_that_is_not_there_is_told_with_the_place_that_is_looked_at() {
    let fatal = ends_with(async |_| {});
    assert!(matches!(fatal, Fatal::Missing { .. }), "{fatal:?}");
    says(
        &fatal,
        &["start a camera", "nobody writes camera/main/rgb of run \"test\" in /", "gltest_"],
    );
}

#[test]
fn a_camera_that_is_connected_and_says_nothing_is_told() {
    let fatal = ends_with(async |bus| {
        let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB).unwrap();
        let () = std::future::pending().await;
        drop(frames);
    });
    assert!(matches!(fatal, Fatal::Missing { .. }), "{fatal:?}");
    says(&fatal, &["the writer of camera/main/rgb is connected and sends nothing"]);
}

#[test]
fn a_camera_of_another_version_is_told_with_both_versions() {
    let fatal = ends_with(async |bus| {
        shows(bus, |sequence, header| FrameHeader { sequence, schema: SCHEMA + 1, ..header }).await;
    });
    let versions =
        format!("messages of schema {}, and this program reads schema {SCHEMA}", SCHEMA + 1);
    is_bad_input(&fatal, &[&versions]);
}

/// Publishes frames whose headers are made from their numbers, like a camera.
async fn shows(bus: Bus, header_of: impl Fn(u64, FrameHeader) -> FrameHeader) {
    let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB).unwrap();
    let (header, pixels) = frame();
    let mut period = tokio::time::interval(FRAME_PERIOD);
    for n in 0.. {
        period.tick().await;
        frames.publish(header_of(n, header), &pixels).unwrap();
    }
}

#[test]
fn a_camera_that_does_not_count_is_called_frozen() {
    let capture_ns = groundloop::clock::monotonic_ns();
    let fatal = ends_with(async |bus| {
        shows(bus, |n, header| FrameHeader { sequence: 7, capture_ns: capture_ns + n, ..header })
            .await;
    });
    is_bad_input(&fatal, &["more frames of number 7", "a frozen camera"]);
}

#[test]
fn a_frame_that_cannot_be_used_is_told_and_not_for_ever() {
    let fatal = ends_with(async |bus| {
        shows(bus, |n, header| FrameHeader { sequence: n, capture_ns: 0, ..header }).await;
    });
    is_bad_input(&fatal, &["no usable frame for 1 s: capture_ns is 0"]);
    // One bad frame, then a good one, then none: the bad one is not why.
    let fatal = ends_with(async |bus| {
        let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB).unwrap();
        let mut scenes: Subscriber<TaskHeader, SceneRecord> =
            bus.subscriber(&SCENE, Depth::newest()).unwrap();
        let (header, pixels) = frame();
        frames.publish(header, &pixels).unwrap();
        let capture_ns = groundloop::clock::monotonic_ns();
        frames.publish(FrameHeader { sequence: 1, capture_ns, ..header }, &pixels).unwrap();
        scenes.newest().await.unwrap();
    });
    says(&fatal, &["nobody writes camera/main/rgb"]);
}

/// A writer of one's own that sends samples and does not notify.
#[test]
fn a_camera_that_wakes_nobody_is_told_what_to_do() {
    let run = TestRun::new();
    let BusConfig { root, prefix, .. } = run.bus("test");
    let mut config = Config::default();
    config.global.set_root_path(&root.unwrap().to_str().unwrap().try_into().unwrap());
    config.global.prefix = prefix.as_str().try_into().unwrap();
    let prepared = PreparedRun::read(looking(), None).unwrap();
    let ended = runtime().block_on(async {
        let bus = Bus::open(&run.bus("test")).unwrap();
        // Who opens a topic first makes it.
        let _reader: Subscriber<FrameHeader, u8> =
            bus.subscriber(&CAMERA_RGB, Depth::newest()).unwrap();
        let node = NodeBuilder::new().config(&config).create::<ipc_threadsafe::Service>().unwrap();
        let name = ServiceName::new("groundloop/test/camera/main/rgb").unwrap();
        let service = node.service_builder(&name).publish_subscribe::<[u8]>();
        let service = service.user_header::<FrameHeader>().open().unwrap();
        let (header, pixels) = frame();
        let writer = service.publisher_builder().initial_max_slice_len(pixels.len());
        let writer = writer.create().unwrap();
        let show = async {
            let mut period = tokio::time::interval(FRAME_PERIOD);
            for sequence in 0.. {
                period.tick().await;
                let sample = writer.loan_slice_uninit(pixels.len()).unwrap();
                let mut sample = sample.write_from_slice(&pixels);
                let capture_ns = groundloop::clock::monotonic_ns();
                let send_ns = capture_ns;
                *sample.user_header_mut() = FrameHeader { sequence, capture_ns, send_ns, ..header };
                sample.send().unwrap();
            }
        };
        let options = groundloop::run::EpisodeOptions { bus, snapshot: None };
        tokio::select! {
            ended = groundloop::run::run_episode(&prepared, options) => ended,
            () = show => unreachable!(),
        }
    });
    let Err(RunError::Fatal(fatal)) = ended else { panic!("{ended:?}") };
    is_bad_input(&fatal, &["nobody was woken for them", "event 4"]);
}

/// Stopped for longer than the wait, the run waits anew: no camera could have been heard.
#[test]
fn a_run_that_was_stopped_waits_anew() {
    let name = unique_run("stopped");
    let sets = ["perception.exemplar={folder=\"sim_320x240\"}", "camera.wait_s=2.0"];
    let sets = sets.iter().flat_map(|set| ["--set", *set]);
    let args = ["run", "configs/photo_blocksworld.toml", "--json", "--run", &name];
    let mut run = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    let ended = runtime().block_on(async {
        let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB).unwrap();
        frames.publish(FrameHeader { schema: SCHEMA, ..FrameHeader::default() }, &[]).unwrap();
        run.wait_for_line("refused");
        run.signal(Signal::STOP);
        // Another run's camera shows frames for longer than this run waits.
        let other = unique_run("stopped-meanwhile");
        let args = ["camera", "images", IMAGE, "--fps", "10", "--frames", "40", "--run", &other];
        assert_eq!(Process::start(&args).end().status.code(), Some(0));
        run.signal(Signal::CONT);
        run.wait_for_line("stood still for");
        run.end()
    });
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
}

/// What is said of a camera is said of a robot, too.
#[test]
fn a_robot_of_another_version_is_told_with_both_versions() {
    let name = unique_run("robot-version");
    let (run, _folder) = external::run(&name, &["robot.wait_s=1"]);
    let ended = runtime().block_on(async {
        let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
        let states: Publisher<DeviceHeader, RobotStateRecord> =
            bus.publisher(&ROBOT_STATE).unwrap();
        let header = DeviceHeader { schema: SCHEMA - 1, ..DeviceHeader::default() };
        states.publish(header, &[RobotStateRecord::default()]).unwrap();
        tokio::task::spawn_blocking(|| run.end()).await.unwrap()
    });
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    let versions =
        format!("messages of schema {}, and this program reads schema {SCHEMA}", SCHEMA - 1);
    assert!(ended.stderr.contains(&versions), "{}", ended.stderr);
}

/// New numbers and stamps, always the same picture, and a robot that moves in it.
#[test]
fn a_frozen_camera_is_told_by_the_robot_that_moves() {
    let name = unique_run("frozen");
    let sets = ["clock=realtime", "perception.exemplar.folder=sim_320x240", "camera.wait_s=2"];
    let (run, _folder) = external::run(&name, &sets);
    let ended = runtime().block_on(async {
        let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
        let states: Publisher<DeviceHeader, RobotStateRecord> =
            bus.publisher(&ROBOT_STATE).unwrap();
        // It looks straight down from two metres: a half turn about x.
        let show = shows(bus, |sequence, header| {
            let capture_ns = groundloop::clock::monotonic_ns();
            let opening_m = 0.05;
            let x = (sequence % 20) as f64 * 0.01;
            let state =
                RobotStateRecord { position: [x, 0.0, 0.4], opening_m, ..Default::default() };
            states
                .publish(
                    groundloop::transport::convert::device_header(sequence, capture_ns),
                    &[state],
                )
                .unwrap();
            FrameHeader {
                sequence,
                capture_ns,
                has_intrinsics: 1,
                has_pose: 1,
                fx: 300.0,
                fy: 300.0,
                cx: 160.0,
                cy: 120.0,
                world_from_camera_xyz: [0.0, 0.0, 2.0],
                world_from_camera_xyzw: [1.0, 0.0, 0.0, 0.0],
                ..header
            }
        });
        tokio::select! {
            ended = tokio::task::spawn_blocking(|| run.end()) => ended.unwrap(),
            () = show => unreachable!(),
        }
    });
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    assert!(
        ended.stderr.contains("pictures are the same, though the robot's tool"),
        "{}",
        ended.stderr
    );
}
