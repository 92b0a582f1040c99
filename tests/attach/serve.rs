//! A long-lived run as a process: signals, its clients, and hardware that comes late.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::process::{Command, Stdio};

use crate::common::{
    Killed, Process, SMALL_CAMERA, example, external, one_object, project, schema, unique_run,
};
use crate::python_client::is_there;
use assert_cmd::cargo::cargo_bin_cmd;
use groundloop::messages::CommandKind;
use groundloop::transport::convert::command_from_wire;
use groundloop::transport::topics::ROBOT_COMMAND;
use groundloop::transport::wire::{CommandRecord, DeviceHeader};
use groundloop::transport::{Bus, BusConfig, Depth, Subscriber};
use rustix::process::Signal;
use serde_json::Value;

const THREE_BLOCKS: &str = "sim.scene=scenes/three_blocks.toml";
const UP: &str = "red over blue over green";

/// A run that serves, once goals may come.
fn serving(name: &str) -> Process {
    let sets = SMALL_CAMERA.iter().chain(&[THREE_BLOCKS]).flat_map(|set| ["--set", *set]);
    let args = ["serve", "configs/blocksworld.toml", "--json", "--run", name];
    let mut run = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    run.wait_for_line("serving run");
    run
}

/// `groundloop task`: exit code, and what it says.
fn task(args: &[&str]) -> (Option<i32>, String) {
    let mut command = cargo_bin_cmd!("groundloop");
    let output = command.current_dir(project("")).arg("task").args(args).output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8(said).unwrap())
}

/// The reports of a run that has ended, one a goal.
fn reports(stdout: &str) -> Vec<Value> {
    let reports: Vec<Value> = stdout.lines().map(one_object).collect();
    for report in &reports {
        schema::obeys("serve", report);
    }
    reports
}

#[test]
fn an_idle_run_ends_well_when_it_is_told_to() {
    for signal in [Signal::TERM, Signal::INT] {
        let run = serving(&unique_run("serve-idle"));
        run.signal(signal);
        let ended = run.end();
        assert_eq!((ended.status.code(), ended.stdout.as_str()), (Some(0), ""), "{}", ended.stderr);
    }
}

/// The running goal is stopped and what waits is cancelled; the last word to the robot is *hold*.
#[test]
fn a_run_that_is_terminated_at_work_leaves_a_robot_that_holds() {
    let name = unique_run("serve-busy");
    let bus = Bus::open(&BusConfig::for_run(name.as_str())).unwrap();
    let runtime = crate::common::runtime();
    let _entered = runtime.enter();
    let mut commands: Subscriber<DeviceHeader, CommandRecord> =
        bus.subscriber(&ROBOT_COMMAND, Depth::all(64)).unwrap();
    let mut run = serving(&name);
    for id in ["runs", "waits"] {
        let (code, said) = task(&["submit", UP, "--run", &name, "--id", id, "--detach"]);
        assert_eq!(code, Some(0), "{said}");
    }
    run.wait_for_line(" skill ");
    assert!(commands.poll_next().unwrap().is_some(), "it is told something");
    run.signal(Signal::TERM);
    let ended = run.end();
    assert_eq!(ended.status.code(), Some(143), "{}", ended.stderr);
    let told = reports(&ended.stdout);
    let states: Vec<[&str; 2]> =
        told.iter().map(|r| [&r["id"], &r["state"]].map(|v| v.as_str().unwrap())).collect();
    assert_eq!(states, [["runs", "cancelled"], ["waits", "cancelled"]]);
    assert_eq!(told[0]["episode"]["verdict"], "stopped");
    let mut last = None;
    while let Some(message) = commands.poll_next().unwrap() {
        last = Some(command_from_wire(message.header(), message.records()).unwrap().kind);
    }
    assert_eq!(last, Some(CommandKind::Hold));
}

#[test]
fn the_command_line_submits_watches_and_cancels() {
    let name = unique_run("serve-cli");
    let (code, said) = task(&["submit", UP, "--run", &name]);
    assert_eq!(code, Some(5), "{said}");
    assert!(said.contains("groundloop serve CONFIG --run"), "{said}");
    let run = serving(&name);
    let watcher = Killed::start(&example("watch_the_bus"), &[&name], Stdio::piped());
    let (code, said) = task(&["submit", UP, "--run", &name, "--json", "--id", "up"]);
    assert_eq!(code, Some(0), "{said}");
    let report = said.lines().find(|line| line.starts_with('{')).unwrap();
    let report = one_object(report);
    schema::obeys("task", &report);
    assert_eq!((&report["state"], &report["verdict"]), (&"done".into(), &"reached".into()));
    let (code, said) = task(&["submit", "the moon over blue", "--run", &name]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("^^^^"), "the words are shown: {said}");
    let (code, said) = task(&["submit", UP, "--run", &name, "--id", "a b"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("id: expected"), "{said}");
    let (code, said) = task(&["cancel", "up", "--run", &name]);
    assert_eq!(code, Some(0), "too late: {said}");
    let (code, said) = task(&["cancel", "nobody", "--run", &name]);
    assert_eq!(code, Some(2), "{said}");
    let (code, said) = task(&["submit", UP, "--run", &name]);
    assert_eq!(code, Some(0), "it holds already: {said}");
    run.signal(Signal::TERM);
    let ended = run.end();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    assert_eq!(reports(&ended.stdout).len(), 3);
    let mut watcher = watcher;
    let mut told = String::new();
    std::io::Read::read_to_string(watcher.0.stdout.as_mut().unwrap(), &mut told).unwrap();
    assert!(watcher.0.wait().unwrap().success());
    let n_ends = told.lines().filter(|line| line.contains(" end: reached")).count();
    assert_eq!(n_ends, 2, "both goals: {told}");
}

/// Hardware that is not there fails the goal, not the run.
#[test]
fn a_goal_without_hardware_fails_and_the_next_one_has_it() {
    let name = unique_run("serve-late");
    let [_, _, exemplars] = SMALL_CAMERA;
    let (mut run, _folder) =
        external::start("serve", &name, &[exemplars, "camera.wait_s=3", "robot.wait_s=3"]);
    run.wait_for_line("serving run");
    let (code, said) = task(&["submit", "red over blue over green", "--run", &name]);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("failed: ") && said.contains(" is missing: "), "{said}");
    let hardware = external::hardware(&name, &[&SMALL_CAMERA[..], &[THREE_BLOCKS]].concat());
    for text in [UP, "green over blue over red"] {
        let (code, said) = task(&["submit", text, "--run", &name]);
        assert_eq!(code, Some(0), "{said}");
        assert!(said.contains("done: reached"), "{said}");
    }
    run.signal(Signal::TERM);
    assert_eq!(run.end().status.code(), Some(0));
    drop(hardware);
}

/// `examples/ten_goals.py`: all are reached, and they are what was asked for.
#[test]
fn ten_goals_from_python() {
    if !is_there() {
        return;
    }
    let name = unique_run("serve-python");
    let run = serving(&name);
    let script = project("examples/ten_goals.py");
    let python = |args: &[&str]| {
        let mut command = Command::new("python3");
        command.args(args).env("PYTHONPATH", project("clients/python")).stdin(Stdio::null());
        let output = command.output().unwrap();
        let said = [output.stdout, output.stderr].concat();
        (output.status.code(), String::from_utf8(said).unwrap())
    };
    let (code, said) = python(&[script.to_str().unwrap()]);
    assert_eq!((code, said.as_str()), (Some(2), "usage: ten_goals.py NAME\n"));
    let (code, said) = python(&[script.to_str().unwrap(), &name]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.ends_with("reached 10/10\n"), "{said}");
    let (code, said) = python(&["-c", CANCEL, &name]);
    assert_eq!((code, said.as_str()), (Some(0), CANCELLED));
    run.signal(Signal::TERM);
    let ended = run.end();
    let told = reports(&ended.stdout);
    let texts: Vec<&str> = told.iter().map(|report| report["text"].as_str().unwrap()).collect();
    let code = std::fs::read_to_string(script).unwrap();
    let goals = code.split_once("GOALS = [").unwrap().1.split_once(']').unwrap().0;
    let goals: Vec<&str> = goals.split('"').skip(1).step_by(2).collect();
    assert_eq!(texts[..10], goals);
    for (text, report) in goals.iter().zip(&told) {
        assert_eq!(report["episode"]["goal_in_simulator"], true, "{text}: {report}");
        let goal = report["episode"]["goal"].as_str().unwrap();
        let words: Vec<&str> = text.split(" over ").collect();
        for pair in words.windows(2) {
            let on = format!("(on {}_block {}_block)", pair[0], pair[1]);
            assert!(goal.contains(&on), "{text}: {goal}");
        }
    }
}

/// One goal that is cancelled, one that is refused, one that is asked for again, and all that was said at the end.
const CANCEL: &str = "
import sys
from groundloop import Tasks

def main():
    tasks = Tasks(sys.argv[1])
    tasks.submit('red over green', id='runs')
    tasks.submit('blue over green', id='waits')
    tasks.cancel('waits')
    print(tasks.wait('waits').state)
    tasks.cancel('runs')
    print(tasks.wait('runs').state)
    refused = tasks.wait(tasks.submit('the moon over blue', id='moon'))
    print(refused.state, refused.is_over, 'moon' in refused.reason)
    print(tasks.wait(tasks.submit('(ontable red_block)', kind='logical', id='logical')).goal)
    for status in tasks:
        if status.id == 'logical' and status.is_over:
            print(status.verdict)
            break

main()
";
const CANCELLED: &str = "cancelled\ncancelled\nrefused True True\n(ontable red_block)\nreached\n";
