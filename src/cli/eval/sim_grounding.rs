//! `groundloop eval sim-grounding`: what the features tell apart, seen from where.

use std::path::PathBuf;

use super::Failure;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Run files with a simulated camera; without any, the first one in configs/ of each domain
    /// that has a scene for this.
    configs: Vec<PathBuf>,
    /// How many scenes are looked at from each camera, with seeds counting up from 1.
    #[arg(long, default_value_t = 40, value_name = "N",
          value_parser = clap::value_parser!(u64).range(1..=10_000))]
    seeds: u64,
    /// Measures over a factor instead of from several cameras: the table has a row for each of its levels;
    /// may be repeated. `all` is each of them.
    #[arg(long, value_name = "FACTOR", conflicts_with = "frames",
          value_parser = ["all", "objects", "elevation", "occlusion", "light", "noise", "exemplars"])]
    over: Vec<String>,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
    /// Writes the first scene of each camera to this folder.
    #[arg(long, value_name = "DIR")]
    frames: Option<PathBuf>,
}

/// Without the simulator there is nothing to look at.
#[cfg(not(feature = "sim"))]
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    tracing::debug!(?args, "not measured");
    let error = crate::parts::PartError::missing("the simulator", "build with `--features sim`");
    Err(crate::run::ConfigError::from(error).into())
}

/// Measures and prints the table.
#[cfg(feature = "sim")]
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    with_sim::run(args)
}

#[cfg(feature = "sim")]
pub(super) mod with_sim {
    use std::collections::BTreeSet;
    use std::path::{Path, PathBuf};

    use comfy_table::{Cell, Table, presets};
    use indicatif::{ProgressBar, ProgressStyle};

    use super::super::super::out;
    use super::super::super::reports::{SimGroundingReport, SimGroundingRow};
    use super::super::super::table::right;
    use super::{Args, Failure};
    use crate::dataset::SceneSource;
    use crate::eval::grounding_factors::{FactorRow, GroundingFactor, measure_factors, n_cells};
    use crate::eval::sim_grounding::{CAMERAS, Row, SCENE, Source, Used, has_scene, measure};
    use crate::files::shipped_names;
    use crate::run::{ConfigError, DomainFolder, Layered, RunConfig, load_run};
    use crate::settings::{Form, Layers};

    pub(super) fn run(args: &Args) -> Result<u8, Failure> {
        let runs = if args.configs.is_empty() { found()? } else { named(&args.configs)? };
        if !args.over.is_empty() {
            return over(args, &runs);
        }
        let bar = bar(runs.len() as u64 * CAMERAS.len() as u64 * args.seeds);
        if let Some(folder) = &args.frames {
            std::fs::create_dir_all(folder).map_err(|e| bad_file(folder, &e))?;
        }
        let mut rows = Vec::new();
        for (run, folder) in &runs {
            let mut unwritten = None;
            let mut seen = |camera: &str, seed: u64, image: &image::RgbImage| {
                bar.inc(1);
                if let Some(frames) = args.frames.as_ref().filter(|_| seed == 1) {
                    let path = frames.join(format!("{}_{camera}.png", folder.domain.name));
                    unwritten =
                        image.save(&path).err().map(|e| bad_file(&path, &e)).or(unwritten.take());
                }
            };
            rows.extend(measure(run, folder, args.seeds, &mut seen)?);
            unwritten.map_or(Ok(()), Err)?;
        }
        bar.finish_and_clear();
        if args.json {
            let rows = rows.into_iter().map(|row| SimGroundingRow {
                precision: row.precision(),
                recall: row.recall(),
                row,
            });
            let (seeds, rows) = ([1, args.seeds], rows.collect());
            out::json(&SimGroundingReport { seeds, rows, factors: Vec::new() })?;
        } else {
            print(&rows, args.seeds);
        }
        Ok(0)
    }

    /// Measures over the factors that are asked for.
    fn over(args: &Args, runs: &[(RunConfig, DomainFolder)]) -> Result<u8, Failure> {
        let is_wanted = |name: &str| args.over.iter().any(|over| over == name || over == "all");
        let wanted = GroundingFactor::ALL.iter().filter(|(name, _)| is_wanted(name));
        let wanted: Vec<GroundingFactor> = wanted.map(|(_, factor)| *factor).collect();
        let sources = runs.iter().map(|(run, _)| source(run));
        let sources: Vec<SceneSource> = sources.collect::<Result<_, _>>()?;
        let cells: Result<Vec<usize>, _> = sources.iter().map(|s| n_cells(s, &wanted)).collect();
        let bar = bar(cells?.iter().sum::<usize>() as u64 * args.seeds);
        let mut factors = Vec::new();
        for source in &sources {
            factors.extend(measure_factors(source, &wanted, args.seeds, &|| bar.inc(1))?);
        }
        bar.finish_and_clear();
        if args.json {
            let seeds = [1, args.seeds];
            out::json(&SimGroundingReport { seeds, rows: Vec::new(), factors })?;
        } else {
            print_factors(&factors, args.seeds);
        }
        Ok(0)
    }

    /// The scenes for this of a run file.
    fn source(run: &RunConfig) -> Result<SceneSource, ConfigError> {
        let layers = run.layers.as_deref().cloned();
        let mut layers = layers.map_or_else(|| Layers::defaults(Form::Run), Ok)?;
        layers.set(&format!("sim.scene={SCENE}"))?;
        SceneSource::new(Layered { file: run.origin.clone(), layers })
    }

    fn print_factors(rows: &[FactorRow], seeds: u64) {
        for (source, used, title) in [
            (Source::Labelled, Used::Boxes, "Boxes of the labelled objects"),
            (Source::Detected, Used::Volumes, "Volumes of what the colour detector finds"),
        ] {
            let mut table = Table::new();
            table.load_preset(presets::ASCII_MARKDOWN);
            table.set_header(["domain", "factor", "level", "P", "R", "exact states", "95 %"]);
            let is_shown = |r: &&FactorRow| (r.row.objects, r.row.features) == (source, used);
            for FactorRow { factor, level, row, precision, recall, exact_share_95 } in
                rows.iter().filter(is_shown)
            {
                let [low, high] = exact_share_95.map(|edge| edge * 100.0);
                table.add_row([
                    Cell::new(&row.domain),
                    Cell::new(factor.word()),
                    Cell::new(level),
                    right(format!("{precision:.3}")),
                    right(format!("{recall:.3}")),
                    right(format!("{}/{}", row.n_exact, row.n_scenes)),
                    right(format!("{low:.0}–{high:.0} %")),
                ]);
            }
            out::line(&format!("{title}, seeds 1 to {seeds}:\n\n{table}\n"));
        }
    }

    fn bad_file(path: &Path, error: &dyn std::fmt::Display) -> Failure {
        Failure::bad_input(format!("{}: {error}", path.display()))
    }

    fn named(paths: &[PathBuf]) -> Result<Vec<(RunConfig, DomainFolder)>, Failure> {
        let read = |path: &PathBuf| {
            let run = load_run(path, &[])?;
            let folder = run.domain_folder()?;
            Ok((run, folder))
        };
        paths.iter().map(read).collect()
    }

    /// The first shipped run file with a simulated camera of each domain that has the scene.
    pub(in crate::cli::eval) fn found() -> Result<Vec<(RunConfig, DomainFolder)>, Failure> {
        let names = shipped_names().into_iter().filter(|name| !name.starts_with("stress"));
        let paths: Vec<PathBuf> = names.map(PathBuf::from).collect();
        let mut domains = BTreeSet::new();
        let mut runs = named(&paths)?;
        runs.retain(|(run, folder)| {
            run.sim.is_some() && has_scene(folder) && domains.insert(folder.domain.name.clone())
        });
        if runs.is_empty() {
            let text =
                "no shipped run file has a simulated camera and a domain with a scene for this";
            return Err(Failure::bad_input(text));
        }
        Ok(runs)
    }

    fn bar(n_scenes: u64) -> ProgressBar {
        let bar = ProgressBar::new(n_scenes);
        match ProgressStyle::with_template("{bar:40} {pos}/{len} scenes, {eta} left") {
            Ok(style) => bar.with_style(style),
            Err(error) => {
                tracing::debug!(%error, "progress is shown plainly");
                bar
            }
        }
    }

    fn print(rows: &[Row], seeds: u64) {
        for (source, title) in [
            (Source::Labelled, "Boxes, pixels and depth of the labelled objects"),
            (Source::Detected, "Boxes and pixels of the colour detector"),
        ] {
            let mut table = Table::new();
            table.load_preset(presets::ASCII_MARKDOWN);
            table.set_header(["domain", "camera", "features", "P", "R", "exact states", "hidden"]);
            for row in rows.iter().filter(|row| row.objects == source) {
                table.add_row([
                    Cell::new(&row.domain),
                    Cell::new(row.camera),
                    Cell::new(name(row.features)),
                    right(format!("{:.3}", row.precision())),
                    right(format!("{:.3}", row.recall())),
                    right(format!("{}/{}", row.n_exact, row.n_scenes)),
                    right(row.n_hidden.to_string()),
                ]);
            }
            out::line(&format!("{title}, seeds 1 to {seeds}:\n\n{table}\n"));
        }
    }

    fn name(features: Used) -> &'static str {
        match features {
            Used::Boxes => "2-D boxes",
            Used::Masks => "masks",
            Used::Volumes => "3-D volumes",
        }
    }
}
