//! `groundloop plan` within limits, and what it says of a plan that is not proven; files of every
//! encoding.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::common::{one_object, schema};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use rustix::process::{Pid, Signal, kill_process};

const DOMAIN: &str = "(define (domain blocks) (:requirements :strips)
  (:predicates (on ?x ?y) (table ?x) (clear ?x) (held ?x) (free))
  (:action pick :parameters (?x) :precondition (and (clear ?x) (table ?x) (free))
    :effect (and (held ?x) (not (table ?x)) (not (clear ?x)) (not (free))))
  (:action drop :parameters (?x) :precondition (held ?x)
    :effect (and (table ?x) (clear ?x) (free) (not (held ?x))))
  (:action stack :parameters (?x ?y) :precondition (and (held ?x) (clear ?y))
    :effect (and (on ?x ?y) (clear ?x) (free) (not (held ?x)) (not (clear ?y))))
  (:action unstack :parameters (?x ?y) :precondition (and (on ?x ?y) (clear ?x) (free))
    :effect (and (held ?x) (clear ?y) (not (on ?x ?y)) (not (clear ?x)) (not (free)))))";

/// A tower of so many blocks that is to stand in another order.
fn tower(n: usize) -> String {
    let name = |i: usize| format!(" b{i}");
    let on = |i: usize, j: usize| format!("(on{}{})", name(i), name(j));
    let blocks: String = (0..n).map(name).collect();
    let init: String = (1..n).map(|i| on(i, i - 1)).collect();
    let goal: String = (1..n).map(|i| on(i * 2 % n, (i - 1) * 2 % n)).collect();
    format!(
        "(define (problem tower) (:domain blocks) (:objects{blocks})
          (:init (table b0) (clear b{}) (free) {init}) (:goal (and {goal})))",
        n - 1
    )
}

fn plan(folder: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_groundloop"));
    let args = ["plan", "--domain", "domain.pddl", "--problem", "problem.pddl"];
    command.current_dir(folder).args(args).args(more);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn texts(output: Output) -> (Option<i32>, String, String) {
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn folder(problem: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("domain.pddl"), DOMAIN).unwrap();
    fs::write(folder.path().join("problem.pddl"), problem).unwrap();
    folder
}

#[test]
fn limits_that_are_met_are_named() {
    let folder = folder(&tower(31));
    let call = |more: &[&str]| texts(plan(folder.path(), more).output().unwrap());
    let (code, stdout, stderr) = call(&["--time-limit", "0.000001"]);
    assert_eq!((code, stdout.as_str()), (Some(4), ""));
    assert_eq!(stderr, "interrupted: the time limit was met\n");
    let (code, stdout, stderr) = call(&["--optimal-expansions", "5000"]);
    assert_eq!(code, Some(0), "{stderr}");
    assert!(stdout.contains("; cost = "), "{stdout}");
    assert!(stderr.starts_with("not proven cheapest: no plan costs less than "), "{stderr}");
    let met = "optimal_expansions_max = 5000 was met (--optimal-expansions N raises this limit)\n";
    assert!(stderr.ends_with(met), "{stderr}");
    let (_, stdout, _) = call(&["--optimal-expansions", "5000", "--json"]);
    let answer = one_object(&stdout);
    schema::obeys("plan", &answer);
    assert_eq!(answer["optimal"], false);
    assert!(answer["unproven"].as_str().unwrap().contains("optimal_expansions_max = 5000"));
    // Who leaves the proof out is not told that there is none.
    let (code, _, stderr) = call(&["--optimal-expansions", "0"]);
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    let (code, _, stderr) = call(&["--grounding-actions", "10"]);
    assert_eq!(code, Some(4));
    let met = "grounding.actions_max = 10 (--grounding-actions N raises this limit)\n";
    assert!(stderr.ends_with(met), "{stderr}");
    let (code, _, stderr) = call(&["--time-limit", "0"]);
    assert_eq!(code, Some(2));
    assert!(stderr.contains("expected a number of seconds above 0, got 0"), "{stderr}");
}

#[test]
fn a_signal_ends_the_search_and_the_best_plan_is_printed() {
    let folder = folder("");
    let problem = folder.path().join("problem.pddl");
    fs::remove_file(&problem).unwrap();
    mknodat(CWD, &problem, FileType::Fifo, Mode::from_raw_mode(0o600), 0).unwrap();
    let child = plan(folder.path(), &["--memory-limit", "1000000"]).spawn().unwrap();
    // The pipe opens once the program reads it: it listens to signals by then.
    let mut pipe: File = OpenOptions::new().write(true).open(&problem).unwrap();
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    pipe.write_all(tower(41).as_bytes()).unwrap();
    drop(pipe);
    let (code, stdout, stderr) = texts(child.wait_with_output().unwrap());
    // The signal may come before or after a first plan.
    assert!(stderr.contains("stopped from outside"), "{stderr}");
    assert_eq!(code == Some(0), stdout.contains("; cost = "), "{code:?}: {stdout}");
    assert!(matches!(code, Some(0 | 4)), "{code:?}");
}

#[test]
fn an_unreachable_part_of_a_goal_is_named() {
    let folder = folder(&tower(3).replace("(:goal (and ", "(:goal (and (on b0 b0) "));
    let (code, _, stderr) = texts(plan(folder.path(), &[]).output().unwrap());
    assert_eq!(code, Some(3));
    assert!(stderr.starts_with("unsolvable: "), "{stderr}");
    let never = tower(1).replace("(table b0)", "").replace("(and )", "(table b0)");
    let folder = self::folder(&never.replace("(clear b0)", ""));
    let (code, _, stderr) = texts(plan(folder.path(), &[]).output().unwrap());
    assert_eq!(code, Some(3));
    assert!(stderr.ends_with("\n  (table b0) cannot be reached\n"), "{stderr}");
}

#[test]
fn bytes_that_are_no_text_are_fine_in_comments_and_located_elsewhere() {
    let folder = folder("");
    let problem = folder.path().join("problem.pddl");
    let mut bytes = b"; by M. M\xfcller\r".to_vec();
    bytes.extend(tower(3).as_bytes());
    fs::write(&problem, &bytes).unwrap();
    let (code, _, stderr) = texts(plan(folder.path(), &[]).output().unwrap());
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    bytes.extend(b"\r\n (\xfc)");
    fs::write(&problem, &bytes).unwrap();
    let (code, _, stderr) = texts(plan(folder.path(), &[]).output().unwrap());
    assert_eq!(code, Some(2));
    assert!(stderr.starts_with("problem.pddl:4:3: error: expected UTF-8, got 0xfc\n"), "{stderr}");
}
