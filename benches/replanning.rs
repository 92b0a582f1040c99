//! What each rung of the replanning ladder costs, on packed states and from whole scenes.
//!
//! `tests/replanning_memory.rs` holds what an episode may take of the heap; `groundloop stress`
//! measures the planner actor behind its topics, in processor time and with tails.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the benchmark")]

use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion};
use groundloop::clock::monotonic_ns;
use groundloop::messages::{GoalMessage, PlanVerdict, Rung};
use groundloop::planners::PlannerConfig;
use groundloop::replanning::{Patience, Replanner, Table};
use groundloop::run::{DomainFolder, load_run};
use groundloop::scene::Scene;
use groundloop::stress::{Feed, Feeder, Template};

const SIZES: &[(&str, &[u32])] =
    &[("blocksworld", &[4, 5, 6, 7, 8]), ("hanoi", &[3, 4, 5, 6, 7, 8, 9, 10])];
/// Random states by case.
const N_STATES: usize = 300;
/// Steps that somebody else does between two of them.
const WALK_STEPS: u32 = 200;

/// One problem with random states of it.
struct Case {
    name: String,
    goal: GoalMessage,
    scenes: Vec<Scene>,
    /// Scenes along one plan.
    walk: Vec<Scene>,
    /// Has a plan and a table.
    replanner: Replanner,
}

fn replanner(folder: &DomainFolder, rungs: &[Rung]) -> Replanner {
    let run = load_run(&Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/hanoi.toml"), &[]);
    let mut config = PlannerConfig { rungs: rungs.to_vec(), ..run.unwrap().planner };
    config.table.bytes_max = 1 << 27;
    let planner = config.planner(Path::new("run.toml"), |_| None).unwrap();
    Replanner::new(Arc::new(folder.domain.clone()), planner.into(), &config, Vec::new())
}

fn adopt_table(replanner: &mut Replanner) {
    replanner.prepare(0);
    if let Some(request) = replanner.pending() {
        let end = request.job.run(&|| false);
        replanner.adopt(end);
    }
}

fn table(replanner: &Replanner) -> Arc<Table> {
    Arc::clone(replanner.ladder().unwrap().table().unwrap())
}

impl Case {
    fn new(domain: &str, size: u32) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains").join(domain);
        let folder = DomainFolder::read(&path).unwrap();
        let file = path.join("stress.toml").display().to_string();
        let template = Template::parse(&file, &std::fs::read_to_string(&file).unwrap()).unwrap();
        let problem = template.problem(&file, &folder.domain, size).unwrap();
        let goal = GoalMessage::new(problem.goal.clone(), Vec::new(), &problem.objects);
        let none = BTreeMap::new();
        let mut feeder = Feeder::new(Feed::Random, (&folder.domain, &problem), WALK_STEPS, 1);
        let scenes: Vec<Scene> = (1..).map(|i| feeder.next(None).scene(i)).take(N_STATES).collect();
        let mut replanner = replanner(&folder, &[Rung::Trajectory, Rung::Table, Rung::Search]);
        // At the goal nobody wants a table.
        for scene in &scenes {
            replanner.replan(scene, &goal, &none);
            adopt_table(&mut replanner);
        }
        let mut feeder = Feeder::new(Feed::Progress, (&folder.domain, &problem), WALK_STEPS, 1);
        let mut walk = vec![feeder.now().scene(1)];
        let verdict = replanner.replan(&walk[0], &goal, &none).verdict;
        let PlanVerdict::Plan { steps, .. } = verdict else { panic!("{verdict:?}") };
        // The last step reaches the goal, which is another rung's business.
        for step in steps.iter().take(steps.len().saturating_sub(1)).take(N_STATES) {
            walk.push(feeder.next(Some(step)).scene(1));
        }
        Self { name: format!("{domain}/{size}"), goal, scenes, walk, replanner }
    }

    /// The time of deciding alone, over and over a list of scenes.
    fn decide(&self, scenes: &[Scene], n: u64, rung: Rung) -> Duration {
        let (mut replanner, none) = (self.replanner.clone(), BTreeMap::new());
        replanner.replan(&scenes[0], &self.goal, &none);
        let mut spent_ns = 0;
        for scene in scenes.iter().cycle().skip(1).take(usize::try_from(n).unwrap()) {
            replanner.prepare(0);
            replanner.observe(scene, &self.goal);
            let start_ns = monotonic_ns();
            let decided = black_box(replanner.decide(scene, &self.goal, &none, Patience::ENDLESS));
            spent_ns += monotonic_ns() - start_ns;
            let others = [Rung::Goal, Rung::Unchanged, Rung::Trajectory];
            let allowed = decided.rung.is_some_and(|r| r == rung || others.contains(&r));
            assert!(allowed, "{:?}", decided.rung);
        }
        Duration::from_nanos(spent_ns)
    }
}

fn bench(criterion: &mut Criterion, case: &Case) {
    let id = |what: &str| BenchmarkId::new(what, &case.name);
    let mut group = criterion.benchmark_group("replanning");
    let mut replanner = case.replanner.clone();
    let mut scenes = case.scenes.iter().cycle();
    group.bench_function(id("observe a scene"), |b| {
        b.iter(|| replanner.observe(scenes.next().unwrap(), &case.goal));
    });
    group.bench_function(id("confirm on the plan"), |b| {
        b.iter_custom(|n| case.decide(&case.walk, n, Rung::Trajectory));
    });
    let table = table(&case.replanner);
    let pack = |scene: &Scene| {
        let mut replanner = case.replanner.clone();
        replanner.observe(scene, &case.goal);
        replanner.ladder().unwrap().grounded().unwrap().1.to_vec()
    };
    let states: Vec<Vec<u64>> = case.scenes.iter().map(pack).collect();
    let mut next = states.iter().cycle();
    group.bench_function(id("deviation: next action"), |b| {
        b.iter(|| table.next_action(black_box(next.next().unwrap())));
    });
    let mut next = states.iter().cycle();
    group.bench_function(id("deviation: whole plan"), |b| {
        b.iter(|| table.plan(black_box(next.next().unwrap())));
    });
    group.bench_function(id("deviation: decide"), |b| {
        b.iter_custom(|n| case.decide(&case.scenes, n, Rung::Table));
    });
    group.finish();
}

fn bench_building(criterion: &mut Criterion, domain: &str, size: u32) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains").join(domain);
    let folder = DomainFolder::read(&path).unwrap();
    let case = Case::new(domain, size);
    let mut replanner = replanner(&folder, &[Rung::Table, Rung::Search]);
    for scene in &case.scenes {
        replanner.replan(scene, &case.goal, &BTreeMap::new());
        replanner.prepare(0);
    }
    let Some(request) = replanner.pending().cloned() else { return };
    let mut group = criterion.benchmark_group("replanning");
    group.sample_size(10);
    group.bench_function(BenchmarkId::new("build the table", &case.name), |b| {
        b.iter(|| request.job.run(&|| false));
    });
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    for &(domain, sizes) in SIZES {
        for &size in sizes {
            bench(&mut criterion, &Case::new(domain, size));
            bench_building(&mut criterion, domain, size);
        }
    }
    criterion.final_summary();
}
