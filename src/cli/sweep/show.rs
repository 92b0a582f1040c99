//! `groundloop sweep show`: which episodes a sweep file means.

use std::collections::BTreeSet;
use std::path::PathBuf;

use comfy_table::Cell;

use super::super::out::Stream;
use super::super::table::{self, right};
use super::super::{Failure, out};
use super::given;
use crate::run::load_run;
use crate::sweep::{Sampling, SweepDesign};

/// Most run files that are read before a sweep starts.
const READ_MAX: usize = 200;
/// Most levels of a factor that are listed.
const LEVELS_MAX: usize = 12;

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The sweep file, or the name of a shipped one.
    spec: PathBuf,
    /// Prints the command that runs this episode alone.
    #[arg(long, value_name = "N")]
    episode: Option<u64>,
}

pub(in crate::cli) fn run(args: &Args) -> Result<u8, Failure> {
    let (file, design) = given(&args.spec)?;
    if let Some(index) = args.episode {
        let last = design.len() - 1;
        let expected =
            || Failure::bad_input(format!("--episode: expected 0 to {last}, got {index}"));
        let plan = design.episode(index).ok_or_else(expected)?;
        out::line(&plan.command());
        return Ok(0);
    }
    let spec = design.spec();
    let how = match spec.sampling {
        Sampling::Grid => {
            let points = design.len() / spec.repeats;
            format!("grid of {points} points, {} episodes at each", spec.repeats)
        }
        Sampling::LatinHypercube => "Latin hypercube".to_owned(),
    };
    out::line(&format!("{file}: {} episodes of {}: {how}\n", design.len(), spec.run));
    let mut listed = table::plain();
    listed.set_header(["factor", "levels", "", "key"]);
    for factor in &spec.factor {
        let values = factor.values.iter().map(ToString::to_string);
        let mut levels: Vec<String> =
            values.chain(factor.levels.iter().map(|level| level.name.clone())).collect();
        if levels.len() > LEVELS_MAX {
            levels.truncate(LEVELS_MAX);
            levels.push("…".to_owned());
        }
        levels.extend(factor.range.map(|[low, high]| format!("{low} to {high}")));
        let n = match spec.sampling {
            Sampling::LatinHypercube if factor.range.is_some() => String::new(),
            Sampling::Grid | Sampling::LatinHypercube => factor.n_levels().to_string(),
        };
        listed.add_row([
            Cell::new(factor.title()),
            right(n),
            Cell::new(levels.join(", ")),
            Cell::new(&factor.key),
        ]);
    }
    Stream::Output.table(listed);
    try_each_point(&design)?;
    Ok(0)
}

/// Reads the run file of every level at least once, so that a wrong key is told before anything runs; of ranges
/// with a value of its own in each episode, the first ones tell.
pub(super) fn try_each_point(design: &SweepDesign) -> Result<(), Failure> {
    let mut tried = BTreeSet::new();
    let mut n_read = 0;
    for plan in (0..design.len()).map_while(|index| design.episode(index)) {
        let before = tried.len();
        tried.extend(plan.settings.iter().map(|s| (s.factor.clone(), s.level.clone())));
        if tried.len() == before && n_read > 0 {
            continue;
        }
        load_run(plan.run.as_ref(), &plan.sets)?;
        n_read += 1;
        if n_read == READ_MAX {
            break;
        }
    }
    Ok(())
}
