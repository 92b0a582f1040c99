//! `groundloop stress`: what replanning costs, measured through the planner actor.

use std::path::{Path, PathBuf};

use comfy_table::{Cell as Text, Table};
use indicatif::{ProgressBar, ProgressStyle};

use super::goal::choice;
use super::out::Stream;
use super::plan::planner;
use super::table::{self, right};
use super::{Failure, exit, out};
use crate::planning::Budget;
use crate::run::{ConfigError, read_text};
use crate::stress::{
    Cell, CheckVerdict, Comparison, Judgement, Options, StressConfig, StressError, StressReport,
    TimingQuantiles, check, instances, load_stress, plot, run_stress, write_logs,
};
use crate::transport::BusConfig;

/// Threads of the runtime: one for the planner, one for who asks it.
const WORKERS: usize = 2;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The stress file, or the name of a shipped one: what is measured.
    config: PathBuf,
    /// What `$data` stands for in the stress file.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Measures this case only; may be repeated.
    #[arg(long = "case", value_name = "NAME")]
    cases: Vec<String>,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
    /// Writes the report into a file: a baseline for `--check`.
    #[arg(long, value_name = "FILE.json")]
    save: Option<PathBuf>,
    /// Writes interval logs (`HdrHistogram` V2), one file for each case, size, feed and rate.
    #[arg(long, value_name = "DIR")]
    logs: Option<PathBuf>,
    /// Draws latency over size.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Gives some of the states to another planner too: see `groundloop parts planner`.
    #[arg(long, value_name = "NAME")]
    compare: Option<String>,
    /// That planner's own options: a TOML file with what `[planner.options]` of a run file has.
    #[arg(long, value_name = "FILE", requires = "compare")]
    compare_options: Option<PathBuf>,
    /// Compares medians of thread-CPU time with an earlier report; exit code 6 when one is more
    /// than a fifth slower.
    #[arg(long, value_name = "FILE.json")]
    check: Option<PathBuf>,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let mut config = load_stress(&args.config)?;
    select(&mut config, &args.cases)?;
    let instances = instances(&config, args.data.as_deref())?;
    let baseline = args.check.as_deref().map(read_report).transpose()?;
    let other = match &args.compare {
        Some(name) => {
            let choice = choice("--compare", name, args.compare_options.as_deref())?;
            Some((name.as_str(), planner(&choice, &Budget::standard())?))
        }
        None => None,
    };
    let options = Options {
        config: &config,
        instances: &instances,
        bus: BusConfig::for_run(format!("stress-{}", std::process::id())),
        compare: other.as_ref().map(|(name, planner)| (*name, &**planner)),
    };
    let bar = bar();
    let mut progress = |done: u64, all: u64, name: &str| {
        bar.set_length(all);
        bar.set_position(done);
        bar.set_message(name.to_owned());
    };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(WORKERS)
        .enable_all()
        .build()
        .map_err(Failure::internal)?;
    let (report, logs) = runtime.block_on(run_stress(&options, &mut progress))?;
    bar.finish_and_clear();
    if let Some(folder) = &args.logs {
        write_logs(&logs, folder)?;
    }
    if let Some(path) = &args.plot {
        write(path, &plot(&report, &logs)?)?;
    }
    if let Some(path) = &args.save {
        write(path, &serde_json::to_string_pretty(&report).map_err(Failure::internal)?)?;
    }
    let judgements = baseline.map(|before| check(&report, &before, config.check_samples_min));
    if args.json {
        out::json(&report)?;
    } else {
        print_report(&report);
    }
    let Some(judgements) = judgements else { return Ok(0) };
    let stream = Stream::beside(args.json);
    stream.line("");
    stream.table(check_table(&judgements));
    let regressed = judgements.iter().any(|j| j.verdict == CheckVerdict::Regressed);
    Ok(if regressed { exit::CHECK_FAILED } else { 0 })
}

fn select(config: &mut StressConfig, wanted: &[String]) -> Result<(), ConfigError> {
    let names: Vec<String> = config.case.iter().map(|case| case.name.clone()).collect();
    if let Some(got) = wanted.iter().find(|name| !names.contains(name)) {
        return Err(ConfigError::Value {
            key: "--case".to_owned(),
            expected: names.join(" or "),
            got: got.clone(),
        });
    }
    config.case.retain(|case| wanted.is_empty() || wanted.contains(&case.name));
    Ok(())
}

fn read_report(path: &Path) -> Result<StressReport, Failure> {
    serde_json::from_str(&read_text(path)?).map_err(|error| {
        let path = path.display();
        Failure::bad_input(format!("{path}: expected a report of groundloop stress: {error}"))
    })
}

fn write(path: &Path, text: &str) -> Result<(), ConfigError> {
    std::fs::write(path, text)
        .map_err(|e| ConfigError::File { path: path.display().to_string(), reason: e.to_string() })
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(0);
    match ProgressStyle::with_template("{bar:40} {pos}/{len}, {msg}") {
        Ok(style) => bar.with_style(style),
        Err(error) => {
            tracing::debug!(%error, "progress is shown plainly");
            bar
        }
    }
}

fn print_report(report: &StressReport) {
    let machine = &report.machine;
    let loads: Vec<String> = machine.load.iter().map(|[now, ..]| format!("{now:.1}")).collect();
    out::line(&format!(
        "planner {}, seed {}, {} repeats; {} x {}, load {}, calibration {:.2} ms",
        report.planner,
        report.seed,
        report.repeats,
        machine.processors,
        machine.processor,
        loads.join(" "),
        machine.calibration_ns as f64 / 1e6,
    ));
    out::line("");
    Stream::Output.table(cell_table(&report.cells));
    if !report.comparisons.is_empty() {
        out::line("");
        Stream::Output.table(comparison_table(&report.comparisons));
    }
}

fn cell_table(cells: &[Cell]) -> Table {
    let mut table = table::plain();
    table.set_header([
        "case",
        "size",
        "feed",
        "Hz",
        "rung",
        "count",
        "CPU µs p50",
        "p90",
        "p99",
        "p99.9",
        "max",
        "wall p50",
        "p99",
        "max",
        "round trip p50",
        "p99",
        "missed",
        "cost ratio",
    ]);
    for cell in cells {
        let key = &cell.key;
        let TimingQuantiles { p50, p90, p99, p999, max } = cell.cpu_ns;
        let (wall, trip) = (cell.wall_ns, cell.round_trip_ns);
        let mut row = vec![
            Text::new(&key.case),
            right(key.problem.clone().unwrap_or_else(|| key.size.to_string())),
            Text::new(key.feed.name()),
            right(&key.rate),
            Text::new(&key.rung),
            right(cell.count),
        ];
        let times = [p50, p90, p99, p999, max, wall.p50, wall.p99, wall.max, trip.p50, trip.p99];
        row.extend(times.map(|ns| right(us(ns))));
        row.push(right(cell.missed));
        row.push(right(cell.cost_ratio.map_or("-".to_owned(), |r| format!("{:.2}", r.mean))));
        table.add_row(row);
    }
    table
}

fn comparison_table(comparisons: &[Comparison]) -> Table {
    let mut table = table::plain();
    table.set_header([
        "same states",
        "size",
        "planner",
        "states",
        "solved",
        "own CPU µs p50",
        "its CPU µs p50",
        "its wall µs p50",
        "ratio",
        "own cost",
        "its cost",
    ]);
    for comparison in comparisons {
        table.add_row([
            Text::new(&comparison.case),
            right(comparison.problem.clone().unwrap_or_else(|| comparison.size.to_string())),
            Text::new(&comparison.planner),
            right(comparison.states),
            right(comparison.solved),
            right(us(comparison.cpu_ns.p50)),
            right(us(comparison.other_cpu_ns.p50)),
            right(us(comparison.other_wall_ns.p50)),
            right(format!("{:.0}", comparison.ratio)),
            right(comparison.cost),
            right(comparison.other_cost),
        ]);
    }
    table
}

fn check_table(judgements: &[Judgement]) -> Table {
    let mut table = table::plain();
    table.set_header(["check", "before µs", "now µs", "ratio", "verdict"]);
    for judgement in judgements {
        let (verdict, known) = match judgement.verdict {
            CheckVerdict::Passed => ("passed", true),
            CheckVerdict::Regressed => ("REGRESSED", true),
            CheckVerdict::TooFew => ("too few to tell", true),
            CheckVerdict::Unmatched => ("not in both", false),
        };
        let ratio = format!("{:.2}", judgement.ratio());
        table.add_row([
            Text::new(judgement.key.to_string()),
            right(us(judgement.before_ns as u64)),
            right(us(judgement.now_ns as u64)),
            right(if known { ratio } else { "-".to_owned() }),
            Text::new(verdict),
        ]);
    }
    table
}

/// Nanoseconds as microseconds, with as many digits as count.
fn us(ns: u64) -> String {
    let us = ns as f64 / 1000.0;
    match ns {
        0..10_000 => format!("{us:.2}"),
        10_000..1_000_000 => format!("{us:.1}"),
        _ => format!("{us:.0}"),
    }
}

impl From<StressError> for Failure {
    fn from(error: StressError) -> Self {
        match error {
            StressError::Config(error) => error.into(),
            StressError::Transport(error) => error.into(),
            StressError::Fatal(error) => crate::run::RunError::from(error).into(),
            StressError::Plot { .. } => Self::internal(error),
            StressError::Silent { .. } => Self { message: error.to_string(), code: exit::GAVE_UP },
            StressError::Wire(error) => Self::bad_input(error),
        }
    }
}
