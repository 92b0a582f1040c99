//! Random states of many blocks: one search, then improvement for ten times as long.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use groundloop::clock::thread_cpu_ns;
use groundloop::pddl::{Atom, Condition, Domain, SourceText, Typed, parse_domain, parse_goal};
use groundloop::planning::{
    Budget, Coverage, GroundingLimits, NO_PENALTIES, PlanRequest, Solver, Task, TaskInput,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

use super::{cost, cpu_ms, quantile, source};

/// States of each number of blocks.
const STATES: usize = 100;
/// How much longer a plan is improved than it was looked for.
const IMPROVE_FACTOR: f64 = 10.0;
/// Costs of good plans, by number of blocks and state: `n,state,cost`.
const REFERENCE: &str = include_str!("blocks_reference.csv");

/// What one size came to.
#[derive(Default)]
struct Figures {
    search_ms: Vec<f64>,
    improved_ms: Vec<f64>,
    /// Costs by those of the reference, after the search and after improvement.
    found: Vec<f64>,
    improved: Vec<f64>,
}

pub(super) fn measure() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains/blocksworld/domain.pddl");
    let domain = parse_domain(&source(&path)).unwrap_or_else(|e| panic!("{}", e.render())).value;
    println!(
        "\n| blocks | states | search p50 ms | p99 ms | then improved, p99 ms | \
         cost / reference found | improved | worst |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for n in [8, 20, 40] {
        let mut f = figures(&domain, n);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        println!(
            "| {n} | {STATES} | {:.2} | {:.2} | {:.1} | {:.2} | {:.2} | {:.2} |",
            quantile(&mut f.search_ms, 0.5),
            quantile(&mut f.search_ms, 0.99),
            quantile(&mut f.improved_ms, 0.99),
            mean(&f.found),
            mean(&f.improved),
            quantile(&mut f.improved, 1.0),
        );
    }
}

fn figures(domain: &Domain, n: usize) -> Figures {
    let mut random = ChaCha8Rng::seed_from_u64(n as u64);
    let names = (0..n).map(|i| Typed::new(format!("b{i}").as_str(), "block"));
    let objects: Vec<Typed> = names.chain([Typed::new("arm", "robot")]).collect();
    let goal: String = ons(&towers(n, &mut random)).map(|atom| atom.to_string()).collect();
    let goal = SourceText::new("goal", format!("(and {goal})"));
    let goal: Condition = parse_goal(&goal, domain, &objects).unwrap();
    let (init, costs) = (BTreeSet::new(), BTreeMap::new());
    let (objects, minimise_cost) = (&objects, false);
    let input =
        TaskInput { domain, objects, init: &init, goal: &goal, costs: &costs, minimise_cost };
    let task = Task::new(&input, Coverage::AllStates, &GroundingLimits::standard()).unwrap();
    let solver = Solver::new(task);
    let mut figures = Figures::default();
    for state in 0..STATES {
        let facts = facts(&towers(n, &mut random));
        let request = PlanRequest {
            objects,
            init: &facts,
            goal: &goal,
            costs: &costs,
            minimise_cost,
            penalties: &NO_PENALTIES,
        };
        let found = |budget: &Budget, interrupt: &dyn Fn() -> bool| {
            let (answer, ms) = cpu_ms(|| solver.solve(&facts, &NO_PENALTIES, budget, interrupt));
            (cost(domain, &request, &answer.outcome).unwrap(), ms)
        };
        let mut budget = Budget::standard();
        (budget.optimal_expansions_max, budget.improve_expansions_max) = (0, 0);
        let (first, ms) = found(&budget, &|| false);
        figures.search_ms.push(ms);
        let until_ns = thread_cpu_ns() + (ms * (1.0 + IMPROVE_FACTOR) * 1e6) as u64;
        budget.improve_expansions_max = u64::MAX;
        let (improved, ms) = found(&budget, &|| thread_cpu_ns() > until_ns);
        figures.improved_ms.push(ms);
        let key = format!("{n},{state},");
        let reference = REFERENCE.lines().find_map(|line| line.strip_prefix(&key));
        if let Some(reference) = reference.and_then(|text| text.parse::<f64>().ok()) {
            figures.found.push(first / reference);
            figures.improved.push(improved / reference);
        }
    }
    figures
}

fn facts(towers: &[Vec<usize>]) -> BTreeSet<Atom> {
    let of_one =
        |predicate: &str, block: usize| Atom::new(predicate, &[format!("b{block}").as_str()]);
    let mut facts: BTreeSet<Atom> = ons(towers).collect();
    for tower in towers {
        facts.insert(of_one("ontable", tower[0]));
        facts.insert(of_one("clear", tower[tower.len() - 1]));
    }
    facts.insert(Atom::new("handempty", &["arm"]));
    facts
}

/// Towers of blocks: who stands on whom, from one random order cut at random places.
fn towers(n: usize, random: &mut ChaCha8Rng) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        order.swap(i, random.next_u32() as usize % (i + 1));
    }
    let mut towers: Vec<Vec<usize>> = Vec::new();
    for block in order {
        match towers.last_mut() {
            Some(tower) if !random.next_u32().is_multiple_of(3) => tower.push(block),
            _ => towers.push(vec![block]),
        }
    }
    towers
}

fn ons(towers: &[Vec<usize>]) -> impl Iterator<Item = Atom> {
    let pairs = towers.iter().flat_map(|tower| tower.windows(2));
    pairs.map(|pair| {
        Atom::new("on", &[format!("b{}", pair[1]).as_str(), format!("b{}", pair[0]).as_str()])
    })
}
