//! `groundloop eval`: measurements on data sets, one file each.

mod prodgv;
mod prodgv_tables;
mod robustness;
mod sim_grounding;

use clap::Subcommand;

use super::Failure;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Measure grounding and planning on the paper's data set, a whole or partial checkout of it.
    ProdgV(prodgv::Args),
    /// Measure grounding from pixels in other light, at other angles, with things in the way.
    Robustness(robustness::Args),
    /// Measure grounding on simulated scenes, by camera and by feature.
    SimGrounding(sim_grounding::Args),
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    match &args.what {
        What::ProdgV(args) => prodgv::run(args),
        What::Robustness(args) => robustness::run(args),
        What::SimGrounding(args) => sim_grounding::run(args),
    }
}
