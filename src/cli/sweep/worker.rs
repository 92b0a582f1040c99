//! `groundloop sweep worker`: runs episodes by their numbers, one after another, in a process of its own. What
//! one episode does to its process, no other one feels.

use std::io::{self, BufRead as _};
use std::path::PathBuf;

use tokio::runtime::Runtime;

use super::super::{Failure, out};
use super::given;
use crate::actors::SnapshotRequest;
use crate::run::{Episode, EpisodeOptions, PreparedRun, RunError, load_run, run_episode};
use crate::sweep::{EpisodePlan, SweepLine};
use crate::transport::{Bus, BusConfig};

/// Threads of the runtime: the loop is a pipeline, more would not help one episode.
const WORKERS: usize = 2;

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The sweep file.
    spec: PathBuf,
}

pub(in crate::cli) fn run(args: &Args) -> Result<u8, Failure> {
    let (_, design) = given(&args.spec)?;
    let mut player = Player::new()?;
    for line in io::stdin().lock().lines() {
        let line = line.map_err(Failure::internal)?;
        let plan = line.trim().parse().ok().and_then(|index| design.episode(index));
        let plan = plan.ok_or_else(|| Failure::bad_input(format!("no such episode: {line}")))?;
        let ended = player.play(&plan, None);
        let ended = ended.as_ref().map(|episode| &episode.report).map_err(Failure::reason);
        out::json(&SweepLine::new(&plan, ended.map_err(|reason| reason as &str)))?;
    }
    Ok(0)
}

impl Failure {
    /// What is said of it.
    pub(super) fn reason(&self) -> &str {
        &self.message
    }
}

/// Runs episodes of a sweep one after another.
pub(super) struct Player {
    runtime: Runtime,
    /// The files of the last episode: the next one of its point has the same.
    last: Option<((String, Vec<String>), PreparedRun)>,
}

impl Player {
    pub(super) fn new() -> Result<Self, Failure> {
        let mut runtime = tokio::runtime::Builder::new_multi_thread();
        let runtime = runtime.worker_threads(WORKERS).enable_all().build();
        Ok(Self { runtime: runtime.map_err(Failure::internal)?, last: None })
    }

    /// Runs an episode, and takes a picture of it if one is asked for.
    pub(super) fn play(
        &mut self,
        plan: &EpisodePlan,
        snapshot: Option<SnapshotRequest>,
    ) -> Result<Episode, Failure> {
        let key = (plan.run.clone(), plan.sets.clone());
        if self.last.as_ref().is_none_or(|(last, _)| *last != key) {
            let config = load_run(plan.run.as_ref(), &plan.sets)?;
            self.last = Some((key, PreparedRun::read(config, None)?));
        }
        let Some((_, prepared)) = &self.last else { return Err(Failure::internal("no run")) };
        let mut prepared = prepared.clone();
        prepared.config.seed = plan.seed;
        let episode = self.runtime.block_on(async {
            let bus = BusConfig::for_run(prepared.config.run_name());
            let bus = tokio::task::block_in_place(|| Bus::open(&bus))?;
            Box::pin(run_episode(&prepared, EpisodeOptions { bus, snapshot })).await
        });
        episode.map_err(|error: RunError| error.into())
    }
}
