//! `groundloop exemplar`: labelled examples of any camera, and checks of them.

use std::path::PathBuf;

use super::{Failure, exemplar_capture, exemplar_check, out};
use crate::run::{RunConfig, load_run};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Take a picture of your own camera and propose its labels: boxes and facts to correct
    Capture(exemplar_capture::Args),
    /// Try labelled examples on themselves: what is not found, named or read there as labelled
    Check(exemplar_check::Args),
    /// Render every scene of the domain's `scenes/exemplar/`, and label it by what is really there.
    Render(Args),
}

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A run file with a simulated camera, or the name of a shipped one.
    config: PathBuf,
    /// Overrides a key of the run file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Whose examples: "main", or the name of a `[cameras.NAME]`.
    #[arg(long, value_name = "NAME", default_value = "main")]
    camera: String,
    /// The folder to write to, below the domain's `exemplar/`.
    #[arg(long, value_name = "NAME")]
    folder: String,
}

pub(super) fn run(verb: &Verb) -> Result<u8, Failure> {
    match verb {
        Verb::Capture(args) => exemplar_capture::run(args),
        Verb::Check(args) => exemplar_check::run(args),
        Verb::Render(args) => render(args),
    }
}

fn render(args: &Args) -> Result<u8, Failure> {
    let config = load_run(&args.config, &args.sets)?;
    for line in render_examples(&config, &args.camera, &args.folder)? {
        out::line(&line);
    }
    Ok(0)
}

/// Renders and labels the examples of a run file's camera into a folder below the domain's `exemplar/`; a
/// line about each.
#[cfg(feature = "sim")]
pub(super) fn render_examples(
    config: &RunConfig,
    camera: &str,
    folder: &str,
) -> Result<Vec<String>, Failure> {
    use crate::hardware::sim::label_scenes;
    use crate::run::ConfigError;

    let domain = config.domain_folder()?;
    let target = domain.files.below("exemplar").below(folder);
    let Some(target) = target.on_disk() else {
        let copy = "name a copy on disk as the domain: --set domain=PATH";
        return Err(Failure::bad_input(format!("{target}: cannot be written to; {copy}")));
    };
    let write = |path: &std::path::Path, bytes: &[u8]| {
        std::fs::write(path, bytes)
            .map_err(|e| Failure::bad_input(format!("{}: {e}", path.display())))
    };
    std::fs::create_dir_all(target)
        .map_err(|e| Failure::bad_input(format!("{}: {e}", target.display())))?;
    config.check_camera("--camera", camera)?;
    let sim = config.sim()?.seen_by(camera);
    let sim =
        sim.ok_or_else(|| Failure::bad_input(format!("--camera: {camera} is not simulated")))?;
    let scenes = label_scenes(domain.scenes(), sim, config.seed);
    let mut lines = Vec::new();
    for scene in scenes.map_err(ConfigError::from)? {
        let stem = target.join(&scene.name);
        scene.image.save(stem.with_extension("png")).map_err(Failure::internal)?;
        write(&stem.with_extension("json"), scene.boxes.as_bytes())?;
        write(&stem.with_extension("masks.json"), scene.masks.as_bytes())?;
        write(&stem.with_extension("volumes.json"), scene.volumes.as_bytes())?;
        write(&stem.with_extension("pddl"), scene.state.as_bytes())?;
        lines.push(format!("{}: {} objects", stem.display(), scene.n_objects));
    }
    Ok(lines)
}

/// Without the simulator there is nothing to render.
#[cfg(not(feature = "sim"))]
pub(super) fn render_examples(
    config: &RunConfig,
    _: &str,
    folder: &str,
) -> Result<Vec<String>, Failure> {
    config.domain_folder()?;
    out::note(&format!("{folder} is not written"));
    let error = crate::parts::PartError::missing("the simulator", "build with `--features sim`");
    Err(crate::run::ConfigError::from(error).into())
}
