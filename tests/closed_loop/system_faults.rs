//! Faults of actors and messages: each happens, is told apart from the others, and the loop copes with it.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs;

use crate::common::{TestRun, small};
use assert_cmd::cargo::cargo_bin_cmd;
use groundloop::messages::Event;
use groundloop::metrics::EpisodeReport;
use groundloop::run::{RunConfig, RunError};
use tempfile::TempDir;

/// A short episode of three blocks with faults, and more settings.
fn config(faults: &str, sets: &[&str]) -> RunConfig {
    let faults = format!("fault=[{faults}]");
    let own = ["sim.scene=scenes/three_blocks.toml", "goal.text=red over blue over green", &faults];
    small("blocksworld.toml", &[&own, sets].concat())
}

/// Its report, and what was told.
fn end(faults: &str, sets: &[&str]) -> (EpisodeReport, Vec<Event>) {
    let run = TestRun::new();
    let report = run.run(config(faults, sets)).unwrap().report;
    let events = run.events.lock().unwrap().clone();
    (report, events)
}

fn report(faults: &str) -> EpisodeReport {
    end(faults, &[]).0
}

/// The error of an episode without a verdict.
fn error(faults: &str, sets: &[&str]) -> RunError {
    TestRun::new().run(config(faults, sets)).unwrap_err()
}

fn lose(topic: &str, when: &str) -> String {
    format!("{{ sent = \"{topic}\", {when}, action = {{ kind = \"lose\" }} }}")
}

#[track_caller]
fn reached(report: &EpisodeReport) {
    assert_eq!(report.verdict, "reached", "{report:#?}");
    assert_eq!(report.goal_in_simulator, Some(true), "{report:#?}");
}

/// Kinds of what happened, each once.
fn kinds(report: &EpisodeReport) -> Vec<&str> {
    let mut kinds: Vec<&str> = report.faults.iter().map(|record| record.kind.as_str()).collect();
    kinds.dedup();
    kinds
}

/// What the loop publishes on, without what tells only how it fares.
const TOPICS: [&str; 13] = [
    "camera/main/depth",
    "camera/main/rgb",
    "decision",
    "dispatch",
    "event",
    "goal",
    "outcome",
    "plan",
    "robot/command",
    "robot/state",
    "robot/status",
    "scene",
    "verdict",
];

#[test]
fn a_message_that_comes_twice_changes_nothing() {
    let calm = report("");
    reached(&calm);
    for topic in TOPICS {
        let fault =
            format!("{{ sent = \"{topic}\", every = true, action = {{ kind = \"duplicate\" }} }}");
        let twice = report(&fault);
        assert_eq!(twice.decision_hash, calm.decision_hash, "{topic}");
        assert_eq!(kinds(&twice), ["duplicate"], "{topic}");
    }
}

/// What is lost now and then is said again, seen, or waited for; the same seed loses the same messages.
#[test]
fn lost_and_late_messages_are_coped_with() {
    for topic in TOPICS.into_iter().filter(|topic| *topic != "robot/state") {
        let when = "every = true, probability = 0.3";
        let lost = report(&lose(topic, when));
        reached(&lost);
        if ["camera/main/rgb", "robot/command", "scene"].contains(&topic) {
            let again = report(&lose(topic, when));
            assert_eq!(lost.faults, again.faults, "{topic}");
            assert_eq!(lost.decision_hash, again.decision_hash, "{topic}");
        }
        let late = format!(
            "{{ sent = \"{topic}\", {when}, action = {{ kind = \"delay\", messages = 2 }} }}"
        );
        reached(&report(&late));
    }
    let mut seeds = [1, 2].map(|seed| {
        let mut config = config(&lose("plan", "every = true, probability = 0.3"), &[]);
        config.seed = seed;
        TestRun::new().run(config).unwrap().report.faults
    });
    assert!(seeds.iter().all(|records| records.len() > 5), "{seeds:?}");
    seeds.iter_mut().flatten().for_each(|record| record.said.clear());
    assert_ne!(seeds[0], seeds[1]);
}

/// What the robot says of its motions is known from its states, too: without one status the same is decided.
#[test]
fn the_end_of_a_step_is_known_without_its_status() {
    let calm = report("");
    let silent = report(&lose("robot/status", "every = true"));
    reached(&silent);
    assert!(silent.faults.len() >= 12, "{:?}", silent.faults);
    assert_eq!(silent.decision_hash, calm.decision_hash);
    let miss = "{ during = \"unstack\", action = { kind = \"miss_grasp\" } }, ";
    let (missed, events) = end(&[miss, &lose("robot/status", "nth = 2")].concat(), &[]);
    reached(&missed);
    assert_eq!((kinds(&missed), missed.skills_failed), (vec!["miss_grasp", "lose"], 1));
    let says = |event: &Event| matches!(event, Event::Failed { reason, .. } if reason.starts_with("ended without a word"));
    assert!(events.iter().any(says), "{events:#?}");
}

#[test]
fn a_step_whose_start_is_lost_is_tried_again() {
    // The first command that starts a motion, whichever it is, is among those that are lost.
    let (lost, events) = end(&lose("robot/command", "every = true, probability = 0.4"), &[]);
    reached(&lost);
    assert!(lost.skills_failed > 0, "{lost:#?}");
    let says = |event: &Event| matches!(event, Event::Failed { .. });
    assert!(events.iter().any(says), "{events:#?}");
}

#[test]
fn what_is_never_heard_ends_the_episode_by_name() {
    let never = report(&lose("robot/command", "every = true"));
    assert!(never.reason.starts_with("limits.failures_max"), "{}", never.reason);
    let never = report(&lose("dispatch", "every = true"));
    assert!(never.reason.starts_with("limits.observing_s_max"), "{}", never.reason);
    for (topic, set, expected) in [
        ("camera/main/rgb", "camera.wait_s=1.0", "a frame on camera/main/rgb"),
        ("robot/state", "robot.wait_s=1.0", "no state on robot/state"),
    ] {
        let error = error(&lose(topic, "every = true"), &[set]);
        assert_eq!(error.exit_code(), 5, "{error}");
        assert!(error.to_string().contains(expected), "{error}");
    }
    // The verdict comes without the last decision, and without any.
    reached(&report(&lose("decision", "every = true")));
}

#[test]
fn actors_that_stand_still_or_panic_change_nothing_in_lockstep() {
    let calm = report("");
    let actors = ["camera", "goal_parser", "planner", "robot", "scene_parser", "skill_executor"];
    for kind in ["kind = \"panic\"", "kind = \"stall\", for_s = 0.2"] {
        let fault = |(idx, actor): (usize, &&str)| {
            let nth = if *actor == "goal_parser" { 2 } else { 20 + 11 * idx };
            format!("{{ message = \"{actor}\", nth = {nth}, action = {{ {kind} }} }}")
        };
        let faults: Vec<String> = actors.iter().enumerate().map(fault).collect();
        let shaken = report(&faults.join(", "));
        assert_eq!(shaken.faults.len(), actors.len(), "{:?}", shaken.faults);
        assert!(shaken.faults.iter().all(|record| record.happened));
        assert!(shaken.faults.is_sorted_by_key(|record| record.at_ns), "{:?}", shaken.faults);
        assert_eq!(shaken.decision_hash, calm.decision_hash, "{kind}");
    }
}

#[test]
fn a_missed_deadline_is_a_plan_that_comes_too_late() {
    let missed = |when: &str| {
        let action = "action = { kind = \"deadline_missed\" }";
        end(&format!("{{ message = \"planner\", {when}, {action} }}"), &[])
    };
    let (sometimes, events) = missed("every = true, probability = 0.3");
    reached(&sometimes);
    let late = |event: &Event| matches!(event, Event::Look { reason } if reason.contains("planner.deadline_ms"));
    assert!(events.iter().any(late), "{events:#?}");
    let (always, _) = missed("every = true");
    assert_eq!(always.verdict, "gave-up");
    assert!(always.reason.starts_with("limits.planner_timeouts_max"), "{}", always.reason);
}

#[test]
fn a_goal_source_that_comes_back_is_asked_again() {
    let down = |n: u32| {
        let fault = |nth: u32| {
            format!(
                "{{ message = \"goal_parser\", nth = {nth}, action = {{ kind = \"source_down\" }} }}"
            )
        };
        (1..=n).map(fault).collect::<Vec<_>>().join(", ")
    };
    let back = report(&down(3));
    reached(&back);
    assert_eq!((kinds(&back), back.faults.len()), (vec!["source_down"], 3));
    let gone = error(&down(4), &[]);
    assert_eq!(gone.exit_code(), 5, "{gone}");
    assert!(gone.to_string().contains("the goal source is missing"), "{gone}");
    reached(&end(&down(4), &["goal.retries_max=4"]).0);
}

#[test]
fn losses_are_coped_with_in_real_time() {
    let faults: Vec<String> =
        ["scene", "plan", "goal", "robot/status", "dispatch", "camera/main/rgb"]
            .map(|topic| lose(topic, "every = true, probability = 0.2"))
            .into();
    let sets = ["clock=realtime", "camera.rate_hz=20.0"];
    let (lost, _) = end(&faults.join(", "), &sets);
    reached(&lost);
    assert!(lost.faults.len() > 20, "{:?}", lost.faults);
}

#[test]
fn a_table_that_there_is_no_more_is_told_with_what_to_write() {
    let folder = TempDir::new().unwrap();
    let text = "extends = \"blocksworld\"\n[[panic]]\nactor = \"planner\"\nat_message = 4\n";
    fs::write(folder.path().join("run.toml"), text).unwrap();
    let mut call = cargo_bin_cmd!("groundloop");
    let output =
        call.current_dir(folder.path()).args(["config", "check", "run.toml"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("run.toml:2:3: error: panic: there is no such table any more"), "{said}");
    assert!(said.contains("write [[fault]] with message = \"planner\""), "{said}");
}
