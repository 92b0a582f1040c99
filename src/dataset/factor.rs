//! What differs from scene to scene: `--vary KEY=LO..HI`, `--vary KEY=a,b,c`.

use std::fmt;
use std::str::FromStr;

use crate::draws::Draws;
use crate::mismatch::{Mismatch, listed};
use crate::settings::near_hint;

/// Factors that are no key of a file; others are keys below `sim.` of the run file, or below `scene.` of
/// the scene file.
pub const OWN_KEYS: [&str; 7] = [
    "light.azimuth_deg",
    "light.elevation_deg",
    "light.intensity",
    "objects",
    "view.azimuth_deg",
    "view.distance_m",
    "view.elevation_deg",
];

/// Something that differs from scene to scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    /// One of [`OWN_KEYS`], a key below `sim.` of the run file, or a key of the scene file after `scene.`.
    pub key: String,
    /// What it may be.
    values: Values,
}

/// A factor's value in one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct FactorValue {
    /// The factor's key.
    pub key: String,
    /// The value.
    pub value: toml::Value,
}

#[derive(Debug, Clone, PartialEq)]
enum Values {
    /// Whole numbers, both ends included.
    Whole([i64; 2]),
    /// Any number between two.
    Real([f64; 2]),
    /// One of several.
    OneOf(Vec<toml::Value>),
}

impl Factor {
    /// Its value in one scene: every possible one is equally likely.
    pub fn drawn(&self, draws: &mut Draws) -> FactorValue {
        let value = match &self.values {
            Values::Whole([low, high]) => {
                let n = usize::try_from(high - low).unwrap_or_default() + 1;
                toml::Value::Integer(low + i64::try_from(draws.below(n)).unwrap_or_default())
            }
            Values::Real([low, high]) => toml::Value::Float(draws.between(*low, *high)),
            Values::OneOf(values) => values[draws.below(values.len())].clone(),
        };
        FactorValue { key: self.key.clone(), value }
    }

    /// The values that have to be possible for all others to be: the ends of a range, each of a list.
    pub fn extremes(&self) -> Vec<FactorValue> {
        let values = match &self.values {
            Values::Whole(ends) => ends.map(toml::Value::Integer).to_vec(),
            Values::Real(ends) => ends.map(toml::Value::Float).to_vec(),
            Values::OneOf(values) => values.clone(),
        };
        let value = |value| FactorValue { key: self.key.clone(), value };
        values.into_iter().map(value).collect()
    }

    /// Its values as text.
    pub fn values_text(&self) -> String {
        match &self.values {
            Values::Whole([low, high]) => format!("{low}..{high}"),
            Values::Real(ends) => {
                // As TOML writes them: with a point, which tells them from whole numbers.
                let [low, high] = ends.map(toml::Value::Float);
                format!("{low}..{high}")
            }
            Values::OneOf(values) => listed(values),
        }
    }
}

impl fmt::Display for Factor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}", self.key, self.values_text())
    }
}

impl FromStr for Factor {
    type Err = Mismatch;

    fn from_str(text: &str) -> Result<Self, Mismatch> {
        let at = |key: &str| format!("--vary {key}");
        let form = "KEY=LO..HI or KEY=A,B,C";
        let (key, values) =
            text.split_once('=').ok_or_else(|| Mismatch::new("--vary", form, text))?;
        let key = key.trim();
        let is_of_file = ["sim.", "scene."].iter().any(|file| key.starts_with(file));
        if !is_of_file && !OWN_KEYS.contains(&key) {
            let own = OWN_KEYS.join(", ");
            let expected = format!("{own}, sim.KEY of the run file or scene.KEY of the scene file");
            let got = format!("{key}{}", near_hint(key, OWN_KEYS));
            return Err(Mismatch::new("--vary", expected, got));
        }
        let values = match values.split_once("..") {
            Some((low, high)) => range(low.trim(), high.trim()),
            None => listed_values(values).map(Values::OneOf),
        };
        let expected = "LO..HI with two finite numbers and LO at most HI, or A,B,C";
        let values = values.ok_or_else(|| Mismatch::new(at(key), expected, text))?;
        Ok(Self { key: key.to_owned(), values })
    }
}

/// Most whole numbers of one range.
const WHOLE_MAX: i64 = 1_000_000;

/// Whole numbers where both ends are written so, else any number.
fn range(low: &str, high: &str) -> Option<Values> {
    if let (Ok(low), Ok(high)) = (low.parse::<i64>(), high.parse::<i64>()) {
        let n = high.checked_sub(low)?;
        return (0..WHOLE_MAX).contains(&n).then_some(Values::Whole([low, high]));
    }
    let [low, high] = [low.parse::<f64>().ok()?, high.parse::<f64>().ok()?];
    let is_range = low.is_finite() && high.is_finite() && low <= high;
    is_range.then_some(Values::Real([low, high]))
}

/// TOML values, or else plain strings, between commas that stand in no brackets.
fn listed_values(text: &str) -> Option<Vec<toml::Value>> {
    let mut depth = 0_i32;
    let is_between = |c: char| {
        depth += match c {
            '[' | '{' => 1,
            ']' | '}' => -1,
            _ => 0,
        };
        c == ',' && depth == 0
    };
    let parts = text.split(is_between).map(str::trim);
    let value = |part: &str| {
        let table = format!("v = {part}").parse::<toml::Table>().ok();
        let parsed = table.and_then(|mut table| table.remove("v"));
        let plain = || toml::Value::String(part.to_owned());
        (!part.is_empty()).then(|| parsed.unwrap_or_else(plain))
    };
    parts.map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expect: &str) {
        assert_eq!(text.parse::<Factor>().unwrap().to_string(), expect);
    }

    #[test]
    fn ranges_and_lists_are_read() {
        check("objects=2..8", "objects = 2..8");
        check("view.elevation_deg = 15..45.0", "view.elevation_deg = 15.0..45.0");
        check("sim.camera.look_at_m=[0,0,0.1],[0, 0, 0.2]", {
            "sim.camera.look_at_m = [[0, 0, 0.1], [0, 0, 0.2]]"
        });
        check("sim.scene=a.toml,b.toml", "sim.scene = [\"a.toml\", \"b.toml\"]");
        check("objects=4", "objects = [4]");
    }

    #[test]
    fn what_is_no_factor_is_refused_with_what_would_be() {
        for (text, expect) in [
            ("objects", "--vary: expected KEY=LO..HI or KEY=A,B,C, got objects"),
            ("object=1..2", "or scene.KEY of the scene file, got object; did you mean"),
            ("objects=8..2", "--vary objects: expected LO..HI with two finite numbers"),
            ("objects=1..", "--vary objects"),
            ("objects=1..inf", "--vary objects"),
            ("objects=0..9223372036854775807", "--vary objects"),
            ("objects=1,,2", "--vary objects"),
            ("objects=", "--vary objects"),
            ("limits.cycles_max=1", "got limits.cycles_max"),
        ] {
            let error = text.parse::<Factor>().unwrap_err().to_string();
            assert!(error.contains(expect), "{text}: {error}");
        }
    }

    #[test]
    fn every_value_comes_up_and_no_other() {
        let mut draws = Draws::of_key([1, 1, 0, 0]);
        for text in ["objects=2..4", "objects=2,3,4"] {
            let factor: Factor = text.parse().unwrap();
            let drawn: Vec<i64> =
                (0..60).filter_map(|_| factor.drawn(&mut draws).value.as_integer()).collect();
            assert!((2..=4).all(|n| drawn.contains(&n)) && drawn.iter().all(|n| *n < 5), "{text}");
        }
        let factor: Factor = "sim.camera.noise.rgb_sigma=0.0..2.0".parse().unwrap();
        let value = factor.drawn(&mut draws).value.as_float().unwrap();
        assert!((0.0..2.0).contains(&value));
        assert_eq!(factor.extremes().len(), 2);
    }
}
