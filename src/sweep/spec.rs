//! What a sweep file says.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::files::FileRef;
use crate::mismatch::Mismatch;
use crate::run::ConfigError;
use crate::settings::TomlFile;

/// Most episodes of a sweep.
const EPISODES_MAX: u64 = 1_000_000;

/// A sweep file: which episodes of which run file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepSpec {
    /// The run file, or the name of a shipped one; a level may name another.
    pub run: String,
    /// How the points are chosen.
    #[serde(default)]
    pub sampling: Sampling,
    /// Seed of the first episode at each point of a grid; of a Latin hypercube, of the first episode, and
    /// of the drawing.
    #[serde(default = "one")]
    pub seed: u64,
    /// Of a grid: episodes at each point, with seeds counting up. The same seeds at every point, so that
    /// points differ in their settings only.
    #[serde(default = "one")]
    pub repeats: u64,
    /// Of a Latin hypercube: how many episodes there are, each at a point of its own.
    #[serde(default)]
    pub samples: u64,
    /// Keys of the run file that are set in every episode: a table as in a run file.
    #[serde(default)]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub set: toml::Table,
    /// What is varied; without any, a grid has one point.
    #[serde(default)]
    pub factor: Vec<SweepFactor>,
    /// How the plot of the report is laid out.
    #[serde(default)]
    pub report: ReportLayout,
}

/// How the plot of a report is laid out, by the names of factors. Without `x`, every factor has a panel of
/// its own.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReportLayout {
    /// What the plot is called.
    #[serde(default)]
    pub title: String,
    /// The factor along the axis; its levels must be numbers.
    #[serde(default)]
    pub x: String,
    /// The factor with a curve for each level.
    #[serde(default)]
    pub by: String,
    /// The factor with a panel for each level.
    #[serde(default)]
    pub panel: String,
}

/// How the points of a sweep are chosen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Every combination of levels.
    #[default]
    Grid,
    /// As many points as `samples`; over them each factor takes every part of its range equally often
    /// (`McKay`, Beckman and Conover, 1979).
    LatinHypercube,
}

/// One thing that is varied, by exactly one of `values`, `range` and `levels`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepFactor {
    /// How it is called in tables; its key when none is given.
    #[serde(default)]
    pub name: String,
    /// The key of the run file that `values` and `range` are of.
    #[serde(default)]
    pub key: String,
    /// The values that the key takes.
    #[serde(default)]
    #[schemars(with = "Vec<serde_json::Value>")]
    pub values: Vec<toml::Value>,
    /// The least and the greatest value that the key takes.
    #[serde(default)]
    pub range: Option<[f64; 2]>,
    /// In a grid: into how many values, both ends included, the range is divided.
    #[serde(default = "two")]
    pub steps: u64,
    /// Whether values of the range are rounded to whole numbers.
    #[serde(default)]
    pub whole: bool,
    /// Levels with names, each of which may set several keys.
    #[serde(default)]
    pub levels: Vec<Level>,
}

/// One level of a factor.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// How it is called in tables.
    pub name: String,
    /// Another run file.
    #[serde(default)]
    pub run: Option<String>,
    /// Keys of the run file: a table as in a run file.
    #[serde(default)]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub set: toml::Table,
}

fn one() -> u64 {
    1
}

fn two() -> u64 {
    2
}

impl SweepFactor {
    /// How it is called in tables.
    pub fn title(&self) -> &str {
        if self.name.is_empty() { &self.key } else { &self.name }
    }

    /// How many levels it has in a grid.
    pub fn n_levels(&self) -> u64 {
        match self.range {
            Some(_) => self.steps,
            None => (self.values.len() + self.levels.len()) as u64,
        }
    }

    fn mismatch(&self, at: &str) -> Option<Mismatch> {
        let ways = [!self.values.is_empty(), self.range.is_some(), !self.levels.is_empty()];
        let fault = |field: &str, expected: &str, got: &str| {
            let at = if field.is_empty() { at.to_owned() } else { format!("{at}.{field}") };
            Some(Mismatch { at, expected: expected.to_owned(), got: got.to_owned() })
        };
        if ways.iter().filter(|way| **way).count() != 1 {
            let given = ["values", "range", "levels"].into_iter().zip(ways);
            let given: Vec<&str> = given.filter(|(_, is)| *is).map(|(name, _)| name).collect();
            let got = if given.is_empty() { "none".to_owned() } else { given.join(" and ") };
            return fault("", "one of values, range and levels", &got);
        }
        if !self.levels.is_empty() && self.name.is_empty() {
            return fault("name", "a name for a factor with levels", "none");
        }
        if self.levels.is_empty() && self.key.is_empty() {
            return fault("key", "the key of the run file that is varied", "none");
        }
        match self.range {
            Some([low, high]) if !(low.is_finite() && high.is_finite() && low < high) => {
                fault("range", "two numbers, the lesser first", &format!("[{low}, {high}]"))
            }
            Some(_) if self.steps < 2 => {
                fault("steps", "2 or more: both ends are taken", &self.steps.to_string())
            }
            Some(_) | None => None,
        }
    }
}

impl SweepSpec {
    /// Reads a sweep file.
    ///
    /// # Errors
    /// [`ConfigError`]: everything that is wrong, each with its line.
    pub fn read(file: &FileRef) -> Result<Self, ConfigError> {
        Self::parse(&file.to_string(), &file.text()?)
    }

    /// Reads a sweep file's text; `name` is the file's in messages.
    ///
    /// # Errors
    /// [`ConfigError`]: everything that is wrong, each with its line.
    pub fn parse(name: &str, text: &str) -> Result<Self, ConfigError> {
        let toml = TomlFile::parse(name, text)?;
        let spec: Self = toml.read()?;
        let problems: Vec<_> = spec.mismatches().into_iter().map(|m| toml.located(m)).collect();
        if problems.is_empty() { Ok(spec) } else { Err(problems.into()) }
    }

    /// How many points a grid has; `None` where that is more than can be counted.
    pub fn n_points(&self) -> Option<u64> {
        let levels = self.factor.iter().map(SweepFactor::n_levels);
        levels.into_iter().try_fold(1_u64, u64::checked_mul)
    }

    /// How many episodes there are; `None` where that is more than can be counted.
    fn n_episodes_unbounded(&self) -> Option<u64> {
        match self.sampling {
            Sampling::Grid => self.n_points()?.checked_mul(self.repeats),
            Sampling::LatinHypercube => Some(self.samples),
        }
    }

    /// How many episodes there are.
    pub fn n_episodes(&self) -> u64 {
        self.n_episodes_unbounded().unwrap_or(u64::MAX)
    }

    fn mismatches(&self) -> Vec<Mismatch> {
        let factors = self.factor.iter().enumerate();
        let mut all: Vec<Mismatch> =
            factors.filter_map(|(i, factor)| factor.mismatch(&format!("factor.{i}"))).collect();
        for (i, factor) in self.factor.iter().enumerate() {
            let earlier = &self.factor[..i];
            if earlier.iter().any(|other| other.title() == factor.title()) {
                let at = format!("factor.{i}");
                let got = format!("{} twice", factor.title());
                all.push(Mismatch { at, expected: "factors with names of their own".into(), got });
            }
        }
        let layout =
            [("x", &self.report.x), ("by", &self.report.by), ("panel", &self.report.panel)];
        let titles: Vec<&str> = self.factor.iter().map(SweepFactor::title).collect();
        for (field, name) in layout {
            if !name.is_empty() && !titles.contains(&name.as_str()) {
                let expected = format!("the name of a factor ({})", titles.join(", "));
                let at = format!("report.{field}");
                all.push(Mismatch { at, expected, got: name.clone() });
            }
        }
        let (at, n) = match self.sampling {
            Sampling::Grid => ("repeats", self.n_episodes_unbounded()),
            Sampling::LatinHypercube => ("samples", Some(self.samples)),
        };
        if n.is_none_or(|n| !(1..=EPISODES_MAX).contains(&n)) {
            let got = n.map_or_else(|| "more than can be counted".to_owned(), |n| n.to_string());
            let expected = format!("1 to {EPISODES_MAX} episodes in all");
            all.push(Mismatch { at: at.to_owned(), expected, got });
        }
        all
    }
}
