//! Ctrl-C and SIGTERM: the robot holds, and there is a verdict all the same.
#![cfg(feature = "sim")]

use crate::common::{Process, SMALL_CAMERA};
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
}

#[test]
fn an_interrupt_stops_with_a_verdict() {
    stopped_by(Signal::INT, 130);
}

#[test]
fn a_termination_stops_with_a_verdict() {
    stopped_by(Signal::TERM, 143);
}
