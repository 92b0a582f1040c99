//! A run seen from outside: its topics, and that nobody joins in who does what another does.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use crate::common::{Process, SMALL_CAMERA, external, project, unique_run};
use assert_cmd::cargo::cargo_bin_cmd;
use rustix::process::Signal;

fn topics(args: &[&str]) -> (Option<i32>, String) {
    let mut command = cargo_bin_cmd!("groundloop");
    let output = command.current_dir(project("")).arg("topics").args(args).output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8(said).unwrap())
}

/// A run in real time that carries a step out.
fn running(name: &str) -> Process {
    let sets = SMALL_CAMERA.iter().chain(&["clock=realtime"]).flat_map(|set| ["--set", *set]);
    let args = ["run", "configs/blocksworld.toml", "--json", "--run", name];
    let mut run = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    run.wait_for_line(" skill ");
    run
}

#[test]
fn topics_are_listed_measured_and_echoed() {
    let name = unique_run("topics");
    let run = running(&name);
    let (code, listed) = topics(&["list", "--run", &name, "--for-s", "0.5"]);
    assert_eq!(code, Some(0), "{listed}");
    let line = |topic: &str| listed.lines().find(|line| line.trim_start().starts_with(topic));
    let rgb: Vec<&str> = line("camera/main/rgb").unwrap().split_whitespace().collect();
    assert_eq!(rgb[1..3], ["1", "1"], "one writer, one reader: {listed}");
    let rate: f64 = rgb[3].parse().unwrap();
    assert!(rate > 0.5, "{listed}");
    assert!(line("robot/command").is_some() && line("plan").is_some(), "{listed}");
    let (code, said) = topics(&["echo", "robot/state", "--run", &name, "--count", "1"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains(" m, ") && said.contains("jaws"), "{said}");
    let (code, said) = topics(&["hz", "camera/main/rgb", "--run", &name, "--for-s", "1"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains(" a second, ") && said.contains("of 230400 bytes"), "{said}");
    let (code, said) = topics(&["echo", "camera/man/rgb", "--run", &name]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("camera/main/rgb"), "what there is: {said}");
    run.signal(Signal::TERM);
    assert_eq!(run.end().status.code(), Some(143));
}

#[test]
fn a_run_that_is_not_there_is_told() {
    let (code, said) = topics(&["list", "--run", &unique_run("nobody")]);
    assert_eq!(code, Some(5), "{said}");
    assert!(said.contains("no run of the name"), "{said}");
}

/// A second run of a name, and a second robot of a run, would be mixed with the first.
#[test]
fn a_second_of_a_kind_is_refused_by_name() {
    let name = unique_run("second");
    let run = running(&name);
    let second =
        Process::start(&["run", "configs/blocksworld.toml", "--json", "--run", &name]).end();
    assert_eq!(second.status.code(), Some(2), "{}", second.stderr);
    let told = format!("run of run \"{name}\" has a writer already");
    assert!(second.stderr.contains(&told), "{}", second.stderr);
    run.signal(Signal::TERM);
    run.end();

    let name = unique_run("second-robot");
    let hardware = external::hardware(&name, &[]);
    let second = Process::start(&["hardware", external::CONFIG, "--run", &name]).end();
    assert_eq!(second.status.code(), Some(2), "{}", second.stderr);
    assert!(second.stderr.contains("robot/state of run"), "{}", second.stderr);
    hardware.signal(Signal::TERM);
    hardware.end();
}
