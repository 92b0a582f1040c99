//! Heuristics, landmarks, improvement and interrupts, on small random tasks whose whole state space
//! is looked at.

use std::cell::Cell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::*;
use crate::planning::answer::{Interrupts, SearchEnd};
use crate::planning::heuristics::{Blind, Heuristic, Landmarks, LmCut, Max};
use crate::planning::task::{Formula, bit};

const N_ATOMS: usize = 5;

const UNTIL_THE_END: Interrupts<'static> = Interrupts { proof: &|| false, all: &|| false };

fn until(interrupt: &dyn Fn() -> bool) -> Interrupts<'_> {
    Interrupts { proof: interrupt, all: interrupt }
}

/// A literal: an atom and its value.
fn literal((atom, value): (usize, bool)) -> String {
    if value { format!("(a{atom})") } else { format!("(not (a{atom}))") }
}

/// Conjunctions, or disjunctions, of literals.
fn condition() -> impl Strategy<Value = String> {
    let literals = prop::collection::vec((0..N_ATOMS, any::<bool>()), 1..=3);
    (literals, prop::bool::weighted(0.2)).prop_map(|(literals, or)| {
        let literals: String = literals.into_iter().map(literal).collect();
        if or { format!("(or {literals})") } else { format!("(and {literals})") }
    })
}

/// An effect, conditional or not.
fn effect() -> impl Strategy<Value = String> {
    let change = (0..N_ATOMS, any::<bool>()).prop_map(literal);
    (prop::option::weighted(0.4, condition()), change).prop_map(|(when, change)| match when {
        Some(when) => format!("(when {when} {change})"),
        None => change,
    })
}

/// A task with conditional effects, negative and disjunctive conditions and costs; with `derived`
/// also an atom that rules derive.
fn random_task(derived: bool) -> impl Strategy<Value = (Solver, Vec<u64>)> {
    let action = (condition(), prop::collection::vec(effect(), 1..=3));
    let actions = prop::collection::vec(action, 2..=6);
    let rule = if derived { condition().prop_map(Some).boxed() } else { Just(None).boxed() };
    let costs = prop::collection::vec(0..4_u64, 6);
    (actions, condition(), rule, costs).prop_map(|(actions, goal, rule, costs)| {
        let atoms = (0..N_ATOMS).map(|atom| format!("(a{atom})")).collect::<Vec<_>>().concat();
        let (goal, rule) = match rule {
            Some(rule) => (format!("(and {goal} (b))"), format!("(:derived (b) {rule})")),
            None => (goal, String::new()),
        };
        let actions = actions.iter().enumerate().map(|(idx, (precondition, effects))| {
            let effects = effects.concat();
            format!(
                "(:action x{idx} :parameters () :precondition {precondition} :effect (and {effects}))"
            )
        });
        let actions = actions.collect::<Vec<_>>().concat();
        let domain =
            format!("(define (domain d) (:predicates {atoms} (b)) {rule} {actions})");
        let problem = format!("(define (problem p) (:domain d) (:init) (:goal {goal}))");
        let (domain, problem) = read(&domain, &problem);
        (Solver::new(task_of(&domain, &problem)), costs)
    })
}

fn task_of(domain: &Domain, problem: &Problem) -> Task {
    let Problem { objects, init, goal, costs, minimise_cost, .. } = problem;
    let minimise_cost = *minimise_cost;
    let input = TaskInput { domain, objects, init, goal, costs, minimise_cost };
    Task::new(&input, Coverage::AllStates, &GroundingLimits::standard()).unwrap()
}

/// Every state of a task, by the values of the atoms that actions change.
fn all_states(task: &Task) -> Vec<Vec<u64>> {
    let n_fluents = task.axioms.first().min(task.n_atoms() as u32);
    let complete = |bits: u64| {
        let mut state = vec![0; task.words];
        if let Some(word) = state.first_mut() {
            *word = bits;
        }
        task.axioms.complete(&mut state);
        state
    };
    (0..1 << n_fluents).map(complete).collect()
}

/// Cost of a cheapest plan whose states, the first one too, all pass `allowed`.
fn cheapest(
    task: &Task,
    costs: &[u64],
    from: &[u64],
    allowed: &dyn Fn(&[u64]) -> bool,
) -> Option<u64> {
    let mut best = BTreeMap::from([(from.to_vec(), 0)]);
    let mut open = BinaryHeap::from([Reverse((0, from.to_vec()))]);
    if !allowed(from) {
        return None;
    }
    while let Some(Reverse((cost, state))) = open.pop() {
        if task.is_goal(&state) {
            return Some(cost);
        }
        for (operator, step_cost) in task.operators.iter().zip(costs) {
            let mut after = Vec::new();
            task.apply(operator, &state, &mut after);
            let cost = cost + step_cost;
            if operator.applicable(&state)
                && allowed(&after)
                && best.get(&after).is_none_or(|&known| cost < known)
            {
                best.insert(after.clone(), cost);
                open.push(Reverse((cost, after)));
            }
        }
    }
    None
}

/// Checks all heuristics, landmarks and searches from every state of a task.
fn check(solver: &Solver, costs: &[u64]) {
    let (task, relaxed) = (solver.task(), solver.relaxed());
    let costs = &costs[..task.n_actions()];
    if task.goal == Formula::False {
        return;
    }
    let mut heuristics: [Box<dyn Heuristic + '_>; 3] = [
        Box::new(Blind::new(task, costs)),
        Box::new(Max::new(relaxed, costs)),
        Box::new(LmCut::new(relaxed, costs)),
    ];
    for (idx, state) in all_states(task).into_iter().enumerate() {
        let truth = cheapest(task, costs, &state, &|_| true);
        let estimates = heuristics.each_mut().map(|h| h.estimate(&state));
        for estimate in estimates {
            let claimed = estimate.unwrap_or(u64::MAX);
            assert!(claimed <= truth.unwrap_or(u64::MAX), "{estimate:?} above {truth:?}");
        }
        assert!(
            estimates[1] <= estimates[2] || estimates[2].is_none(),
            "cuts sum to less than max"
        );
        if let Some(landmarks) = Landmarks::new(relaxed, &state) {
            for &(atom, value) in landmarks.literals() {
                let without = |state: &[u64]| bit(state, atom) != value;
                assert_eq!(cheapest(task, costs, &state, &without), None, "{atom} {value}");
            }
        }
        if idx % 4 == 1 {
            searches_agree(solver, costs, &state, truth);
        }
    }
}

/// Every kind of search from one state, against the true cost.
fn searches_agree(solver: &Solver, costs: &[u64], state: &[u64], truth: Option<u64>) {
    let guided = |optimal_heuristic| Budget { optimal_heuristic, ..budget(true) };
    let improve = |improve_expansions_max| Budget { improve_expansions_max, ..budget(false) };
    let mut found = Vec::new();
    for budget in [
        guided(OptimalHeuristic::Auto),
        guided(OptimalHeuristic::Max),
        guided(OptimalHeuristic::LmCut),
        improve(0),
        improve(500),
    ] {
        let answer = solver.search_from(state, costs, &budget, UNTIL_THE_END);
        assert_eq!(answer, solver.search_from(state, costs, &budget, UNTIL_THE_END));
        match (answer.end, truth) {
            (SearchEnd::Exhausted { .. }, None) => {}
            (SearchEnd::Found { operators, cost, proven_optimal }, Some(truth)) => {
                assert!(answer.lower_bound <= truth && truth <= cost);
                assert!(!proven_optimal || cost == truth);
                assert!(proven_optimal || budget.optimal_expansions_max == 0);
                assert_eq!(replayed(solver.task(), costs, state, &operators), cost);
                found.push(cost);
            }
            (end, truth) => panic!("{end:?}, brute force: {truth:?}"),
        }
    }
    if let [.., plain, improved] = found[..] {
        assert!(improved <= plain, "improvement made {improved} of {plain}");
    }
}

/// The cost of a plan, which must be applicable and reach the goal.
fn replayed(task: &Task, costs: &[u64], state: &[u64], operators: &[u32]) -> u64 {
    let (mut state, mut cost) = (state.to_vec(), 0);
    for &action in operators {
        let operator = &task.operators[action as usize];
        assert!(operator.applicable(&state));
        let mut after = Vec::new();
        task.apply(operator, &state, &mut after);
        state = after;
        cost += costs[action as usize];
    }
    assert!(task.is_goal(&state));
    cost
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn bounds_landmarks_and_searches_agree_with_brute_force((solver, costs) in random_task(false)) {
        check(&solver, &costs);
    }

    #[test]
    fn they_do_so_over_derived_atoms_too((solver, costs) in random_task(true)) {
        check(&solver, &costs);
    }
}

/// A tower of an odd number of blocks that is to be built anew in another order.
fn tall_task(n: usize) -> (Solver, Vec<u64>, Vec<u64>) {
    let name = |i: usize| format!("b{i}");
    let blocks: Vec<String> = (0..n).map(name).collect();
    let blocks = blocks.join(" ");
    let on = |i: usize, j: usize| format!("(on {} {})", name(i), name(j));
    let init: String = (1..n).map(|i| on(i, i - 1)).collect();
    let goal: String = (1..n).map(|i| on(i * 2 % n, (i - 1) * 2 % n)).collect();
    let problem = format!(
        "(define (problem p) (:domain blocks) (:objects {blocks} - block)
          (:init (table b0) (clear {}) (free) {init}) (:goal (and {goal})))",
        name(n - 1)
    );
    let (domain, problem) = read(BLOCKS, &problem);
    let task = task_of(&domain, &problem);
    let (state, costs) = (task.state(&problem.init), vec![1; task.n_actions()]);
    (Solver::new(task), state, costs)
}

#[test]
fn more_improvement_never_costs_more_and_is_repeatable() {
    let (solver, state, costs) = tall_task(11);
    let mut last = u64::MAX;
    let mut all = Vec::new();
    for improve_expansions_max in [0, 30, 300, 3000, 30_000] {
        let budget = Budget { improve_expansions_max, ..budget(false) };
        let answer = solver.search_from(&state, &costs, &budget, UNTIL_THE_END);
        assert_eq!(answer, solver.search_from(&state, &costs, &budget, UNTIL_THE_END));
        let SearchEnd::Found { operators, cost, .. } = answer.end else { panic!("a plan exists") };
        assert_eq!(replayed(solver.task(), &costs, &state, &operators), cost);
        assert!(cost <= last, "{cost} after {last}");
        last = cost;
        all.push(cost);
    }
    assert!(last < all[0], "a greedy plan of many blocks has detours: {all:?}");
}

#[test]
fn an_interrupt_ends_every_search_with_what_it_has() {
    let (solver, state, costs) = tall_task(13);
    let after = |n_asked: u32| {
        let left = Cell::new(n_asked);
        move || {
            left.set(left.get().saturating_sub(1));
            left.get() == 0
        }
    };
    for budget in [budget(true), budget(false)] {
        let answer = solver.search_from(&state, &costs, &budget, until(&after(2)));
        let expanded: u64 = answer.phases.iter().map(|p| p.expanded).sum();
        assert!(expanded < 100, "{expanded} states after the second question");
        assert_eq!(answer.end, SearchEnd::Interrupted);
    }
    let n_asked = Cell::new(0);
    let count = || {
        n_asked.set(n_asked.get() + 1);
        false
    };
    solver.search_from(&state, &costs, &budget(false), until(&count));
    let improving = Budget { improve_expansions_max: 100_000, ..budget(false) };
    let whole = solver.search_from(&state, &costs, &improving, UNTIL_THE_END);
    let cut = solver.search_from(&state, &costs, &improving, until(&after(n_asked.get() + 20)));
    let improvement = |phases: &[Phase]| phases.last().map_or(0, |p| p.expanded);
    let expanded = (improvement(&cut.phases), improvement(&whole.phases));
    assert!(expanded.0 < expanded.1, "{expanded:?}");
    let (SearchEnd::Found { cost: best, .. }, SearchEnd::Found { operators, cost, .. }) =
        (whole.end, cut.end)
    else {
        panic!("a plan exists and is found before the interrupt")
    };
    assert_eq!(replayed(solver.task(), &costs, &state, &operators), cost);
    assert!(best <= cost);
}

#[test]
fn a_plan_that_is_there_is_not_lost_to_an_interrupt() {
    let (solver, state, costs) = tall_task(13);
    let mut is_there = false;
    for n_asked in (1..2000).step_by(100) {
        let left = Cell::new(n_asked);
        let interrupt = || {
            left.set(left.get() - i32::from(left.get() > 0));
            left.get() == 0
        };
        let answer = solver.search_from(&state, &costs, &Budget::standard(), until(&interrupt));
        let is_found = matches!(answer.end, SearchEnd::Found { .. });
        assert!(is_found || !is_there, "lost at question {n_asked}: {:?}", answer.end);
        is_there = is_found;
    }
    assert!(is_there);
}

#[test]
fn turns_of_two_searches_meet_the_same_limits() {
    let (solver, state, costs) = tall_task(9);
    for optimal_expansions_max in [10, 70_000] {
        let budget = Budget { optimal_expansions_max, ..budget(true) };
        let answer = solver.search_from(&state, &costs, &budget, UNTIL_THE_END);
        let expanded: u64 = answer.phases.iter().map(|p| p.expanded).sum();
        assert!(expanded <= optimal_expansions_max);
        assert!(answer.lower_bound > 0);
        if let SearchEnd::OutOfBudget { limit, value } = answer.end {
            assert_eq!((limit, value), ("optimal_expansions_max", optimal_expansions_max));
        } else {
            assert_eq!(answer.phases.len(), 2, "found by the second search");
        }
    }
}
