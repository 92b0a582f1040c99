//! Task success over the rate of faults, with the loop open and closed: the same worlds, skills and seeds, and at
//! each rate the same draws.

mod report;
mod plot;

pub use plot::{FaultsPlotError, plot};
pub use report::{FaultsReport, FaultsRow};

use crate::executive::ExecutiveMode;
use crate::metrics::EpisodeReport;
use crate::run::{EpisodeOptions, PreparedRun, RunError, run_episode};
use crate::transport::{Bus, BusConfig};

/// One point of a curve: a run file at one rate of faults, with the loop open or closed.
#[derive(Debug, Clone)]
pub struct FaultsPoint {
    /// What is run, with its rate and mode.
    pub prepared: PreparedRun,
    /// How the run file is called in tables.
    pub name: String,
}

impl FaultsPoint {
    /// Its row, of no episodes yet.
    pub fn row(&self) -> FaultsRow {
        let config = &self.prepared.config;
        FaultsRow::new(&self.name, mode_word(config.executive), config.fault_rate)
    }

    /// Runs one episode on a bus of its own.
    ///
    /// # Errors
    /// [`RunError`] when it ends without a verdict.
    pub async fn run(&self, seed: u64) -> Result<EpisodeReport, RunError> {
        let mut prepared = self.prepared.clone();
        prepared.config.seed = seed;
        let bus = BusConfig::for_run(prepared.config.run_name());
        let bus = tokio::task::block_in_place(|| Bus::open(&bus))?;
        let options = EpisodeOptions { bus, snapshot: None };
        Ok(Box::pin(run_episode(&prepared, options)).await?.report)
    }
}

/// How a mode is written in run files.
fn mode_word(mode: ExecutiveMode) -> &'static str {
    match mode {
        ExecutiveMode::ClosedLoop => "closed_loop",
        ExecutiveMode::OpenLoop => "open_loop",
    }
}
