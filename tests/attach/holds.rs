//! Nobody watches, or the run ends in mid-skill: the robot is told to hold.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use crate::common::{Ended, Process, SMALL_CAMERA, external, runtime, small, unique_run};
use groundloop::actors::Monitor;
use groundloop::messages::{CommandKind, Control, Event, StatusKind};
use groundloop::run::HardwarePorts;
use groundloop::transport::convert::{
    command_from_wire, control_to_wire, device_header, status_from_wire,
};
use groundloop::transport::topics::{CONTROL, RELIABLE_DEPTH, ROBOT_COMMAND, ROBOT_STATUS};
use groundloop::transport::wire::{CommandRecord, ControlRecord, DeviceHeader, StatusRecord};
use groundloop::transport::{Bus, BusConfig, Depth, EventReader, Publisher, Subscriber};
use rustix::process::Signal;
use tokio::task::JoinSet;

/// What is done to the run once its first skill moves the robot.
#[derive(Clone, Copy, PartialEq)]
enum Trouble {
    /// The camera's process ends.
    CameraEnds,
    /// The robot's process ends.
    RobotEnds,
    /// Somebody pauses the loop; once the robot has been told to hold, the run is stopped.
    Pause,
    /// The run's terminal is closed.
    Signal(Signal),
}

/// A run in real time whose first skill has just begun; camera and robot are played here.
struct Moving {
    run: Process,
    bus: Bus,
    commands: Subscriber<DeviceHeader, CommandRecord>,
    statuses: Subscriber<DeviceHeader, StatusRecord>,
    events: EventReader,
    camera: JoinSet<()>,
    robot: JoinSet<()>,
    _folder: tempfile::TempDir,
}

impl Moving {
    async fn start(what: &str, sets: &[&str]) -> Self {
        let name = unique_run(&format!("holds-{what}"));
        let clock = "clock=realtime";
        let config = small("blocksworld.toml", &[clock]);
        let ports = HardwarePorts::build(&config, &config.domain_folder().unwrap()).unwrap();
        let sets = [&[clock, SMALL_CAMERA[2], "robot.wait_s=120"], sets].concat();
        let (run, folder) = external::run(&name, &sets);
        let bus = Bus::open(&BusConfig::for_run(name)).unwrap();
        let commands = bus.subscriber(&ROBOT_COMMAND, Depth::all(RELIABLE_DEPTH)).unwrap();
        let statuses = bus.subscriber(&ROBOT_STATUS, Depth::all(RELIABLE_DEPTH)).unwrap();
        let mut events = EventReader::open(&bus).unwrap();
        let [mut camera, mut robot] = [JoinSet::new(), JoinSet::new()];
        for actor in ports.actors(&bus, &Monitor::default()) {
            let playing = if actor.name == "robot" { &mut robot } else { &mut camera };
            playing.spawn(async move { (actor.serve)().await.unwrap() });
        }
        while !matches!(events.next().await.unwrap().event, Event::Started { .. }) {}
        Self { run, bus, commands, statuses, events, camera, robot, _folder: folder }
    }

    async fn command(&mut self) -> CommandKind {
        let command = self.commands.next().await.unwrap();
        command_from_wire(command.header(), command.records()).unwrap().kind
    }
}

/// Makes trouble in mid-skill: how the run ends, all commands, and what was told.
fn commands_after(
    what: &str,
    trouble: Trouble,
    sets: &[&str],
) -> (Ended, Vec<CommandKind>, String) {
    runtime().block_on(async {
        let mut moving = Moving::start(what, sets).await;
        match trouble {
            Trouble::CameraEnds => moving.camera.shutdown().await,
            Trouble::RobotEnds => moving.robot.shutdown().await,
            Trouble::Pause => {
                let controls: Publisher<DeviceHeader, ControlRecord> =
                    moving.bus.publisher(&CONTROL).unwrap();
                let pause = control_to_wire(Control::Pause);
                controls.publish(device_header(0, 0), &[pause]).unwrap();
                while moving.command().await != CommandKind::Hold {}
                moving.run.signal(Signal::TERM);
            }
            Trouble::Signal(signal) => moving.run.signal(signal),
        }
        let Moving { run, mut commands, mut events, .. } = moving;
        let mut ended = tokio::task::spawn_blocking(|| run.end());
        let (mut kinds, mut told) = (Vec::new(), Vec::new());
        let ended = loop {
            tokio::select! {
                biased;
                command = commands.next() => {
                    let command = command.unwrap();
                    let read = command_from_wire(command.header(), command.records()).unwrap();
                    kinds.push(read.kind);
                }
                event = events.next() => told.push(event.unwrap().event),
                ended = &mut ended => break ended.unwrap(),
            }
        };
        (ended, kinds, format!("{told:#?}"))
    })
}

/// All commands after the first hold are holds.
#[track_caller]
fn holds_until_the_end(commands: &[CommandKind]) {
    let mut after = commands.iter().skip_while(|kind| **kind != CommandKind::Hold);
    assert!(after.all(|kind| *kind == CommandKind::Hold), "{commands:?}");
}

#[test]
fn a_robot_that_nobody_watches_is_told_to_hold() {
    let sets = ["camera.wait_s=4", "limits.unwatched_ms_max=500"];
    let (ended, commands, told) = commands_after("camera", Trouble::CameraEnds, &sets);
    assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
    assert!(told.contains("the robot holds: no frame has led to a plan for "), "{told}");
    let holds = commands.iter().rev().take_while(|kind| **kind == CommandKind::Hold).count();
    assert!(holds > 3, "said again and again until the end: {commands:?}");
}

/// Frames go on and lead to plans, and nobody knows what the robot does.
#[test]
fn a_robot_that_says_nothing_is_told_to_hold() {
    let sets = ["robot.wait_s=4", "limits.unwatched_ms_max=500"];
    let (ended, commands, told) = commands_after("robot", Trouble::RobotEnds, &sets);
    assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
    assert!(told.contains("the robot holds: no state of the robot for "), "{told}");
    assert!(commands.iter().filter(|kind| **kind == CommandKind::Hold).count() > 3, "{commands:?}");
    holds_until_the_end(&commands);
}

#[test]
fn a_paused_robot_is_told_nothing_but_to_hold() {
    let (_, commands, _) = commands_after("pause", Trouble::Pause, &[]);
    assert!(commands.iter().all(|kind| *kind == CommandKind::Hold), "{commands:?}");
}

/// Nobody is left who could say hold.
#[test]
fn a_robot_whose_run_is_killed_holds_by_itself() {
    runtime().block_on(async {
        let mut moving = Moving::start("killed", &[]).await;
        moving.run.signal(Signal::KILL);
        loop {
            let status = moving.statuses.next().await.unwrap();
            let status = status_from_wire(status.header(), status.records()).unwrap();
            if status.kind == StatusKind::Cancelled {
                break;
            }
            assert_eq!(status.kind, StatusKind::Accepted, "the motion was over before");
        }
        moving.run.end();
    });
}

#[test]
fn the_last_word_of_a_run_is_hold() {
    for (what, signal) in [("hang-up", Signal::HUP), ("terminate", Signal::TERM)] {
        let (ended, commands, _) = commands_after(what, Trouble::Signal(signal), &[]);
        assert_eq!(ended.status.code(), Some(143), "{}", ended.stderr);
        assert_eq!(commands.last(), Some(&CommandKind::Hold), "{commands:?}");
    }
}

/// Whatever is wrong with a name is told before anything starts.
#[test]
fn a_run_has_a_plain_name() {
    for name in ["two words", "a/../b", "h\u{e9}llo", &"x".repeat(65)] {
        let ended = Process::start(&["run", external::CONFIG, "--run", name]).end();
        assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
        assert!(ended.stderr.contains("letters a-z, digits"), "{}", ended.stderr);
    }
}

/// A process that was killed between making and sizing a file leaves it empty: iceoryx2 would wait for it without
/// an end.
#[test]
fn what_a_killed_start_left_empty_keeps_nobody() {
    let BusConfig { prefix, .. } = BusConfig::for_run("x");
    let left = std::path::PathBuf::from(format!(
        "/dev/shm/{prefix}left_by_{}.dynamic",
        std::process::id()
    ));
    std::fs::write(&left, "").unwrap();
    let ended = Process::start(&["topics", "list", "--run", &unique_run("nobody")]).end();
    assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
    assert!(!left.exists());
}
