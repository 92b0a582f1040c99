//! Published domains and problems: everything is read, solved and validated.
//!
//! The files are read in place from the folder that the environment variable `GROUNDLOOP_DATA`
//! names; without it every test here says that it was skipped.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test file")]

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::data;
use groundloop::logic::{Extension, Facts, Universe};
use groundloop::pddl::{
    Domain, ErrorKind, Problem, SourceText, Typed, parse_domain, parse_problem, parse_rules,
    print_domain, print_problem,
};
use groundloop::planning::{
    Budget, Outcome, Plan, PlanAnswer, PlanRequest, Validation, plan, validate,
};

fn source(path: &Path) -> SourceText {
    SourceText::new(path.display().to_string(), fs::read_to_string(path).unwrap())
}

fn domain(path: &Path) -> Domain {
    let source = source(path);
    let domain = parse_domain(&source).unwrap_or_else(|e| panic!("{}", e.render())).value;
    let printed = SourceText::new("printed", print_domain(&domain));
    let read = parse_domain(&printed).unwrap_or_else(|e| panic!("{}", e.render())).value;
    assert_eq!(read, domain, "{}", source.name);
    domain
}

fn problem(path: &Path, domain: &Domain) -> Problem {
    let source = source(path);
    let problem = parse_problem(&source, domain).unwrap_or_else(|e| panic!("{}", e.render())).value;
    let printed = SourceText::new("printed", print_problem(&problem));
    let read = parse_problem(&printed, domain).unwrap_or_else(|e| panic!("{}", e.render())).value;
    assert_eq!(read, problem, "{}", source.name);
    problem
}

/// The `.pddl` files of a folder in order, without the domain.
fn problem_files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "pddl"))
        .filter(|p| !p.ends_with("domain.pddl"))
        .collect();
    files.sort();
    files
}

#[test]
fn competition_files_are_read() {
    let Some(root) = data("ipc", "published problems") else { return };
    let mut folders: Vec<PathBuf> =
        fs::read_dir(root).unwrap().map(|e| e.unwrap().path()).collect();
    folders.sort();
    let mut n_problems = 0;
    for folder in folders.iter().filter(|f| f.is_dir()) {
        let domain = domain(&folder.join("domain.pddl"));
        for file in problem_files(folder) {
            problem(&file, &domain);
            n_problems += 1;
        }
    }
    assert_eq!(n_problems, 29);
}

#[test]
fn prodg_v_files_are_read() {
    let Some(root) = data("prodgv/data", "published problems") else { return };
    for name in ["blocksworld", "cooking", "hanoi"] {
        let folder = root.join(name);
        let domain = domain(&folder.join("domain.pddl"));
        for file in problem_files(&folder.join("problems")) {
            problem(&file, &domain);
        }
        let rules = source(&folder.join("derived.pddl"));
        match (name, parse_rules(&rules, &domain)) {
            // These rules name a type that their domain lacks.
            ("cooking", Err(error)) => {
                assert_eq!(error.kind, ErrorKind::Semantics);
                assert_eq!((error.place.line, error.place.column), (4, 32));
                assert_eq!(error.message, "unknown type `vegetable`");
            }
            (_, Ok(rules)) => assert!(!rules.is_empty()),
            (_, Err(error)) => panic!("{}", error.render()),
        }
    }
}

#[test]
fn the_derived_predicates_of_a_known_complaint_are_read() {
    let Some(folder) = data("derived-328", "published problems") else { return };
    let domain = domain(&folder.join("domain.pddl"));
    assert_eq!(domain.axioms.len(), 13);
    let problem = problem(&folder.join("problem.pddl"), &domain);
    let request = PlanRequest::new(&problem);
    let PlanAnswer { outcome, statistics } = plan(&domain, &request, &Budget::standard());
    let Outcome::Solved(plan) = outcome else { panic!("{outcome:?}") };
    assert_eq!(plan.steps.len(), 1);
    // Grounding everything would give 644,332 atoms of one derived predicate alone.
    assert_eq!((statistics.n_actions, statistics.n_atoms), (1, 9));
    let objects: Vec<Typed> = domain.constants.iter().chain(&problem.objects).cloned().collect();
    let universe = Universe { types: &domain.types, objects: &objects };
    let all = Extension::new(&domain.axioms, &universe, &Facts::new(problem.init.clone()));
    assert_eq!(all.len_of(&"inferred-party".into()), 644_332);
}

/// Plans for a problem and checks the plan.
fn solved(domain: &Domain, problem: &Problem, budget: &Budget) -> Plan {
    let request = PlanRequest::new(problem);
    let PlanAnswer { outcome, statistics } = plan(domain, &request, budget);
    let Outcome::Solved(plan) = outcome else {
        panic!("{}: {outcome:?} after {statistics:?}", problem.name)
    };
    let cost = plan.in_full(plan.cost);
    assert_eq!(validate(domain, &request, &plan.steps), Validation::Valid { cost });
    plan
}

/// Lengths of cheapest plans, as two other planners found them.
const GOLDEN: &[(&str, &[(u32, u64)])] = &[
    ("blocksworld", &[(1, 6), (2, 8), (3, 8), (5, 10), (7, 16), (10, 8)]),
    ("cooking", &[(1, 5), (2, 5), (4, 10), (8, 9), (9, 9), (10, 9)]),
    ("hanoi", &[(2, 15), (3, 3), (4, 2), (5, 127), (7, 511), (10, 31)]),
];

#[test]
fn prodg_v_problems_are_solved_at_the_least_cost() {
    let Some(root) = data("prodgv/data", "published problems") else { return };
    for (name, golden) in GOLDEN {
        let folder = root.join(name);
        let domain = domain(&folder.join("domain.pddl"));
        for (number, cost) in *golden {
            let problem = problem(&folder.join(format!("problems/problem{number}.pddl")), &domain);
            let plan = solved(&domain, &problem, &Budget::standard());
            assert_eq!((plan.cost, plan.proven_optimal), (*cost, true), "{name} {number}");
        }
    }
}

/// Problems that nobody is known to have solved within seconds; they are only read.
const UNSOLVED: &[&str] = &["cavediving-14-adl"];

#[test]
fn competition_problems_are_solved() {
    let Some(root) = data("ipc", "published problems") else { return };
    let mut folders: Vec<PathBuf> =
        fs::read_dir(root).unwrap().map(|e| e.unwrap().path()).collect();
    folders.sort();
    let mut budget = Budget::standard();
    budget.optimal_expansions_max = 0;
    let mut n_solved = 0;
    for folder in folders.iter().filter(|f| f.is_dir()) {
        if UNSOLVED.iter().any(|name| folder.ends_with(name)) {
            continue;
        }
        let domain = domain(&folder.join("domain.pddl"));
        for file in problem_files(folder) {
            let problem = problem(&file, &domain);
            let plan = solved(&domain, &problem, &budget);
            println!("{}: cost {}", file.display(), plan.cost);
            n_solved += 1;
        }
    }
    assert_eq!(n_solved, 28);
}
