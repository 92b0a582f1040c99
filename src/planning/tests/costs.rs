//! Costs are exact: whatever their digits and their unit.

use super::*;

/// A direct way and one over `m`; costs are as they are written.
fn tour(direct: &str, first: &str, second: &str) -> (Domain, Problem) {
    let domain = "(define (domain tour) (:predicates (at ?x) (leg ?x ?y))
      (:functions (total-cost) - number (len ?x ?y) - number)
      (:action go :parameters (?x ?y) :precondition (and (at ?x) (leg ?x ?y))
        :effect (and (at ?y) (not (at ?x)) (increase (total-cost) (len ?x ?y)))))";
    let problem = format!(
        "(define (problem t) (:domain tour) (:objects a m z) (:init (at a)
          (leg a z) (= (len a z) {direct}) (leg a m) (= (len a m) {first})
          (leg m z) (= (len m z) {second})) (:goal (at z)) (:metric minimize (total-cost)))"
    );
    read(domain, &problem)
}

#[test]
fn no_digit_is_lost() {
    for (costs, n_steps, total) in [
        (["1.0004", "0.5001", "0.5001"], 2, "1.0002"),
        (["0.0014", "0.0006", "0.0006"], 2, "0.0012"),
        (["0.0011", "0.0006", "0.0006"], 1, "0.0011"),
        (["12.345678901234567", "6.172839450617283", "6.172839450617282"], 2, "12.345678901234565"),
        (["3e19", "1e19", "1e19"], 2, "20000000000000000000"),
        (["9000000000000000003", "9e18", "1"], 2, "9000000000000000001"),
        (["0", "0", "0"], 1, "0"),
    ] {
        let (domain, problem) = tour(costs[0], costs[1], costs[2]);
        let request = PlanRequest::new(&problem);
        let plan = solved(&domain, &request, &budget(true));
        let cost = number(total);
        assert_eq!((plan.steps.len(), plan.in_full(plan.cost)), (n_steps, cost));
        assert!(plan.proven_optimal);
        assert_eq!(plan.to_string().lines().last(), Some(&*format!("; cost = {total}")));
        assert_eq!(validate(&domain, &request, &plan.steps), Validation::Valid { cost });
    }
}

#[test]
fn what_cannot_be_said_is_an_error() {
    let outcome = |costs: [&str; 3]| {
        let (domain, problem) = tour(costs[0], costs[1], costs[2]);
        plan(&domain, &PlanRequest::new(&problem), &Budget::standard()).outcome
    };
    let wide = outcome(["3e19", "0.1", "1"]);
    assert!(wide.reason().unwrap().contains("of their common unit 0.1, got 3"), "{wide}");
    let negative = outcome(["-1", "1", "1"]);
    assert_eq!(negative.to_string(), "bad-input: expected a cost (len a z) of 0 or more, got -1");
    // A path that is too dear is no path, and no proof that there is none.
    let (domain, problem) = read(
        "(define (domain d) (:predicates (p ?x)) (:functions (total-cost) (c ?x))
          (:action a :parameters (?x) :effect (and (p ?x) (increase (total-cost) (c ?x)))))",
        "(define (problem p) (:domain d) (:objects a b c) (:goal (and (p a) (p b) (p c)))
          (:init (= (c a) 9000000000000000001) (= (c b) 9000000000000000003)
            (= (c c) 9000000000000000007)) (:metric minimize (total-cost)))",
    );
    for budget in [budget(true), budget(false), Budget::standard()] {
        let steep = plan(&domain, &PlanRequest::new(&problem), &budget).outcome;
        let limit = "cost_units_max";
        assert_eq!(steep, Outcome::OutOfBudget { limit, value: u64::MAX });
    }
}

#[test]
fn plans_do_not_depend_on_the_unit_of_cost() {
    let (domain, problem) = read(ROADS, ROADS_PROBLEM);
    for budget in [budget(true), budget(false), Budget::standard()] {
        let plan = |factor: u64| {
            let mut scaled = problem.clone();
            scaled.costs.values_mut().for_each(|cost| *cost = cost.times(factor).unwrap());
            let found = solved(&domain, &PlanRequest::new(&scaled), &budget);
            (found.steps.clone(), found.in_full(found.cost))
        };
        let (steps, cost) = plan(1);
        for factor in [2, 1000, 1_000_000_000] {
            assert_eq!(plan(factor), (steps.clone(), cost.times(factor).unwrap()));
        }
    }
}
