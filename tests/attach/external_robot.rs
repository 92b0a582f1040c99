//! A robot, and the camera that sees what it does, in a process of their own.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::process::Stdio;

use crate::common::external::{CONFIG, hardware, run, waypoint};
use crate::common::{Killed, Process, SMALL_CAMERA, example, project, small, unique_run};
use groundloop::actors::Monitor;
use groundloop::messages::{Command, CommandKind, Event, Motion, StatusKind};
use groundloop::run::{HardwarePorts, PreparedRun, load_run};
use groundloop::transport::convert::{
    command_to_wire, device_header, robot_state_from_wire, status_from_wire,
};
use groundloop::transport::topics::{RELIABLE_DEPTH, ROBOT_COMMAND, ROBOT_STATE, ROBOT_STATUS};
use groundloop::transport::wire::{CommandRecord, DeviceHeader, RobotStateRecord, StatusRecord};
use groundloop::transport::{Bus, BusConfig, Depth, EventReader, Publisher, Received, Subscriber};
use nalgebra::Point3;
use rustix::process::Signal;
use tokio::task::JoinSet;

/// Two processes decide as one does: every decision is that of the run with both in one process.
#[test]
fn a_robot_in_another_process_reaches_the_goal() {
    let name = unique_run("robot");
    let hardware = hardware(&name, &[]);
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

/// The run files to copy for real arms are whole: what is copied starts.
#[test]
fn run_files_for_real_arms_can_be_read() {
    for name in ["real_arm_eye_to_hand", "real_arm_eye_in_hand"] {
        let config = load_run(&project("configs").join(name).with_extension("toml"), &[]).unwrap();
        assert_eq!(
            (config.camera.kind.as_str(), config.robot.kind.as_str()),
            ("external", "external")
        );
        PreparedRun::read(config, None).unwrap();
    }
}

#[test]
fn a_robot_that_does_not_come_ends_the_run_with_its_own_exit_code() {
    let name = unique_run("no-robot");
    let _hardware = hardware(&unique_run("elsewhere"), &[]);
    let ended = run(&name, &["robot.wait_s=0.1"]).0.end();
    assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
    assert!(ended.stderr.contains("the robot"), "{}", ended.stderr);
    assert!(ended.stderr.contains("robot.wait_s"), "{}", ended.stderr);
}

/// `examples/attach_robot.rs` carries out a motion and says so.
#[test]
fn the_example_follows_waypoints() {
    let name = unique_run("example");
    let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    let program = example("attach_robot");
    crate::common::runtime().block_on(async {
        let commands: Publisher<DeviceHeader, CommandRecord> =
            bus.publisher(&ROBOT_COMMAND).unwrap();
        let mut states: Subscriber<DeviceHeader, RobotStateRecord> =
            bus.subscriber(&ROBOT_STATE, Depth::newest()).unwrap();
        let mut statuses: Subscriber<DeviceHeader, StatusRecord> =
            bus.subscriber(&ROBOT_STATUS, Depth::all(RELIABLE_DEPTH)).unwrap();
        let _robot = Killed::start(&program, &[&name], Stdio::null());
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

/// In real time nobody waits for anybody, and the loop closes over both processes all the same.
#[test]
fn a_robot_in_another_process_reaches_the_goal_in_real_time() {
    let name = unique_run("realtime");
    let clock = "clock=realtime";
    let hardware = hardware(&name, &[clock, SMALL_CAMERA[0], SMALL_CAMERA[1]]);
    // Whether the goal is reached shall not depend on how busy the machine is.
    let patient =
        ["robot.wait_s=120", "limits.state_age_ms_max=60000", "limits.skill_timeout_s=600"];
    let sets = [clock, SMALL_CAMERA[2], "goal.text=blue over green"];
    let ended = run(&name, &[&sets[..], &patient].concat()).0.end();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let report = ended.json();
    assert_eq!(report["verdict"], "reached", "{report}");
    assert!(report["skills_done"].as_u64().unwrap() >= 2, "{report}");
    hardware.signal(Signal::TERM);
    assert_eq!(hardware.end().status.code(), Some(0));
}

/// The robot is lost while it carries a step out, and the camera goes on. The run says what is missing.
fn lost(clock: &str) {
    let name = unique_run(&format!("lost-{clock}"));
    let clock = format!("clock={clock}");
    let config = small("blocksworld.toml", &[&clock]);
    let ports = HardwarePorts::build(&config, &config.domain_folder().unwrap()).unwrap();
    let sets = [&clock, SMALL_CAMERA[2], "robot.wait_s=2", "camera.wait_s=120"];
    let (run, _folder) = run(&name, &sets);
    crate::common::runtime().block_on(async {
        let bus = Bus::open(&BusConfig::for_run(name)).unwrap();
        let mut events = EventReader::open(&bus).unwrap();
        let [mut camera, mut robot] = [JoinSet::new(), JoinSet::new()];
        for actor in ports.actors(&bus, &Monitor::default()) {
            let playing = if actor.name == "robot" { &mut robot } else { &mut camera };
            playing.spawn((actor.serve)());
        }
        while !matches!(events.next().await.unwrap().event, Event::Started { .. }) {}
        robot.shutdown().await;
        let ended = tokio::task::spawn_blocking(|| run.end()).await.unwrap();
        assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
        let said = ended.stderr.lines().last().unwrap();
        let expected = "error: the robot: no state on robot/state for 2.0 s is missing: \
             start the process that plays it, or raise robot.wait_s; nobody writes robot/state of run";
        assert!(said.starts_with(expected), "{said}");
    });
}

#[test]
fn a_robot_that_is_lost_in_real_time_ends_the_run() {
    lost("realtime");
}

#[test]
fn a_robot_that_is_lost_in_lockstep_ends_the_run() {
    lost("lockstep");
}
