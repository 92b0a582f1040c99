//! What must be true of any text that is given as a domain and a problem.
//!
//! The fuzz target and `tests/planning/front_end.rs` share it.

use std::collections::BTreeMap;

use groundloop::logic::Facts;
use groundloop::logic::{Universe, derive};
use groundloop::pddl::{
    Domain, PddlError, Problem, SourceText, Typed, parse_domain, parse_facts, parse_goal,
    parse_plan, parse_problem, parse_rules, print_domain, print_problem,
};
use groundloop::planning::{
    Budget, Coverage, GroundingLimits, MutexGroups, OptimalHeuristic, Outcome, PlanRequest, Task,
    TaskInput, Validation, plan, validate,
};

/// What stands between a domain and its problem.
pub(crate) const SEPARATOR: &str = ";; problem";

/// Most elementary steps of grounding: small, so that many inputs are tried.
const GROUNDING_STEPS_MAX: u64 = 20_000;
/// Most states that a search expands.
const EXPANSIONS_MAX: u64 = 200;
/// Completing a state has no limit of its own, so only small ones are completed.
const DERIVED_OBJECTS_MAX: usize = 6;
/// Most parameters of a rule that is evaluated.
const DERIVED_PARAMETERS_MAX: usize = 4;

/// Reads, prints, grounds, plans and validates; panics when something that must hold does not.
pub(crate) fn check(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let (domain, problem) = text.split_once(SEPARATOR).unwrap_or((&text, ""));
    let (domain, problem) =
        (SourceText::new("domain", domain), SourceText::new("problem", problem));
    let Some(domain) = shown(parse_domain(&domain)) else { return };
    let domain = domain.value;
    let printed = SourceText::new("printed", print_domain(&domain));
    let again =
        parse_domain(&printed).unwrap_or_else(|e| panic!("{}\n{}", e.render(), printed.text));
    assert_eq!(again.value, domain, "{}", printed.text);
    let objects = &domain.constants;
    shown(parse_rules(&problem, &domain));
    shown(parse_plan(&problem));
    shown(parse_goal(&problem, &domain, objects));
    shown(parse_facts(&problem, &domain, objects));
    let Some(problem) = shown(parse_problem(&problem, &domain)) else { return };
    let problem = problem.value;
    let printed = SourceText::new("printed", print_problem(&problem));
    let again = parse_problem(&printed, &domain);
    let again = again.unwrap_or_else(|e| panic!("{}\n{}", e.render(), printed.text));
    assert_eq!(again.value, problem, "{}", printed.text);
    solve(&domain, &problem);
    complete(&domain, &problem);
}

/// The value; an error must point at a line and show itself.
fn shown<T>(read: Result<T, PddlError>) -> Option<T> {
    read.inspect_err(|e| assert!(e.place.line >= 1 && e.render().contains(&e.message))).ok()
}

fn grounding() -> GroundingLimits {
    GroundingLimits { actions_max: 500, atoms_max: 1000, steps_max: GROUNDING_STEPS_MAX }
}

/// Every plan that is found is valid, and no search contradicts another.
fn solve(domain: &Domain, problem: &Problem) {
    let request = PlanRequest::new(problem);
    let outcome = |optimal_heuristic, optimal: u64, greedy: u64| {
        let budget = Budget {
            optimal_expansions_max: optimal,
            optimal_heuristic,
            greedy_expansions_max: greedy,
            improve_expansions_max: greedy,
            grounding: grounding(),
            ..Budget::standard()
        };
        plan(domain, &request, &budget).outcome
    };
    let optimal = [
        OptimalHeuristic::Auto,
        OptimalHeuristic::Blind,
        OptimalHeuristic::Max,
        OptimalHeuristic::LmCut,
        OptimalHeuristic::Patterns,
    ];
    let any = outcome(OptimalHeuristic::Blind, 0, EXPANSIONS_MAX);
    let cheapest = optimal.map(|heuristic| outcome(heuristic, EXPANSIONS_MAX, 0));
    let mut cost = None;
    for outcome in cheapest.iter().chain([&any]) {
        let Outcome::Solved(plan) = outcome else { continue };
        let checked = validate(domain, &request, &plan.steps);
        assert!(matches!(checked, Validation::Valid { .. }), "{checked:?} {plan}");
        assert!(plan.lower_bound <= plan.cost);
        if plan.proven_optimal {
            assert_eq!(*cost.get_or_insert(plan.cost), plan.cost, "{plan}");
        }
    }
    if let (Outcome::Solved(any), Some(cost)) = (&any, cost) {
        assert!(cost <= any.cost && any.lower_bound <= cost);
    }
    let is_solved = |outcome: &Outcome| matches!(outcome, Outcome::Solved(_));
    let has_none = |outcome: &Outcome| matches!(outcome, Outcome::Unsolvable { .. });
    let all = || cheapest.iter().chain([&any]);
    assert!(!(all().any(is_solved) && all().any(has_none)), "{cheapest:?} {any:?}");
    let input = TaskInput {
        domain,
        objects: request.objects,
        init: request.init,
        goal: request.goal,
        costs: &BTreeMap::new(),
        minimise_cost: false,
    };
    if let Ok(task) = Task::new(&input, Coverage::AllStates, &grounding()) {
        let groups = MutexGroups::synthesise(&task).hold_in(&problem.init);
        assert!(groups.violations(&problem.init).is_empty());
    }
}

/// Completing a completed state changes nothing.
fn complete(domain: &Domain, problem: &Problem) {
    let objects: Vec<Typed> = domain.constants.iter().chain(&problem.objects).cloned().collect();
    let n_params = domain.axioms.iter().map(|a| a.head.params.len()).max().unwrap_or(0);
    if objects.len() > DERIVED_OBJECTS_MAX || n_params > DERIVED_PARAMETERS_MAX {
        return;
    }
    let universe = Universe { types: &domain.types, objects: &objects };
    let once = derive(&domain.axioms, &universe, &Facts::new(problem.init.clone()));
    assert_eq!(derive(&domain.axioms, &universe, &once), once);
}
