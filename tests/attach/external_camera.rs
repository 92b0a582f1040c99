//! A camera in a process of its own, and messages from processes that nobody asked.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::common::{Ended, Process, data, one_object, project, unique_run};
use groundloop::pddl::{Condition, Problem, SourceText, parse_plan, parse_problem, print_problem};
use groundloop::planning::{PlanRequest, Validation, validate};
use groundloop::run::DomainFolder;
use groundloop::transport::topics::{CAMERA_RGB, GOAL, SCENE};
use groundloop::transport::wire::{FrameHeader, SCHEMA, SceneRecord, TaskHeader};
use groundloop::transport::{Bus, BusConfig, Publisher};
use rustix::process::Signal;

const IMAGE: &str = "domains/blocksworld/exemplar/sim_640x480/a_tower_and_singles.png";

/// A camera process that shows one image.
fn camera(image: &str, run: &str) -> Process {
    let mut camera = Process::start(&["camera", "images", image, "--fps", "20", "--run", run]);
    camera.wait_for_line("publishing images as camera main");
    camera
}

/// A run that looks through an external camera, with the labelled examples of the shipped images.
fn looking(run: &str) -> Process {
    let settings = [
        "perception.exemplar={folder=\"sim_640x480\"}",
        "goal.text=red over blue over green",
        "camera.wait_s=120.0",
    ];
    let args = ["run", "configs/photo_blocksworld.toml", "--json", "--run", run];
    let sets = settings.iter().flat_map(|set| ["--set", *set]);
    Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>())
}

/// The run has seen the image as it is, and has planned from there.
#[track_caller]
fn has_planned(ended: &Ended) {
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let report = ended.json();
    assert_eq!(report["verdict"], "planned", "{report}");
    let lines = |key: &str| {
        let list = report[key].as_array().unwrap().iter();
        list.map(|v| v.as_str().unwrap()).collect::<Vec<_>>().join("\n")
    };
    insta::assert_snapshot!("facts_of_a_tower_and_singles", lines("facts"));
    insta::assert_snapshot!("plan_for_a_tower_and_singles", lines("plan"));
}

#[test]
fn a_camera_in_another_process_is_looked_through() {
    let name = unique_run("camera");
    let camera = camera(IMAGE, &name);
    has_planned(&looking(&name).end());
    camera.signal(Signal::TERM);
    assert_eq!(camera.end().status.code(), Some(0));
}

#[test]
fn a_camera_that_comes_later_is_found() {
    let name = unique_run("later");
    let mut run = looking(&name);
    let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    tokio_test(async {
        let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB).unwrap();
        frames.publish(FrameHeader { schema: SCHEMA, ..FrameHeader::default() }, &[]).unwrap();
        run.wait_for_line("refused");
    });
    let _camera = camera(IMAGE, &name);
    has_planned(&run.end());
}

/// Frames of another size of the same ratio are scaled to the labelled examples.
#[test]
fn a_camera_of_half_the_size_is_looked_through() {
    let name = unique_run("half");
    let image = "domains/blocksworld/exemplar/sim_320x240/a_tower_and_singles.png";
    let _camera = camera(image, &name);
    has_planned(&looking(&name).end());
}

/// What a program writes to its standard output is a camera: here the image with blue first and a gap
/// after each row.
#[test]
fn a_program_in_a_pipe_is_looked_through() {
    let name = unique_run("pipe");
    let folder = tempfile::tempdir().unwrap();
    let raw = folder.path().join("raw");
    let picture = image::open(project(IMAGE)).unwrap().into_rgb8();
    let rows = picture.rows().flat_map(|row| {
        let pixels = row.flat_map(|image::Rgb([red, green, blue])| [*blue, *green, *red]);
        pixels.chain([255; 80]).collect::<Vec<u8>>()
    });
    fs::write(&raw, rows.collect::<Vec<u8>>()).unwrap();
    let forever = format!("while cat '{}'; do :; done", raw.display());
    let layout = ["--size", "640x480", "--encoding", "bgr8", "--stride", "2000"];
    let args = [&["camera", "pipe"][..], &layout, &["--run", &name, "--", "sh", "-c", &forever]];
    let mut camera = Process::start(&args.concat());
    camera.wait_for_line("publishing pipe as camera main");
    has_planned(&looking(&name).end());
    camera.signal(Signal::TERM);
    assert_eq!(camera.end().status.code(), Some(0));
}

#[test]
fn how_a_camera_ends_is_told() {
    let name = unique_run("ended");
    let raw = ["camera", "pipe", "--size", "2x1", "--encoding", "rgb8", "--run", &name];
    let of = |more: &[&str]| Process::start(&[&raw[..], more].concat()).end();
    let failed = of(&["--", "sh", "-c", "printf abcdefgh; echo no device >&2; exit 3"]);
    assert_eq!(failed.status.code(), Some(5), "{}", failed.stderr);
    let expect = "the program sh: it ended with exit status: 3 after 1 pictures, within one: 2 of 6 bytes; it \
                  said: no device";
    assert!(failed.stderr.contains(expect), "{}", failed.stderr);
    let counted = of(&["--frames", "2", "--", "yes"]);
    assert_eq!(counted.status.code(), Some(0), "{}", counted.stderr);
    let wrong = of(&["--stride", "5", "--", "yes"]);
    assert_eq!(wrong.status.code(), Some(2), "{}", wrong.stderr);
    assert!(wrong.stderr.contains("camera.options.stride: expected 6 to"), "{}", wrong.stderr);
    let recording = "tests/attach/recordings/ros2.mcap";
    let mcap = ["camera", "mcap", recording, "--run", &name, "--fps", "50", "--topic"];
    let of = |more: &[&str]| Process::start(&[&mcap[..], more].concat()).end();
    let played = of(&["/camera/image_raw", "--depth-topic", "/depth/image_raw"]);
    assert_eq!(played.status.code(), Some(0), "{}", played.stderr);
    assert!(played.stderr.contains("intrinsics without camera.options.pose"), "{}", played.stderr);
    let nowhere = of(&["/camera"]);
    assert_eq!(nowhere.status.code(), Some(2), "{}", nowhere.stderr);
    assert!(nowhere.stderr.contains("topics with pictures: "), "{}", nowhere.stderr);
}

/// The flags of a kind are its options.
#[test]
fn each_kind_of_camera_explains_its_flags() {
    for (kind, words) in [
        ("images", &["<PATH>", "--repeat <N>", "--intrinsics <INTRINSICS>", "--fps <HZ>"][..]),
        ("mcap", &["--topic <TOPIC>", "--depth-topic", "--again", "--pose <A,B,…>"]),
        ("pipe", &["-- <COMMAND>...", "--size <WIDTHxHEIGHT>", "--encoding", "--stride <N>"]),
    ] {
        let ended = Process::start(&["camera", kind, "--help"]).end();
        assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
        let missing: Vec<_> = words.iter().filter(|word| !ended.stdout.contains(**word)).collect();
        assert!(missing.is_empty(), "{kind}: {missing:?} in {}", ended.stdout);
    }
}

/// Runs something on a runtime like the program's.
fn tokio_test(test: impl Future<Output = ()>) {
    crate::common::runtime().block_on(test);
}

/// A time of day where a monotonic clock should be, nanoseconds.
const UNIX_NS: u64 = 1_800_000_000_000_000_000;

/// A frame as a camera would send it, but for one thing.
struct ForeignFrame {
    header: FrameHeader,
    n_bytes: usize,
    refused_for: &'static str,
}

fn foreign_frames() -> Vec<ForeignFrame> {
    let good = FrameHeader {
        schema: SCHEMA,
        width: 640,
        height: 480,
        stride: 640 * 3,
        ..FrameHeader::default()
    };
    let n_bytes = 640 * 480 * 3;
    let foreign = |header, n_bytes, refused_for| ForeignFrame { header, n_bytes, refused_for };
    let mut frames = vec![
        foreign(FrameHeader { width: 0, height: 0, stride: 0, ..good }, 0, "width x height"),
        foreign(FrameHeader { width: u32::MAX, ..good }, n_bytes, "width x height"),
        foreign(good, n_bytes - 1, "payload: expected 921600 bytes, got 921599"),
        foreign(good, 0, "payload: expected 921600 bytes, got 0"),
        foreign(FrameHeader { stride: 640, ..good }, n_bytes, "stride"),
        foreign(FrameHeader { encoding: 7, ..good }, n_bytes, "encoding"),
        foreign(
            FrameHeader { has_intrinsics: 1, has_pose: 1, fx: f64::NAN, ..good },
            n_bytes,
            "fx, fy, cx, cy",
        ),
        foreign(
            FrameHeader { width: 320, height: 200, stride: 960, ..good },
            320 * 200 * 3,
            "the labelled examples are 640x480 pixels, the frame is 320x200: frames of the same ratio",
        ),
        foreign(FrameHeader { schema: SCHEMA + 1, ..good }, n_bytes, "schema"),
        foreign(good, n_bytes, "capture_ns is 0: stamp with CLOCK_MONOTONIC"),
        foreign(FrameHeader { capture_ns: UNIX_NS, ..good }, n_bytes, "s in the future"),
    ];
    for (frame, sequence) in frames.iter_mut().zip(1_000..) {
        frame.header.sequence = sequence;
    }
    frames
}

/// Frames that cannot be used are counted by kind, and `topics list` shows the counts.
#[test]
fn refused_frames_are_counted_by_kind() {
    let name = unique_run("counted");
    let mut run = looking(&name);
    let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    tokio_test(async {
        let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB).unwrap();
        for frame in foreign_frames() {
            frames.publish(frame.header, &vec![9; frame.n_bytes]).unwrap();
            run.wait_for_line(frame.refused_for);
        }
        let list = ["topics", "list", "--run", &name, "--for-s", "1.5"];
        let listed = Process::start(&list).end();
        let expect = "scene_parser: 10 messages refused (7 malformed, 1 of another size, 1 with a stamp that \
                      stands still or is none, 1 from the future), the last: capture_ns is";
        assert!(listed.stdout.contains(expect), "{}", listed.stdout);
    });
    run.signal(Signal::TERM);
    run.end();
}

/// Everything that is wrong with a message is told, and the run goes on as if it had not come.
#[test]
fn foreign_messages_do_not_end_a_run() {
    let name = unique_run("foreign");
    let mut run = looking(&name);
    let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    let folder = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    let (right, wrong) = (folder.hash, folder.hash ^ 1);
    tokio_test(async {
        let frames: Publisher<FrameHeader, u8> = bus.publisher(&CAMERA_RGB).unwrap();
        for frame in foreign_frames() {
            frames.publish(frame.header, &vec![9; frame.n_bytes]).unwrap();
            run.wait_for_line(frame.refused_for);
        }
        drop(frames);
        let scenes: Publisher<TaskHeader, SceneRecord> = bus.publisher(&SCENE).unwrap();
        let goals: Publisher<TaskHeader, u8> = bus.publisher(&GOAL).unwrap();
        let no_number = SceneRecord {
            score: f32::NAN,
            pixel_box: [f64::NAN; 4],
            state: 3,
            ..SceneRecord::default()
        };
        for (cycle, domain_hash, refused_for) in
            [(7, wrong, "domain_hash"), (u64::MAX, right, "run_id"), (3, right, "run_id")]
        {
            let header = TaskHeader { cycle, domain_hash, ..TaskHeader::default() };
            goals.publish(header, b"(:goal (and").unwrap();
            scenes.publish(header, &[no_number; 3]).unwrap();
            run.wait_for_line(refused_for);
        }
    });
    let _camera = camera(IMAGE, &name);
    has_planned(&run.end());
}

// ── photographs ─────────────────────────────────────────────────────────────────────────────────

/// A photograph of the data set through two processes: facts as labelled, and a plan that the
/// validator accepts.
fn photograph(domain: &str, config: &str, number: u32, goal: &str) {
    let what = format!("a photograph of {domain} through two processes");
    let Some(root) = data("prodgv", &what) else { return };
    let files = root.join("data").join(domain);
    let image = files.join(format!("observations/problem{number}.jpg"));
    let name = unique_run(domain);
    let _camera = camera(image.to_str().unwrap(), &name);
    let goal = format!("goal.text={goal}");
    let args = ["run", config, "--json", "--run", &name, "--data", root.to_str().unwrap()];
    let sets = ["--set", &goal, "--set", "camera.wait_s=120.0"];
    let ended = Process::start(&[&args[..], &sets].concat()).end();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let report = one_object(&ended.stdout);
    assert_eq!(report["verdict"], "planned");
    let strings = |key: &str| -> Vec<&str> {
        report[key].as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect()
    };
    let folder = DomainFolder::read(&project("domains").join(domain)).unwrap();
    let labelled = labelled(&files.join(format!("problems/problem{number}.pddl")), &folder);
    let seen: BTreeSet<String> = strings("facts").into_iter().map(str::to_owned).collect();
    assert_eq!(seen, labelled.init.iter().map(ToString::to_string).collect());
    let problem = Problem { goal: parse_goal(&report["goal"], &labelled, &folder), ..labelled };
    let steps = parse_plan(&SourceText::new("plan", strings("plan").join("\n"))).unwrap();
    let checked = validate(&folder.domain, &PlanRequest::new(&problem), &steps);
    assert!(matches!(checked, Validation::Valid { .. }), "{checked:?}: {report}");
    assert!(!steps.is_empty());
}

/// A labelled problem of the data set, which calls the arm `bot`.
fn labelled(path: &Path, folder: &DomainFolder) -> Problem {
    let text = fs::read_to_string(path).unwrap();
    let text = text.replace("bot)", "arm)").replace("bot - ", "arm - ");
    let source = SourceText::new(path.display().to_string(), text);
    parse_problem(&source, &folder.domain).unwrap().value
}

/// A goal that a report tells, about the objects of a problem.
fn parse_goal(goal: &serde_json::Value, problem: &Problem, folder: &DomainFolder) -> Condition {
    let goal = goal.as_str().unwrap();
    let empty = Problem { goal: Condition::True, ..problem.clone() };
    let text = print_problem(&empty).replace("(:goal (and))", &format!("(:goal {goal})"));
    let parsed = parse_problem(&SourceText::new("goal", text), &folder.domain).unwrap().value;
    assert_ne!(parsed.goal, Condition::True, "{goal}");
    parsed.goal
}

#[test]
fn a_photograph_of_blocks_is_planned_from() {
    let goal = "yellow over pink over green over red over purple over orange";
    photograph("blocksworld", "configs/photo_blocksworld.toml", 7, goal);
}

#[test]
fn a_photograph_of_disks_is_planned_from() {
    let goal = "Move all disks to the rightmost peg.";
    photograph("hanoi", "configs/photo_hanoi.toml", 10, goal);
}
