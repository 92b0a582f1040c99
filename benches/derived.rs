//! Derived predicates of a known hard case: one goal on demand, and everything that follows.
//!
//! Reads `derived-328/` in the folder that the environment variable `GROUNDLOOP_DATA` names.

#![expect(
    clippy::panic,
    clippy::print_stdout,
    reason = "a failed step must fail the benchmark; it says so"
)]

use std::env;
use std::hint::black_box;
use std::path::Path;

use criterion::Criterion;
use groundloop::logic::{Demand, Extension, Facts, Universe, bind, evaluate};
use groundloop::pddl::{
    Atom, Condition, Literal, Name, SourceText, Term, Typed, parse_domain, parse_problem,
};

fn read(folder: &Path, file: &str) -> Result<SourceText, String> {
    let text = std::fs::read_to_string(folder.join(file)).map_err(|e| e.to_string())?;
    Ok(SourceText::new(file, text))
}

fn measure(criterion: &mut Criterion, folder: &Path) -> Result<(), String> {
    let domain = parse_domain(&read(folder, "domain.pddl")?).map_err(|e| e.render())?.value;
    let problem =
        parse_problem(&read(folder, "problem.pddl")?, &domain).map_err(|e| e.render())?.value;
    let objects: Vec<Typed> = domain.constants.iter().chain(&problem.objects).cloned().collect();
    let universe = Universe { types: &domain.types, objects: &objects };
    let base = Facts::new(problem.init.clone());
    // The goal is what the domain's one action does; its precondition is the derived atom in question.
    let action = domain.actions.first().ok_or("the domain has no action")?;
    let goal = first_atom(&problem.goal).ok_or("the goal names no atom")?;
    let args: Vec<Name> = goal.args.iter().filter_map(object).cloned().collect();
    let bindings = bind(action, &args).ok_or("the goal does not fit the action")?;
    let mut group = criterion.benchmark_group("derived-328");
    group.bench_function("goal on demand", |b| {
        b.iter(|| {
            let demand = Demand::new(&domain.axioms, universe, black_box(&base));
            let truth = |atom: &Atom| demand.truth(atom);
            evaluate(&action.precondition, &bindings, &universe, &truth)
        });
    });
    group.sample_size(20).bench_function("everything", |b| {
        b.iter(|| Extension::new(&domain.axioms, &universe, black_box(&base)));
    });
    group.finish();
    Ok(())
}

fn object(term: &Term) -> Option<&Name> {
    if let Term::Object(name) = term { Some(name) } else { None }
}

/// The first atom of a conjunction.
fn first_atom(goal: &Condition) -> Option<&Literal> {
    match goal {
        Condition::Atom(literal) => Some(literal),
        Condition::And(parts) => parts.iter().find_map(first_atom),
        Condition::True
        | Condition::False
        | Condition::Equal(..)
        | Condition::Not(_)
        | Condition::Or(_)
        | Condition::Exists(..)
        | Condition::Forall(..) => None,
    }
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let root = env::var_os("GROUNDLOOP_DATA").unwrap_or_else(|| "../shared".into());
    let folder = Path::new(&root).join("derived-328");
    if !folder.is_dir() {
        println!("skipped: {} is not there (set GROUNDLOOP_DATA)", folder.display());
        return;
    }
    if let Err(error) = measure(&mut criterion, &folder) {
        panic!("{error}");
    }
    criterion.final_summary();
}
