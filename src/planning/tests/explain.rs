//! Why plans are wrong, and how they are put right.

use super::*;
use crate::planning::{explain, impossible_parts};

const ROBOT: &str = "(define (domain robot) (:requirements :adl) (:types place thing)
  (:predicates (at ?p - place) (in ?t - thing ?p - place) (holds ?t - thing) (free))
  (:action go :parameters (?a ?b - place) :precondition (at ?a)
    :effect (and (not (at ?a)) (at ?b)))
  (:action take :parameters (?t - thing ?p - place)
    :precondition (and (at ?p) (in ?t ?p) (free))
    :effect (and (not (in ?t ?p)) (holds ?t) (not (free))))
  (:action put :parameters (?t - thing ?p - place) :precondition (and (at ?p) (holds ?t))
    :effect (and (in ?t ?p) (not (holds ?t)) (free))))";
const TWO_THINGS: &str = "(define (problem p) (:domain robot) (:objects a b - place x y - thing)
  (:init (at a) (in x a) (in y a) (free)) (:goal (and (in x b) (not (at a)))))";

fn explained(plan: &str) -> String {
    let (domain, problem) = read(ROBOT, TWO_THINGS);
    let steps = crate::pddl::parse_plan(&SourceText::new("plan", plan)).unwrap();
    let request = PlanRequest::new(&problem);
    let found = explain(&domain, &request, &steps);
    assert_eq!(found.is_none(), validate(&domain, &request, &steps).is_valid());
    let Some(found) = found else { return "right".to_owned() };
    if let Some(repair) = &found.repair {
        assert!(validate(&domain, &request, &repair.steps).is_valid(), "{repair:?}");
    }
    found.to_string()
}

#[test]
fn the_failing_condition_its_cause_and_the_nearest_repair_are_told() {
    assert_eq!(explained("(take x a) (go a b) (put x b)"), "right");
    assert_eq!(
        explained("(take x a) (take y a) (go a b) (put x b)"),
        "step 2 needs (and (at a) (in y a) (free))\n(free): not since step 1 (take x a)\n\
         nearest repair: leave out step 2"
    );
    assert_eq!(
        explained("(take x a) (put x b)"),
        "step 2 needs (and (at b) (holds x))\n(at b): never up to there\n\
         nearest repair: insert (go a b) before step 2"
    );
    assert_eq!(
        explained("(go a b) (put x b)").lines().last(),
        Some("nearest repair: insert (go b a) (take x a) (go a b) before step 2")
    );
    assert_eq!(
        explained("(put x a) (take x a) (go a b) (put x b)").lines().last(),
        Some("nearest repair: leave out step 1")
    );
    assert_eq!(
        explained("(go a b) (take x a) (put x b)").lines().last(),
        Some("nearest repair: move step 2 (take x a) before step 1")
    );
    assert_eq!(
        explained("(take x a)"),
        "the goal needs (and (in x b) (not (at a)))\n(in x b): never up to there\n\
         (not (at a)): (at a) holds from the start\nnearest repair: append (go a b) (put x b)"
    );
    assert_eq!(
        explained("(fly a) (take x a) (go a b) (put x b)"),
        "nearest repair: leave out step 1"
    );
}

#[test]
fn a_goal_that_cannot_be_reached_is_taken_apart() {
    let parts = |goal: &str| {
        let problem = TWO_THINGS.replace("(and (in x b) (not (at a)))", goal);
        let (domain, problem) = read(ROBOT, &problem);
        let parts = impossible_parts(&domain, &PlanRequest::new(&problem), 2);
        parts.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!(parts("(and (in x b) (in y b))"), Vec::<String>::new());
    let never = "(and (in x b) (= x y) (exists (?p - place) (and (at ?p) (= x y))) (= a b))";
    assert_eq!(parts(never), ["(= x y)", "(exists (?p - place) (and (at ?p) (= x y)))"]);
}
