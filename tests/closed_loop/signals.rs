//! Ctrl-C and SIGTERM: the robot holds, and there is a verdict all the same.
#![cfg(feature = "sim")]

use std::net::TcpListener;

use crate::common::{Ended, Process, SMALL_CAMERA, runtime, unique_run};
use groundloop::transport::{Bus, BusConfig, join};
use rustix::process::Signal;

/// Stops a run in the middle of a skill.
#[track_caller]
fn stopped_by(signal: Signal, code: i32) {
    let sets = SMALL_CAMERA.iter().chain(&["clock=realtime"]).flat_map(|set| ["--set", *set]);
    let args: Vec<&str> =
        ["run", "configs/blocksworld.toml", "--json"].into_iter().chain(sets).collect();
    let mut run = Process::start(&args);
    run.wait_for_line(" skill ");
    run.signal(signal);
    let ended = run.end();
    assert_eq!(ended.status.code(), Some(code), "{}", ended.stderr);
    let report = ended.json();
    assert_eq!(report["verdict"], "stopped", "{report}");
    assert!(report["cycles"].as_u64().is_some_and(|n| n > 0), "{report}");
    assert!(ended.stderr.contains(" end     stopped"), "{}", ended.stderr);
    assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
}

/// Ends a run while it does what it says in a line.
fn ended_while(line: &str, sets: &[&str], signals: &[Signal]) -> Ended {
    let sets = SMALL_CAMERA.iter().chain(sets).flat_map(|set| ["--set", *set]);
    let args = ["run", "configs/blocksworld.toml", "--json"];
    let mut run = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    if !line.is_empty() {
        run.wait_for_line(line);
    }
    for signal in signals {
        run.signal(*signal);
    }
    run.end()
}

/// Before it has begun, in every part of it, and in whichever thread: no stop is a panic.
#[test]
fn no_termination_is_a_panic() {
    for line in [" goal ", " state ", " plan ", " skill ", " done "] {
        for clock in ["clock=realtime", "clock=lockstep"] {
            let ended = ended_while(line, &[clock], &[Signal::TERM]);
            assert_eq!(ended.status.code(), Some(143), "{line}, {clock}: {}", ended.stderr);
            assert!(!ended.stderr.contains("panicked"), "{line}, {clock}: {}", ended.stderr);
        }
    }
}

/// Ends a run once something has happened in it, which `until` waits for.
fn ended_once(sets: &[&str], until: impl FnOnce(&str)) -> Ended {
    let name = unique_run("ended-once");
    let sets = SMALL_CAMERA.iter().chain(sets).flat_map(|set| ["--set", *set]);
    let args = ["run", "configs/blocksworld.toml", "--json", "--run", &name];
    let run = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    until(&name);
    run.signal(Signal::TERM);
    run.end()
}

/// A camera that shows a frame every hundred seconds keeps nobody.
#[test]
fn a_stop_does_not_wait_for_the_next_frame() {
    let slow = ["clock=realtime", "camera.rate_hz=0.01", "camera.wait_s=1000", "robot.wait_s=900"];
    let ended = ended_once(&slow, |name| {
        runtime().block_on(async {
            let bus = Bus::open(&BusConfig::for_run(name)).unwrap();
            join(&bus).await.unwrap();
        });
    });
    assert_eq!(ended.status.code(), Some(143), "{}", ended.stderr);
}

/// A detector in the loop whose service never answers keeps nobody, either.
#[test]
fn a_stop_does_not_wait_for_a_service() {
    let service = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("perception.options.url=http://{}/", service.local_addr().unwrap());
    let sets = [
        "clock=realtime",
        "perception.detector=http",
        "perception.options.dialect=hugging_face",
        "perception.detector_mode=sync",
        &url,
    ];
    let mut asked = None;
    let ended = ended_once(&sets, |_| asked = Some(service.accept().unwrap()));
    assert_eq!(ended.status.code(), Some(143), "{}", ended.stderr);
    assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
}

/// Whoever asks twice does not want to wait for anything.
#[test]
fn a_second_signal_ends_at_once() {
    let ended = ended_while(" skill ", &["clock=realtime"], &[Signal::TERM, Signal::INT]);
    let code = ended.status.code();
    // The first may have been enough.
    assert!(code == Some(130) || code == Some(143), "{code:?}: {}", ended.stderr);
    assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
}

#[test]
fn an_interrupt_stops_with_a_verdict() {
    stopped_by(Signal::INT, 130);
}

#[test]
fn a_termination_stops_with_a_verdict() {
    stopped_by(Signal::TERM, 143);
}
