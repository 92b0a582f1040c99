//! `groundloop sweep report`: tables, a plot, and a page with pictures of failures.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use comfy_table::{Cell, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};

use super::super::table::right;
use super::super::{Failure, out};
use super::opened;
use super::worker::Player;
use crate::actors::{SnapshotMoment, SnapshotRequest};
use crate::sweep::{
    FailurePicture, SweepDesign, SweepFactor, SweepLevel, SweepPage, SweepRecord, SweepReport,
    episodes_csv, plot_sweep, points_csv,
};

/// How long before the end of an episode its picture is from, in cycles.
const BEFORE_END: u64 = 10;

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The sweep's folder: what was given as `--out`.
    dir: PathBuf,
    /// Where the report is written; without it, `report` in the sweep's folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The factor along the plot's axis; without it, what the sweep file says.
    #[arg(long, value_name = "FACTOR")]
    x: Option<String>,
    /// The factor with a curve for each level; without it, what the sweep file says.
    #[arg(long, value_name = "FACTOR")]
    by: Option<String>,
    /// The factor with a panel for each level; without it, what the sweep file says.
    #[arg(long, value_name = "FACTOR")]
    panel: Option<String>,
    /// Of how many failures the page has a picture: their episodes are run again, one for each reason first.
    #[arg(long, value_name = "N", default_value_t = 6)]
    pictures: usize,
    /// Reports on what is there when episodes are missing.
    #[arg(long)]
    partial: bool,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

pub(in crate::cli) fn run(args: &Args) -> Result<u8, Failure> {
    let (folder, design) = opened(&args.dir)?;
    let there = if args.partial { folder.records() } else { folder.complete(design.len()) };
    let (records, _) = there?;
    let mut report = SweepReport::new(&name_of(&args.dir), &design, &records);
    let layout = &mut report.layout;
    for (wanted, field) in
        [(&args.x, &mut layout.x), (&args.by, &mut layout.by), (&args.panel, &mut layout.panel)]
    {
        if let Some(wanted) = wanted {
            known_factor(&design, wanted)?;
            field.clone_from(wanted);
        }
    }
    let to = args.out.clone().unwrap_or_else(|| args.dir.join("report"));
    let plot = plot_sweep(&report, &records).map_err(Failure::internal)?;
    let pictures = pictures(&design, &report.failures, args.pictures, &to)?;
    let spec = folder.spec()?;
    let page = SweepPage {
        report: &report,
        design: &design,
        plot: &plot,
        pictures: &pictures,
        spec: &spec,
    };
    write(&to, "index.html", page.html().as_bytes())?;
    write(&to, "success.svg", plot.as_bytes())?;
    write(&to, "points.csv", &points_csv(&report))?;
    write(&to, "episodes.csv", &episodes_csv(&records))?;
    if args.json {
        out::json(&report)?;
    } else {
        print(&report);
        out::line(&format!("\n{}", to.join("index.html").display()));
    }
    Ok(0)
}

/// What the sweep is called: the name of its folder.
fn name_of(dir: &Path) -> String {
    let whole = std::fs::canonicalize(dir).unwrap_or_else(|_| dir.to_owned());
    whole.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

fn known_factor(design: &SweepDesign, wanted: &str) -> Result<(), Failure> {
    let factors: Vec<&str> = design.spec().factor.iter().map(SweepFactor::title).collect();
    if wanted.is_empty() || factors.contains(&wanted) {
        return Ok(());
    }
    Err(Failure::bad_input(format!("expected a factor ({}), got {wanted}", factors.join(", "))))
}

fn write(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), Failure> {
    let path = folder.join(name);
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&path, bytes))
        .map_err(|error| Failure::bad_input(format!("{}: {error}", path.display())))
}

/// Runs failed episodes again, and takes a picture of what was believed at the end.
fn pictures(
    design: &SweepDesign,
    failures: &[SweepRecord],
    n: usize,
    to: &Path,
) -> Result<Vec<FailurePicture>, Failure> {
    let chosen = chosen(failures, n);
    if chosen.is_empty() {
        return Ok(Vec::new());
    }
    let folder = to.join("pictures");
    std::fs::create_dir_all(&folder)
        .map_err(|error| Failure::bad_input(format!("{}: {error}", folder.display())))?;
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} pictures, {eta} left");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(chosen.len() as u64).with_style(style);
    let mut player = Player::new()?;
    let mut taken = Vec::new();
    for record in chosen {
        let path = folder.join(format!("{}.png", record.index));
        let request = SnapshotRequest {
            path: path.clone(),
            from_cycle: record.cycles.saturating_sub(BEFORE_END),
            moment: SnapshotMoment::First,
        };
        if let Some(plan) = design.episode(record.index) {
            let again = player.play(&plan, Some(request));
            let index = record.index;
            match (again, std::fs::read(&path)) {
                (Ok(_), Ok(png)) => taken.push(FailurePicture { index, png }),
                (Ok(_), Err(error)) => tracing::warn!(index, %error, "no picture of a failure"),
                (Err(failure), _) => {
                    tracing::warn!(index, reason = failure.reason(), "a failure without a picture");
                }
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(taken)
}

/// The failures that are shown: of each reason one, then others; those without a cycle have nothing to show.
fn chosen(failures: &[SweepRecord], n: usize) -> Vec<&SweepRecord> {
    let mut reasons = BTreeSet::new();
    let shown = failures.iter().filter(|record| record.cycles > 0);
    let (mut first, others): (Vec<_>, Vec<_>) =
        shown.partition(|record| reasons.insert((&record.verdict, &record.reason)));
    first.extend(others);
    first.truncate(n);
    first
}

fn print(report: &SweepReport) {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    let (titles, rows) = rows(report);
    let counted = ["success", "95 % interval", "false", "errors", "untrue", "against evidence"];
    table.set_header(titles.into_iter().chain(counted.map(str::to_owned)));
    for (names, tally) in rows {
        let [low, high] = tally.success_share_95.map(|edge| edge * 100.0);
        table.add_row(names.into_iter().map(Cell::new).chain([
            right(format!("{}/{}", tally.successes, tally.episodes)),
            right(format!("{low:.1}–{high:.1} %")),
            right(tally.false_reached),
            right(tally.errors),
            right(tally.against_truth),
            right(tally.against_evidence),
        ]));
    }
    out::line(&table.to_string());
    let all = &report.all;
    out::line(&format!(
        "\nsuccess {}/{} of {} episodes",
        all.successes, all.episodes, report.expected
    ));
}

type Rows<'a> = Vec<(Vec<&'a String>, &'a crate::sweep::SweepTally)>;

/// The points of a grid; of a Latin hypercube, the levels of each factor.
fn rows(report: &SweepReport) -> (Vec<String>, Rows<'_>) {
    let Some(first) = report.points.first() else {
        let rows = report.levels.iter();
        let rows = rows.map(|SweepLevel { factor, level, tally }| (vec![factor, level], tally));
        return (["factor", "level"].map(str::to_owned).to_vec(), rows.collect());
    };
    let rows = report.points.iter().map(|p| (p.factors.values().collect(), &p.tally));
    (first.factors.keys().cloned().collect(), rows.collect())
}
