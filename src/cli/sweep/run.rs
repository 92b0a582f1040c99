//! `groundloop sweep run`: the episodes of a sweep, or one shard of them.

use std::collections::BTreeSet;
use std::path::PathBuf;

use indicatif::{ProgressBar, ProgressStyle};

use super::super::{Failure, exit, out};
use super::show::try_each_point;
use super::{given, pool};
use crate::clock::monotonic_ns;
use crate::sweep::{Shard, SweepFolder, SweepLine};

/// How often progress is told where there is no terminal.
const TOLD_EVERY_S: f64 = 30.0;
const MINUTE_S: f64 = 60.0;

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The sweep file, or the name of a shipped one.
    spec: PathBuf,
    /// Which part of it: `2/8` is the second of eight. `auto/8` takes the number that the scheduler of a cluster
    /// tells (Slurm, Kubernetes, `HyperQueue`, PBS, Grid Engine, LSF, AWS Batch).
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: String,
    /// The sweep's folder; all shards share it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How many episodes are run side by side; without it, as many as there are processors.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

pub(in crate::cli) fn run(args: &Args) -> Result<u8, Failure> {
    #[expect(clippy::disallowed_methods, reason = "schedulers tell a task its number so")]
    let variable = |name: &str| std::env::var(name).ok();
    let shard = Shard::parse(&args.shard, &variable).map_err(Failure::bad_input)?;
    let (file, design) = given(&args.spec)?;
    try_each_point(&design)?;
    let text = file.text().map_err(Failure::bad_input)?;
    let folder = SweepFolder::open(&args.out, (&file.to_string(), &text))?;
    let Some(mut kept) = folder.shard(shard)? else {
        out::note(&format!("shard {shard} is done: {}", args.out.display()));
        return Ok(0);
    };
    let there: BTreeSet<u64> = kept.lines().iter().map(|line| line.record.index).collect();
    let mut left: Vec<u64> = shard.episodes(design.len()).collect();
    let n_all = left.len();
    left.retain(|index| !there.contains(index));
    let processors = || std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = args.jobs.map_or_else(processors, usize::from);
    let mut progress = Progress::new(n_all, kept.lines());
    pool::run_all((&folder.spec_path(), &design), &left, jobs, |line| {
        let index = line.record.index;
        progress.count(&line);
        kept.keep(line)?;
        tracing::info!(index, "an episode has ended");
        Ok(())
    })?;
    kept.finish()?;
    out::note(&progress.summary(jobs));
    if shard.count() == 1 {
        folder.merge(design.len())?;
    }
    Ok(progress.exit_code())
}

fn since_s(ns: u64) -> f64 {
    (monotonic_ns() - ns) as f64 / 1e9
}

/// How far it is, and what it came to.
struct Progress {
    bar: ProgressBar,
    started_ns: u64,
    told_ns: u64,
    n_all: usize,
    n_before: usize,
    n: usize,
    successes: usize,
    errors: usize,
    wrong: usize,
    cpu_s: f64,
}

impl Progress {
    fn new(n_all: usize, before: &[SweepLine]) -> Self {
        let style = "{bar:30} {pos}/{len} episodes, {eta} left, {msg}";
        let style = ProgressStyle::with_template(style);
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(n_all as u64).with_style(style);
        bar.set_position(before.len() as u64);
        bar.reset_eta();
        let now_ns = monotonic_ns();
        let mut progress = Self {
            bar,
            started_ns: now_ns,
            told_ns: now_ns,
            n_all,
            n_before: before.len(),
            n: 0,
            successes: 0,
            errors: 0,
            wrong: 0,
            cpu_s: 0.0,
        };
        for line in before {
            progress.judge(line);
        }
        progress
    }

    fn judge(&mut self, SweepLine { record, timing }: &SweepLine) {
        self.n += 1;
        self.successes += usize::from(record.is_success());
        self.errors += usize::from(timing.is_none());
        self.wrong += usize::from(record.is_wrong());
    }

    fn count(&mut self, line: &SweepLine) {
        self.judge(line);
        self.cpu_s += line.timing.map_or(0.0, |timing| timing.cpu_s);
        let told = format!("{:.0} a minute, {}", self.a_minute(), self.tally());
        self.bar.inc(1);
        self.bar.set_message(told.clone());
        if self.bar.is_hidden() && since_s(self.told_ns) >= TOLD_EVERY_S {
            self.told_ns = monotonic_ns();
            let left = (self.n_all - self.n) as f64 / self.a_minute().max(1e-9);
            out::note(&format!("{}/{} episodes, {left:.1} min left, {told}", self.n, self.n_all));
        }
    }

    fn a_minute(&self) -> f64 {
        let seconds = since_s(self.started_ns).max(1e-9);
        (self.n - self.n_before) as f64 * MINUTE_S / seconds
    }

    fn tally(&self) -> String {
        let Self { successes, n, errors, wrong, .. } = self;
        let bad = [(errors, "without a verdict"), (wrong, "FALSE or against evidence")];
        let bad = bad.into_iter().filter(|(count, _)| **count > 0);
        let bad = bad.map(|(count, what)| format!(", {count} {what}"));
        format!("success {successes}/{n}{}", bad.collect::<String>())
    }

    fn summary(&self, jobs: usize) -> String {
        self.bar.finish_and_clear();
        let seconds = since_s(self.started_ns);
        format!(
            "{} of {} episodes run in {seconds:.0} s ({:.0} a minute, {jobs} side by side, {:.2} processors busy): {}",
            self.n - self.n_before,
            self.n_all,
            self.a_minute(),
            self.cpu_s / seconds.max(1e-9),
            self.tally()
        )
    }

    /// Failures are what a sweep is for; what may never be is not.
    fn exit_code(&self) -> u8 {
        match (self.errors, self.wrong) {
            (0, 0) => 0,
            (0, _) => exit::CHECK_FAILED,
            _ => exit::INTERNAL,
        }
    }
}
