//! The JSON Schemas in `docs/schemas/` are those of this version, and say what every key means.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs;

use crate::common::{files_below, project, schema};
use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::{Value, json};

/// What `groundloop schema` says to a verb: exit code, standard output, standard error.
fn call(verb: &str) -> (Option<i32>, String, String) {
    let output = cargo_bin_cmd!("groundloop").args(["schema", verb]).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// The verbs that have a schema, as the refusal of another one lists them.
fn verbs() -> Vec<String> {
    let (code, _, said) = call("wibble");
    assert_eq!(code, Some(2), "{said}");
    let (_, list) = said.split_once("[possible values: ").unwrap();
    let (list, _) = list.split_once(']').unwrap();
    list.split(", ").map(str::to_owned).collect()
}

#[test]
fn the_shipped_schemas_are_those_of_this_version() {
    let verbs = verbs();
    assert!(verbs.len() >= 10 && verbs.is_sorted(), "{verbs:?}");
    for verb in &verbs {
        let (code, now, said) = call(verb);
        assert_eq!(code, Some(0), "{said}");
        let shipped = project("docs/schemas").join(format!("{verb}.json"));
        let shipped = fs::read_to_string(shipped).unwrap_or_default();
        assert!(
            shipped == now,
            "docs/schemas/{verb}.json: write it again with\n  \
             cargo run --release -- schema {verb} > docs/schemas/{verb}.json"
        );
    }
    let files = files_below(&project("docs/schemas"), "json");
    assert_eq!(files.len(), verbs.len(), "a schema of a verb that is gone");
}

#[test]
fn every_key_has_a_description() {
    for file in files_below(&project("docs/schemas"), "json") {
        let schema: Value = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
        assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
        let structs = schema::structs(&schema);
        assert!(!structs.is_empty(), "{file:?}");
        for (key, value) in structs.into_iter().flatten() {
            assert!(value["description"].is_string(), "{file:?}: {key} is not described");
        }
    }
}

/// What a verb writes with `--json`.
fn written(args: &[&str]) -> Value {
    let output =
        cargo_bin_cmd!("groundloop").current_dir(project(".")).args(args).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn lists_of_parts_and_shown_settings_obey_their_schemas() {
    let parts = written(&["parts", "--json"]);
    schema::obeys("parts", &parts);
    assert_eq!(written(&["parts", "robot", "--json"])["kinds"].as_array().unwrap().len(), 1);
    assert!(parts["kinds"].as_array().unwrap().len() >= 7, "{parts:#}");
    for file in ["configs/blocksworld_disturbed.toml", "configs/stress.toml"] {
        let shown = written(&["config", "show", file, "--set", "seed=7", "--json"]);
        schema::obeys("config-show", &shown);
        assert_eq!((&shown["file"], &shown["values"]["seed"]), (&json!(file), &json!(7)));
        let set = json!({ "kind": "set", "file": null, "line": null });
        assert_eq!(shown["origins"]["seed"], set);
        let kinds = shown["origins"].as_object().unwrap().values().map(|at| &at["kind"]);
        let kinds: std::collections::BTreeSet<_> = kinds.filter_map(Value::as_str).collect();
        assert!(kinds.into_iter().eq(["default", "file", "set"]), "{shown:#}");
    }
}

#[test]
fn what_a_schema_does_not_allow_is_refused() {
    let good = json!({"valid": true, "cost": 6.0, "steps": 6, "step_idx": null, "reason": null});
    schema::obeys("validate", &good);
    for (key, value) in [("cost", json!("6")), ("steps", json!(-1)), ("wibble", json!(1))] {
        let mut bad = good.clone();
        bad[key] = value;
        let refused = std::panic::catch_unwind(|| schema::obeys("validate", &bad));
        assert!(refused.is_err(), "{bad}");
    }
}

/// Schemas are those of a version: the program tells it.
#[test]
fn the_version_is_told() {
    let output = cargo_bin_cmd!("groundloop").arg("--version").output().unwrap();
    let expected = format!("groundloop {}\n", env!("CARGO_PKG_VERSION"));
    assert_eq!(String::from_utf8(output.stdout).unwrap(), expected);
}
