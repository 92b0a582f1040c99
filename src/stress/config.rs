//! The file of a stress test, as written. `configs/stress.toml` describes every key.

use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};

use super::Workload;
use crate::files::FileRef;
use crate::mismatch::{Mismatch, quoted};
use crate::planners::PlannerConfig;
use crate::run::{ConfigError, Layered, file_schema, schema_with_parts};
use crate::settings::Form;

/// Everything that a stress test needs to know.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StressConfig {
    /// The file it was read from.
    #[serde(skip)]
    pub origin: FileRef,
    /// The file that this one is laid over: a path, which starts from this file's folder, or the
    /// name of a shipped file.
    pub extends: Option<String>,
    /// Seed of everything random.
    pub seed: u64,
    /// How often everything is measured. Quantiles are over all; `--check` looks at the quickest.
    #[schemars(range(min = 1))]
    pub repeats: u32,
    /// How long a plan may take to come before the test is given up, seconds of wall time.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub answer_s_max: f64,
    /// Cells with fewer plans are not judged by `--check`.
    pub check_samples_min: u64,
    /// How plans are found, as in a run file.
    pub planner: PlannerConfig,
    /// What is measured.
    pub case: Vec<CaseConfig>,
}

/// `[[case]]`: problems of one domain, and how their worlds change.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CaseConfig {
    /// Its name in reports.
    pub name: String,
    /// Name of a folder below `domains/`, or the path of a domain folder.
    pub domain: String,
    /// Sizes for the folder's `stress.toml`.
    pub sizes: Vec<u32>,
    /// Problem files; `$data` stands for `--data`.
    pub problems: Vec<String>,
    /// Kinds of workload.
    #[schemars(length(min = 1))]
    pub feeds: Vec<Workload>,
    /// Scenes per second, or `"max"`: the next one as soon as the plan is there.
    #[schemars(length(min = 1))]
    pub rates_hz: Vec<Rate>,
    /// Plans that count in each cell.
    #[schemars(range(min = 1))]
    pub samples: u32,
    /// Random steps to a random state.
    pub walk_steps: u32,
    /// Between the first plan and the first one that counts, milliseconds: what is made beside the
    /// loop has time to be finished.
    pub warm_up_ms: u64,
    /// Plans of each cell whose cost is compared with that of a cheapest plan, off the clock.
    pub optimal_samples: u32,
    /// States of each size that `--compare` gives to the other planner.
    pub compare_samples: u32,
    /// What differs from `[planner]` in this case.
    pub planner: PlannerConfig,
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

impl JsonSchema for Rate {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Rate".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        schemars::json_schema!({
            "anyOf": [{ "type": "number", "minimum": 0.001, "maximum": 1_000_000 }, { "const": "max" }]
        })
    }
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
            RateText::Word(got) => {
                Err(format!("expected a number or \"max\", got {}", quoted(&got)))
            }
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

/// The schema that the file of a stress test laid over the defaults must fulfil.
pub fn stress_schema() -> serde_json::Value {
    schema_with_parts::<StressConfig>()
}

/// The schema of the file of a stress test as it is written: what has a default may be left out.
pub fn stress_file_schema() -> serde_json::Value {
    file_schema(stress_schema(), Form::Stress)
}

/// Reads the file of a stress test by its path, or a shipped one by its name.
///
/// # Errors
/// [`ConfigError`]: everything that is wrong with its keys and values, each with file and line.
pub fn load_stress(path: &Path) -> Result<StressConfig, ConfigError> {
    let layered = Layered::read(path, &[], Form::Stress)?;
    for warning in &layered.layers.warnings {
        tracing::warn!("{warning}");
    }
    stress_of(layered)
}

/// The file of a stress test, from its layers.
///
/// # Errors
/// As [`load_stress`].
pub fn stress_of(layered: Layered) -> Result<StressConfig, ConfigError> {
    let mut config: StressConfig = layered.typed(&stress_schema(), StressConfig::mismatches)?;
    config.origin = layered.file;
    Ok(config)
}

impl StressConfig {
    /// What types cannot say and is not so, each by its key.
    fn mismatches(&self) -> Vec<Mismatch> {
        let mut found = Vec::new();
        for (idx, case) in self.case.iter().enumerate() {
            if case.sizes.is_empty() && case.problems.is_empty() {
                found.push(Mismatch::new(format!("case[{idx}]"), "sizes or problems", "neither"));
            }
            if let Err(Mismatch { at, expected, got }) = case.planner.check() {
                found.push(Mismatch::new(format!("case[{idx}].{at}"), expected, got));
            }
        }
        found
    }
}
