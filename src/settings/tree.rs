//! TOML as a tree whose every key and value keeps its span.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::Deserialize as _;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use super::problem::SettingsProblem;
use super::sources::{LayerOrigin, Sources};

/// A value with its span in all sources.
pub(crate) type Value = Spanned<Node>;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Node {
    /// A string, number, boolean or time.
    Leaf(toml::Value),
    /// An array, of tables too.
    Array(Vec<Value>),
    /// Keys below it, in the order of the file.
    Table(Tree),
}

/// A table: its entries by key.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Tree(pub(super) BTreeMap<String, Entry>);

/// One key with its value. Two are equal when their values are, wherever they stand.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// Where the key stands.
    pub(super) key: Range<usize>,
    /// What it holds.
    pub(super) value: Value,
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl Tree {
    /// Parses a text.
    ///
    /// # Errors
    /// Every mistake of syntax, with its place.
    pub(crate) fn parse(
        sources: &mut Sources,
        origin: LayerOrigin,
        text: &str,
    ) -> Result<Self, Vec<SettingsProblem>> {
        let start = sources.add(origin, text);
        let (table, errors) = DeTable::parse_recoverable(text);
        let mut problems: Vec<SettingsProblem> = Vec::new();
        let mut fault = |error: &toml::de::Error| {
            let span = error.span().unwrap_or(0..0);
            let message = error.message().trim_end().replace('\n', ", ");
            problems.push(SettingsProblem::at(sources, &moved(span, start), "", message));
        };
        errors.iter().for_each(&mut fault);
        let tree = table_of(table.into_inner(), start, &mut fault);
        if problems.is_empty() { Ok(tree) } else { Err(problems) }
    }

    /// The entry of a dotted key.
    pub(crate) fn get(&self, key: &str) -> Option<&Entry> {
        match key.split_once('.') {
            None => self.0.get(key),
            Some((first, rest)) => match self.0.get(first)?.value.get_ref() {
                Node::Table(table) => table.get(rest),
                Node::Leaf(_) | Node::Array(_) => None,
            },
        }
    }

    /// The span of the value at a dotted key whose parts may have indices: `fault[0].action`.
    pub(crate) fn span_of(&self, key: &str) -> Option<Range<usize>> {
        let (first, rest) = key.split_once('.').map_or((key, None), |(a, b)| (a, Some(b)));
        let (name, indices) = first.split_once('[').unwrap_or((first, ""));
        let mut value = &self.0.get(name)?.value;
        for index in indices.split(['[', ']']).filter(|index| !index.is_empty()) {
            let Node::Array(items) = value.get_ref() else { return None };
            value = items.get(index.parse::<usize>().ok()?)?;
        }
        match (rest, value.get_ref()) {
            (None, _) => Some(value.span()),
            (Some(rest), Node::Table(table)) => table.span_of(rest),
            (Some(_), Node::Leaf(_) | Node::Array(_)) => None,
        }
    }

    /// The span of the value at a dotted key, or of the last part of it that is there. In an array of
    /// tables a part may be an index, or what an item is called: `type.block.naming`.
    pub(crate) fn nearest_span(&self, key: &str) -> Option<Range<usize>> {
        let mut parts = key.split(['.', '[', ']']).filter(|part| !part.is_empty());
        let mut value = &self.0.get(parts.next()?)?.value;
        for part in parts {
            let Some(inner) = value.get_ref().part(part) else { break };
            value = inner;
        }
        Some(value.span())
    }

    /// The string at a dotted key.
    pub(crate) fn string(&self, key: &str) -> Option<&str> {
        match self.get(key)?.value.get_ref() {
            Node::Leaf(toml::Value::String(text)) => Some(text),
            Node::Leaf(_) | Node::Array(_) | Node::Table(_) => None,
        }
    }

    /// Takes the entry of a dotted key out.
    pub(crate) fn remove(&mut self, key: &str) -> Option<Entry> {
        match key.split_once('.') {
            None => self.0.remove(key),
            Some((first, rest)) => match self.0.get_mut(first)?.value.get_mut() {
                Node::Table(table) => table.remove(rest),
                Node::Leaf(_) | Node::Array(_) => None,
            },
        }
    }

    /// Puts an entry at a dotted key; tables on the way that are missing are made, and stand where
    /// the entry's key does.
    pub(crate) fn insert(&mut self, key: &str, entry: Entry) {
        let Some((first, rest)) = key.split_once('.') else {
            self.0.insert(key.to_owned(), entry);
            return;
        };
        let at = entry.key.clone();
        let made = || Entry {
            key: at.clone(),
            value: Spanned::new(at.clone(), Node::Table(Self::default())),
        };
        let parent = self.0.entry(first.to_owned()).or_insert_with(made);
        if !matches!(parent.value.get_ref(), Node::Table(_)) {
            *parent = Entry {
                key: at.clone(),
                value: Spanned::new(at.clone(), Node::Table(Self::default())),
            };
        }
        if let Node::Table(table) = parent.value.get_mut() {
            table.insert(rest, entry);
        }
    }

    /// Lays a table over this one: tables key by key, everything else as a whole. Afterwards a key
    /// stands where the upper table has it.
    pub(crate) fn lay(&mut self, over: Self) {
        for (name, mut upper) in over.0 {
            if let Node::Table(table) = upper.value.get_mut()
                && let Some(mut lower) = self.0.remove(&name)
                && let Node::Table(under) = lower.value.get_mut()
            {
                under.lay(std::mem::take(table));
                *table = std::mem::take(under);
            }
            self.0.insert(name, upper);
        }
    }

    /// Tells each key that holds a plain value or an array, and where it stands.
    pub(super) fn each_leaf(&self, path: &str, tell: &mut dyn FnMut(&str, &Range<usize>)) {
        for (name, entry) in &self.0 {
            let key = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            match entry.value.get_ref() {
                Node::Table(table) => table.each_leaf(&key, tell),
                Node::Leaf(_) | Node::Array(_) => tell(&key, &entry.key),
            }
        }
    }

    /// The same without spans.
    pub(crate) fn plain(&self) -> toml::Table {
        self.0.iter().map(|(key, entry)| (key.clone(), entry.value.get_ref().plain())).collect()
    }
}

impl Node {
    /// What a part of a key leads to.
    fn part(&self, part: &str) -> Option<&Value> {
        match self {
            Self::Leaf(_) => None,
            Self::Table(table) => table.0.get(part).map(|entry| &entry.value),
            Self::Array(items) => {
                let at = part.parse().ok().and_then(|idx: usize| items.get(idx));
                let called = |item: &&Value| match item.get_ref() {
                    Self::Table(table) => table.0.values().any(|entry| {
                        matches!(entry.value.get_ref(),
                            Self::Leaf(toml::Value::String(text)) if text == part)
                    }),
                    Self::Leaf(toml::Value::String(text)) => text == part,
                    Self::Leaf(_) | Self::Array(_) => false,
                };
                let only = match items.as_slice() {
                    [only] => only.get_ref().part(part),
                    _ => None,
                };
                at.or_else(|| items.iter().find(called)).or(only)
            }
        }
    }

    /// The same without spans.
    pub(crate) fn plain(&self) -> toml::Value {
        match self {
            Self::Leaf(value) => value.clone(),
            Self::Array(items) => {
                toml::Value::Array(items.iter().map(|item| item.get_ref().plain()).collect())
            }
            Self::Table(table) => toml::Value::Table(table.plain()),
        }
    }

    /// What kind of value it is, for people.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Leaf(toml::Value::String(_)) => "a string",
            Self::Leaf(toml::Value::Integer(_)) => "an integer",
            Self::Leaf(toml::Value::Float(_)) => "a number",
            Self::Leaf(toml::Value::Boolean(_)) => "a boolean",
            Self::Leaf(_) => "a date or time",
            Self::Array(_) => "an array",
            Self::Table(_) => "a table",
        }
    }
}

/// Parses one value; a text that is no TOML is a string.
pub(super) fn value_of(text: &str, start: usize) -> Value {
    let mut errors = Vec::new();
    let parsed = DeValue::parse(text).map(|value| {
        let span = moved(value.span(), start);
        let mut fault = |error: &toml::de::Error| errors.push(error.clone());
        Spanned::new(span, node_of(value, start, &mut fault))
    });
    match parsed {
        Ok(value) if errors.is_empty() => value,
        Ok(_) | Err(_) => {
            let string = toml::Value::String(text.to_owned());
            Spanned::new(start..start + text.len(), Node::Leaf(string))
        }
    }
}

fn moved(span: Range<usize>, start: usize) -> Range<usize> {
    span.start + start..span.end + start
}

fn table_of(table: DeTable<'_>, start: usize, fault: &mut dyn FnMut(&toml::de::Error)) -> Tree {
    let entries = table.into_iter().map(|(key, value)| {
        let span = moved(value.span(), start);
        let value = Spanned::new(span, node_of(value, start, fault));
        (key.get_ref().to_string(), Entry { key: moved(key.span(), start), value })
    });
    Tree(entries.collect())
}

fn node_of(
    value: Spanned<DeValue<'_>>,
    start: usize,
    fault: &mut dyn FnMut(&toml::de::Error),
) -> Node {
    let span = value.span();
    match value.into_inner() {
        DeValue::Table(table) => Node::Table(table_of(table, start, fault)),
        DeValue::Array(items) => {
            let items = items.into_iter().map(|item| {
                let span = moved(item.span(), start);
                Spanned::new(span, node_of(item, start, fault))
            });
            Node::Array(items.collect())
        }
        leaf @ (DeValue::String(_)
        | DeValue::Integer(_)
        | DeValue::Float(_)
        | DeValue::Boolean(_)
        | DeValue::Datetime(_)) => {
            let leaf = ValueDeserializer::from(Spanned::new(span, leaf));
            match toml::Value::deserialize(leaf) {
                Ok(value) => Node::Leaf(value),
                Err(error) => {
                    fault(&error);
                    Node::Leaf(toml::Value::Boolean(false))
                }
            }
        }
    }
}
