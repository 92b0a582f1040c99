//! The planner against brute force by direct interpretation, on random small tasks of every shipped
//! domain; and, where there is one, against Fast Downward, on those and on a corpus.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the test")]

use std::path::Path;

use crate::common::{data, files_below, folders_in, project};
use crate::differential_tasks::{Brute, SmallTask, Tasks};
use groundloop::parts::{PartChoice, PartContext};
use groundloop::pddl::{Domain, Problem, SourceText, parse_domain, parse_problem};
use groundloop::planners::{FastDownward, PlannerInputs};
use groundloop::planning::{
    Budget, Coverage, NO_PENALTIES, Outcome, PlanRequest, Solver, Task, TaskInput, plan, validate,
};

/// Random tasks of each domain.
const TASKS_PER_DOMAIN: usize = 2_000;
/// Most states that brute force looks at for one task; a task with more proves nothing.
const STATES_MAX: usize = 3_000;
/// Random tasks of each domain that go through Fast Downward, unless
/// `GROUNDLOOP_FAST_DOWNWARD_TASKS` says otherwise.
const FAST_DOWNWARD_TASKS: usize = 20;

fn domain_of(folder: &Path) -> Domain {
    let file = folder.join("domain.pddl");
    let text = std::fs::read_to_string(&file).unwrap();
    let parsed = parse_domain(&SourceText::new(file.display().to_string(), text));
    parsed.unwrap_or_else(|e| panic!("{}", e.render())).value
}

fn problem_of(file: &Path, domain: &Domain) -> Problem {
    let text = std::fs::read_to_string(file).unwrap();
    let parsed = parse_problem(&SourceText::new(file.display().to_string(), text), domain);
    parsed.unwrap_or_else(|e| panic!("{}", e.render())).value
}

/// The shipped domain of that name with random tasks.
fn tasks<'a>(domain: &'a Domain, folder: &Path, seed: u64) -> Tasks<'a> {
    let problems = files_below(&folder.join("problems"), "pddl");
    Tasks::new(domain, problems.iter().map(|file| problem_of(file, domain)).collect(), seed)
}

fn optimal() -> Budget {
    Budget { greedy_expansions_max: 0, optimal_expansions_max: 1_000_000, ..Budget::standard() }
}

fn greedy() -> Budget {
    Budget { optimal_expansions_max: 0, ..Budget::standard() }
}

/// The cost of an answer, `None` for "unsolvable"; every plan must be right.
#[track_caller]
fn cost(outcome: &Outcome, task: &SmallTask, domain: &Domain) -> Option<u64> {
    match outcome {
        Outcome::Solved(plan) => {
            let checked = validate(domain, &PlanRequest::new(&task.problem), &plan.steps);
            assert!(checked.is_valid(), "{checked:?}\n{}", task.problem);
            Some(plan.cost)
        }
        Outcome::Unsolvable { .. } => None,
        other @ (Outcome::OutOfBudget { .. }
        | Outcome::Interrupted
        | Outcome::Unsupported { .. }
        | Outcome::BadInput { .. }) => panic!("{other:?}\n{}", task.problem),
    }
}

/// Both searches, and the task that covers every state, agree with brute force on every task whose
/// states it could all look at.
#[track_caller]
fn agrees_with_brute_force(name: &str) {
    let folder = project("domains").join(name);
    let domain = domain_of(&folder);
    let (mut n_solved, mut n_unsolvable) = (0, 0);
    for task in tasks(&domain, &folder, 1).take(TASKS_PER_DOMAIN) {
        let request = PlanRequest::new(&task.problem);
        let brute = task.brute_force(STATES_MAX);
        let found = cost(&plan(&domain, &request, &optimal()).outcome, &task, &domain);
        let quickly = cost(&plan(&domain, &request, &greedy()).outcome, &task, &domain);
        let input = TaskInput {
            domain: &domain,
            objects: request.objects,
            init: request.init,
            goal: request.goal,
            costs: request.costs,
            minimise_cost: false,
        };
        let every = Task::new(&input, Coverage::AllStates, &optimal().grounding).unwrap();
        let every = Solver::new(every);
        let again = every.solve(request.init, &NO_PENALTIES, &optimal(), &|| false);
        let again = cost(&again.outcome, &task, &domain);
        let shown = || format!("brute force {brute:?}\n{}", task.problem);
        assert_eq!(found, again, "{}", shown());
        assert_eq!(found.is_some(), quickly.is_some(), "{}", shown());
        assert!(quickly >= found, "{quickly:?} < {found:?}, {}", shown());
        match brute {
            Brute::Cheapest(cheapest) => assert_eq!(found, Some(cheapest), "{}", shown()),
            Brute::Unsolvable => assert_eq!(found, None, "{}", shown()),
            Brute::TooMany => continue,
        }
        n_solved += u32::from(found.is_some());
        n_unsolvable += u32::from(found.is_none());
    }
    // The comparison is worth something.
    let told = (n_solved + n_unsolvable) as usize;
    assert!(told * 10 >= TASKS_PER_DOMAIN * 9, "{told} of {TASKS_PER_DOMAIN} tasks tell something");
    assert!(n_solved >= 500 && n_unsolvable >= 100, "{n_solved} solved, {n_unsolvable} unsolvable");
}

#[test]
fn blocksworld_agrees_with_brute_force() {
    agrees_with_brute_force("blocksworld");
}

#[test]
fn cooking_agrees_with_brute_force() {
    agrees_with_brute_force("cooking");
}

#[test]
fn hanoi_agrees_with_brute_force() {
    agrees_with_brute_force("hanoi");
}

#[test]
fn sorting_agrees_with_brute_force() {
    agrees_with_brute_force("sorting");
}

#[test]
fn every_shipped_domain_is_compared() {
    let names = folders_in(&project("domains"));
    let names: Vec<_> = names.iter().map(|f| f.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(
        names,
        ["blocksworld", "cooking", "hanoi", "sorting"],
        "a new domain needs its own test above"
    );
}

/// Fast Downward through the Python that `GROUNDLOOP_FAST_DOWNWARD` names; prints what is skipped
/// without it.
#[expect(clippy::disallowed_methods, reason = "two documented variables, for tests only")]
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
fn fast_downward(optimal: bool) -> Option<(FastDownward, usize)> {
    let Ok(python) = std::env::var("GROUNDLOOP_FAST_DOWNWARD") else {
        println!("skipped: set GROUNDLOOP_FAST_DOWNWARD to a python with up-fast-downward");
        return None;
    };
    let n_tasks = std::env::var("GROUNDLOOP_FAST_DOWNWARD_TASKS");
    let n_tasks = n_tasks.map_or(FAST_DOWNWARD_TASKS, |n| n.parse().unwrap());
    let options = format!("python = {python:?}\noptimal = {optimal}\ntimeout_s = 120");
    let options: toml::Table = options.parse().unwrap();
    let choice = PartChoice::new("test", "fast-downward").with_options(Some(&options), "test");
    let inputs = PlannerInputs { budget: &Budget::standard() };
    let context = PartContext { choice: &choice, inputs, environment: |_| None };
    Some((FastDownward::new(&context).unwrap(), n_tasks))
}

#[test]
fn fast_downward_agrees_on_random_tasks() {
    let Some((other, n_tasks)) = fast_downward(true) else { return };
    for folder in folders_in(&project("domains")) {
        let domain = domain_of(&folder);
        for task in tasks(&domain, &folder, 2).take(n_tasks) {
            let request = PlanRequest::new(&task.problem);
            let found = cost(&plan(&domain, &request, &optimal()).outcome, &task, &domain);
            let told = other.solve(&domain, &request, &|| false).outcome;
            assert_eq!(cost(&told, &task, &domain), found, "{}", task.problem);
        }
    }
}

#[test]
fn fast_downward_avoids_a_penalised_step_like_the_embedded_planner() {
    let Some((other, _)) = fast_downward(true) else { return };
    let folder = project("domains/blocksworld");
    let domain = domain_of(&folder);
    let problem = problem_of(&folder.join("problems/five-blocks-spread.pddl"), &domain);
    let request = PlanRequest::new(&problem);
    let Outcome::Solved(free) = plan(&domain, &request, &optimal()).outcome else { panic!() };
    let penalties = free.steps.iter().take(2).map(|step| (step.clone(), 3)).collect();
    let request = PlanRequest { penalties: &penalties, ..request };
    let sum = |outcome: Outcome| {
        let Outcome::Solved(plan) = outcome else { panic!("{outcome:?}") };
        plan.cost + plan.penalty
    };
    let own = sum(plan(&domain, &request, &optimal()).outcome);
    assert_eq!(sum(other.solve(&domain, &request, &|| false).outcome), own);
}

/// Problems of the corpus with the costs that Fast Downward has been recorded with.
fn corpus(config: &str) -> Vec<(Domain, Problem, Option<f64>, String)> {
    let Some(root) = data("ipc", "the corpus through both planners") else { return Vec::new() };
    let csv = std::fs::read_to_string(root.join("fast_downward.csv")).unwrap();
    let rows = csv.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    let rows = rows.filter(|row| row[2] == config);
    rows.map(|row| {
        let domain = domain_of(&root.join(row[0]));
        let problem = problem_of(&root.join(row[0]).join(row[1]), &domain);
        let cost = (row[3] == "1").then(|| row[4].parse().unwrap());
        (domain, problem, cost, format!("{}/{}", row[0], row[1]))
    })
    .collect()
}

/// What either planner solves, the other solves too, and both plans are right.
#[test]
fn both_planners_solve_the_corpus() {
    let Some((other, _)) = fast_downward(false) else { return };
    for (domain, problem, recorded, name) in corpus("lama_first") {
        if recorded.is_none() {
            continue; // nobody has shown that there is a plan
        }
        let request = PlanRequest::new(&problem);
        let Outcome::Solved(own) = plan(&domain, &request, &greedy()).outcome else {
            panic!("{name}")
        };
        assert!(validate(&domain, &request, &own.steps).is_valid(), "{name}");
        let told = other.solve(&domain, &request, &|| false).outcome;
        assert!(matches!(told, Outcome::Solved(_)), "{name}: {told:?}");
    }
}

/// Where both prove a plan cheapest, it costs the same.
#[test]
fn cheapest_plans_of_the_corpus_cost_what_fast_downward_says() {
    let mut n_compared = 0;
    let problems = corpus("astar_lmcut");
    let is_there = !problems.is_empty();
    for (domain, problem, recorded, name) in problems {
        let Some(recorded) = recorded else { continue };
        let budget = Budget { optimal_expansions_max: 200_000, ..optimal() };
        if let Outcome::Solved(own) = plan(&domain, &PlanRequest::new(&problem), &budget).outcome {
            assert!(own.proven_optimal, "{name}");
            assert_eq!(own.in_full(own.cost).to_f64(), recorded, "{name}");
            n_compared += 1;
        }
    }
    assert!(n_compared >= 8 || !is_there, "{n_compared} compared");
}
