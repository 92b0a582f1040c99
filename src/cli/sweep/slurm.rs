//! `groundloop sweep slurm`: a job script.

use std::path::{Path, PathBuf, absolute};

use super::super::{Failure, out};
use super::given;
use crate::sweep::slurm_script;

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The sweep file, or the name of a shipped one.
    spec: PathBuf,
    /// How many jobs the array has.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    shards: u64,
    /// The sweep's folder, which all nodes see.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(in crate::cli) fn run(args: &Args) -> Result<u8, Failure> {
    let (file, _) = given(&args.spec)?;
    let whole = |path: &Path| absolute(path).map_err(Failure::internal);
    // A shipped one is in the program wherever it runs.
    let on_disk = file.folder.on_disk().map(|folder| folder.join(&file.name));
    let spec = on_disk.map_or_else(|| Ok(args.spec.clone()), |path| whole(&path))?;
    let name = format!("groundloop-{}", file.stem());
    let script = slurm_script(&name, (&spec, &whole(&args.out)?), args.shards);
    out::line(script.trim_end());
    Ok(0)
}
