//! `groundloop eval robustness`: what is read off disturbed pictures.

use std::path::{Path, PathBuf};

use comfy_table::{Cell, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};

use super::super::table::right;
use super::super::{Failure, out};
use crate::eval::prodgv::{DomainData, FittedDomain, data_set};
use crate::eval::robustness::{
    Conditions, RobustnessReport, RobustnessRow, TRANSFORMS, Transform, Tried, Worth,
    on_photographs, plot,
};
use crate::files::Folder;
use crate::parts::PartChoice;
use crate::run::{DomainFolder, read_text};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A checkout of the paper's data set, whose photographs are disturbed; without it, only
    /// rendered scenes are.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Only this domain; may be given several times.
    #[arg(long, value_name = "NAME")]
    domain: Vec<String>,
    /// How many rendered scenes of each domain are disturbed.
    #[arg(long, default_value_t = 20, value_name = "N",
          value_parser = clap::value_parser!(u64).range(0..=10_000))]
    scenes: u64,
    /// Which detector finds the objects.
    #[arg(long, default_value = "colour")]
    detector: String,
    /// Which grounder judges the facts.
    #[arg(long, default_value = "s2s-joint")]
    grounder: String,
    /// Only this disturbance; may be given several times.
    #[arg(long = "transform", value_name = "NAME", value_parser = names())]
    transforms: Vec<String>,
    /// Where the disturbances' seeds begin.
    #[arg(long, default_value_t = 1, value_name = "S")]
    seed: u64,
    /// Also says what is wrong with each state that is not right.
    #[arg(long)]
    details: bool,
    /// Writes each disturbed picture that is not read rightly to this folder.
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// Draws the table: for each disturbance how many states are right, unknown, doubted and silent.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Shows a report that was saved with `--json`, and measures nothing.
    #[arg(long, value_name = "FILE.json",
          conflicts_with_all = ["data", "domain", "scenes", "detector", "grounder", "transforms",
                                "seed", "details", "pictures"])]
    from: Option<PathBuf>,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

fn names() -> clap::builder::PossibleValuesParser {
    clap::builder::PossibleValuesParser::new(TRANSFORMS.iter().map(|transform| transform.name))
}

/// Measures, or takes a saved report; prints the table and draws it.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let report = match &args.from {
        Some(path) => saved(path)?,
        None => measured(args)?,
    };
    if let Some(path) = &args.plot {
        let svg = plot(&report).map_err(Failure::internal)?;
        std::fs::write(path, svg).map_err(|e| unwritten(path, &e))?;
    }
    if args.json {
        out::json(&report)?;
    } else {
        print(&report);
    }
    Ok(0)
}

fn saved(path: &Path) -> Result<RobustnessReport, Failure> {
    serde_json::from_str(&read_text(path)?).map_err(|error| {
        let expected = "expected a report of groundloop eval robustness --json";
        Failure::bad_input(format!("{}: {expected}: {error}", path.display()))
    })
}

fn measured(args: &Args) -> Result<RobustnessReport, Failure> {
    let wanted =
        |t: &Transform| args.transforms.is_empty() || args.transforms.iter().any(|n| n == t.name);
    let transforms: Vec<Transform> = TRANSFORMS.iter().filter(|t| wanted(t)).copied().collect();
    let conditions = Conditions {
        detector: &PartChoice::new("--detector", &args.detector),
        grounder: &PartChoice::new("--grounder", &args.grounder),
        transforms: &transforms,
        seed: args.seed,
    };
    if let Some(folder) = &args.pictures {
        std::fs::create_dir_all(folder).map_err(|e| unwritten(folder, &e))?;
    }
    let mut report = RobustnessReport::new(&args.detector, &args.grounder, args.seed);
    let bar = ProgressBar::no_length().with_style(style());
    let mut unwritten = None;
    let mut add = |pictures: &str, tried: &Tried<'_>| {
        bar.inc(1);
        bar.set_message(pictures.to_owned());
        report.add(pictures, tried, args.details);
        if let Some(folder) = &args.pictures {
            unwritten = write(folder, tried).err().or(unwritten.take());
        }
    };
    if let Some(root) = &args.data {
        for data in data_set::read(root, &args.domain)? {
            photographs(&data, &conditions, &mut add)?;
        }
    }
    scenes(args, &conditions, &mut add)?;
    bar.finish_and_clear();
    unwritten.map_or(Ok(report), Err)
}

type Add<'a> = &'a mut dyn FnMut(&str, &Tried<'_>);

fn photographs(
    data: &DomainData,
    conditions: &Conditions<'_>,
    add: Add<'_>,
) -> Result<(), Failure> {
    let folder = DomainFolder::find(&data.name, &Folder::default())?;
    let fitted = FittedDomain::new(folder, &data.domain)?;
    let set = format!("{}, photographs", data.name);
    Ok(on_photographs(data, &fitted, conditions, &mut |tried| add(&set, tried))?)
}

#[cfg(feature = "sim")]
fn scenes(args: &Args, conditions: &Conditions<'_>, add: Add<'_>) -> Result<(), Failure> {
    use super::sim_grounding::with_sim::found;
    use crate::eval::robustness::on_rendered_scenes;

    if args.scenes == 0 {
        return Ok(());
    }
    for (run, folder) in found()? {
        let name = folder.domain.name.to_string();
        if args.domain.is_empty() || args.domain.contains(&name) {
            let set = format!("{name}, rendered");
            let mut add = |tried: &Tried<'_>| add(&set, tried);
            on_rendered_scenes(&run, &folder, args.scenes, conditions, &mut add)?;
        }
    }
    Ok(())
}

/// Without the simulator there are photographs only.
#[cfg(not(feature = "sim"))]
fn scenes(args: &Args, _: &Conditions<'_>, _: Add<'_>) -> Result<(), Failure> {
    if args.data.is_none() {
        let error =
            crate::parts::PartError::missing("the simulator", "build with `--features sim`");
        return Err(crate::run::ConfigError::from(error).into());
    }
    Ok(())
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{pos} pictures, {msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn unwritten(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure::bad_input(format!("{}: {error}", path.display()))
}

fn write(folder: &Path, tried: &Tried<'_>) -> Result<(), Failure> {
    if tried.judgement.worth == Worth::Right {
        return Ok(());
    }
    let name = format!("{} {}.png", tried.case, tried.transform.name).replace(' ', "_");
    let path = folder.join(name);
    tried.picture.image.save(&path).map_err(|e| unwritten(&path, &e))
}

fn print(report: &RobustnessReport) {
    for set in report.sets() {
        let mut table = Table::new();
        table.load_preset(presets::ASCII_MARKDOWN);
        table.set_header([
            "disturbance",
            "right",
            "unknown",
            "wrong, doubted",
            "wrong, silent",
            "of",
        ]);
        let rows = report.transforms().filter_map(|name| report.row(set, name));
        for row in rows.chain([&report.total(set)]) {
            table.add_row(cells(row));
        }
        out::line(&format!(
            "{set}, detector {}, grounder {}:\n\n{table}\n",
            report.detector, report.grounder
        ));
    }
    for fault in &report.faults {
        let anomalies = if fault.anomalies.is_empty() {
            String::new()
        } else {
            format!(" [{}]", fault.anomalies.join("; "))
        };
        out::line(&format!(
            "{}, {}: {}{anomalies}",
            fault.case,
            fault.transform,
            fault.faults.join("; ")
        ));
    }
}

fn cells(row: &RobustnessRow) -> Vec<Cell> {
    let name = row.label();
    let numbers = [row.right, row.unknown, row.doubted, row.silent, row.n()];
    std::iter::once(Cell::new(name)).chain(numbers.map(right)).collect()
}
