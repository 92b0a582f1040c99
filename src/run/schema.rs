//! The JSON Schema of run files, parts and their options included.

use schemars::{JsonSchema, SchemaGenerator};
use serde_json::{Value, json};

use super::RunConfig;
use crate::goals::GOALS;
use crate::hardware::{CAMERAS, ROBOTS};
use crate::parts::{OptionsSchema, Registry, Role};
use crate::perception::detectors::DETECTORS;
use crate::perception::grounders::GROUNDERS;
use crate::planners::PLANNERS;
use crate::settings::{Form, Layers, bound_numbers, default_options};

/// The parts of one role, as a run file chooses among them.
struct Choices {
    /// The table that names the part.
    table: &'static str,
    /// The key in it.
    key: &'static str,
    /// The key in it that holds the part's options.
    options: &'static str,
    /// The parts: name, help, options.
    parts: Vec<(&'static str, &'static str, OptionsSchema)>,
}

impl Choices {
    fn of<T: Role + ?Sized>(registry: &Registry<T>) -> Option<Self> {
        let (table, key) = T::KEY.split_once('.')?;
        let (_, options) = T::OPTIONS.split_once('.')?;
        let parts = registry.0.iter().map(|part| (part.name, part.help, part.options)).collect();
        Some(Self { table, key, options, parts })
    }

    fn all() -> Vec<Self> {
        [
            Self::of(&GOALS),
            Self::of(&DETECTORS),
            Self::of(&GROUNDERS),
            Self::of(&PLANNERS),
            Self::of(&CAMERAS),
            Self::of(&ROBOTS),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// The schema that a run file laid over the defaults must fulfil.
pub fn run_schema() -> Value {
    schema_with_parts::<RunConfig>()
}

/// The schema of a run file as it is written: what has a default may be left out.
pub fn run_file_schema() -> Value {
    file_schema(run_schema(), Form::Run)
}

/// A schema for files as they are written, from the one for files laid over the defaults: nothing is
/// required that the defaults have, and keys tell their defaults.
pub(crate) fn file_schema(mut schema: Value, form: Form) -> Value {
    let Ok(layers) = Layers::defaults(form) else { return schema };
    relax(&mut schema, "", &json!(layers.plain()));
    for choices in Choices::all() {
        for (part, _, _) in &choices.parts {
            let within = format!("{}.{}", choices.table, choices.options);
            let defaults = json!(default_options(&within, part));
            let rules = table_of(&mut schema, choices.table).and_then(|t| t["allOf"].as_array());
            let is_of = |rule: &&Value| rule["if"]["properties"][choices.key]["const"] == *part;
            let rule = rules.and_then(|rules| rules.iter().find(is_of));
            let options = rule.map(|rule| &rule["then"]["properties"][choices.options]["$ref"]);
            let reference = options.and_then(Value::as_str).and_then(|r| r.strip_prefix('#'));
            if let Some(pointer) = reference.map(str::to_owned) {
                relax(&mut schema, &pointer, &defaults);
            }
        }
    }
    schema
}

/// Takes what has a default out of what the table at a place requires, and says the default.
fn relax(schema: &mut Value, pointer: &str, defaults: &Value) {
    let Some(defaults) = defaults.as_object() else { return };
    let Some(table) = schema.pointer_mut(pointer) else { return };
    if let Some(required) = table["required"].as_array_mut() {
        required.retain(|key| key.as_str().is_none_or(|key| !defaults.contains_key(key)));
    }
    for (key, default) in defaults {
        let Some(table) = schema.pointer_mut(pointer) else { return };
        let property = &mut table["properties"][key];
        let branches = property["anyOf"].as_array().cloned().unwrap_or_default();
        let reference = branches.iter().chain([&*property]).find_map(|b| b["$ref"].as_str());
        match reference.and_then(|r| r.strip_prefix('#')).map(str::to_owned) {
            Some(inner) if default.is_object() => relax(schema, &inner, default),
            Some(_) | None => property["default"] = default.clone(),
        }
    }
}

/// The schema of a type, with the parts there are in the tables that choose parts, and the options of
/// each.
pub(crate) fn schema_with_parts<T: JsonSchema>() -> Value {
    let mut generator = SchemaGenerator::default();
    let mut added = Vec::new();
    for choices in Choices::all() {
        let Choices { table, key, options, parts } = choices;
        let rules: Vec<Value> = parts
            .iter()
            .map(|(name, _, schema)| {
                let schema = schema(&mut generator).to_value();
                json!({
                    "if": { "properties": { key: { "const": name } }, "required": [key] },
                    "then": { "properties": { options: schema } },
                })
            })
            .collect();
        let names =
            parts.iter().map(|(name, help, _)| json!({ "const": name, "description": help }));
        added.push((table, key, names.collect::<Vec<Value>>(), rules));
    }
    let mut schema = generator.into_root_schema_for::<T>().to_value();
    for (table, key, names, mut rules) in added {
        if let Some(table) = table_of(&mut schema, table) {
            table["properties"][key]["oneOf"] = json!(names);
            if let Some(more) = table["allOf"].as_array() {
                rules.extend(more.iter().cloned());
            }
            table["allOf"] = json!(rules);
        }
    }
    bound_numbers(&mut schema);
    schema
}

/// The definition of a table of the root.
fn table_of<'a>(schema: &'a mut Value, name: &str) -> Option<&'a mut Value> {
    let property = &schema["properties"][name];
    let reference = property["$ref"].as_str()?.strip_prefix('#')?.to_owned();
    schema.pointer_mut(&reference)
}
