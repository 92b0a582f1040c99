//! `groundloop eval faults`: task success over the rate of faults, with the loop open and closed.

use std::path::{Path, PathBuf};

use comfy_table::{Cell, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};

use super::super::table::right;
use super::super::{Failure, exit, out};
use crate::eval::faults::{FaultsPoint, FaultsReport, FaultsRow, plot};
use crate::executive::ExecutiveMode;
use crate::run::{PreparedRun, load_run, read_text};

/// The run files that are measured when none is given.
const CONFIGS: [&str; 2] = ["blocksworld_faults", "hanoi_faults"];
/// Threads of the runtime: the loop is a pipeline, more would not help one episode.
const WORKERS: usize = 2;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Run files with faults, or names of shipped ones; without any, `blocksworld_faults` and `hanoi_faults`.
    configs: Vec<PathBuf>,
    /// The rates: what `fault_rate` of each run file is set to.
    #[arg(long, value_name = "R,R…", value_delimiter = ',',
          default_values_t = [0.0, 0.05, 0.1, 0.2, 0.3, 0.5])]
    rates: Vec<f64>,
    /// How many episodes are run at each point, with seeds counting up from the first.
    #[arg(long, value_name = "N", default_value_t = 20,
          value_parser = clap::value_parser!(u64).range(1..=100_000))]
    episodes: u64,
    /// The first seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Overrides a key of every run file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Draws the curves.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Shows a report that was saved with `--json`, and measures nothing.
    #[arg(long, value_name = "FILE.json",
          conflicts_with_all = ["configs", "rates", "episodes", "seed", "sets"])]
    from: Option<PathBuf>,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Measures, or takes a saved report; prints the table and draws it.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let report = match &args.from {
        Some(path) => saved(path)?,
        None => measured(args)?,
    };
    if let Some(path) = &args.plot {
        let svg = plot(&report).map_err(Failure::internal)?;
        let written = std::fs::write(path, svg);
        written.map_err(|e| Failure::bad_input(format!("{}: {e}", path.display())))?;
    }
    if args.json {
        out::json(&report)?;
    } else {
        print(&report);
    }
    let of_closed = report.rows.iter().filter(|row| row.executive == "closed_loop");
    let mut wrong = of_closed.map(|row| row.false_seeds.len() as u64 + row.against_evidence);
    Ok(if wrong.any(|n| n > 0) { exit::CHECK_FAILED } else { 0 })
}

fn saved(path: &Path) -> Result<FaultsReport, Failure> {
    serde_json::from_str(&read_text(path)?).map_err(|error| {
        let expected = "expected a report of groundloop eval faults --json";
        Failure::bad_input(format!("{}: {expected}: {error}", path.display()))
    })
}

fn measured(args: &Args) -> Result<FaultsReport, Failure> {
    let points = points(args)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(WORKERS)
        .enable_all()
        .build()
        .map_err(Failure::internal)?;
    let last = args.seed.saturating_add(args.episodes - 1);
    let mut report = FaultsReport { seeds: [args.seed, last], rows: Vec::new() };
    let bar = ProgressBar::new(args.episodes * points.len() as u64);
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} episodes, {eta} left, {msg}");
    let bar = bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    for point in &points {
        let mut row = point.row();
        bar.set_message(format!("{}, {}, {}", row.config, row.executive, row.fault_rate));
        for seed in args.seed..=last {
            row.count(&runtime.block_on(point.run(seed))?);
            bar.inc(1);
        }
        report.rows.push(row);
    }
    bar.finish_and_clear();
    Ok(report)
}

/// Every run file with the loop open and closed at every rate; whatever may fail fails here.
fn points(args: &Args) -> Result<Vec<FaultsPoint>, Failure> {
    let shipped = || CONFIGS.iter().map(PathBuf::from).collect();
    let configs = if args.configs.is_empty() { shipped() } else { args.configs.clone() };
    let mut points = Vec::new();
    for path in &configs {
        for mode in [ExecutiveMode::ClosedLoop, ExecutiveMode::OpenLoop] {
            for rate in &args.rates {
                let sets = [args.sets.clone(), vec![format!("fault_rate={rate}")]].concat();
                let mut config = load_run(path, &sets)?;
                config.executive = mode;
                let name = config.origin.stem().to_owned();
                let prepared = PreparedRun::read(config, None)?;
                points.push(FaultsPoint { prepared, name });
            }
        }
    }
    Ok(points)
}

fn print(report: &FaultsReport) {
    for config in report.configs() {
        let mut table = Table::new();
        table.load_preset(presets::ASCII_MARKDOWN);
        table.set_header([
            "loop",
            "rate",
            "success",
            "95 % interval",
            "false",
            "faults",
            "steps",
            "untrue",
            "against evidence",
        ]);
        for row in report.rows.iter().filter(|row| row.config == config) {
            table.add_row(cells(row));
        }
        out::line(&format!("{config}:\n\n{table}\n"));
        let failed = report.rows.iter().filter(|row| row.config == config);
        failed.filter(|row| row.executive == "closed_loop").for_each(print_seeds);
    }
}

/// The seeds that failed with the loop closed, to be looked into with `groundloop run`.
fn print_seeds(row: &FaultsRow) {
    let list = |seeds: &[u64]| seeds.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    for (what, seeds) in [("failed", &row.failed_seeds), ("FALSE", &row.false_seeds)] {
        if !seeds.is_empty() {
            out::line(&format!("{what} at rate {}: seeds {}", row.fault_rate, list(seeds)));
        }
    }
}

fn cells(row: &FaultsRow) -> Vec<Cell> {
    let [low, high] = row.success_share_95.map(|edge| edge * 100.0);
    vec![
        Cell::new(row.executive.replace("_loop", "")),
        right(row.fault_rate),
        right(format!("{}/{}", row.successes, row.episodes)),
        right(format!("{low:.1}–{high:.1} %")),
        right(row.false_seeds.len()),
        right(row.faults),
        right(row.dispatches),
        right(row.against_truth),
        right(row.against_evidence),
    ]
}
