//! Planning as a whole, against brute force by direct interpretation.

mod costs;
mod explain;
mod search;

use std::collections::VecDeque;

use proptest::prelude::*;

use super::*;
use crate::logic::{Facts, Universe, bind, derive, effects, evaluate};
use crate::pddl::{Name, Number, SourceText, parse_domain, parse_problem};

fn read(domain: &str, problem: &str) -> (Domain, Problem) {
    let domain = parse_domain(&SourceText::new("domain", domain));
    let domain = domain.unwrap_or_else(|e| panic!("{}", e.render())).value;
    let problem = parse_problem(&SourceText::new("problem", problem), &domain);
    (domain, problem.unwrap_or_else(|e| panic!("{}", e.render())).value)
}

/// Only one of the searches.
fn budget(optimal: bool) -> Budget {
    let mut budget = Budget::standard();
    if optimal {
        budget.greedy_expansions_max = 0;
    } else {
        budget.optimal_expansions_max = 0;
    }
    budget
}

/// Every argument tuple of an action.
fn tuples(domain: &Domain, universe: &Universe<'_>) -> Vec<Step> {
    let mut steps = Vec::new();
    for action in &domain.actions {
        let mut tuples: Vec<Vec<Name>> = vec![vec![]];
        for param in &action.params {
            let objects: Vec<&Name> = universe.of(&param.types).collect();
            let extend = |tuple: &Vec<Name>| {
                let tuple = tuple.clone();
                let extended =
                    objects.iter().map(move |&o| [tuple.clone(), vec![o.clone()]].concat());
                extended.collect::<Vec<_>>()
            };
            tuples = tuples.iter().flat_map(extend).collect();
        }
        steps.extend(tuples.into_iter().map(|args| Step { action: action.name.clone(), args }));
    }
    steps
}

/// Length of a shortest plan by breadth-first search over interpreted states.
fn brute_force(domain: &Domain, problem: &Problem) -> Option<u64> {
    let objects = [domain.constants.clone(), problem.objects.clone()].concat();
    let universe = Universe { types: &domain.types, objects: &objects };
    let steps = tuples(domain, &universe);
    let start = derive(&domain.axioms, &universe, &Facts::new(problem.init.clone()));
    let mut seen = BTreeSet::from([start.known.clone()]);
    let mut open = VecDeque::from([(start, 0)]);
    while let Some((state, length)) = open.pop_front() {
        let truth = |atom: &Atom| state.truth(atom);
        if evaluate(&problem.goal, &BTreeMap::new(), &universe, &truth).is_true() {
            return Some(length);
        }
        for step in &steps {
            let action = domain.action(step.action.as_str()).unwrap();
            let bindings = bind(action, &step.args).unwrap();
            if evaluate(&action.precondition, &bindings, &universe, &truth).is_true() {
                let changes = effects(action, &bindings, &universe, &truth);
                let after = derive(&domain.axioms, &universe, &changes.apply(&state));
                if seen.insert(after.known.clone()) {
                    open.push_back((after, length + 1));
                }
            }
        }
    }
    None
}

/// Checks all configurations on one problem against brute force.
fn agrees_with_brute_force(domain: &Domain, problem: &Problem) {
    let request = PlanRequest::new(problem);
    let shortest = brute_force(domain, problem);
    let guided = |optimal_heuristic| (Budget { optimal_heuristic, ..budget(true) }, true);
    let improved = Budget { improve_expansions_max: 1000, ..budget(false) };
    for (budget, optimal) in [
        guided(OptimalHeuristic::Auto),
        guided(OptimalHeuristic::Blind),
        guided(OptimalHeuristic::Max),
        guided(OptimalHeuristic::LmCut),
        guided(OptimalHeuristic::Patterns),
        (budget(false), false),
        (improved, false),
    ] {
        match (plan(domain, &request, &budget).outcome, shortest) {
            (Outcome::Unsolvable { .. }, None) => {}
            (Outcome::Solved(plan), Some(shortest)) => {
                assert!(plan.proven_optimal || !optimal);
                assert!(plan.cost == shortest || !plan.proven_optimal && plan.cost > shortest);
                assert!(plan.lower_bound <= shortest);
                let cost = Number::from(plan.cost);
                assert_eq!(validate(domain, &request, &plan.steps), Validation::Valid { cost });
                for step_idx in 0..plan.steps.len() {
                    rejects_mutations(domain, problem, &plan, step_idx);
                }
            }
            (outcome, _) => panic!("{outcome:?}, brute force: {shortest:?}"),
        }
    }
}

/// A plan must not pass with a step renamed, with one argument too many or a stranger in it, nor,
/// if it is a shortest one, with a step missing.
fn rejects_mutations(domain: &Domain, problem: &Problem, plan: &Plan, idx: usize) {
    let request = PlanRequest::new(problem);
    let steps = &plan.steps;
    if plan.proven_optimal {
        let mut shorter = steps.clone();
        shorter.remove(idx);
        assert!(!validate(domain, &request, &shorter).is_valid());
    }
    let mut renamed = steps.clone();
    renamed[idx].action = "fly".into();
    let verdict = validate(domain, &request, &renamed);
    assert!(matches!(verdict, Validation::Invalid { step_idx: Some(at), .. } if at == idx));
    let mut widened = steps.clone();
    widened[idx].args.push("a".into());
    assert!(!validate(domain, &request, &widened).is_valid());
    let mut stranger = steps.clone();
    if let Some(arg) = stranger[idx].args.first_mut() {
        *arg = "nobody".into();
        assert!(!validate(domain, &request, &stranger).is_valid());
    }
}

const BLOCKS: &str = "(define (domain blocks) (:types block)
  (:predicates (on ?x ?y - block) (table ?x - block) (clear ?x - block) (held ?x - block) (free))
  (:action pick :parameters (?x - block)
    :precondition (and (clear ?x) (table ?x) (free))
    :effect (and (held ?x) (not (table ?x)) (not (clear ?x)) (not (free))))
  (:action drop :parameters (?x - block) :precondition (held ?x)
    :effect (and (table ?x) (clear ?x) (free) (not (held ?x))))
  (:action stack :parameters (?x ?y - block) :precondition (and (held ?x) (clear ?y))
    :effect (and (on ?x ?y) (clear ?x) (free) (not (held ?x)) (not (clear ?y))))
  (:action unstack :parameters (?x ?y - block) :precondition (and (on ?x ?y) (clear ?x) (free))
    :effect (and (held ?x) (clear ?y) (not (on ?x ?y)) (not (clear ?x)) (not (free)))))";

/// The same world with derived `clear` and `free`, a quantified precondition and one action.
const DERIVED_BLOCKS: &str = "(define (domain blocks) (:types block)
  (:predicates (on ?x ?y - block) (table ?x - block) (clear ?x - block) (above ?x ?y - block))
  (:derived (clear ?x - block) (not (exists (?y - block) (on ?y ?x))))
  (:derived (above ?x ?y - block)
    (or (on ?x ?y) (exists (?z - block) (and (on ?x ?z) (above ?z ?y)))))
  (:action move :parameters (?x ?y - block)
    :precondition (and (clear ?x) (not (= ?x ?y)) (not (exists (?z - block) (on ?z ?y))))
    :effect (and (on ?x ?y) (not (table ?x))
      (forall (?z - block) (when (and (on ?x ?z) (not (= ?z ?y))) (not (on ?x ?z))))))
  (:action down :parameters (?x - block) :precondition (and (clear ?x) (not (table ?x)))
    :effect (and (table ?x) (forall (?z - block) (not (on ?x ?z))))))";

/// `(on …)`, `(table …)` (and with `full` also `(clear …)` and `(free)`) of towers over block
/// names; a block's entry is the one below it, if it is an earlier, still uncovered one.
fn towers(below: &[Option<usize>], full: bool) -> String {
    let names = ["a", "b", "c", "d"];
    let mut covered = [false; 4];
    let mut text = Vec::new();
    for (idx, below) in below.iter().enumerate() {
        text.push(match below {
            Some(b) if *b < idx && !covered[*b] => {
                covered[*b] = true;
                format!("(on {} {})", names[idx], names[*b])
            }
            _ => format!("(table {})", names[idx]),
        });
    }
    if full {
        let clear = names.iter().zip(covered).take(below.len()).filter(|(_, covered)| !covered);
        text.extend(clear.map(|(name, _)| format!("(clear {name})")));
        text.push("(free)".to_owned());
    }
    text.concat()
}

fn problem_text(n_blocks: usize, init: &str, goal: &str) -> String {
    let blocks = ["a", "b", "c", "d"][..n_blocks].join(" ");
    format!(
        "(define (problem p) (:domain blocks) (:objects {blocks} - block) (:init {init})
          (:goal (and {goal})))"
    )
}

fn tower_indices(n: usize) -> impl Strategy<Value = Vec<Option<usize>>> {
    prop::collection::vec(prop::option::of(0..n), n)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn shortest_plans_are_as_short_as_brute_force_finds(
        (from, to) in (2..=4_usize).prop_flat_map(|n| (tower_indices(n), tower_indices(n))),
    ) {
        // The goal's tower is over reversed names, so that it differs from the start.
        let names = ["a", "b", "c", "d"];
        let mut goal = towers(&to, false);
        for (idx, name) in names[..to.len()].iter().enumerate() {
            goal = goal.replace(&format!(" {name}"), &format!(" #{idx}"));
        }
        for idx in 0..to.len() {
            goal = goal.replace(&format!("#{idx}"), names[to.len() - 1 - idx]);
        }
        let (domain, problem) = read(BLOCKS, &problem_text(from.len(), &towers(&from, true), &goal));
        agrees_with_brute_force(&domain, &problem);
        let derived = problem_text(from.len(), &towers(&from, false), &goal);
        let (domain, problem) = read(DERIVED_BLOCKS, &derived);
        agrees_with_brute_force(&domain, &problem);
    }
}

#[test]
fn goals_over_recursive_axioms_and_quantifiers_are_reached() {
    for goal in [
        "(above a c)",
        "(not (above a b)) (exists (?x - block) (above ?x a))",
        "(forall (?x - block) (imply (above ?x b) (clear ?x))) (above a b) (above c b)",
        "(or (above a a) (above c a))",
        "(above a b) (above b a)",
    ] {
        let init = "(on a b)(on b c)(table c)";
        let (domain, problem) = read(DERIVED_BLOCKS, &problem_text(3, init, goal));
        agrees_with_brute_force(&domain, &problem);
    }
}

const SWITCHES: &str = "(define (domain s) (:types lamp key) (:constants main - lamp)
  (:predicates (lit ?l - lamp) (near ?l ?m - lamp) (broken) (at ?x - (either lamp key)))
  (:action toggle :parameters (?l - lamp) :precondition (not (broken))
    :effect (forall (?m - lamp) (when (or (near ?l ?m) (= ?l ?m))
      (and (when (lit ?m) (not (lit ?m))) (when (not (lit ?m)) (lit ?m))))))
  (:action break :parameters (?x - (either lamp key)) :precondition (at ?x)
    :effect (and (broken) (not (broken)) (lit main))))";

#[test]
fn nested_conditional_effects_constants_and_either_types_are_searched_correctly() {
    for (init, goal) in [
        ("(near a b) (near b c)", "(and (lit a) (lit b) (lit c))"),
        ("(near a b) (near b a) (lit a)", "(and (not (lit a)) (lit b))"),
        ("(near main a) (at k)", "(and (lit main) (not (lit a)) (lit b))"),
        ("(broken)", "(lit main)"),
        ("(broken) (at a)", "(and (lit main) (not (broken)))"),
        ("(broken) (at k)", "(forall (?l - lamp) (imply (lit ?l) (= ?l main)))"),
    ] {
        let (domain, problem) = read(
            SWITCHES,
            &format!(
                "(define (problem p) (:domain s) (:objects a b c - lamp k - key) (:init {init})
                  (:goal {goal}))"
            ),
        );
        agrees_with_brute_force(&domain, &problem);
    }
}

const ROADS: &str = "(define (domain roads) (:types place)
  (:predicates (road ?x ?y - place) (at ?x - place))
  (:functions (total-cost) - number (far ?x ?y - place) - number)
  (:action go :parameters (?x ?y - place) :precondition (and (at ?x) (road ?x ?y))
    :effect (and (at ?y) (not (at ?x)) (increase (total-cost) (far ?x ?y)))))";
const ROADS_PROBLEM: &str = "(define (problem p) (:domain roads) (:objects a b c d - place)
  (:init (at a) (road a d) (road a b) (road b c) (road c d) (= (far a d) 10) (= (far a b) 1.5)
    (= (far b c) 2) (= (far c d) 3) (= (total-cost) 0))
  (:goal (at d)) (:metric minimize (total-cost)))";

fn number(text: &str) -> Number {
    Number::parse(text).unwrap()
}

fn solved(domain: &Domain, request: &PlanRequest<'_>, budget: &Budget) -> Plan {
    match plan(domain, request, budget).outcome {
        Outcome::Solved(plan) => plan,
        other @ (Outcome::Unsolvable { .. }
        | Outcome::OutOfBudget { .. }
        | Outcome::Interrupted
        | Outcome::Unsupported { .. }
        | Outcome::BadInput { .. }) => panic!("{other:?}"),
    }
}

#[test]
fn costs_decide_and_fractions_are_scaled() {
    let (domain, problem) = read(ROADS, ROADS_PROBLEM);
    let request = PlanRequest::new(&problem);
    let plan = solved(&domain, &request, &budget(true));
    assert_eq!((plan.steps.len(), plan.in_full(plan.cost)), (3, number("6.5")));
    assert_eq!(validate(&domain, &request, &plan.steps), Validation::Valid { cost: number("6.5") });
    let steps_only = PlanRequest { minimise_cost: false, ..request };
    assert_eq!(solved(&domain, &steps_only, &budget(true)).cost, 1);
}

#[test]
fn a_penalised_step_is_worth_a_detour_but_not_a_failure() {
    let (domain, problem) = read(ROADS, ROADS_PROBLEM);
    let penalties = BTreeMap::from([(Step::new("go", &["b", "c"]), 4)]);
    let request = PlanRequest { penalties: &penalties, ..PlanRequest::new(&problem) };
    let plan = solved(&domain, &request, &budget(true));
    assert_eq!((plan.steps.len(), plan.in_full(plan.cost), plan.penalty), (1, number("10"), 0));
    let mild = BTreeMap::from([(Step::new("go", &["b", "c"]), 1)]);
    let request = PlanRequest { penalties: &mild, ..request };
    let plan = solved(&domain, &request, &budget(true));
    let costs = [plan.cost, plan.penalty].map(|units| plan.in_full(units));
    assert_eq!(costs, [number("6.5"), number("1")]);
}

#[test]
fn bad_input_is_named() {
    let (domain, mut problem) = read(ROADS, ROADS_PROBLEM);
    problem.costs.remove(&Atom::new("far", &["b", "c"]));
    let outcome = plan(&domain, &PlanRequest::new(&problem), &budget(true)).outcome;
    let reason = "expected a value of the cost (far b c), got none".to_owned();
    assert_eq!(outcome, Outcome::BadInput { reason });
    problem.init.insert(Atom::new("at", &["nowhere"]));
    let outcome = plan(&domain, &PlanRequest::new(&problem), &budget(true)).outcome;
    assert!(matches!(outcome, Outcome::BadInput { reason } if reason.contains("nowhere")));
}

#[test]
fn every_limit_is_named_when_it_is_met() {
    let (domain, problem) = read(
        BLOCKS,
        &problem_text(4, "(table a)(on b a)(on c b)(on d c)(clear d)(free)", "(on a d)"),
    );
    let request = PlanRequest::new(&problem);
    let limit = |change: &dyn Fn(&mut Budget), optimal: bool| {
        let mut budget = budget(optimal);
        change(&mut budget);
        match plan(&domain, &request, &budget).outcome {
            Outcome::OutOfBudget { limit, .. } => limit,
            other @ (Outcome::Solved(_)
            | Outcome::Unsolvable { .. }
            | Outcome::Interrupted
            | Outcome::Unsupported { .. }
            | Outcome::BadInput { .. }) => panic!("{other:?}"),
        }
    };
    assert_eq!(limit(&|b| b.optimal_expansions_max = 2, true), "optimal_expansions_max");
    assert_eq!(limit(&|b| b.greedy_expansions_max = 2, false), "greedy_expansions_max");
    assert_eq!(limit(&|b| b.states_max = 3, true), "states_max");
    assert_eq!(limit(&|b| b.bytes_max = 100, false), "bytes_max");
    assert_eq!(limit(&|b| b.grounding.actions_max = 5, true), "grounding.actions_max");
    assert_eq!(limit(&|b| b.grounding.atoms_max = 5, true), "grounding.atoms_max");
    assert_eq!(limit(&|b| b.grounding.steps_max = 50, true), "grounding.steps_max");
}

#[test]
fn a_goal_that_cannot_be_reached_is_proved_so_without_a_search() {
    let (domain, problem) =
        read(BLOCKS, &problem_text(2, "(table a)(clear a)(table b)(clear b)", "(on a b)"));
    for optimal in [true, false] {
        let answer = plan(&domain, &PlanRequest::new(&problem), &budget(optimal));
        assert!(matches!(answer.outcome, Outcome::Unsolvable { .. }), "the hand is never free");
        assert_eq!(answer.statistics.expanded(), 0);
    }
}

#[test]
fn a_goal_that_holds_needs_no_step() {
    let (domain, problem) =
        read(BLOCKS, &problem_text(2, "(table a)(on b a)(clear b)", "(on b a)"));
    assert!(solved(&domain, &PlanRequest::new(&problem), &budget(true)).steps.is_empty());
    assert!(solved(&domain, &PlanRequest::new(&problem), &budget(false)).steps.is_empty());
}

#[test]
fn the_validator_names_the_step_and_the_literal() {
    let init = "(table a)(on b a)(clear b)(free)";
    let (domain, problem) = read(BLOCKS, &problem_text(2, init, "(on a b)"));
    let request = PlanRequest::new(&problem);
    let reason = |steps: &[Step]| match validate(&domain, &request, steps) {
        Validation::Invalid { step_idx, reason } => (step_idx, reason),
        Validation::Valid { cost } => panic!("valid at {cost}"),
    };
    let steps = [
        Step::new("unstack", &["b", "a"]),
        Step::new("drop", &["b"]),
        Step::new("pick", &["a"]),
        Step::new("stack", &["a", "b"]),
    ];
    assert_eq!(validate(&domain, &request, &steps), Validation::Valid { cost: Number::from(4) });
    let without_drop = [steps[0].clone(), steps[2].clone()];
    assert_eq!(reason(&without_drop), (Some(1), "(pick a): (free) does not hold".to_owned()));
    assert_eq!(reason(&steps[..3]), (None, "goal not reached: (on a b) does not hold".to_owned()));
    let nobody = [Step::new("pick", &["q"])];
    let expected = "(pick q): `q` is no object that may stand for `?x`";
    assert_eq!(reason(&nobody), (Some(0), expected.to_owned()));
}

#[test]
fn one_task_serves_every_state_over_its_objects() {
    let first = problem_text(3, "(table a)(on b a)(on c b)(clear c)(free)", "(on a b)");
    let (domain, problem) = read(BLOCKS, &first);
    let Problem { objects, init, goal, costs, minimise_cost, .. } = &problem;
    let minimise_cost = *minimise_cost;
    let input = TaskInput { domain: &domain, objects, init, goal, costs, minimise_cost };
    let limits = GroundingLimits::standard();
    let solver = Solver::new(Task::new(&input, Coverage::AllStates, &limits).unwrap());
    for init in [
        "(table a)(clear a)(table b)(clear b)(table c)(clear c)(free)",
        "(table a)(on b a)(clear b)(held c)",
        "(table a)(on b a)(on c b)(clear c)(free)",
    ] {
        let (_, problem) = read(BLOCKS, &problem_text(3, init, "(on a b)"));
        let outcome = solver.solve(&problem.init, &NO_PENALTIES, &budget(true), &|| false).outcome;
        let Outcome::Solved(plan) = outcome else { panic!("{outcome:?}") };
        assert_eq!(Some(plan.cost), brute_force(&domain, &problem));
    }
}

#[test]
fn the_same_request_gives_the_same_answer() {
    let init = "(table a)(on b a)(table c)(on d c)(clear b)(clear d)(free)";
    let (domain, problem) = read(BLOCKS, &problem_text(4, init, "(on a c)(on c b)"));
    let request = PlanRequest::new(&problem);
    for optimal in [true, false] {
        let first = plan(&domain, &request, &budget(optimal));
        assert!((0..3).all(|_| plan(&domain, &request, &budget(optimal)) == first));
    }
    let mut shuffled = problem.clone();
    shuffled.objects.reverse();
    let plan = solved(&domain, &PlanRequest::new(&shuffled), &budget(true));
    assert_eq!(Some(plan.cost), brute_force(&domain, &problem));
}
