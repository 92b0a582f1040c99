//! `groundloop config`: run files shown, checked and described.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::reports::{ConfigReport, KeyOrigin};
use super::{Failure, exit, out};
use crate::run::{ConfigError, Layered, run_file_schema, run_schema};
use crate::settings::{Form, Written};
use crate::stress::{stress_file_schema, stress_of, stress_schema};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, clap::Subcommand)]
enum Verb {
    /// Print a run file or stress file with everything that it is laid over, and where each value
    /// comes from.
    Show(ShowArgs),
    /// Check run files and stress files: every unknown key, missing key and wrong value, each with
    /// its line.
    Check(CheckArgs),
    /// Print the JSON Schema of run files, for editors: write `#:schema FILE` in a run file's first
    /// line.
    Schema(SchemaArgs),
}

#[derive(Debug, clap::Args)]
struct ShowArgs {
    /// The file, or the name of a shipped one.
    config: PathBuf,
    /// Overrides a key of the file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, clap::Args)]
struct CheckArgs {
    /// The files, or names of shipped ones.
    #[arg(required = true)]
    configs: Vec<PathBuf>,
    /// Overrides a key of each file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

#[derive(Debug, clap::Args)]
struct SchemaArgs {
    /// The schema of stress files instead.
    #[arg(long)]
    stress: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    match &args.verb {
        Verb::Show(args) => show(args),
        Verb::Check(args) => Ok(check(args)),
        Verb::Schema(args) => {
            let schema = if args.stress { stress_file_schema() } else { run_file_schema() };
            out::line(&serde_json::to_string_pretty(&schema).map_err(Failure::internal)?);
            Ok(0)
        }
    }
}

/// Reads a file of either form.
fn read(path: &Path, sets: &[String]) -> Result<(Layered, Value), ConfigError> {
    let layered = Layered::read_any(path, sets)?;
    let schema = match layered.layers.form() {
        Form::Run => run_schema(),
        Form::Stress => stress_schema(),
    };
    Ok((layered, schema))
}

fn show(args: &ShowArgs) -> Result<u8, Failure> {
    let (layered, schema) = read(&args.config, &args.sets)?;
    for warning in &layered.layers.warnings {
        out::note(&warning.render());
    }
    // What is wrong is told, and shown all the same: seeing it may help.
    let problems = layered.layers.problems(&schema, &layered.file.to_string());
    if args.json {
        let origins = layered.layers.origins().into_iter().map(|(key, at)| (key, origin(&at)));
        out::json(&ConfigReport {
            file: layered.file.to_string(),
            values: layered.layers.plain(),
            origins: origins.collect(),
        })?;
    } else {
        out::line(layered.layers.show(&schema).trim_end());
    }
    if problems.is_empty() { Ok(0) } else { Err(ConfigError::from(problems).into()) }
}

fn origin(written: &Written) -> KeyOrigin {
    let (file, line) = written.in_file().unzip();
    KeyOrigin { kind: written.kind(), file: file.map(str::to_owned), line }
}

fn check(args: &CheckArgs) -> u8 {
    let mut code = 0;
    for path in &args.configs {
        match check_one(path, &args.sets) {
            Ok(text) => out::line(&text),
            Err(error) => {
                out::error(&error.render());
                code = exit::BAD_INPUT;
            }
        }
    }
    code
}

/// Checks one file with its domain; says what it is.
fn check_one(path: &Path, sets: &[String]) -> Result<String, ConfigError> {
    let (layered, _) = read(path, sets)?;
    for warning in &layered.layers.warnings {
        out::note(&warning.render());
    }
    let file = layered.file.to_string();
    match layered.layers.form() {
        Form::Run => {
            let run = layered.run()?;
            let folder = run.domain_folder()?;
            run.check_domain(&folder)?;
            Ok(format!("{file}: ok, a run file for {}", folder.files))
        }
        Form::Stress => {
            let n_cases = stress_of(layered)?.case.len();
            Ok(format!("{file}: ok, a stress file with {n_cases} cases"))
        }
    }
}
