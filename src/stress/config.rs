//! The file of a stress test, as written. `configs/stress.toml` describes every key.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Workload;
use crate::planners::PlannerConfig;
use crate::run::{ConfigError, read_text};

/// Everything that a stress test needs to know.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StressConfig {
    /// The file it was read from.
    #[serde(skip)]
    pub origin: PathBuf,
    /// Seed of everything random.
    pub seed: u64,
    /// How often everything is measured. Quantiles are over all; `--check` looks at the quickest.
    pub repeats: u32,
    /// How long a plan may take to come before the test is given up, seconds of wall time.
    pub answer_s_max: f64,
    /// Cells with fewer plans are not judged by `--check`.
    pub check_samples_min: u64,
    /// `[planner]`, as in a run file.
    pub planner: toml::Table,
    /// What is measured.
    pub case: Vec<CaseConfig>,
}

/// `[[case]]`: problems of one domain, and how their worlds change.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseConfig {
    /// Its name in reports.
    pub name: String,
    /// Name of a folder below `domains/`, or the path of a domain folder.
    pub domain: String,
    /// Sizes for the folder's `stress.toml`.
    #[serde(default)]
    pub sizes: Vec<u32>,
    /// Problem files; `$data` stands for `--data`.
    #[serde(default)]
    pub problems: Vec<String>,
    /// Kinds of workload.
    pub feeds: Vec<Workload>,
    /// Scenes per second, or `"max"`: the next one as soon as the plan is there.
    pub rates_hz: Vec<Rate>,
    /// Plans that count in each cell.
    pub samples: u32,
    /// Random steps to a random state.
    pub walk_steps: u32,
    /// Between the first plan and the first one that counts, milliseconds: what is made beside the
    /// loop has time to be finished.
    #[serde(default)]
    pub warm_up_ms: u64,
    /// Plans of each cell whose cost is compared with that of a cheapest plan, off the clock.
    #[serde(default)]
    pub optimal_samples: u32,
    /// States of each size that `--compare` gives to the other planner.
    #[serde(default)]
    pub compare_samples: u32,
    /// What differs from `[planner]` in this case.
    #[serde(default)]
    pub planner: toml::Table,
}

/// How many scenes are sent per second.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RateText", into = "RateText")]
pub enum Rate {
    /// The next scene goes as soon as the plan is there.
    Max,
    /// So many, whether plans come or not.
    Hz(f64),
}

/// A rate as it is written.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum RateText {
    Hz(f64),
    Word(String),
}

impl TryFrom<RateText> for Rate {
    type Error = String;

    fn try_from(text: RateText) -> Result<Self, String> {
        match text {
            RateText::Hz(hz) if hz.is_finite() && hz > 0.0 => Ok(Self::Hz(hz)),
            RateText::Word(word) if word == "max" => Ok(Self::Max),
            RateText::Hz(got) => Err(format!("expected a positive number, got {got}")),
            RateText::Word(got) => Err(format!("expected a number or \"max\", got {got:?}")),
        }
    }
}

impl From<Rate> for RateText {
    fn from(rate: Rate) -> Self {
        match rate {
            Rate::Max => Self::Word("max".to_owned()),
            Rate::Hz(hz) => Self::Hz(hz),
        }
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Max => f.write_str("max"),
            Self::Hz(hz) => write!(f, "{hz}"),
        }
    }
}

/// Reads the file of a stress test.
///
/// # Errors
/// [`ConfigError`] naming file and line or key.
pub fn load_stress(path: &Path) -> Result<StressConfig, ConfigError> {
    let text = read_text(path)?;
    let mut config: StressConfig = toml::from_str(&text).map_err(|e| fault(path, e.to_string()))?;
    path.clone_into(&mut config.origin);
    config.check()?;
    Ok(config)
}

fn fault(path: &Path, message: String) -> ConfigError {
    ConfigError::Toml { path: path.display().to_string(), message }
}

impl StressConfig {
    fn check(&self) -> Result<(), ConfigError> {
        let value = |key: String, expected: &str, got: String| {
            Err(ConfigError::Value { key, expected: expected.to_owned(), got })
        };
        if self.repeats == 0 {
            return value("repeats".to_owned(), "1 or more", "0".to_owned());
        }
        if !(self.answer_s_max.is_finite() && self.answer_s_max > 0.0) {
            let got = self.answer_s_max.to_string();
            return value("answer_s_max".to_owned(), "a positive number", got);
        }
        for case in &self.case {
            let key = |key: &str| format!("case {:?}: {key}", case.name);
            if case.sizes.is_empty() && case.problems.is_empty() {
                return value(key("sizes"), "sizes or problems", "neither".to_owned());
            }
            if case.samples == 0 {
                return value(key("samples"), "1 or more", "0".to_owned());
            }
            let empty = [("feeds", case.feeds.is_empty()), ("rates_hz", case.rates_hz.is_empty())];
            if let Some((name, _)) = empty.iter().find(|(_, is_empty)| *is_empty) {
                return value(key(name), "one or more", "none".to_owned());
            }
            self.planner(case)?;
        }
        Ok(())
    }

    /// `[planner]` as it is for a case.
    ///
    /// # Errors
    /// [`ConfigError::Toml`] naming the case.
    pub fn planner(&self, case: &CaseConfig) -> Result<PlannerConfig, ConfigError> {
        let mut table = self.planner.clone();
        merge(&mut table, &case.planner);
        let config: PlannerConfig = toml::Value::Table(table)
            .try_into()
            .map_err(|e| fault(&self.origin, format!("[planner] of case {:?}: {e}", case.name)))?;
        config.check()?;
        Ok(config)
    }
}

/// Lays one table over another, tables inside them too.
fn merge(under: &mut toml::Table, over: &toml::Table) {
    for (key, value) in over {
        match (under.get_mut(key), value) {
            (Some(toml::Value::Table(under)), toml::Value::Table(over)) => merge(under, over),
            _ => {
                under.insert(key.clone(), value.clone());
            }
        }
    }
}
