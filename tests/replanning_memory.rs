//! What a replanning episode takes of the heap, by an allocator that counts.

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::project;
use groundloop::messages::{GoalMessage, PlanSource, PlanVerdict, Spent};
use groundloop::pddl::Step;
use groundloop::planners::Deadlines;
use groundloop::replanning::{BuildInPlace, ReplanQuery, Replanner};
use groundloop::run::{DomainFolder, load_run};
use groundloop::stress::{Template, Workload, WorkloadGenerator};

/// Most that an episode with 10 disks may take at any time.
const HEAP_BYTES_MAX: usize = 64 << 20;
/// Scenes of the episode; somebody else interferes in every second one.
const N_SCENES: u64 = 300;

struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn took(bytes: usize) {
    let held = HELD.fetch_add(bytes, Ordering::Relaxed) + bytes;
    PEAK.fetch_max(held, Ordering::Relaxed);
}

#[expect(unsafe_code, reason = "an allocator cannot be written otherwise")]
// SAFETY: every call is handed on to the system's allocator as it is; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        took(layout.size());
        // SAFETY: the caller keeps the promises of `GlobalAlloc::alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: `place` came from `System` with this layout.
        unsafe { System.dealloc(place, layout) };
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn an_episode_with_ten_disks_stays_small() {
    let path = project("domains/hanoi");
    let folder = DomainFolder::read(&path).unwrap();
    let file = path.join("stress.toml").display().to_string();
    let template = Template::parse(&file, &std::fs::read_to_string(&file).unwrap()).unwrap();
    let problem = template.problem(&file, &folder.domain, 10).unwrap();
    let goal = GoalMessage::new(problem.goal.clone(), Vec::new(), &problem.objects);
    let config = load_run(&project("configs/hanoi.toml"), &[]).unwrap().planner;
    let mut feeder = WorkloadGenerator::new(Workload::Deviation, (&folder.domain, &problem), 0, 1);

    let before = HELD.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    let planner = config.planner(Path::new("run.toml"), |_| None).unwrap();
    let domain = Arc::new(folder.domain.clone());
    let mut replanner = Replanner::new(domain, planner.into(), &config, Vec::new());
    let (mut next, mut rungs): (Option<Step>, BTreeMap<PlanSource, u32>) = (None, BTreeMap::new());
    let mut longest = 0;
    for cycle in 0..N_SCENES {
        let view = if cycle == 0 { feeder.now() } else { feeder.next(next.as_ref()) };
        let scene = view.scene(cycle);
        let query = ReplanQuery { scene: &scene, goal: &goal, failures: &BTreeMap::new() };
        let (tables, spent) = (&mut BuildInPlace, &Spent::default);
        let plan = replanner.plan(query, Deadlines::NONE, spent, tables);
        *rungs.entry(plan.source.unwrap()).or_default() += 1;
        if let PlanVerdict::Plan { steps, .. } = plan.verdict {
            longest = longest.max(steps.len());
            next = steps.first().cloned();
        }
        replanner.prepare(&mut BuildInPlace);
    }
    let peak = PEAK.load(Ordering::Relaxed) - before;
    println!("peak {:.1} MB, {rungs:?}, longest plan {longest}", peak as f64 / 1e6);
    assert!(
        rungs.contains_key(&PlanSource::Table) && rungs.contains_key(&PlanSource::Trajectory),
        "{rungs:?}"
    );
    assert!(longest >= 1000, "{longest} steps");
    assert!(peak <= HEAP_BYTES_MAX, "{peak} bytes");
}
