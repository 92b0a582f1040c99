//! A planner of your own: breadth-first search by direct interpretation of the domain, in one screen. It is asked
//! for a plan here, and the independent validator checks the answer. Every step costs one, and a domain with derived
//! predicates is beyond it.
//!
//! ```console
//! cargo run --release --example own_planner
//! ```
//!
//! To choose it in a run file, move it to `src/planners/breadth_first.rs`, add a `PART` (see `src/planners/embedded.rs`)
//! and a line in `PLANNERS`; `planner.name = "breadth-first"` then lets the loop ask it.

#![expect(clippy::print_stdout, reason = "an example shows what it does")]

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use groundloop::logic::{Facts, Universe, bind, effects, evaluate};
use groundloop::pddl::{
    Action, Atom, Number, SourceText, Step, Typed, parse_domain, parse_problem,
};
use groundloop::planners::{PlanQuery, Planner};
use groundloop::planning::{
    Outcome, Plan, PlanAnswer, PlanRequest, Proof, Statistics, Validation, validate,
};

/// Most states that are looked at.
const STATES_MAX: usize = 100_000;

/// A state, and where each known state was first reached from.
type State = BTreeSet<Atom>;
type CameFrom = BTreeMap<State, Option<(State, Step)>>;

#[derive(Debug)]
struct BreadthFirst;

impl Planner for BreadthFirst {
    fn plan(&self, query: &PlanQuery<'_>) -> PlanAnswer {
        let universe = Universe { types: &query.domain.types, objects: query.objects };
        let steps = all_steps(query);
        let mut came_from: CameFrom = BTreeMap::from([(query.init.clone(), None)]);
        let mut queue = VecDeque::from([query.init.clone()]);
        let outcome = loop {
            let Some(state) = queue.pop_front() else {
                let n_states = came_from.len();
                break Outcome::Unsolvable { proof: Proof::Exhausted { n_states } };
            };
            if came_from.len() > STATES_MAX || (query.deadlines.hard)() {
                break Outcome::OutOfBudget { limit: "states_max", value: STATES_MAX as u64 };
            }
            let facts = Facts::new(state.clone());
            let truth = |atom: &_| facts.truth(atom);
            if evaluate(query.goal, &BTreeMap::new(), &universe, &truth).is_true() {
                break Outcome::Solved(plan_to(&state, &came_from));
            }
            for (action, step) in &steps {
                let Some(bindings) = bind(action, &step.args) else { continue };
                if !evaluate(&action.precondition, &bindings, &universe, &truth).is_true() {
                    continue;
                }
                let changes = effects(action, &bindings, &universe, &truth);
                let next: BTreeSet<Atom> = &(&state - &changes.delete) | &changes.add;
                if !came_from.contains_key(&next) {
                    came_from.insert(next.clone(), Some((state.clone(), step.clone())));
                    queue.push_back(next);
                }
            }
        };
        PlanAnswer { outcome, statistics: Statistics::default() }
    }
}

/// Every step whose arguments have the right types, in a fixed order.
fn all_steps<'a>(query: &PlanQuery<'a>) -> Vec<(&'a Action, Step)> {
    let mut steps = Vec::new();
    for action in &query.domain.actions {
        let mut argument_lists = vec![Vec::new()];
        for parameter in &action.params {
            let fits = |object: &&Typed| query.domain.types.fits(&object.types, &parameter.types);
            let objects: Vec<&Typed> = query.objects.iter().filter(fits).collect();
            let longer = argument_lists.iter().flat_map(|args: &Vec<_>| {
                objects
                    .iter()
                    .map(|object| [args.as_slice(), std::slice::from_ref(&object.name)].concat())
            });
            argument_lists = longer.collect();
        }
        let named =
            argument_lists.into_iter().map(|args| Step { action: action.name.clone(), args });
        steps.extend(named.map(|step| (action, step)));
    }
    steps
}

/// The steps that led to a state: a shortest plan, since states are reached in order of their depth.
fn plan_to(state: &State, came_from: &CameFrom) -> Plan {
    let mut steps = VecDeque::new();
    let mut state = state;
    while let Some(Some((before, step))) = came_from.get(state) {
        steps.push_front(step.clone());
        state = before;
    }
    let cost = steps.len() as u64;
    Plan {
        steps: steps.into(),
        cost,
        cost_unit: Number::ONE,
        penalty: 0,
        lower_bound: cost,
        proven_optimal: true,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let read = |path: &str| -> std::io::Result<SourceText> {
        Ok(SourceText { name: path.to_owned(), text: std::fs::read_to_string(path)? })
    };
    let domain = parse_domain(&read("domains/blocksworld/domain.pddl")?)?.value;
    let problem = "(define (problem three) (:domain blocksworld)
        (:objects a b c - block arm - robot)
        (:init (on a b) (ontable b) (ontable c) (clear a) (clear c) (handempty arm))
        (:goal (and (on b c) (on c a))))";
    let problem = SourceText { name: "three".to_owned(), text: problem.to_owned() };
    let problem = parse_problem(&problem, &domain)?.value;
    let query = PlanQuery::once(&domain, &PlanRequest::new(&problem));
    let Outcome::Solved(plan) = BreadthFirst.plan(&query).outcome else {
        return Err("expected a plan".into());
    };
    print!("{plan}");
    let checked = validate(&domain, &PlanRequest::new(&problem), &plan.steps);
    println!(
        "validator: {}",
        if matches!(checked, Validation::Valid { .. }) { "valid" } else { "invalid" }
    );
    Ok(())
}
