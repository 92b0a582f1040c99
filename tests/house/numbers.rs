//! Every number of a run file: what cannot be is refused by the key's name, and nothing ends in a panic.
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::collections::BTreeMap;

use crate::common::project;
use crate::common::schema::resolved;
use groundloop::run::{HardwarePorts, RunConfig, load_run, run_schema};
use serde_json::Value;

/// A number of a run file.
#[derive(Debug, Clone)]
struct Number {
    /// Where it stands, with `{}` in place of its value, as `--set` takes it.
    set: String,
    /// What it is called in messages.
    key: String,
    /// The part whose option it is, as `--set` chooses it.
    part: Option<String>,
}

/// All numbers of a schema.
struct Numbers<'a> {
    root: &'a Value,
    found: Vec<Number>,
}

impl Numbers<'_> {
    /// The numbers of a table; `set` writes a table's key, such as `limits.{}` or `fault=[{{}}]`.
    fn table(&mut self, schema: &Value, within: &dyn Fn(&str) -> String, part: Option<&str>) {
        for (key, property) in schema["properties"].as_object().into_iter().flatten() {
            let property = resolved(self.root, property).clone();
            let is = |schema: &Value, kind: &str| {
                let kinds = &schema["type"];
                kinds == kind || kinds.as_array().is_some_and(|all| all.iter().any(|k| k == kind))
            };
            let items = resolved(self.root, &property["items"]).clone();
            let mut add = |value: &str| {
                let (set, part) = (within(&format!("{key}={value}")), part.map(str::to_owned));
                let path = set.split_once('=').map(|(path, _)| path.to_owned());
                let is_listed = is_in_list(&set);
                let key = path.filter(|_| !is_listed).unwrap_or_else(|| format!("[0].{key}"));
                self.found.push(Number { set, key, part });
            };
            if is(&property, "number") || is(&property, "integer") {
                add("{}");
            } else if is(&items, "number") || is(&items, "integer") {
                let n = items_of(&property);
                add(&format!("[{}]", vec!["{}"; n].join(",")));
            }
            if property["properties"].is_object() {
                self.table(&property, &|inner| within(&format!("{key}.{inner}")), part);
            }
            if items["properties"].is_object() {
                let one = |inner: &str| within(&format!("{key}=[{{{inner}}}]"));
                self.table(&items, &one, part);
            }
            let named = resolved(self.root, &property["additionalProperties"]).clone();
            if named["properties"].is_object() {
                self.table(&named, &|inner| within(&format!("{key}.mine.{inner}")), part);
            }
            for rule in property["allOf"].as_array().into_iter().flatten() {
                let chosen = rule["if"]["properties"].as_object().into_iter().flatten().next();
                let Some((kind, name)) = chosen else { continue };
                let chosen = format!("{key}.{kind}={}", name["const"].as_str().unwrap());
                for (options, inner) in rule["then"]["properties"].as_object().into_iter().flatten()
                {
                    let inner = resolved(self.root, inner).clone();
                    let at = |option: &str| within(&format!("{key}.{options}.{option}"));
                    self.table(&inner, &at, Some(&chosen));
                }
            }
        }
    }
}

/// Whether a number stands in a list of tables.
fn is_in_list(set: &str) -> bool {
    set.contains("=[{") && !set.contains("=[{}")
}

/// How many items a list of numbers has.
fn items_of(property: &Value) -> usize {
    property["minItems"].as_u64().and_then(|n| usize::try_from(n).ok()).unwrap_or(1)
}

fn numbers() -> Vec<Number> {
    let root = run_schema();
    let mut numbers = Numbers { root: &root, found: Vec::new() };
    numbers.table(&root, &str::to_owned, None);
    numbers.found
}

fn loaded(sets: &[String]) -> Result<RunConfig, String> {
    load_run(&project("configs/blocksworld.toml"), sets).map_err(|error| error.render())
}

/// Sets that are tried at once: one for each part that they belong to, and one for each element of a list of
/// tables, which are replaced as a whole.
fn at_once(numbers: &[Number]) -> Vec<Vec<&Number>> {
    let mut groups: BTreeMap<(Option<&str>, &str), Vec<&Number>> = BTreeMap::new();
    for number in numbers {
        let alone = if is_in_list(&number.set) { number.set.as_str() } else { "" };
        groups.entry((number.part.as_deref(), alone)).or_default().push(number);
    }
    groups.into_values().collect()
}

#[test]
fn a_number_that_cannot_be_is_refused_by_its_key() {
    let numbers = numbers();
    assert!(numbers.len() > 120, "{}", numbers.len());
    let mut faults = Vec::new();
    for value in ["nan", "inf", "-inf", "1e30", "-1e30"] {
        for group in at_once(&numbers) {
            let part = group.first().and_then(|number| number.part.clone());
            let sets = group.iter().map(|number| number.set.replace("{}", value));
            let sets: Vec<String> = part.into_iter().chain(sets).collect();
            let said = loaded(&sets).err().unwrap_or_default();
            let is_said = |number: &&&Number| !said.contains(&number.key);
            faults.extend(group.iter().filter(is_said).map(|n| n.set.replace("{}", value)));
        }
    }
    assert!(
        faults.is_empty(),
        "accepted, or refused without the key's name:\n{}",
        faults.join("\n")
    );
}

/// What may be in one run makes no sense in another: zero, and as much as can be written. It is refused by its key,
/// or the run's hardware can be made of it.
#[test]
fn the_least_and_the_most_is_refused_or_accepted_and_never_a_panic() {
    let mut n_accepted = 0;
    for number in numbers() {
        for value in ["0", "-1", "9223372036854775807"] {
            let set = number.set.replace("{}", value);
            let sets: Vec<String> = number.part.iter().cloned().chain([set.clone()]).collect();
            let Ok(config) = loaded(&sets) else { continue };
            n_accepted += 1;
            let Ok(folder) = config.domain_folder() else { continue };
            if let Err(error) = HardwarePorts::build(&config, &folder) {
                assert!(!error.render().is_empty(), "{set}");
            }
        }
    }
    assert!(n_accepted > 50, "{n_accepted}");
}
