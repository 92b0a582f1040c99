//! What each source of the plan-reuse cascade costs, on packed states and from whole scenes.
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
use groundloop::messages::{GoalMessage, PlanMessage, PlanSource, PlanVerdict, Spent};
use groundloop::planners::Deadlines;
use groundloop::planners::PlannerConfig;
use groundloop::replanning::{
    Adoption, BuildInPlace, BuildNever, DistanceTable, ReplanQuery, Replanner, TableBuilder,
};
use groundloop::run::{DomainFolder, load_run};
use groundloop::scene::Scene;
use groundloop::stress::{Template, Workload, WorkloadGenerator};

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

fn replanner(folder: &DomainFolder, rungs: &[PlanSource]) -> Replanner {
    let run = load_run(&Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/hanoi.toml"), &[]);
    let mut config = PlannerConfig { rungs: rungs.to_vec(), ..run.unwrap().planner };
    config.table.bytes_max = 1 << 27;
    let planner = config.planner(Path::new("run.toml"), |_| None).unwrap();
    Replanner::new(Arc::new(folder.domain.clone()), planner.into(), &config, Vec::new())
        .adopting(Adoption::WhenReady)
}

/// What the planner actor does in one cycle; the time that is told is wall-clock time.
fn cycle(
    replanner: &mut Replanner,
    (scene, goal): (&Scene, &GoalMessage),
    tables: &mut dyn TableBuilder,
) -> PlanMessage {
    let query = ReplanQuery { scene, goal, failures: &BTreeMap::new() };
    let spent = || Spent { cpu_ns: 0, wall_ns: monotonic_ns() };
    let message = replanner.plan(query, Deadlines::NONE, &spent, tables);
    replanner.prepare(tables);
    message
}

fn table(replanner: &Replanner) -> Arc<DistanceTable> {
    Arc::clone(replanner.cascade().unwrap().table().unwrap())
}

impl Case {
    fn new(domain: &str, size: u32) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains").join(domain);
        let folder = DomainFolder::read(&path).unwrap();
        let file = path.join("stress.toml").display().to_string();
        let template = Template::parse(&file, &std::fs::read_to_string(&file).unwrap()).unwrap();
        let problem = template.problem(&file, &folder.domain, size).unwrap();
        let goal = GoalMessage::new(problem.goal.clone(), Vec::new(), &problem.objects);
        let mut feeder =
            WorkloadGenerator::new(Workload::Random, (&folder.domain, &problem), WALK_STEPS, 1);
        let scenes: Vec<Scene> = (1..).map(|i| feeder.next(None).scene(i)).take(N_STATES).collect();
        let mut replanner =
            replanner(&folder, &[PlanSource::Trajectory, PlanSource::Table, PlanSource::Search]);
        // At the goal nobody wants a table.
        for scene in &scenes {
            cycle(&mut replanner, (scene, &goal), &mut BuildInPlace);
        }
        let mut feeder =
            WorkloadGenerator::new(Workload::Progress, (&folder.domain, &problem), WALK_STEPS, 1);
        let mut walk = vec![feeder.now().scene(1)];
        let verdict = cycle(&mut replanner, (&walk[0], &goal), &mut BuildInPlace).verdict;
        let PlanVerdict::Plan { steps, .. } = verdict else { panic!("{verdict:?}") };
        // The last step reaches the goal, which is another source's business.
        for step in steps.iter().take(steps.len().saturating_sub(1)).take(N_STATES) {
            walk.push(feeder.next(Some(step)).scene(1));
        }
        Self { name: format!("{domain}/{size}"), goal, scenes, walk, replanner }
    }

    /// The time of deciding alone, over and over a list of scenes.
    fn decide(&self, scenes: &[Scene], n: u64, source: PlanSource) -> Duration {
        let mut replanner = self.replanner.clone();
        let mut ask = |scene| cycle(&mut replanner, (scene, &self.goal), &mut BuildNever);
        ask(&scenes[0]);
        let mut spent_ns = 0;
        for scene in scenes.iter().cycle().skip(1).take(usize::try_from(n).unwrap()) {
            let message = black_box(ask(scene));
            spent_ns += message.decide.wall_ns;
            let others = [PlanSource::Goal, PlanSource::Unchanged, PlanSource::Trajectory];
            let allowed = message.source.is_some_and(|r| r == source || others.contains(&r));
            assert!(allowed, "{:?}", message.source);
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
        b.iter_custom(|n| case.decide(&case.walk, n, PlanSource::Trajectory));
    });
    let table = table(&case.replanner);
    let pack = |scene: &Scene| {
        let mut replanner = case.replanner.clone();
        replanner.observe(scene, &case.goal);
        replanner.cascade().unwrap().grounded().unwrap().1.to_vec()
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
        b.iter_custom(|n| case.decide(&case.scenes, n, PlanSource::Table));
    });
    group.finish();
}

fn bench_building(criterion: &mut Criterion, domain: &str, size: u32) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains").join(domain);
    let folder = DomainFolder::read(&path).unwrap();
    let case = Case::new(domain, size);
    let mut replanner = replanner(&folder, &[PlanSource::Table, PlanSource::Search]);
    for scene in &case.scenes {
        cycle(&mut replanner, (scene, &case.goal), &mut BuildNever);
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
