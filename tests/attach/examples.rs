//! The programs of `examples/` run, and print what they are for.
//! `tests/attach/external_robot.rs` has `attach_robot`, `tests/planning/llama_server.rs` what `llama_server.py` serves.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{Killed, SMALL_CAMERA, example, external, files_below, project, unique_run};
use groundloop::perception::ImageView;
use groundloop::transport::convert::frame_from_wire;
use groundloop::transport::topics::CAMERA_RGB;
use groundloop::transport::wire::FrameHeader;
use groundloop::transport::{Bus, BusConfig, Depth, Received, Subscriber};
use rustix::process::{Pid, Signal, kill_process};

/// What an example prints that needs nobody else.
#[track_caller]
fn printed(name: &str) -> String {
    let output = Command::new(example(name)).current_dir(project("")).output().unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{name}: {}\n{errors}", output.status);
    assert_eq!(errors, "", "{name}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn own_detector_finds_the_red_block() {
    insta::assert_snapshot!("own_detector", printed("own_detector"));
}

#[test]
fn own_planner_finds_a_valid_plan() {
    insta::assert_snapshot!("own_planner", printed("own_planner"));
}

#[test]
fn own_skill_goes_down_to_a_block_and_up() {
    insta::assert_snapshot!("own_skill", printed("own_skill"));
}

#[test]
fn plan_from_rust_plans() {
    insta::assert_snapshot!("plan_from_rust", printed("plan_from_rust"));
}

/// The examples that want the name of a run say so.
#[test]
fn an_example_without_its_argument_says_how_it_is_used() {
    for name in ["attach_camera", "attach_robot", "watch_the_bus"] {
        let output = Command::new(example(name)).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{name}");
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(said, format!("usage: {name} NAME\n"));
    }
}

/// Whoever watches a run is told what it is, and what happens up to its end.
#[test]
fn watch_the_bus_follows_a_run_to_its_end() {
    let name = unique_run("watched");
    // The run waits for its camera and robot, so that the watcher has joined before anything happens.
    let [_, _, exemplars] = SMALL_CAMERA;
    let (run, _folder) = external::run(&name, &[exemplars, "robot.wait_s=120"]);
    let mut watcher = Killed::start(&example("watch_the_bus"), &[&name], Stdio::piped());
    let pid = Pid::from_child(&watcher.0);
    let wait = move || {
        let ended = run.end();
        if !ended.status.success() {
            // Nothing would come any more.
            kill_process(pid, Signal::KILL).unwrap();
        }
        ended
    };
    let ended = std::thread::Builder::new().name("run".to_owned()).spawn(wait).unwrap();
    let mut lines = BufReader::new(watcher.0.stdout.take().unwrap());
    let mut first = String::new();
    lines.read_line(&mut first).unwrap();
    let _hardware = external::hardware(&name, &SMALL_CAMERA);
    let mut rest = String::new();
    lines.read_to_string(&mut rest).unwrap();
    let ended = ended.join().unwrap();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    assert!(watcher.0.wait().unwrap().success());
    assert_eq!(first, format!("run {name}: domain blocksworld, seed 1\n"));
    let n_lines = |text: &str| rest.lines().filter(|line| line.contains(text)).count();
    assert_eq!(n_lines(" plan: "), 1, "{rest}");
    assert!(n_lines(" started (") >= 4 && n_lines(" started (") == n_lines(" done ("), "{rest}");
    assert!(rest.lines().last().unwrap().contains("end: reached"), "{rest}");
}

/// The columns of the red square that both cameras of `examples/` show in their row 240.
fn square(received: &Received<FrameHeader, u8>) -> (u64, Vec<usize>) {
    let frame = frame_from_wire(received.header(), received.records()).unwrap();
    assert_eq!((frame.width, frame.height), (640, 480));
    assert!(frame.model.is_none());
    let view = ImageView::new(640, 480, frame.rgb).unwrap();
    let row = view.row(240).chunks_exact(3);
    let columns = row.enumerate().filter(|(_, pixel)| *pixel == [200, 40, 40]).map(|(x, _)| x);
    (received.header().sequence, columns.collect())
}

/// A run hears a camera of one's own: numbered frames on which a square moves.
fn shows_a_moving_square(program: &Path, args: &[&str], name: &str) {
    let bus = Bus::open(&BusConfig::for_run(name.to_owned())).unwrap();
    crate::common::runtime().block_on(async {
        let depth = Depth::all(CAMERA_RGB.depth_max);
        let mut frames: Subscriber<FrameHeader, u8> = bus.subscriber(&CAMERA_RGB, depth).unwrap();
        let _camera = Killed::start(program, args, Stdio::null());
        let mut before = None;
        for _ in 0..4 {
            let received = frames.next().await.unwrap();
            let (sequence, columns) = square(&received);
            let left = sequence as usize % 560;
            assert_eq!(columns, (left..left + 80).collect::<Vec<_>>());
            let capture_ns = received.header().capture_ns;
            if let Some((sequence_before, capture_ns_before)) = before {
                // A frame may be overtaken while this process waits for a processor.
                assert!(sequence > sequence_before && capture_ns > capture_ns_before);
            }
            before = Some((sequence, capture_ns));
        }
    });
}

#[test]
fn attach_camera_publishes_frames() {
    let name = unique_run("camera-rs");
    shows_a_moving_square(&example("attach_camera"), &[&name], &name);
}

/// Boards that are drawn as a known camera sees them calibrate it; without `OpenCV` it says how to get it.
#[test]
fn calibrate_finds_a_known_camera() {
    let mut command = Command::new("python3");
    let path = "examples/calibrate.py";
    let output = command.args([path, "--self-test"]).current_dir(project("")).output().unwrap();
    let [stdout, stderr] = [&output.stdout, &output.stderr].map(|b| String::from_utf8_lossy(b));
    if output.status.code() == Some(5) {
        assert!(stderr.contains("pip install opencv-python-headless"), "{stderr}");
        println!("skipped: {stderr}");
        return;
    }
    assert_eq!(output.status.code(), Some(0), "{stdout}{stderr}");
    assert!(stdout.starts_with("20 pictures, reprojection error 0.0"), "{stdout}");
}

/// An example that is added is run by a test.
#[test]
fn every_example_is_run_by_a_test() {
    let tests = files_below(&project("tests"), "rs");
    let tests: String = tests.iter().map(|t| std::fs::read_to_string(t).unwrap()).collect();
    let examples =
        [files_below(&project("examples"), "rs"), files_below(&project("examples"), "py")];
    for path in examples.concat() {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let calls = if path.extension().unwrap() == "rs" {
            [format!("printed(\"{name}\")"), format!("example(\"{name}\")")]
        } else {
            [format!("\"examples/{name}.py\""), format!("`examples/{name}.py`")]
        };
        let is_run = calls.iter().any(|call| tests.contains(call));
        assert!(is_run, "no test runs {}", path.display());
    }
}
