//! Settings held against their JSON Schema: every unknown key, every missing one and every value of
//! the wrong kind at once.
//!
//! The schema is the one that `groundloop config schema` prints, made by `schemars` from the types
//! that read the settings; serde reads them afterwards and has the last word. A general validator
//! (`jsonschema`) was weighed: it tells a path and not a span, says of a union only that no branch
//! fits, and costs some forty crates. What is read here is the part of JSON Schema that `schemars`
//! writes for structs, enums, options, arrays and numbers.

use std::ops::Range;

use serde_json::Value as Json;

use super::problem::SettingsProblem;
use super::sources::Sources;
use super::spelling::did_you_mean;
use super::tree::{Node, Tree, Value};

/// Longest value that a message repeats, in characters.
const SHOWN_CHARS_MAX: usize = 60;

/// Checks a table.
///
/// `key` is where the table stands; `file` is named for keys that are missing in tables that no file has.
pub(super) fn check(
    schema: &Json,
    (tree, key): (&Tree, &str),
    sources: &Sources,
    file: &str,
) -> Vec<SettingsProblem> {
    let mut check = Check { schema, sources, file, problems: Vec::new() };
    check.table(resolve(schema, schema), tree, None, key);
    check.problems.sort_by_key(SettingsProblem::order);
    check.problems
}

struct Check<'a> {
    schema: &'a Json,
    sources: &'a Sources,
    file: &'a str,
    problems: Vec<SettingsProblem>,
}

impl<'a> Check<'a> {
    fn fault(&mut self, span: &Range<usize>, key: &str, message: String) {
        self.problems.push(SettingsProblem::at(self.sources, span, key, message));
    }

    fn value(&mut self, schema: &'a Json, value: &Value, key: &str) {
        let schema = resolve(self.schema, schema);
        let span = value.span();
        if let Some(words) = words(schema) {
            return self.word(&words, value, key);
        }
        match value.get_ref() {
            Node::Table(table) if schema.get("oneOf").is_some() => {
                self.tagged(schema, table, &span, key);
            }
            Node::Table(table) if is_type(schema, "object") => {
                self.table(schema, table, Some(&span), key);
            }
            Node::Array(items) if is_type(schema, "array") => {
                self.array(schema, items, &span, key);
            }
            node if is_leaf_of(schema, node) => self.number(schema, value, key),
            Node::Table(_) | Node::Array(_) | Node::Leaf(_) => {
                let message = format!("expected {}, got {}", expected(schema), self.got(value));
                self.fault(&span, key, message);
            }
        }
    }

    /// A string that is one of some words.
    fn word(&mut self, words: &[&str], value: &Value, key: &str) {
        let got = match value.get_ref() {
            Node::Leaf(toml::Value::String(text)) => Some(text.as_str()),
            Node::Leaf(_) | Node::Array(_) | Node::Table(_) => None,
        };
        if got.is_some_and(|got| words.contains(&got)) {
            return;
        }
        let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
        let near = got.and_then(|got| did_you_mean(got, words.iter().copied()));
        let near = near.map(|near| format!("; did you mean \"{near}\"?")).unwrap_or_default();
        let message = format!("expected {}, got {}{near}", quoted.join(" or "), self.got(value));
        self.fault(&value.span(), key, message);
    }

    /// A table whose `kind` says which keys it has.
    fn tagged(&mut self, schema: &'a Json, table: &Tree, span: &Range<usize>, key: &str) {
        let tag_of = |branch: &'a Json| {
            let properties = branch.get("properties")?.as_object()?;
            properties.iter().find_map(|(tag, p)| Some((tag, p.get("const")?.as_str()?)))
        };
        let tags: Vec<_> =
            branches(schema, "oneOf").map(|b| (resolve(self.schema, b), b)).collect();
        let Some((tag, _)) = tags.iter().find_map(|(branch, _)| tag_of(branch)) else { return };
        let words: Vec<&str> = tags.iter().filter_map(|(b, _)| Some(tag_of(b)?.1)).collect();
        let Some(entry) = table.get(tag) else {
            return self.missing(&[tag], Some(span), key);
        };
        let said = table.string(tag);
        match tags.iter().find(|(branch, _)| tag_of(branch).map(|t| t.1) == said) {
            Some((branch, _)) => self.table(branch, table, Some(span), key),
            None => self.word(&words, &entry.value, &join(key, tag)),
        }
    }

    fn table(&mut self, schema: &'a Json, table: &Tree, span: Option<&Range<usize>>, key: &str) {
        let mut known: Vec<(&'a str, &'a Json)> = properties(schema).collect();
        for rule in branches(schema, "allOf").filter(|rule| holds(rule, table)) {
            for (name, property) in rule.get("then").into_iter().flat_map(properties) {
                known.retain(|(other, _)| *other != name);
                known.push((name, property));
            }
        }
        let required = schema.get("required").and_then(Json::as_array);
        let required = required.into_iter().flatten().filter_map(Json::as_str);
        let missing: Vec<&str> = required.filter(|name| !table.0.contains_key(*name)).collect();
        if !missing.is_empty() {
            self.missing(&missing, span, key);
        }
        let others = schema.get("additionalProperties");
        for (name, entry) in &table.0 {
            let inner = join(key, name);
            match known.iter().find(|(known, _)| known == name) {
                Some((_, property)) => self.value(property, &entry.value, &inner),
                None if others == Some(&Json::Bool(false)) => {
                    let names: Vec<&str> = known.iter().map(|(known, _)| *known).collect();
                    self.fault(&entry.key, &inner, unknown(name, &names));
                }
                None => {
                    if let Some(other) = others.filter(|other| other.is_object()) {
                        self.value(other, &entry.value, &inner);
                    }
                }
            }
        }
    }

    /// Names all keys that a table lacks, at the table.
    fn missing(&mut self, names: &[&str], span: Option<&Range<usize>>, key: &str) {
        let is_written = |span: &&Range<usize>| !self.sources.is_default(span);
        let (plural, list) = (if names.len() == 1 { "" } else { "s" }, names.join(", "));
        let problem = if let Some(span) = span.filter(is_written) {
            SettingsProblem::at(self.sources, span, key, format!("missing key{plural}: {list}"))
        } else {
            let list: Vec<String> = names.iter().map(|name| join(key, name)).collect();
            let message = format!("missing key{plural}: {}", list.join(", "));
            SettingsProblem::of_file(self.file, "", message)
        };
        self.problems.push(problem);
    }

    fn array(&mut self, schema: &'a Json, items: &[Value], span: &Range<usize>, key: &str) {
        let bound = |name: &str| schema.get(name).and_then(Json::as_u64);
        let n = items.len() as u64;
        let (min, max) = (bound("minItems"), bound("maxItems"));
        if min.is_some_and(|min| n < min) || max.is_some_and(|max| n > max) {
            let message = format!("expected {}, got {n} values", expected(schema));
            self.fault(span, key, message);
        }
        let Some(item_schema) = schema.get("items") else { return };
        for (idx, item) in items.iter().enumerate() {
            self.value(item_schema, item, &format!("{key}[{idx}]"));
        }
    }

    /// The bounds of a number.
    fn number(&mut self, schema: &'a Json, value: &Value, key: &str) {
        let number = match value.get_ref() {
            Node::Leaf(toml::Value::Integer(number)) => *number as f64,
            Node::Leaf(toml::Value::Float(number)) => *number,
            Node::Leaf(_) | Node::Array(_) | Node::Table(_) => return,
        };
        let bound = |name: &str| schema.get(name).and_then(Json::as_f64);
        let low = bound("minimum").is_some_and(|min| number < min)
            || bound("exclusiveMinimum").is_some_and(|min| number <= min);
        let widest = match schema.get("format").and_then(Json::as_str) {
            Some("uint8") => Some(f64::from(u8::MAX)),
            Some("uint16") => Some(f64::from(u16::MAX)),
            Some("uint32") => Some(f64::from(u32::MAX)),
            _ => None,
        };
        let high = bound("maximum").or(widest).is_some_and(|max| number > max);
        if low || high || number.is_nan() {
            let message = format!("expected {}, got {}", expected(schema), self.got(value));
            self.fault(&value.span(), key, message);
        }
    }

    /// A value as it stands in the text, and what kind of value that is where it is not plain.
    fn got(&self, value: &Value) -> String {
        if let Node::Table(_) = value.get_ref() {
            return "a table".to_owned();
        }
        let text = self.sources.text(&value.span()).lines().next().unwrap_or_default();
        if text.is_empty() {
            return value.get_ref().plain().to_string();
        }
        let shown: String = text.chars().take(SHOWN_CHARS_MAX).collect();
        match (value.get_ref(), shown == text) {
            (Node::Leaf(toml::Value::String(text)), true) if !shown.starts_with(['"', '\'']) => {
                format!("the string \"{text}\"")
            }
            (_, true) => shown,
            (node, false) => node.kind().to_owned(),
        }
    }
}

/// Follows references, and takes the part of an optional value that is there.
pub(super) fn resolve<'a>(root: &'a Json, schema: &'a Json) -> &'a Json {
    let reference = schema.get("$ref").and_then(Json::as_str);
    if let Some(pointer) = reference.and_then(|r| r.strip_prefix('#')) {
        return root.pointer(pointer).map_or(schema, |found| resolve(root, found));
    }
    let is_null = |branch: &&Json| branch.get("type").and_then(Json::as_str) == Some("null");
    let mut present = branches(schema, "anyOf").filter(|branch| !is_null(branch));
    match (present.next(), present.next()) {
        (Some(only), None) => resolve(root, only),
        _ => schema,
    }
}

fn unknown(name: &str, names: &[&str]) -> String {
    if names.is_empty() {
        return "unknown key: this table has none".to_owned();
    }
    match did_you_mean(name, names.iter().copied()) {
        Some(near) => format!("unknown key; did you mean {near}?"),
        None => format!("unknown key; known here: {}", names.join(", ")),
    }
}

fn join(key: &str, name: &str) -> String {
    if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") }
}

fn branches<'a>(schema: &'a Json, keyword: &str) -> impl Iterator<Item = &'a Json> {
    schema.get(keyword).and_then(Json::as_array).into_iter().flatten()
}

pub(super) fn properties(schema: &Json) -> impl Iterator<Item = (&str, &Json)> {
    let properties = schema.get("properties").and_then(Json::as_object);
    properties.into_iter().flatten().map(|(name, property)| (name.as_str(), property))
}

/// Whether the keys that an `if` names have the values that it names.
fn holds(rule: &Json, table: &Tree) -> bool {
    let Some(condition) = rule.get("if") else { return false };
    let mut wanted = properties(condition);
    wanted.all(|(key, p)| p.get("const").and_then(Json::as_str) == table.string(key))
}

/// The words of a schema that allows nothing else.
fn words(schema: &Json) -> Option<Vec<&str>> {
    own_words(schema).or_else(|| {
        let each: Option<Vec<Vec<&str>>> = branches(schema, "oneOf").map(own_words).collect();
        each.map(|each| each.concat()).filter(|words| !words.is_empty())
    })
}

fn own_words(schema: &Json) -> Option<Vec<&str>> {
    let listed = schema.get("enum").and_then(Json::as_array).into_iter().flatten();
    let words: Option<Vec<&str>> = listed.chain(schema.get("const")).map(Json::as_str).collect();
    words.filter(|words| !words.is_empty())
}

/// The types that a schema allows.
fn types(schema: &Json) -> Vec<&str> {
    match schema.get("type") {
        Some(Json::String(one)) => vec![one],
        Some(Json::Array(several)) => several.iter().filter_map(Json::as_str).collect(),
        _ => Vec::new(),
    }
}

fn is_type(schema: &Json, name: &str) -> bool {
    let types = types(schema);
    types.contains(&name) || types.is_empty()
}

fn is_leaf_of(schema: &Json, node: &Node) -> bool {
    let Node::Leaf(leaf) = node else { return false };
    match leaf {
        toml::Value::String(_) => is_type(schema, "string"),
        toml::Value::Integer(_) => is_type(schema, "integer") || is_type(schema, "number"),
        toml::Value::Float(_) => is_type(schema, "number"),
        toml::Value::Boolean(_) => is_type(schema, "boolean"),
        toml::Value::Datetime(_) | toml::Value::Array(_) | toml::Value::Table(_) => {
            types(schema).is_empty()
        }
    }
}

/// What may stand where a schema is, in words.
fn expected(schema: &Json) -> String {
    let names: Vec<String> = types(schema).into_iter().filter_map(|t| noun(t, schema)).collect();
    if names.is_empty() { "something else".to_owned() } else { names.join(" or ") }
}

fn noun(name: &str, schema: &Json) -> Option<String> {
    let bounds = || {
        let bound = |name: &str| schema.get(name).filter(|b| b.is_number()).map(Json::to_string);
        match (bound("minimum"), bound("maximum")) {
            (Some(min), Some(max)) => format!(" from {min} to {max}"),
            (Some(min), None) => format!(", {min} or more"),
            (None, Some(max)) => format!(", {max} or less"),
            (None, None) => {
                bound("exclusiveMinimum").map_or_else(String::new, |min| format!(" above {min}"))
            }
        }
    };
    Some(match name {
        "object" => "a table".to_owned(),
        "string" => "a string".to_owned(),
        "boolean" => "true or false".to_owned(),
        "integer" => format!("an integer{}", bounds()),
        "number" => format!("a number{}", bounds()),
        "array" => match (schema.get("minItems"), schema.get("maxItems")) {
            (Some(min), Some(max)) if min == max => format!("an array of {min} values"),
            _ => "an array".to_owned(),
        },
        _ => return None,
    })
}
