//! Nobody watches, or the run ends in mid-skill: the robot is told to hold.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use crate::common::{Ended, Process, SMALL_CAMERA, external, runtime, small, unique_run};
use groundloop::actors::Monitor;
use groundloop::messages::{CommandKind, Event};
use groundloop::run::HardwarePorts;
use groundloop::transport::convert::command_from_wire;
use groundloop::transport::topics::{RELIABLE_DEPTH, ROBOT_COMMAND};
use groundloop::transport::wire::{CommandRecord, DeviceHeader};
use groundloop::transport::{Bus, BusConfig, Depth, EventReader, Subscriber};
use rustix::process::Signal;
use tokio::task::JoinSet;

/// What is done to the run once its first skill moves the robot.
#[derive(Clone, Copy, PartialEq)]
enum Trouble {
    /// The camera's process ends.
    CameraEnds,
    /// The run's terminal is closed.
    Signal(Signal),
}

/// Makes trouble in mid-skill: how the run ends, all commands, and what was told.
fn commands_after(
    what: &str,
    trouble: Trouble,
    sets: &[&str],
) -> (Ended, Vec<CommandKind>, String) {
    let name = unique_run(&format!("holds-{what}"));
    let clock = "clock=realtime";
    let config = small("blocksworld.toml", &[clock]);
    let ports = HardwarePorts::build(&config, &config.domain_folder().unwrap()).unwrap();
    let sets = [&[clock, SMALL_CAMERA[2], "robot.wait_s=120"], sets].concat();
    let (run, _folder) = external::run(&name, &sets);
    runtime().block_on(async {
        let bus = Bus::open(&BusConfig::for_run(name)).unwrap();
        let mut commands: Subscriber<DeviceHeader, CommandRecord> =
            bus.subscriber(&ROBOT_COMMAND, Depth::all(RELIABLE_DEPTH)).unwrap();
        let mut events = EventReader::open(&bus).unwrap();
        let [mut camera, mut robot] = [JoinSet::new(), JoinSet::new()];
        for actor in ports.actors(&bus, &Monitor::default()) {
            let playing = if actor.name == "robot" { &mut robot } else { &mut camera };
            playing.spawn((actor.serve)());
        }
        while !matches!(events.next().await.unwrap().event, Event::Started { .. }) {}
        match trouble {
            Trouble::CameraEnds => camera.shutdown().await,
            Trouble::Signal(signal) => run.signal(signal),
        }
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

#[test]
fn a_robot_that_nobody_watches_is_told_to_hold() {
    let sets = ["camera.wait_s=4", "limits.unwatched_ms_max=500"];
    let (ended, commands, told) = commands_after("camera", Trouble::CameraEnds, &sets);
    assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
    assert!(told.contains("the robot holds: no frame has led to a plan for "), "{told}");
    let holds = commands.iter().rev().take_while(|kind| **kind == CommandKind::Hold).count();
    assert!(holds > 3, "said again and again until the end: {commands:?}");
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
