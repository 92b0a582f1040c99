//! What came of all episodes, counted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::eval::wilson_95;
use crate::messages::Verdict;
use crate::metrics::EpisodeReport;

/// Output of `groundloop eval faults --json`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "groundloop eval faults --json")]
pub struct FaultsReport {
    /// First and last seed of every point.
    pub seeds: [u64; 2],
    /// One row for each run file, mode and rate.
    pub rows: Vec<FaultsRow>,
}

/// One run file at one rate of faults, with the loop open or closed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultsRow {
    /// The run file.
    pub config: String,
    /// The mode, as `executive` has it.
    pub executive: String,
    /// The rate, as `fault_rate` has it.
    pub fault_rate: f64,
    /// How many episodes were run.
    pub episodes: u32,
    /// In how many the goal held in the simulator at the end; with the loop closed also said to be reached.
    pub successes: u32,
    /// Wilson's 95 % interval of their share.
    pub success_share_95: [f64; 2],
    /// Seeds of the episodes whose goal was said to be reached and did not hold.
    pub false_seeds: Vec<u64>,
    /// Seeds of the episodes that failed without being false.
    pub failed_seeds: Vec<u64>,
    /// Steps that were started.
    pub dispatches: u64,
    /// Those of them whose precondition did not really hold.
    pub against_truth: u64,
    /// Those of them that went against what could be known.
    pub against_evidence: u64,
    /// Faults that happened.
    pub faults: u64,
}

impl FaultsRow {
    /// A row of no episodes yet.
    pub fn new(config: &str, executive: &str, fault_rate: f64) -> Self {
        Self {
            config: config.to_owned(),
            executive: executive.to_owned(),
            fault_rate,
            episodes: 0,
            successes: 0,
            success_share_95: [0.0, 1.0],
            false_seeds: Vec::new(),
            failed_seeds: Vec::new(),
            dispatches: 0,
            against_truth: 0,
            against_evidence: 0,
            faults: 0,
        }
    }

    /// Counts one episode.
    pub fn count(&mut self, episode: &EpisodeReport) {
        let says_so = [Verdict::Reached.word(), Verdict::Executed.word()];
        let is_so = episode.goal_in_simulator == Some(true);
        let is_success = is_so && says_so.contains(&episode.verdict);
        self.episodes += 1;
        self.successes += u32::from(is_success);
        self.success_share_95 = wilson_95(self.successes, self.episodes);
        if episode.is_false() {
            self.false_seeds.push(episode.seed);
        } else if !is_success {
            self.failed_seeds.push(episode.seed);
        }
        if let Some(audit) = &episode.dispatches {
            self.dispatches += audit.n_dispatches;
            self.against_truth += audit.against_truth.len() as u64;
            self.against_evidence += audit.n_against_evidence;
        }
        self.faults += episode.faults.iter().filter(|fault| fault.happened).count() as u64;
    }

    /// The share of successes; `None` of no episodes.
    pub fn share(&self) -> Option<f64> {
        (self.episodes > 0).then(|| f64::from(self.successes) / f64::from(self.episodes))
    }
}

impl FaultsReport {
    /// The run files, each once, in order.
    pub fn configs(&self) -> Vec<&str> {
        let mut configs: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !configs.contains(&row.config.as_str()) {
                configs.push(&row.config);
            }
        }
        configs
    }
}
