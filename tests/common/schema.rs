//! The JSON Schemas of `docs/schemas/`, and whether what a verb writes obeys its own.

use std::fs;

use boon::{Compiler, Schemas};
use serde_json::{Map, Value};

use super::project;

/// Fails unless a verb's output obeys its schema and has no key that the schema does not name.
#[track_caller]
pub fn obeys(verb: &str, output: &Value) {
    let path = project("docs/schemas").join(format!("{verb}.json"));
    let mut schema: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    close(&mut schema);
    let (mut schemas, mut compiler) = (Schemas::new(), Compiler::new());
    compiler.add_resource("schema.json", schema).unwrap();
    let root = compiler.compile("schema.json", &mut schemas).unwrap();
    if let Err(error) = schemas.validate(output, root) {
        panic!("groundloop {verb}: {error:#}\n{output:#}");
    }
}

/// Forbids keys that a schema does not name. Users may ignore keys that are added later; here one
/// that is missing in the schema is a fault.
fn close(schema: &mut Value) {
    match schema {
        Value::Object(map) => {
            let is_struct = map.contains_key("properties");
            map.values_mut().for_each(close);
            if is_struct {
                map.insert("additionalProperties".to_owned(), Value::Bool(false));
            }
        }
        Value::Array(items) => items.iter_mut().for_each(close),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

/// What a part of a schema stands for: references followed, and "or null" left out.
pub fn resolved<'a>(root: &'a Value, mut schema: &'a Value) -> &'a Value {
    while let Some(inner) = schema["anyOf"]
        .as_array()
        .and_then(|branches| branches.iter().find(|branch| branch["type"] != "null"))
        .or_else(|| root.pointer(schema["$ref"].as_str()?.strip_prefix('#')?))
    {
        schema = inner;
    }
    schema
}

/// Every object in a schema that has keys, by the place where it stands.
pub fn structs(schema: &Value) -> Vec<&Map<String, Value>> {
    let mut found = Vec::new();
    let mut rest = vec![schema];
    while let Some(value) = rest.pop() {
        if let Some(map) = value.get("properties").and_then(Value::as_object) {
            found.push(map);
        }
        match value {
            Value::Object(map) => rest.extend(map.values()),
            Value::Array(items) => rest.extend(items),
            Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
        }
    }
    found
}
