//! The range of every number, by the unit that its key ends with.
//!
//! A number that says no range of its own gets that of its unit: far wider than anything that makes
//! sense, and narrow enough that no sum of times overflows and no wait is for ever.

use serde_json::{Value as Json, json};

/// Endings of keys whose whole numbers have a range, too: times, which are added up.
const TIMES: [&str; 2] = ["_s", "_ms"];

/// Endings of keys with lowest and highest value, the longer one first where one ends with the other.
const UNITS: &[(&str, f64, f64)] = &[
    ("_m_s", 0.001, 100.0),
    ("_rad_s", 0.001, 1_000.0),
    ("_kg_m3", 1.0, 100_000.0),
    ("_s", 0.0, 1_000_000.0),
    ("_ms", 0.0, 1_000_000_000.0),
    ("_hz", 0.01, 10_000.0),
    ("_m", -100.0, 100.0),
    ("_mm", -100_000.0, 100_000.0),
    ("_deg", -3_600.0, 3_600.0),
    ("_rad", -100.0, 100.0),
    ("_px", -100_000.0, 100_000.0),
    ("seconds", 0.0, 1_000_000.0),
    ("_usd", 0.0, 1_000_000.0),
    ("_friction", 0.0, 10.0),
    ("_rate", 0.0, 1.0),
    ("_sigma", 0.0, 255.0),
    ("_share", 0.0, 1.0),
    ("_probability", 0.0, 1.0),
];

/// Keys that are a quantity's own name: positions in metres, shares and factors.
const NAMES: &[(&str, f64, f64)] = &[
    ("gripper_home", -100.0, 100.0),
    ("to", -100.0, 100.0),
    ("view_poses", -100.0, 100.0),
    ("factor", 0.0, 1_000.0),
    ("friction", 0.0, 10.0),
    ("intensity", 0.0, 100.0),
    ("pose", -100.0, 100.0),
    ("probability", 0.0, 1.0),
    ("region", 0.0, 1.0),
    ("share", 0.0, 1.0),
    ("temperature", 0.0, 10.0),
    ("width", 0.0, 1.0),
];

/// Gives every number of a schema a range: its own, or that of its key's unit.
pub(crate) fn bound_numbers(schema: &mut Json) {
    match schema {
        Json::Object(object) => {
            if let Some(Json::Object(properties)) = object.get_mut("properties") {
                for (key, property) in properties {
                    if let Some(range) = range_of(key) {
                        limit(property, range, TIMES.iter().any(|end| stem(key).ends_with(end)));
                    }
                }
            }
            object.values_mut().for_each(bound_numbers);
        }
        Json::Array(items) => items.iter_mut().for_each(bound_numbers),
        Json::Null | Json::Bool(_) | Json::Number(_) | Json::String(_) => {}
    }
}

/// The range of a key's unit.
fn range_of(key: &str) -> Option<[f64; 2]> {
    let named = NAMES.iter().find(|(name, ..)| *name == key);
    let unit = || UNITS.iter().find(|(end, ..)| stem(key).ends_with(end));
    named.or_else(unit).map(|(_, min, max)| [*min, *max])
}

/// A key without the word that says which bound it is.
fn stem(key: &str) -> &str {
    ["_max", "_min"].iter().find_map(|end| key.strip_suffix(end)).unwrap_or(key)
}

/// Puts a range on a number, on the items of an array of numbers, and on what may be left out.
fn limit(schema: &mut Json, range: [f64; 2], is_whole_too: bool) {
    for inner in ["items", "anyOf", "oneOf"] {
        match schema.get_mut(inner) {
            Some(Json::Array(branches)) => {
                for branch in branches {
                    limit(branch, range, is_whole_too);
                }
            }
            Some(item) => limit(item, range, is_whole_too),
            None => {}
        }
    }
    let is = |name: &str| match &schema["type"] {
        Json::String(one) => one == name,
        Json::Array(several) => several.iter().any(|one| one == name),
        Json::Null | Json::Bool(_) | Json::Number(_) | Json::Object(_) => false,
    };
    if !(is("number") || is_whole_too && is("integer")) {
        return;
    }
    let has = |name: &str| schema.get(name).is_some();
    let has_min = has("minimum") || has("exclusiveMinimum");
    let has_max = has("maximum");
    if !has_min {
        schema["minimum"] = number(range[0]);
    }
    if !has_max {
        schema["maximum"] = number(range[1]);
    }
}

/// Whole numbers as such: they are repeated in messages.
fn number(value: f64) -> Json {
    if value.fract() == 0.0 { json!(value as i64) } else { json!(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_range_of_its_unit_or_its_own() {
        let mut schema = json!({ "properties": {
            "wait_s": { "type": "number" },
            "reach_x_m": { "type": "array", "items": { "type": "number" } },
            "deadline_ms": { "anyOf": [{ "type": "integer", "minimum": 0 }, { "type": "null" }] },
            "speed_m_s_max": { "type": "number", "maximum": 2 },
            "name": { "type": "string" },
        } });
        bound_numbers(&mut schema);
        let expect = json!({ "properties": {
            "wait_s": { "type": "number", "minimum": 0, "maximum": 1_000_000 },
            "reach_x_m": { "type": "array", "items":
                { "type": "number", "minimum": -100, "maximum": 100 } },
            "deadline_ms": { "anyOf": [
                { "type": "integer", "minimum": 0, "maximum": 1_000_000_000 }, { "type": "null" }] },
            "speed_m_s_max": { "type": "number", "minimum": 0.001, "maximum": 2 },
            "name": { "type": "string" },
        } });
        assert_eq!(schema, expect);
    }
}
