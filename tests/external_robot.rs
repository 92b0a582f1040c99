//! A robot, and the camera that sees what it does, in a process of their own.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

mod common;

use std::path::PathBuf;

use common::{Process, unique_run};
use groundloop::messages::{Command, CommandKind, Expect, Motion, StatusKind, Waypoint};
use groundloop::transport::convert::{
    command_to_wire, device_header, robot_state_from_wire, status_from_wire,
};
use groundloop::transport::topics::{RELIABLE_DEPTH, ROBOT_COMMAND, ROBOT_STATE, ROBOT_STATUS};
use groundloop::transport::wire::{CommandRecord, DeviceHeader, RobotStateRecord, StatusRecord};
use groundloop::transport::{Bus, BusConfig, Depth, Publisher, Received, Subscriber};
use nalgebra::Point3;
use rustix::process::Signal;

const CONFIG: &str = "configs/blocksworld.toml";

/// A run file for the same task, whose camera and robot are played elsewhere. How a robot of one's own
/// moves, and what it hides, is one's own to say.
const EXTERNAL: &str = r#"
extends = "blocksworld"

[camera]
kind = "external"
wait_s = 120.0

[robot]
kind = "external"

[robot.motion]
travel_z_m = 0.55
speed_m_s = 1.2
approach_speed_m_s = 0.3
approach_m = 0.04
jaw_clearance_m = 0.03
opening_m_max = 0.13
grip_depth_m = 0.025
release_gap_m = 0.002
table_clearance_m = 0.03
table_z_m = 0.0
place_x_m = [-0.30, 0.30]
place_y_m = -0.02
reach_x_m = [-0.45, 0.45]
reach_y_m = [-0.30, 0.25]
view_poses = []

[robot.self_filter]
beyond_jaws_m = 0.03
half_depth_m = 0.03
below_m = 0.02
above_m = 0.60
"#;

/// A run whose camera and robot are played elsewhere.
fn run(name: &str, sets: &[&str]) -> (Process, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("external.toml");
    std::fs::write(&path, EXTERNAL).unwrap();
    let sets = sets.iter().flat_map(|set| ["--set", *set]);
    let args = ["run", path.to_str().unwrap(), "--json", "--run", name];
    let process = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    (process, folder)
}

/// A process that plays the simulated camera and gripper of the run file.
fn hardware(name: &str) -> Process {
    let mut hardware = Process::start(&["hardware", CONFIG, "--run", name]);
    hardware.wait_for_line("playing camera and robot");
    hardware
}

/// Two processes decide as one does: every decision is that of the run with both in one process.
#[test]
fn a_robot_in_another_process_reaches_the_goal() {
    let name = unique_run("robot");
    let hardware = hardware(&name);
    let ended = run(&name, &["robot.wait_s=120"]).0.end();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let two = ended.json();
    assert_eq!(two["verdict"], "reached", "{two}");
    assert!(two["skills_done"].as_u64().unwrap() >= 4, "{two}");
    hardware.signal(Signal::TERM);
    assert_eq!(hardware.end().status.code(), Some(0));

    let ended = Process::start(&["run", CONFIG, "--json"]).end();
    let one = ended.json();
    assert_eq!(two["decision_hash"], one["decision_hash"], "{two}\n{one}");
}

#[test]
fn a_robot_that_does_not_come_ends_the_run_with_its_own_exit_code() {
    let name = unique_run("no-robot");
    let _hardware = hardware(&unique_run("elsewhere"));
    let ended = run(&name, &["robot.wait_s=0.1"]).0.end();
    assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
    assert!(ended.stderr.contains("the robot"), "{}", ended.stderr);
    assert!(ended.stderr.contains("robot.wait_s"), "{}", ended.stderr);
}

fn waypoint(z: f64) -> Waypoint {
    Waypoint {
        position: Point3::new(0.1, 0.0, z),
        yaw_rad: 0.0,
        opening_m: 0.05,
        speed_m_s: 5.0,
        expect: Expect::Empty,
        retractable: true,
    }
}

/// The program of an example. Tests and examples lie in folders beside each other.
fn example(name: &str) -> PathBuf {
    let folder = std::env::current_exe().unwrap().ancestors().nth(2).unwrap().to_owned();
    let program = folder.join("examples").join(name);
    if !program.is_file() {
        // Only a run of all tests builds examples.
        let profile = if folder.ends_with("debug") { "dev" } else { "release" };
        let args = ["build", "--quiet", "--profile", profile, "--example", name];
        let built = std::process::Command::new(env!("CARGO")).args(args).status().unwrap();
        assert!(built.success());
    }
    program
}

/// A process that ends with the test, however that ends.
struct Killed(std::process::Child);

impl Drop for Killed {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

/// `examples/attach_robot.rs` carries out a motion and says so.
#[test]
fn the_example_follows_waypoints() {
    let name = unique_run("example");
    let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    let program = example("attach_robot");
    common::runtime().block_on(async {
        let commands: Publisher<DeviceHeader, CommandRecord> =
            bus.publisher(&ROBOT_COMMAND).unwrap();
        let mut states: Subscriber<DeviceHeader, RobotStateRecord> =
            bus.subscriber(&ROBOT_STATE, Depth::newest()).unwrap();
        let mut statuses: Subscriber<DeviceHeader, StatusRecord> =
            bus.subscriber(&ROBOT_STATUS, Depth::all(RELIABLE_DEPTH)).unwrap();
        let child = std::process::Command::new(program).arg(&name).spawn().unwrap();
        let _robot = Killed(child);
        let read = |m: Received<_, _>| robot_state_from_wire(m.header(), m.records());
        let first = states.newest_of(read).await.unwrap();
        assert!(first.position.z > 0.4 && !first.holding);
        let motion = Motion { waypoints: vec![waypoint(0.3), waypoint(0.1)] };
        let command = Command {
            id: 1,
            frame_sequence: 0,
            capture_ns: 0,
            kind: CommandKind::Start(motion),
            step: None,
        };
        commands.publish(device_header(0, 0), &[command_to_wire(&command).unwrap()]).unwrap();
        for wanted in [StatusKind::Accepted, StatusKind::Done] {
            let status = statuses.next().await.unwrap();
            let status = status_from_wire(status.header(), status.records()).unwrap();
            assert_eq!((status.command_id, status.kind), (1, wanted));
        }
        // States from before its end may still be waiting.
        let mut last = first;
        while last.position.z > 0.11 || last.command_id.is_some() {
            last = states.newest_of(read).await.unwrap();
        }
        assert!((last.position - Point3::new(0.1, 0.0, 0.1)).norm() < 1e-3, "{last:?}");
    });
}
