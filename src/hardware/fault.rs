//! `[[fault]]` of a run file: when something goes wrong, and what.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

use crate::mismatch::{Mismatch, listed};

/// Stands for any step and any object, and for an object that the seed draws.
pub(crate) const ANY: &str = "any";

/// `[[fault]]`: something that goes wrong, in the simulated world, its robot or its cameras, or among the
/// actors. Exactly one of `at_s`, `during`, `after`, `holding`, `frame`, `message` and `sent` says when.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultConfig {
    /// When: at this time of the simulated world, seconds; or at a time between two, which the seed
    /// draws.
    pub at_s: Option<FaultTime>,
    /// When: while this action (`stack`), this step (`(stack red_block blue_block arm)`) or "any" is
    /// carried out.
    pub during: Option<String>,
    /// When: once this action, this step or "any" has ended, however it ended.
    pub after: Option<String>,
    /// When: as the gripper takes this object, or "any".
    pub holding: Option<String>,
    /// When: as this camera ("main", or the name of a `[cameras.NAME]`) takes a frame, or "any".
    pub frame: Option<String>,
    /// When: as this actor has received a message: `camera` (`camera/NAME` for others), `goal_parser`,
    /// `planner`, `robot`, `scene_parser` or `skill_executor`.
    pub message: Option<String>,
    /// When: as a message is about to be published on this topic, such as "robot/status".
    pub sent: Option<String>,
    /// At which occurrence of that, counted from 1; without the key the first.
    pub nth: Option<u32>,
    /// Whether at every occurrence instead.
    pub every: Option<bool>,
    /// How long after that, seconds of simulated time; without the key at once.
    pub after_s: Option<f64>,
    /// How likely it is to happen, each time: 0 to 1; without the key always. The run's seed draws it, and
    /// `fault_rate` of the run file is multiplied with it.
    pub probability: Option<f64>,
    /// What happens.
    #[cfg_attr(feature = "sim", schemars(with = "super::sim::FaultAction"))]
    #[cfg_attr(
        not(feature = "sim"),
        schemars(with = "serde_json::Map<String, serde_json::Value>")
    )]
    pub action: toml::Table,
}

/// A time of the simulated world, in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum FaultTime {
    /// This one.
    At(f64),
    /// One between these, both included.
    Between([f64; 2]),
}

impl JsonSchema for FaultTime {
    fn schema_name() -> Cow<'static, str> {
        "FaultTime".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": ["number", "array"],
            "minimum": 0,
            "maximum": 1_000_000,
            "items": { "type": "number", "minimum": 0, "maximum": 1_000_000 },
            "minItems": 2,
            "maxItems": 2,
        })
    }
}

impl FaultTime {
    /// The earliest and the latest time.
    pub fn bounds_s(self) -> [f64; 2] {
        match self {
            Self::At(at_s) => [at_s, at_s],
            Self::Between(bounds) => bounds,
        }
    }
}

impl FaultConfig {
    /// The actions and steps that it waits for, each with its key.
    pub fn steps(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let keys = [("during", &self.during), ("after", &self.after)];
        let named = keys.into_iter().filter_map(|(key, said)| Some((key, said.as_deref()?)));
        named.filter(|(_, said)| *said != ANY)
    }

    /// The same, so many times as likely.
    #[must_use]
    pub fn at_rate(mut self, rate: f64) -> Self {
        self.probability = Some(self.probability.unwrap_or(1.0) * rate);
        self
    }

    /// Whether it concerns the actors and their messages, and not the simulated world.
    pub fn is_system(&self) -> bool {
        self.message.is_some() || self.sent.is_some()
    }

    /// What is wrong with when it happens; `at` is where it stands.
    pub(crate) fn mismatch(&self, at: &str) -> Option<Mismatch> {
        self.when(at).or_else(|| self.number(at))
    }

    /// A number that is no time, count or probability.
    fn number(&self, at: &str) -> Option<Mismatch> {
        let is_time = |s: &f64| s.is_finite() && *s >= 0.0;
        let expected = "a finite number, 0 or more";
        match self.at_s {
            Some(FaultTime::At(got)) if !is_time(&got) => {
                return Some(Mismatch::new(format!("{at}.at_s"), expected, got));
            }
            Some(FaultTime::Between(got)) if !(got.iter().all(is_time) && got[0] <= got[1]) => {
                let expected = "two finite numbers, 0 or more, the lower one first";
                return Some(Mismatch::new(format!("{at}.at_s"), expected, listed(got)));
            }
            Some(_) | None => {}
        }
        if let Some(got) = self.after_s.filter(|s| !is_time(s)) {
            return Some(Mismatch::new(format!("{at}.after_s"), expected, got));
        }
        if let Some(got) = self.probability.filter(|p| !(0.0..=1.0).contains(p)) {
            return Some(Mismatch::new(format!("{at}.probability"), "a number from 0 to 1", got));
        }
        let nth = self.nth.filter(|nth| *nth == 0)?;
        Some(Mismatch::new(format!("{at}.nth"), "an integer, 1 or more", nth))
    }

    fn when(&self, at: &str) -> Option<Mismatch> {
        let triggers = [
            ("at_s", self.at_s.is_some()),
            ("during", self.during.is_some()),
            ("after", self.after.is_some()),
            ("holding", self.holding.is_some()),
            ("frame", self.frame.is_some()),
            ("message", self.message.is_some()),
            ("sent", self.sent.is_some()),
        ];
        let given = triggers.iter().filter(|(_, is_there)| *is_there);
        let given: Vec<&str> = given.map(|(key, _)| *key).collect();
        if given.len() != 1 {
            let got = if given.is_empty() { "none".to_owned() } else { given.join(" and ") };
            let expected = "one of at_s, during, after, holding, frame, message and sent";
            return Some(Mismatch::new(at, expected, got));
        }
        let is_every = self.every == Some(true);
        if is_every && self.nth.is_some() {
            return Some(Mismatch::new(format!("{at}.nth"), "none beside every = true", "a value"));
        }
        let keys =
            [("nth", self.nth.is_some()), ("every", is_every), ("after_s", self.after_s.is_some())];
        let (key, _) = keys.into_iter().find(|(_, is_there)| *is_there)?;
        self.at_s?;
        Some(Mismatch::new(format!("{at}.{key}"), "none beside at_s", "a value"))
    }
}
