//! `groundloop new`: something to start from.

use std::path::{Path, PathBuf};

use super::{Failure, exemplar, out};
use crate::new_domain::{SET_UP, write_skeleton};
use crate::run::load_run;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Write a small domain that explains itself, with a run file: it runs in the simulator at once
    Domain(Args),
}

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// What it is called: small letters, digits, - and _.
    name: String,
    /// Where it is written: the folder NAME and the run file NAME.toml.
    #[arg(long = "in", value_name = "DIR", default_value = ".")]
    beside: PathBuf,
}

/// Carries the verb out.
pub(super) fn run(verb: &Verb) -> Result<u8, Failure> {
    let Verb::Domain(args) = verb;
    let new = write_skeleton(&args.name, &args.beside)?;
    let (folder, run_file) = (shown(&new.folder), shown(&new.run_file));
    out::line(&format!("{folder}: a domain that stacks blocks; every file says what it is for"));
    out::line(&format!("{run_file}: its run file"));
    if cfg!(feature = "sim") {
        let config = load_run(&new.run_file, &[])?;
        let examples = exemplar::render_examples(&config, "main", SET_UP)?;
        out::line(&format!("{folder}/exemplar/{SET_UP}: {} labelled examples", examples.len()));
    } else {
        out::line("no labelled examples: the simulator is not in this build");
    }
    out::line("");
    out::line("Next:");
    out::line(&format!("  groundloop run {run_file}"));
    out::line(&format!("  groundloop domain check {folder}      after every change"));
    out::line(&format!("  groundloop exemplar render {run_file} --folder {SET_UP}"));
    Ok(0)
}

fn shown(path: &Path) -> String {
    path.strip_prefix(".").unwrap_or(path).display().to_string()
}
