//! `groundloop sweep`: many episodes over chosen factors.

mod pool;
mod report;
mod run;
mod show;
mod slurm;
mod worker;

use std::path::{Path, PathBuf};

use super::Failure;
use crate::files::FileRef;
use crate::run::find_sweep;
use crate::sweep::{StoreError, SweepDesign, SweepFolder, SweepSpec};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Show which episodes a sweep file means
    Show(show::Args),
    /// Run the episodes of a sweep, or one shard of them; what is there already is not run again
    Run(run::Args),
    /// Put the results of all shards into one file
    Merge(MergeArgs),
    /// Write tables, a plot and a page with pictures of failures
    Report(report::Args),
    /// Print a job script for Slurm: an array of jobs, one a shard
    Slurm(slurm::Args),
    /// Run episodes by their numbers, read from standard input
    #[command(hide = true)]
    Worker(worker::Args),
}

#[derive(Debug, clap::Args)]
pub(super) struct MergeArgs {
    /// The sweep's folder: what was given as `--out`.
    dir: PathBuf,
}

/// Carries a verb out.
pub(super) fn run(verb: &Verb) -> Result<u8, Failure> {
    match verb {
        Verb::Show(args) => show::run(args),
        Verb::Run(args) => run::run(args),
        Verb::Merge(args) => merge(args),
        Verb::Report(args) => report::run(args),
        Verb::Slurm(args) => slurm::run(args),
        Verb::Worker(args) => worker::run(args),
    }
}

fn merge(args: &MergeArgs) -> Result<u8, Failure> {
    let (folder, design) = opened(&args.dir)?;
    let written = folder.merge(design.len())?;
    super::out::line(&format!("{}: {} episodes", written.display(), design.len()));
    Ok(0)
}

/// A sweep's folder, and what its sweep file means.
fn opened(dir: &Path) -> Result<(SweepFolder, SweepDesign), Failure> {
    let folder = SweepFolder::at(dir);
    let text = folder.spec()?;
    let spec = SweepSpec::parse(&folder.spec_path().display().to_string(), &text)?;
    Ok((folder, SweepDesign::new(spec)))
}

/// A sweep file by its path, or a shipped one by its name, with what it means.
fn given(path: &Path) -> Result<(FileRef, SweepDesign), Failure> {
    let file = find_sweep(path)
        .map_err(|reason| Failure::bad_input(format!("{}: {reason}", path.display())))?;
    let spec = SweepSpec::read(&file)?;
    Ok((file, SweepDesign::new(spec)))
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        Self::bad_input(error)
    }
}
