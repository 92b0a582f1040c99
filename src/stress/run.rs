//! The whole test: every case, problem, workload and rate, over and over.

use std::time::Duration;

use super::case::case_of;
use super::measure::{AllSamples, Key, Timing, TimingQuantiles};
use super::reference::Reference;
use super::report::FORMAT;
use super::session::{Answer, Session, Start, nanoseconds};
use super::workload::{View, WorkloadGenerator};
use super::{
    Comparison, Instance, Logs, Machine, Rate, StressConfig, StressError, StressReport, Workload,
    machine,
};
use crate::clock::{monotonic_ns, thread_cpu_ns};
use crate::pddl::{Step, Typed};
use crate::planners::{PlanQuery, Planner};
use crate::planning::{NO_PENALTIES, Outcome, PlanRequest};
use crate::transport::BusConfig;

/// Stands for the source of a first plan: grounding and all.
const COLD: &str = "cold";

/// Told before each part of the test: which part of how many, and its name.
pub type Progress<'a> = dyn FnMut(u64, u64, &str) + 'a;

/// What a stress test is run with.
#[expect(missing_debug_implementations, reason = "holds a closure")]
pub struct Options<'a> {
    /// What is measured, how often, with which planner.
    pub config: &'a StressConfig,
    /// The problems of all cases, read beforehand.
    pub instances: &'a [Instance],
    /// Where the bus lies; each session has its own run on it.
    pub bus: BusConfig,
    /// Gets some of the same states.
    pub compare: Option<(&'a str, &'a dyn Planner)>,
}

/// One part: a problem with a workload at a rate.
#[derive(Clone, Copy)]
struct Part<'a> {
    instance: &'a Instance,
    feed: Workload,
    rate: Rate,
    seed: u64,
}

/// A state whose plan was measured.
struct Seen {
    view: View,
    timing: Timing,
    cost: Option<u64>,
    rung: String,
}

/// Runs a stress test.
///
/// # Errors
/// [`StressError`]; a plan that does not come ends the test.
pub async fn run_stress(
    options: &Options<'_>,
    progress: &mut Progress<'_>,
) -> Result<(StressReport, Logs), StressError> {
    let config = options.config;
    let parts = parts(config, options.instances);
    let n_parts = parts.len() as u64 * u64::from(config.repeats);
    let (mut samples, mut comparisons) = (AllSamples::new(), Vec::new());
    let (mut load, mut calibrations) = (vec![machine::load()], Vec::new());
    for repeat in 0..config.repeats {
        let mut rounds = Vec::new();
        for (number, part) in parts.iter().enumerate() {
            let done = u64::from(repeat) * parts.len() as u64 + number as u64;
            progress(done, n_parts, &part.instance.name());
            let part = Part { seed: part.seed.wrapping_add(u64::from(repeat)), ..*part };
            rounds.push(tokio::task::block_in_place(machine::calibrate));
            let seen = measure(options, part, repeat, &mut samples).await?;
            if repeat == 0 {
                tokio::task::block_in_place(|| {
                    look_up_costs(config, part, &seen, &mut samples);
                    let other = options.compare.filter(|_| is_compared(config, part));
                    comparisons.extend(other.and_then(|o| compare(config, part, &seen, o)));
                });
            }
        }
        calibrations.push(TimingQuantiles::of(rounds).p50);
        load.push(machine::load());
    }
    let processor = machine::processor();
    let machine = Machine {
        processor: processor.name,
        processors: processor.n,
        load,
        calibration_ns: calibrations.into_iter().min().unwrap_or(1),
    };
    let report = StressReport {
        format: FORMAT,
        config: config.origin.to_string(),
        planner: config.planner.name.clone(),
        seed: config.seed,
        repeats: config.repeats,
        machine,
        cells: samples.iter().map(|(key, samples)| samples.cell(key)).collect(),
        comparisons,
    };
    Ok((report, Logs(samples)))
}

/// Of the parts of a problem one is compared: that with the least that is known beforehand, back
/// to back where there is such a rate.
fn is_compared(config: &StressConfig, part: Part<'_>) -> bool {
    let case = case_of(config, part.instance);
    part.rate == *case.rates_hz.iter().find(|rate| **rate == Rate::Max).unwrap_or(&case.rates_hz[0])
        && Some(&part.feed) == case.feeds.iter().max()
}

fn parts<'a>(config: &StressConfig, instances: &'a [Instance]) -> Vec<Part<'a>> {
    let mut parts = Vec::new();
    for instance in instances {
        let case = case_of(config, instance);
        for &feed in &case.feeds {
            for &rate in &case.rates_hz {
                let mut part = Part { instance, feed, rate, seed: 0 };
                part.seed = seed(config.seed, &part.key("").to_string());
                parts.push(part);
            }
        }
    }
    parts
}

/// A seed of a part's own, whatever other parts there are: FNV-1a over its name.
fn seed(seed: u64, name: &str) -> u64 {
    let start = 0xcbf2_9ce4_8422_2325 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    name.bytes()
        .fold(start, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// One session: a cold start, a warm-up, then what counts.
async fn measure(
    options: &Options<'_>,
    part: Part<'_>,
    repeat: u32,
    samples: &mut AllSamples,
) -> Result<Vec<Seen>, StressError> {
    let Part { instance, feed, rate, seed } = part;
    let config = options.config;
    let case = case_of(config, instance);
    let run = format!("{}-{seed:x}", options.bus.run);
    let start = Start {
        folder: &instance.folder,
        problem: &instance.problem,
        planner: &case.planner,
        origin: &config.origin,
        bus: BusConfig { run, ..options.bus.clone() },
        answer_max: Duration::from_secs_f64(config.answer_s_max),
        name: instance.name(),
    };
    let mut session = Session::start(start).await?;
    let problem = (&instance.folder.domain, &instance.problem);
    let mut generator = WorkloadGenerator::new(feed, problem, case.walk_steps, seed);
    let first = session.ask(&generator.now()).await?;
    let mut log = SampleLog { part, repeat, samples, seen: Vec::new() };
    log.write(COLD, first.timing);
    let mut step = first.first_step().cloned();
    if case.warm_up_ms > 0 {
        session.pause(Duration::from_millis(case.warm_up_ms)).await;
        // One scene that does not count takes over what was made meanwhile.
        let view = generator.next(step.as_ref());
        step = session.ask(&view).await?.first_step().cloned();
    }
    match rate {
        Rate::Max => {
            back_to_back(&mut session, &mut generator, step, case.samples, &mut log).await?;
        }
        Rate::Hz(hz) => {
            let mut clocked = Clocked { session: &mut session, generator: &mut generator, step };
            clocked.run(hz, case.samples, &mut log).await?;
        }
    }
    let seen = log.seen;
    session.stop().await;
    Ok(seen)
}

/// Where samples are written.
struct SampleLog<'a> {
    part: Part<'a>,
    repeat: u32,
    samples: &'a mut AllSamples,
    seen: Vec<Seen>,
}

impl SampleLog<'_> {
    fn samples(&mut self, rung: &str) -> &mut super::measure::Samples {
        let samples = self.samples.entry(self.part.key(rung)).or_default();
        let n_repeats = self.repeat as usize + 1;
        if samples.timings.len() < n_repeats {
            samples.timings.resize(n_repeats, Vec::new());
        }
        samples
    }

    fn write(&mut self, rung: &str, timing: Timing) {
        let repeat = self.repeat as usize;
        self.samples(rung).timings[repeat].push(timing);
    }

    fn answer(&mut self, view: View, answer: &Answer) {
        self.write(&answer.rung, answer.timing);
        let (timing, cost, rung) = (answer.timing, answer.cost(), answer.rung.clone());
        self.seen.push(Seen { view, timing, cost, rung });
    }
}

impl Part<'_> {
    fn key(&self, rung: &str) -> Key {
        Key {
            case: self.instance.case.clone(),
            size: self.instance.size,
            problem: self.instance.problem_name.clone(),
            feed: self.feed,
            rate: self.rate.to_string(),
            rung: rung.to_owned(),
        }
    }
}

async fn back_to_back(
    session: &mut Session,
    generator: &mut WorkloadGenerator<'_>,
    mut step: Option<Step>,
    samples: u32,
    log: &mut SampleLog<'_>,
) -> Result<(), StressError> {
    let mut n = 0;
    while n < samples {
        let view = generator.next(step.as_ref());
        let answer = session.ask(&view).await?;
        step = answer.first_step().cloned();
        if view.counts {
            n += 1;
            log.answer(view, &answer);
        }
    }
    Ok(())
}

/// Scenes at fixed times, whether plans come or not.
struct Clocked<'s, 'f, 'd> {
    session: &'s mut Session,
    generator: &'f mut WorkloadGenerator<'d>,
    step: Option<Step>,
}

impl Clocked<'_, '_, '_> {
    async fn run(
        &mut self,
        hz: f64,
        samples: u32,
        log: &mut SampleLog<'_>,
    ) -> Result<(), StressError> {
        let period_ns = nanoseconds(Duration::from_secs_f64(1.0 / hz));
        let mut due_ns = monotonic_ns();
        let mut n = 0;
        while n < samples {
            let view = self.generator.next(self.step.as_ref());
            let cycle = self.session.send(&view)?;
            n += u32::from(view.counts);
            due_ns = due_ns.saturating_add(period_ns);
            let answered = self.until(due_ns, cycle).await?;
            match answered {
                Some(answer) if view.counts => {
                    if answer.timing.round_trip_ns > period_ns {
                        log.samples(&answer.rung).missed += 1;
                    }
                    log.answer(view, &answer);
                }
                None if view.counts => log.samples("late").missed += 1,
                Some(_) | None => {}
            }
        }
        Ok(())
    }

    /// Waits for that moment; returns the plan for that scene, if it has come.
    async fn until(&mut self, due_ns: u64, cycle: u64) -> Result<Option<Answer>, StressError> {
        let mut found = None;
        loop {
            let left = Duration::from_nanos(due_ns.saturating_sub(monotonic_ns()));
            if found.is_some() {
                self.session.pause(left).await;
                return Ok(found);
            }
            match self.session.answer(left).await? {
                Some(answer) => {
                    self.step = answer.first_step().cloned();
                    found = (answer.cycle == cycle).then_some(answer);
                }
                None => return Ok(None),
            }
        }
    }
}

/// Compares the costs of some plans with cheapest ones. Views without an object have no such
/// reference.
fn look_up_costs(config: &StressConfig, part: Part<'_>, seen: &[Seen], samples: &mut AllSamples) {
    let Instance { folder, problem, .. } = part.instance;
    let n_wanted = case_of(config, part.instance).optimal_samples as usize;
    if n_wanted == 0 {
        return;
    }
    let reference = Reference::new(&folder.domain, problem);
    let objects = objects(part.instance);
    let whole = seen.iter().filter(|s| s.cost.is_some() && s.view.objects == objects);
    for seen in spread(whole.collect(), n_wanted) {
        if let (Some(cost), Some(cheapest)) = (seen.cost, reference.cheapest(&seen.view.facts)) {
            samples.entry(part.key(&seen.rung)).or_default().costs.push((cost, cheapest));
        }
    }
}

fn objects(instance: &Instance) -> Vec<Typed> {
    super::world::World::new(&instance.folder.domain, &instance.problem).objects().to_vec()
}

/// So many of them, from first to last.
fn spread<T>(all: Vec<T>, n: usize) -> Vec<T> {
    let step = all.len().div_ceil(n.max(1)).max(1);
    all.into_iter().step_by(step).collect()
}

/// Gives some of the states to another planner.
fn compare(
    config: &StressConfig,
    part: Part<'_>,
    seen: &[Seen],
    (name, other): (&str, &dyn Planner),
) -> Option<Comparison> {
    let Instance { folder, problem, case, size, problem_name, .. } = part.instance;
    let n_wanted = case_of(config, part.instance).compare_samples as usize;
    let chosen = if n_wanted == 0 { Vec::new() } else { spread(seen.iter().collect(), n_wanted) };
    if chosen.is_empty() {
        return None;
    }
    let (mut cpu_ns, mut wall_ns) = (Vec::new(), Vec::new());
    let (mut solved, mut costs) = (0, (0, 0));
    for seen in &chosen {
        let request = PlanRequest {
            objects: &seen.view.objects,
            init: &seen.view.facts.known,
            minimise_cost: false,
            penalties: &NO_PENALTIES,
            ..PlanRequest::new(problem)
        };
        let (before_ns, thread_ns) = (monotonic_ns(), thread_cpu_ns());
        let answer = other.plan(&PlanQuery::once(&folder.domain, &request));
        cpu_ns.push(thread_cpu_ns() - thread_ns + answer.statistics.process_cpu_ns);
        wall_ns.push(monotonic_ns() - before_ns);
        if let Outcome::Solved(plan) = answer.outcome {
            solved += 1;
            if let Some(cost) = seen.cost {
                costs = (costs.0 + cost, costs.1 + plan.cost);
            }
        }
    }
    let own = TimingQuantiles::of(chosen.iter().map(|seen| seen.timing.cpu_ns()));
    let others = TimingQuantiles::of(cpu_ns);
    Some(Comparison {
        planner: name.to_owned(),
        case: case.clone(),
        size: *size,
        problem: problem_name.clone(),
        states: chosen.len() as u64,
        solved,
        cpu_ns: own,
        other_cpu_ns: others,
        other_wall_ns: TimingQuantiles::of(wall_ns),
        ratio: others.p50 as f64 / own.p50.max(1) as f64,
        cost: costs.0,
        other_cost: costs.1,
    })
}
