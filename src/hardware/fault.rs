//! `[[fault]]` of a run file.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::mismatch::Mismatch;

/// `[[fault]]`: one disturbance of the simulated world.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultConfig {
    /// When: at this time of the simulated world, seconds. Either this or `during`.
    pub at_s: Option<f64>,
    /// When: while this action (`stack`) or this step (`(stack red_block blue_block arm)`) is carried
    /// out.
    pub during: Option<String>,
    /// Which execution of what `during` names, counted from 1; without the key the first.
    pub nth: Option<u32>,
    /// How long after the start of that execution, seconds of simulated time; without the key at
    /// once.
    pub after_s: Option<f64>,
    /// What happens.
    #[cfg_attr(feature = "sim", schemars(with = "super::sim::WorldFault"))]
    #[cfg_attr(
        not(feature = "sim"),
        schemars(with = "serde_json::Map<String, serde_json::Value>")
    )]
    pub action: toml::Table,
}

impl FaultConfig {
    /// What is wrong with when it happens; `at` is where it stands.
    pub(crate) fn mismatch(&self, at: &str) -> Option<Mismatch> {
        self.when(at).or_else(|| self.number(at))
    }

    /// A number that is no time or count.
    fn number(&self, at: &str) -> Option<Mismatch> {
        for (key, seconds) in [("at_s", self.at_s), ("after_s", self.after_s)] {
            if let Some(got) = seconds.filter(|s| !(s.is_finite() && *s >= 0.0)) {
                let expected = "a finite number, 0 or more";
                return Some(Mismatch::new(format!("{at}.{key}"), expected, got));
            }
        }
        let nth = self.nth.filter(|nth| *nth == 0)?;
        Some(Mismatch::new(format!("{at}.nth"), "an integer, 1 or more", nth))
    }

    fn when(&self, at: &str) -> Option<Mismatch> {
        let either = |got: &str| Some(Mismatch::new(at, "either at_s or during", got));
        match (&self.at_s, &self.during) {
            (Some(_), Some(_)) => either("both"),
            (None, None) => either("neither"),
            (None, Some(_)) => None,
            (Some(_), None) => {
                let keys = [("nth", self.nth.is_some()), ("after_s", self.after_s.is_some())];
                let (key, _) = keys.into_iter().find(|(_, is_there)| *is_there)?;
                Some(Mismatch::new(format!("{at}.{key}"), "none beside at_s", "a value"))
            }
        }
    }
}
