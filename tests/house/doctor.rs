//! `groundloop doctor`: what it says of this machine, and what it removes.
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs;
use std::net::TcpListener;
use std::path::PathBuf;
use std::time::UNIX_EPOCH;

use crate::common::{project, schema};
use assert_cmd::cargo::cargo_bin_cmd;
use groundloop::transport::BusConfig;
use serde_json::Value;

/// Exit code, and what `--json` writes.
fn doctor(args: &[&str]) -> (Option<i32>, Value) {
    let mut command = cargo_bin_cmd!("groundloop");
    let output = command.current_dir(project(".")).args(["doctor", "--json"]).args(args).output();
    let output = output.unwrap();
    assert!(!output.stdout.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    schema::obeys("doctor", &report);
    (output.status.code(), report)
}

/// What was found of one check.
fn found<'a>(report: &'a Value, check: &str) -> Vec<&'a Value> {
    report["findings"].as_array().unwrap().iter().filter(|f| f["check"] == check).collect()
}

#[test]
fn every_check_says_how_well_it_is_and_the_exit_code_says_whether_anything_is_a_fault() {
    let (code, report) = doctor(&["blocksworld"]);
    let checks = ["shared memory", "room", "folders", "runs", "leftovers", "open files", "clock"];
    for check in checks.into_iter().chain(["cores", "programs"]) {
        assert!(!found(&report, check).is_empty(), "{check}: {report:#}");
    }
    let n_faults = report["n_faults"].as_u64().unwrap();
    assert_eq!(code, Some(if n_faults == 0 { 0 } else { 6 }), "{report:#}");
    assert!(found(&report, "room")[0]["measured"].as_str().unwrap().contains("a frame of main"));
}

/// The file system would have to be larger than any: the message comes before anything starts.
#[test]
fn frames_that_do_not_fit_are_a_fault_with_the_size_that_is_needed() {
    let size = ["--set", "sim.camera.width=65000", "--set", "sim.camera.height=65000"];
    let (code, report) = doctor(&[&["blocksworld"], &size[..]].concat());
    assert_eq!(code, Some(6), "{report:#}");
    let findings = report["findings"].as_array().unwrap();
    let fault = findings.iter().find(|f| f["health"] == "fault").unwrap();
    assert!(!fault["remedy"].as_str().unwrap().is_empty(), "{report:#}");
}

#[test]
fn a_run_file_that_cannot_be_run_is_a_fault() {
    let (code, report) = doctor(&["blocksworld", "--set", "limits.seconds_max=nan"]);
    assert_eq!(code, Some(6));
    let said = found(&report, "run file")[0]["measured"].as_str().unwrap();
    assert!(said.contains("limits.seconds_max"), "{said}");
}

#[test]
fn a_service_that_does_not_answer_is_a_fault_and_one_that_does_is_none() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("goal.options.url=http://{}/v1", server.local_addr().unwrap());
    let sets =
        ["goal.kind=language_model", "goal.options.model=m", "goal.options.dialect=llamacpp", &url];
    let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", *set]).collect();
    let args = [&["blocksworld"], &sets[..]].concat();
    let health = |report: &Value| found(report, "services")[0]["health"].clone();
    assert_eq!(health(&doctor(&args).1), "ok");
    drop(server);
    let (code, report) = doctor(&args);
    assert_eq!((code, health(&report)), (Some(6), "fault".into()), "{report:#}");
}

/// A file of a process that is gone is counted, and removed when that is asked for; whatever is in use stays.
#[test]
fn what_dead_processes_left_is_removed_and_what_lives_is_not() {
    let prefix = BusConfig::for_run("x").prefix;
    let name = format!("{prefix}left_by_{}.dynamic", std::process::id());
    let left = PathBuf::from("/dev/shm").join(name);
    let file = fs::File::create(&left).unwrap();
    file.set_len(4096).unwrap();
    file.set_modified(UNIX_EPOCH).unwrap();
    drop(file);
    let (code, report) = doctor(&[]);
    let leftovers = found(&report, "leftovers")[0];
    if leftovers["measured"].as_str().unwrap().starts_with("cannot be told") {
        fs::remove_file(&left).unwrap();
        println!("skipped: the bus has processes that cannot be seen from here");
        return;
    }
    assert_eq!((code, &leftovers["health"]), (Some(0), &"warning".into()), "{report:#}");
    let (_, cleaned) = doctor(&["--clean"]);
    assert!(cleaned["cleaned"][0].as_u64().unwrap() >= 1, "{cleaned:#}");
    assert!(!left.exists());
}
