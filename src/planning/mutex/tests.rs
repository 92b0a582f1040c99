//! Which groups are found, and that they are right.

use std::collections::BTreeSet;

use super::*;
use crate::pddl::{Domain, Problem, SourceText, parse_domain, parse_problem};
use crate::planning::{Coverage, GroundingLimits, PlanRequest, TaskInput};

fn read(domain: &str, problem: &str) -> (Domain, Problem) {
    let domain = parse_domain(&SourceText::new("d", domain));
    let domain = domain.unwrap_or_else(|e| panic!("{}", e.render())).value;
    let problem = parse_problem(&SourceText::new("p", problem), &domain);
    (domain, problem.unwrap_or_else(|e| panic!("{}", e.render())).value)
}

fn task(domain: &Domain, problem: &Problem) -> Task {
    let PlanRequest { objects, init, goal, costs, minimise_cost, .. } = PlanRequest::new(problem);
    let input = TaskInput { domain, objects, init, goal, costs, minimise_cost };
    Task::new(&input, Coverage::AllStates, &GroundingLimits::standard()).unwrap()
}

/// The groups as text, such as `(holding 0) (on 0 _)`.
fn shown(groups: &MutexGroups) -> Vec<String> {
    let part = |part: &Part| {
        let args = part.args.iter().map(|arg| arg.map_or("_".to_owned(), |p| p.to_string()));
        let words: Vec<String> = [part.predicate.to_string()].into_iter().chain(args).collect();
        format!("({})", words.join(" "))
    };
    let group = |c: &Candidate| c.parts.iter().map(part).collect::<Vec<_>>().join(" ");
    groups.candidates.iter().map(group).collect()
}

const BLOCKS: &str = "(define (domain blocks)
  (:requirements :strips :typing) (:types block hand)
  (:predicates (on ?x ?y - block) (table ?x - block) (clear ?x - block) (held ?x - block ?h - hand)
    (free ?h - hand) (busy ?h - hand))
  (:action pick :parameters (?x - block ?h - hand)
    :precondition (and (clear ?x) (table ?x) (free ?h))
    :effect (and (held ?x ?h) (busy ?h) (not (clear ?x)) (not (table ?x)) (not (free ?h))))
  (:action drop :parameters (?x - block ?h - hand)
    :precondition (and (held ?x ?h) (busy ?h))
    :effect (and (clear ?x) (table ?x) (free ?h) (not (held ?x ?h)) (not (busy ?h))))
  (:action stack :parameters (?x ?y - block ?h - hand)
    :precondition (and (held ?x ?h) (clear ?y) (busy ?h))
    :effect (and (on ?x ?y) (clear ?x) (free ?h)
      (not (held ?x ?h)) (not (clear ?y)) (not (busy ?h))))
  (:action unstack :parameters (?x ?y - block ?h - hand)
    :precondition (and (on ?x ?y) (clear ?x) (free ?h))
    :effect (and (held ?x ?h) (clear ?y) (busy ?h)
      (not (on ?x ?y)) (not (clear ?x)) (not (free ?h)))))";

const BLOCKS_PROBLEM: &str = "(define (problem p) (:domain blocks)
  (:objects a b c - block l r - hand)
  (:init (table a) (on b a) (clear b) (table c) (clear c) (free l) (free r))
  (:goal (and (on a b) (free l) (held c r))))";

#[test]
fn a_block_is_at_one_place_and_a_hand_holds_one() {
    let (domain, problem) = read(BLOCKS, BLOCKS_PROBLEM);
    let groups = MutexGroups::synthesise(&task(&domain, &problem));
    assert_eq!(
        shown(&groups),
        [
            "(busy _) (free _)",
            "(busy 0) (free 0)",
            "(clear 0) (held 0 _) (on _ 0)",
            "(free 0) (held _ 0)",
            "(held 0 _) (on 0 _) (table 0)",
        ]
    );
    // Two hands are free: that their number stays the same does not make it one.
    let groups = groups.hold_in(&problem.init);
    assert_eq!(shown(&groups).len(), 4);
    assert!(groups.violations(&problem.init).is_empty());
    let mut seen = problem.init.clone();
    seen.insert(Atom::new("held", &["a", "l"]));
    let atoms = |names: &[(&str, &[&str])]| Violation {
        atoms: names.iter().map(|(predicate, args)| Atom::new(predicate, args)).collect(),
    };
    assert_eq!(
        groups.violations(&seen).into_iter().collect::<Vec<_>>(),
        [
            atoms(&[("free", &["l"]), ("held", &["a", "l"])]),
            atoms(&[("held", &["a", "l"]), ("on", &["b", "a"])]),
            atoms(&[("held", &["a", "l"]), ("table", &["a"])]),
        ]
    );
}

const LIFT: &str = "(define (domain lift) (:requirements :adl)
  (:types person floor - object)
  (:predicates (at ?p - person ?f - floor) (lift ?f - floor) (broken ?f - floor) (in ?p - person)
    (wants ?p - person ?f - floor))
  (:action ride :parameters (?from ?to - floor)
    :precondition (and (lift ?from) (not (= ?from ?to)) (or (not (broken ?from)) (broken ?to)))
    :effect (and (lift ?to) (not (lift ?from))
      (forall (?p - person) (when (and (in ?p) (wants ?p ?to)) (and (at ?p ?to) (not (in ?p)))))
      (forall (?p - person) (when (at ?p ?from) (and (in ?p) (not (at ?p ?from)))))))
  (:action call :parameters (?f - floor) :precondition (or (lift ?f) (broken ?f))
    :effect (broken ?f)))";

const LIFT_PROBLEM: &str =
    "(define (problem p) (:domain lift) (:objects ann bob - person g h i - floor)
  (:init (lift g) (at ann g) (at bob h) (wants ann h) (wants bob g))
  (:goal (and (at ann h) (at bob g) (broken h))))";

#[test]
fn conditional_and_quantified_effects_are_understood() {
    let (domain, problem) = read(LIFT, LIFT_PROBLEM);
    let groups = MutexGroups::synthesise(&task(&domain, &problem));
    // Nobody who is out of the lift and in it at once is let out: `in` and `at` balance.
    assert_eq!(shown(&groups), ["(lift _)", "(at 0 _) (in 0)"]);
}

/// States along pseudo-random walks from a right state violate nothing.
#[test]
fn what_actions_do_keeps_every_group() {
    for (domain, problem, largest) in [(BLOCKS, BLOCKS_PROBLEM, 6), (LIFT, LIFT_PROBLEM, 4)] {
        let (domain, problem) = read(domain, problem);
        let task = task(&domain, &problem);
        let groups = MutexGroups::synthesise(&task).hold_in(&problem.init);
        let (mut state, mut after) = (task.state(&problem.init), Vec::new());
        let mut applicable = Vec::new();
        let mut random = 1_u64;
        for _ in 0..500 {
            task.successors.find(&task.operators, &state, &mut applicable);
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let chosen = applicable[(random >> 33) as usize % applicable.len()];
            task.apply(&task.operators[chosen as usize], &state, &mut after);
            std::mem::swap(&mut state, &mut after);
            let holds = |&n: &u32| state[n as usize / 64] >> (n % 64) & 1 == 1;
            let numbers: Vec<u32> = (0..task.n_atoms() as u32).filter(holds).collect();
            let facts = numbers.iter().map(|&n| task.atoms[n as usize].clone()).collect();
            assert_eq!(groups.violations(&facts), BTreeSet::new());
        }
        let sizes: Vec<usize> = groups.atoms(&task).iter().map(Vec::len).collect();
        assert!(sizes.iter().all(|&n| n > 1) && sizes.iter().max() == Some(&largest), "{sizes:?}");
    }
}
