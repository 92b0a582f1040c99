//! Planning from Rust: two texts in, a plan or the reason why there is none out.
//!
//! ```console
//! cargo run --release --example plan_from_rust
//! ```

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "an example shows what it does")]

use std::process::ExitCode;

const DOMAIN: &str = "
(define (domain ferry)
  (:requirements :strips :typing :negative-preconditions)
  (:types shore car)
  (:predicates (at ?c - car ?s - shore) (aboard ?c - car) (ferry-at ?s - shore) (empty))
  (:action board :parameters (?c - car ?s - shore)
    :precondition (and (at ?c ?s) (ferry-at ?s) (empty))
    :effect (and (aboard ?c) (not (at ?c ?s)) (not (empty))))
  (:action sail :parameters (?from ?to - shore)
    :precondition (and (ferry-at ?from) (not (ferry-at ?to)))
    :effect (and (ferry-at ?to) (not (ferry-at ?from))))
  (:action debark :parameters (?c - car ?s - shore)
    :precondition (and (aboard ?c) (ferry-at ?s))
    :effect (and (at ?c ?s) (empty) (not (aboard ?c)))))
";

const PROBLEM: &str = "
(define (problem two-cars)
  (:domain ferry)
  (:objects left right - shore red blue - car)
  (:init (at red left) (at blue left) (ferry-at right) (empty))
  (:goal (and (at red right) (at blue right))))
";

fn main() -> ExitCode {
    let answer = match groundloop::plan_text(DOMAIN, PROBLEM) {
        Ok(answer) => answer,
        Err(error) => {
            // It shows the line of the text that is wrong.
            eprintln!("{}", error.render());
            return ExitCode::FAILURE;
        }
    };
    let Some(plan) = answer.outcome.plan() else {
        println!("no plan: {}", answer.outcome);
        return ExitCode::SUCCESS;
    };
    println!("{} steps, proven cheapest: {}", plan.steps.len(), plan.proven_optimal);
    for step in &plan.steps {
        println!("  {step}");
    }
    ExitCode::SUCCESS
}
