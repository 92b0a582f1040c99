//! What options a part has, read off their JSON Schema.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Serialize;
use serde_json::{Map, Value, to_value};

/// The JSON Schema of a part's options.
pub type OptionsSchema = fn(&mut SchemaGenerator) -> Schema;

/// The schema of options that a struct declares.
pub const fn options_of<O: JsonSchema>() -> OptionsSchema {
    SchemaGenerator::subschema_for::<O>
}

/// The schema of the options of a part that has none.
pub fn no_options(_: &mut SchemaGenerator) -> Schema {
    schemars::json_schema!({ "type": "object", "additionalProperties": false })
}

/// One option of a part, as people read it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PartOption {
    /// Its key; one of a table in the options is written `table.key`.
    pub name: String,
    /// What may stand there: "a string", "\"png\" or \"jpeg\"".
    pub kind: String,
    /// Whether it must be there.
    pub required: bool,
    /// What counts without it, where that is a value.
    pub default: Option<Value>,
    /// What it means, with its unit.
    pub meaning: String,
}

/// The options that a schema declares, in their order, with their defaults.
pub(super) fn described(schema: OptionsSchema, defaults: &toml::Table) -> Vec<PartOption> {
    let mut generator = SchemaGenerator::default();
    let schema = schema(&mut generator).to_value();
    let definitions = generator.take_definitions(true);
    let mut options = Vec::new();
    let defaults = toml::Value::Table(defaults.clone());
    Reader { definitions: &definitions, options: &mut options }.table(&schema, "", Some(&defaults));
    options
}

struct Reader<'a> {
    definitions: &'a Map<String, Value>,
    options: &'a mut Vec<PartOption>,
}

impl Reader<'_> {
    /// What a schema is, wherever it is written; of "this or null", this.
    fn resolve<'s>(&'s self, schema: &'s Value) -> &'s Value {
        let named = schema.get("$ref").and_then(Value::as_str);
        if let Some(found) = named.and_then(|path| self.definitions.get(path.rsplit('/').next()?)) {
            return found;
        }
        let any = schema.get("anyOf").and_then(Value::as_array).into_iter().flatten();
        match any.into_iter().find(|one| one.get("type").is_none_or(|kind| kind != "null")) {
            Some(one) => self.resolve(one),
            None => schema,
        }
    }

    fn table(&mut self, schema: &Value, within: &str, defaults: Option<&toml::Value>) {
        let table = self.resolve(schema).clone();
        let required = table.get("required").and_then(Value::as_array);
        let is_required = |name: &str| required.is_some_and(|r| r.iter().any(|n| n == name));
        for (name, property) in
            table.get("properties").and_then(Value::as_object).into_iter().flatten()
        {
            let name_here = format!("{within}{name}");
            let default = defaults.and_then(|defaults| defaults.get(name));
            let inner = self.resolve(property).clone();
            let text =
                |of: &Value| of.get("description").and_then(Value::as_str).map(str::to_owned);
            self.options.push(PartOption {
                name: name_here.clone(),
                kind: self.kind(&inner),
                required: default.is_none() && is_required(name),
                default: default.filter(|d| !d.is_table()).and_then(|d| to_value(d).ok()),
                meaning: text(property).or_else(|| text(&inner)).unwrap_or_default(),
            });
            if inner.get("properties").is_some() {
                self.table(&inner, &format!("{name_here}."), default);
            }
        }
    }

    fn kind(&self, schema: &Value) -> String {
        if let Some(words) = words(schema) {
            return words.join(" or ");
        }
        let types: Vec<&str> = match schema.get("type") {
            Some(Value::String(one)) => vec![one],
            Some(Value::Array(several)) => several.iter().filter_map(Value::as_str).collect(),
            _ => Vec::new(),
        };
        match types.into_iter().find(|kind| *kind != "null") {
            Some("array") => {
                let items = schema.get("items").map(|items| self.kind(self.resolve(items)));
                format!("array of {}", items.unwrap_or_else(|| "anything".to_owned()))
            }
            Some("object") => "table".to_owned(),
            Some(kind) => kind.to_owned(),
            None => "anything".to_owned(),
        }
    }
}

/// The words that a string may be.
fn words(schema: &Value) -> Option<Vec<String>> {
    let quoted = |word: &Value| word.as_str().map(|word| format!("\"{word}\""));
    if let Some(words) = schema.get("enum").and_then(Value::as_array) {
        return words.iter().map(quoted).collect();
    }
    let one_of = schema.get("oneOf").and_then(Value::as_array)?;
    let word = |branch: &Value| match (branch.get("const"), words(branch)) {
        (Some(word), _) => quoted(word).map(|word| vec![word]),
        (None, words) => words,
    };
    Some(one_of.iter().map(word).collect::<Option<Vec<_>>>()?.concat())
}
