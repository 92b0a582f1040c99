//! Settings as TOML, with the origin of each as a comment.

use serde_json::Value as Json;

use super::check::{properties, resolve};
use super::sources::Sources;
use super::tree::{Entry, Node, Tree};

/// Comments of one table stand below one another, unless a line is longer than this.
const COLUMN_MAX: usize = 60;

/// A table and all that is in it, in the order of the schema.
pub(super) fn toml(schema: &Json, tree: &Tree, sources: &Sources) -> String {
    let mut show = Show { root: schema, sources, text: String::new() };
    show.table(schema, tree, "");
    show.text
}

struct Show<'a> {
    root: &'a Json,
    sources: &'a Sources,
    text: String,
}

impl Show<'_> {
    fn table(&mut self, schema: &Json, tree: &Tree, path: &str) {
        let schema = resolve(self.root, schema);
        let order: Vec<&str> = properties(schema).map(|(name, _)| name).collect();
        let place = |name: &str| order.iter().position(|known| *known == name);
        let mut entries: Vec<(&String, &Entry)> = tree.0.iter().collect();
        entries.sort_by_key(|(name, _)| (place(name).unwrap_or(order.len()), *name));
        let is_table = |entry: &Entry| matches!(entry.value.get_ref(), Node::Table(_));
        let (tables, rest): (Vec<_>, Vec<_>) = entries.into_iter().partition(|e| is_table(e.1));
        let (arrays, leaves): (Vec<_>, Vec<_>) = rest.into_iter().partition(|e| is_tables(e.1));
        self.lines(&leaves);
        let child = |name: &str| properties(schema).find(|(known, _)| *known == name);
        for (name, entry) in tables {
            let Node::Table(table) = entry.value.get_ref() else { continue };
            let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            // A table that has only tables needs no heading.
            if table.0.values().any(|entry| !is_table(entry)) || table.0.is_empty() {
                self.heading(&format!("[{path}]"));
            }
            self.table(child(name).map_or(&Json::Null, |(_, schema)| schema), table, &path);
        }
        for (name, entry) in arrays {
            let Node::Array(items) = entry.value.get_ref() else { continue };
            let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            for item in items {
                self.heading(&format!("[[{path}]]"));
                if let Node::Table(table) = item.get_ref() {
                    self.lines(&table.0.iter().collect::<Vec<_>>());
                }
            }
        }
    }

    fn heading(&mut self, text: &str) {
        let gap = if self.text.is_empty() { "" } else { "\n" };
        self.text.push_str(gap);
        self.text.push_str(text);
        self.text.push('\n');
    }

    fn lines(&mut self, entries: &[(&String, &Entry)]) {
        let line = |(name, entry): &(&String, &Entry)| {
            let key = toml_key(name);
            let origin = self.sources.written(&entry.key);
            let origin = origin.map(|origin| origin.to_string()).unwrap_or_default();
            (format!("{key} = {}", entry.value.get_ref().plain()), origin)
        };
        let lines: Vec<(String, String)> = entries.iter().map(line).collect();
        let widths = lines.iter().map(|(text, _)| text.chars().count());
        let width = widths.filter(|width| *width <= COLUMN_MAX).max().unwrap_or(0);
        for (text, origin) in lines {
            self.text.extend([format!("{text:width$}  # {origin}\n")]);
        }
    }
}

fn is_tables(entry: &Entry) -> bool {
    match entry.value.get_ref() {
        Node::Array(items) => {
            !items.is_empty() && items.iter().all(|i| matches!(i.get_ref(), Node::Table(_)))
        }
        Node::Leaf(_) | Node::Table(_) => false,
    }
}

/// A key as TOML writes it.
fn toml_key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(is_bare) {
        return name.to_owned();
    }
    toml::Value::String(name.to_owned()).to_string()
}
