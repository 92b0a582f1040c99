//! `groundloop dataset`: data sets of rendered scenes.

use std::path::PathBuf;

use super::Failure;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Render scenes in the layout of ProDG-v: `groundloop eval prodg-v` reads them as they are
    Generate(Args),
}

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A shipped domain (its `scenes/evaluation.toml`, seen by its first run file's camera), or a run file
    /// with a simulated camera (the scene that it names).
    source: PathBuf,
    /// The folder to write to: `data/<domain>/` below it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How many scenes.
    #[arg(long, value_name = "N", default_value_t = 100,
          value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    scenes: u64,
    /// Seed of everything random: the same seed gives the same files.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// What differs from scene to scene: `KEY=LO..HI` or `KEY=A,B,C`, drawn anew for each; may be repeated.
    /// Keys are `objects`, `view.elevation_deg`, `view.azimuth_deg`, `view.distance_m`, `light.intensity`,
    /// `light.azimuth_deg`, `light.elevation_deg`, any `sim.…` of the run file and `scene.…` of the scene file.
    #[arg(long = "vary", value_name = "KEY=VALUES")]
    vary: Vec<String>,
    /// Overrides a key of the run file in all scenes; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// How many threads work, if not one for each processor.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(verb: &Verb) -> Result<u8, Failure> {
    let Verb::Generate(args) = verb;
    generate(args)
}

/// Without the simulator there is nothing to render.
#[cfg(not(feature = "sim"))]
fn generate(args: &Args) -> Result<u8, Failure> {
    tracing::debug!(?args, "nothing rendered");
    let error = crate::parts::PartError::missing("the simulator", "build with `--features sim`");
    Err(crate::run::ConfigError::from(error).into())
}

#[cfg(feature = "sim")]
use with_sim::generate;

#[cfg(feature = "sim")]
mod with_sim {
    use std::path::{Path, PathBuf};

    use indicatif::{ProgressBar, ProgressStyle};

    use super::super::out;
    use super::{Args, Failure};
    use crate::dataset::{self, DatasetReport, DatasetRequest, Factor, SceneSource};
    use crate::eval::sim_grounding::SCENE;
    use crate::files::{shipped_domains, shipped_names};
    use crate::run::{ConfigError, Layered, load_run};
    use crate::settings::Form;

    pub(super) fn generate(args: &Args) -> Result<u8, Failure> {
        let factors = args.vary.iter().map(|text| text.parse::<Factor>());
        let factors: Vec<Factor> = factors.collect::<Result<_, _>>().map_err(ConfigError::from)?;
        let source = source(&args.source, &args.sets)?;
        let all = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let request = DatasetRequest {
            out: args.out.clone(),
            scenes: args.scenes,
            seed: args.seed,
            factors,
            threads: args.threads.map_or_else(all, usize::from),
        };
        let bar = bar(args.scenes);
        let report = dataset::generate(&source, &request, &|| bar.inc(1))?;
        bar.finish_and_clear();
        if args.json {
            out::json(&report)?;
        } else {
            print(&report);
        }
        Ok(0)
    }

    /// The scenes of a run file, or those that a shipped domain has for evaluation.
    fn source(path: &Path, sets: &[String]) -> Result<SceneSource, Failure> {
        let domain = path.to_str().filter(|name| shipped_domains().iter().any(|d| d == name));
        let (path, sets) = match domain {
            None => (path.to_owned(), sets.to_vec()),
            Some(domain) => {
                let scene = format!("sim.scene={SCENE}");
                (run_file_of(domain)?, [vec![scene], sets.to_vec()].concat())
            }
        };
        Ok(SceneSource::new(Layered::read(&path, &sets, Form::Run)?)?)
    }

    /// The first shipped run file of a domain that has a simulated camera.
    fn run_file_of(domain: &str) -> Result<PathBuf, Failure> {
        let names = shipped_names().into_iter().filter(|name| !name.starts_with("stress"));
        for path in names.map(PathBuf::from) {
            let run = load_run(&path, &[])?;
            if run.domain == domain && run.sim.is_some() {
                return Ok(path);
            }
        }
        let text = format!("{domain}: no shipped run file has a simulated camera; name a run file");
        Err(Failure::bad_input(text))
    }

    fn bar(n_scenes: u64) -> ProgressBar {
        let style = "{bar:40} {pos}/{len} scenes, {per_sec}, {eta} left";
        let style = ProgressStyle::with_template(style);
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::new(n_scenes).with_style(style)
    }

    fn print(report: &DatasetReport) {
        out::line(&format!(
            "{}: {} scenes, {} objects, {:.1} scenes per second on {} threads",
            report.folder, report.scenes, report.objects, report.scenes_per_second, report.threads
        ));
        if report.arrangements_dropped > 0 {
            let n = report.arrangements_dropped;
            out::line(&format!("{n} arrangements with hidden or restless objects were drawn anew"));
        }
        if report.without_instruction > 0 {
            let n = report.without_instruction;
            out::line(&format!(
                "{n} scenes without an instruction: no words read back as their goal"
            ));
        }
    }
}
