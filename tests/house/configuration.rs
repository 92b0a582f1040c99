//! `configs/defaults.toml` is the reference of every key, and `groundloop config show` prints them all.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use crate::common::project;
use crate::common::schema::resolved;
use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::Value;

/// What `groundloop config` says on standard output, from the project's folder.
fn config(args: &[&str]) -> String {
    let output = cargo_bin_cmd!("groundloop")
        .current_dir(project("."))
        .arg("config")
        .args(args)
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_run_file_is_shown_with_all_that_it_is_laid_over() {
    insta::assert_snapshot!("show_blocksworld", config(&["show", "configs/blocksworld.toml"]));
}

#[test]
fn what_a_file_extends_and_what_is_set_are_told_apart() {
    let shown = config(&[
        "show",
        "configs/blocksworld_disturbed.toml",
        "--set",
        "limits.cycles_max=9",
        "--set",
        "perception.detector=http",
        "--set",
        "perception.options.dialect=roboflow",
    ]);
    insta::assert_snapshot!("show_blocksworld_disturbed_set", shown);
}

#[test]
fn a_stress_file_is_shown_with_the_defaults_of_its_cases() {
    insta::assert_snapshot!("show_stress_quick", config(&["show", "configs/stress_quick.toml"]));
}

/// One key or table of `defaults.toml`.
#[derive(Debug)]
struct Listed {
    /// Whether it has a default; one that has none stands behind a `#` without a blank.
    has_default: bool,
    /// Whether it is a table's heading.
    is_table: bool,
    /// The comment above it.
    comment: String,
}

/// Every key and table of `defaults.toml`, by its dotted name.
fn listed() -> BTreeMap<String, Listed> {
    let text = fs::read_to_string(project("configs/defaults.toml")).unwrap();
    let is_name = |name: &str| {
        !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || "_-.".contains(c))
    };
    // A heading behind a `#` is for the keys behind a `#` that follow it.
    let (mut found, mut comment) = (BTreeMap::new(), String::new());
    let (mut table, mut here) = (String::new(), String::new());
    for line in text.lines() {
        if line.starts_with("# ") || line.is_empty() {
            let above = std::mem::take(&mut comment);
            comment =
                if line.is_empty() { String::new() } else { above + line.trim_start_matches('#') };
            continue;
        }
        let (has_default, line) = line.strip_prefix('#').map_or((true, line), |rest| (false, rest));
        let heading = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        let heading =
            heading.map(|name| name.trim_matches(['[', ']'])).filter(|name| is_name(name));
        let key = line.split_once(" = ").map(|(key, _)| key).filter(|key| is_name(key));
        if let Some(heading) = heading {
            heading.clone_into(&mut here);
            if has_default {
                heading.clone_into(&mut table);
            }
        }
        let within = if has_default { &table } else { &here };
        let name = match (heading, key) {
            (Some(heading), _) => heading.to_owned(),
            (None, Some(key)) if within.is_empty() => key.to_owned(),
            (None, Some(key)) => format!("{within}.{key}"),
            (None, None) => continue,
        };
        let is_table = heading.is_some();
        let comment = std::mem::take(&mut comment);
        let again = found.insert(name.clone(), Listed { has_default, is_table, comment });
        assert!(again.is_none(), "configs/defaults.toml has {name} twice");
    }
    found
}

/// What a key has for a default.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Has {
    None,
    /// An empty list or table.
    Nothing,
    Value,
}

/// The keys of a schema by their dotted names, and whether each has a default.
struct Keys<'a> {
    root: &'a Value,
    found: BTreeMap<String, Has>,
}

impl<'a> Keys<'a> {
    fn of(root: &'a Value) -> BTreeMap<String, Has> {
        let mut keys = Self { root, found: BTreeMap::new() };
        keys.table(root, "");
        keys.found
    }

    fn table(&mut self, schema: &'a Value, name: &str) {
        for (key, property) in schema["properties"].as_object().into_iter().flatten() {
            let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
            let has = match &property["default"] {
                Value::Null => Has::None,
                Value::Array(items) if items.is_empty() => Has::Nothing,
                Value::Object(map) if map.is_empty() => Has::Nothing,
                Value::Bool(_)
                | Value::Number(_)
                | Value::String(_)
                | Value::Array(_)
                | Value::Object(_) => Has::Value,
            };
            self.found.insert(name.clone(), has);
            let inner = resolved(self.root, property);
            let items = resolved(self.root, &inner["items"]);
            self.table(if items.is_null() { inner } else { items }, &name);
            // Tables by names of one's own stand in the defaults as that of NAME.
            let named = resolved(self.root, &inner["additionalProperties"]);
            if named["properties"].is_object() {
                self.found.insert(format!("{name}.NAME"), Has::None);
                self.table(named, &format!("{name}.NAME"));
            }
        }
        // Each part has options of its own, whose defaults stand below [options.ROLE.PART].
        for rule in schema["allOf"].as_array().into_iter().flatten() {
            let (key, part) = rule["if"]["properties"].as_object().unwrap().iter().next().unwrap();
            let role = if name == "perception" { key.as_str() } else { name };
            for options in rule["then"]["properties"].as_object().into_iter().flatten() {
                let within = format!("options.{role}.{}", part["const"].as_str().unwrap());
                self.table(resolved(self.root, options.1), &within);
            }
        }
    }
}

/// Every key that a schema has, by the name that it has in `defaults.toml`.
fn known() -> BTreeMap<String, Has> {
    let schemas = [config(&["schema"]), config(&["schema", "--stress"])];
    let [run, stress] = schemas.map(|text| serde_json::from_str::<Value>(&text).unwrap());
    let mut known = Keys::of(&run);
    let defaults: toml::Table =
        fs::read_to_string(project("configs/defaults.toml")).unwrap().parse().unwrap();
    let shares = |role: &str, part: &str, table: &str| {
        let part = defaults["options"].get(role)?.get(part)?;
        Some(part.get("shared")?.as_array()?.iter().any(|name| name.as_str() == Some(table)))
    };
    let in_common = |name: &str| {
        let words: Vec<&str> = name.split('.').collect();
        match words[..] {
            ["options", role, part, table, ..] if shares(role, part, table) == Some(true) => {
                Some(format!("options.{}", words[3..].join(".")))
            }
            _ => None,
        }
    };
    known = known.into_iter().map(|(name, d)| (in_common(&name).unwrap_or(name), d)).collect();
    // What stress files have as run files do, is not listed again.
    let new = Keys::of(&stress).into_iter().filter(|(name, _)| !known.contains_key(name));
    let new: Vec<_> = new
        .filter(|(name, _)| !name.starts_with("options.") && !name.starts_with("case.planner."))
        .map(|(name, d)| (format!("stress.{name}"), d))
        .collect();
    known.extend(new);
    known
}

#[test]
fn the_defaults_list_every_key_there_is_and_no_other() {
    let (listed, known) = (listed(), known());
    assert!(known.len() > 150, "{}", known.len());
    let parents: BTreeSet<&str> = listed
        .keys()
        .flat_map(|name| name.match_indices('.').map(|(at, _)| name.split_at(at).0))
        .collect();
    let mut faults = Vec::new();
    // A table that is written as one value is one key.
    let is_in_value = |name: &str| {
        let mut outer = name.match_indices('.').map(|(at, _)| name.split_at(at).0);
        outer.any(|outer| listed.get(outer).is_some_and(|outer| !outer.is_table))
    };
    for name in known.keys().filter(|name| !listed.contains_key(*name)) {
        if !parents.contains(name.as_str()) && !is_in_value(name) {
            faults.push(format!("configs/defaults.toml does not list {name}"));
        }
    }
    let is_shelf = |name: &str| name.starts_with("options.") || name == "stress";
    for (name, Listed { is_table, .. }) in &listed {
        let is_known = known.contains_key(name) || (*is_table && is_shelf(name));
        if !is_known && !name.ends_with(".shared") {
            faults.push(format!("configs/defaults.toml lists {name}, which no file may have"));
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// `#key` says that a key has no default.
#[test]
fn the_defaults_say_which_keys_have_none() {
    let known = known();
    let mut n_without = 0;
    for (name, Listed { has_default, is_table, .. }) in listed() {
        let Some(has) = known.get(&name).filter(|_| !is_table) else { continue };
        // A schema of stress files does not say what each case starts from.
        if *has != Has::Nothing && !name.starts_with("stress.case.") {
            assert_eq!(*has == Has::Value, has_default, "{name}");
        }
        n_without += usize::from(!has_default);
    }
    assert!(n_without > 20, "{n_without}");
}

/// Words that a comment has which says the unit of a key.
const UNITS: &[(&str, &str)] = &[
    ("_bytes", "byte"),
    ("_deg", "degrees"),
    ("_hz", "per second"),
    ("_kg_m3", "kilograms per cubic metre"),
    ("_m", "metre"),
    ("_mb", "megabyte"),
    ("_m_s", "metres per second"),
    ("_ms", "millisecond"),
    ("_s", "second"),
];

#[test]
fn every_key_of_the_defaults_is_explained_with_its_unit() {
    let listed = listed();
    let heading = |name: &str| {
        let (table, _) = name.rsplit_once('.')?;
        Some(listed.get(table)?.comment.as_str())
    };
    let mut faults = Vec::new();
    for (name, Listed { comment, .. }) in &listed {
        if name.ends_with(".shared") {
            continue; // explained at the table that is shared
        }
        if comment.split_whitespace().count() < 2 || !comment.ends_with('.') {
            faults.push(format!("{name}: no sentence above it says what it means: {comment}"));
        }
        let bare = name.trim_end_matches("_max").trim_end_matches("_min");
        let units = UNITS.iter().filter(|(suffix, _)| bare.ends_with(suffix));
        if let Some((_, unit)) = units.max_by_key(|(suffix, _)| suffix.len())
            && !comment.contains(unit)
            && !heading(name).is_some_and(|heading| heading.contains(unit))
        {
            faults.push(format!("{name}: neither its comment nor its table's says \"{unit}\""));
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// Numbers of a schema that have no range, by the name that they stand under.
fn without_range(schema: &Value, name: &str, found: &mut Vec<String>) {
    let is = |one: &str| {
        let types = &schema["type"];
        types == one || types.as_array().is_some_and(|all| all.iter().any(|t| t == one))
    };
    let has_min = schema.get("minimum").or(schema.get("exclusiveMinimum")).is_some();
    if is("number") && !(has_min && schema.get("maximum").is_some()) {
        found.push(name.to_owned());
    }
    match schema {
        Value::Object(object) => object.iter().for_each(|(key, inner)| {
            let is_name = !["items", "properties", "anyOf", "oneOf"].contains(&key.as_str());
            without_range(inner, if is_name { key } else { name }, found);
        }),
        Value::Array(items) => items.iter().for_each(|item| without_range(item, name, found)),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

/// A number that is not finite, or far beyond sense, is told by its key and never met in the middle
/// of a run.
#[test]
fn every_number_of_run_and_stress_files_has_a_range() {
    for args in [&["schema"][..], &["schema", "--stress"]] {
        let schema: Value = serde_json::from_str(&config(args)).unwrap();
        let mut found = Vec::new();
        without_range(&schema, "", &mut found);
        assert!(found.is_empty(), "{args:?}: {found:?}");
    }
    let run = |set: &str| {
        let mut command = cargo_bin_cmd!("groundloop");
        let output = command
            .current_dir(project("."))
            .args(["config", "check", "configs/blocksworld.toml", "--set", set])
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    for (set, range) in [
        ("camera.wait_s=-1", "0 to 1000000"),
        ("camera.wait_s=inf", "0 to 1000000"),
        ("camera.wait_s=1e30", "0 to 1000000"),
        ("camera.rate_hz=1e12", "0.01 to 10000"),
        ("camera.rate_hz=nan", "0.01 to 10000"),
        ("limits.skill_timeout_s=inf", "0 to 1000000"),
        ("supervisor.backoff_ms_max=99999999999", "0 to 1000000000"),
        ("sim.world.density_kg_m3=-1", "1 to 100000"),
    ] {
        let (code, said) = run(set);
        let (key, _) = set.split_once('=').unwrap();
        assert_eq!(code, Some(2), "{set}: {said}");
        assert!(said.contains(key) && said.contains(range), "{set}: {said}");
    }
}
