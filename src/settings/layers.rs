//! Layers laid over one another, and read into a type.

use serde::de::DeserializeOwned;
use serde_json::Value as Json;

use super::check::check;
use super::choices::{CHOICES, Shelf, replace_alternatives};
use super::problem::SettingsProblem;
use super::renamed::rename;
use super::sources::{LayerOrigin, Sources, Written};
use super::tree::{Entry, Node, Tree, value_of};
use super::{DEFAULTS, show};
use crate::mismatch::Mismatch;

/// Below these keys of the defaults stands what no run file has: the options of parts, and the keys
/// of stress files.
const OPTIONS: &str = "options";
const STRESS: &str = "stress";
/// The array of a stress file whose items have defaults, and the table that each of them may change.
const CASE: &str = "case";
const PLANNER: &str = "planner";

/// What a file is read as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// A run file.
    Run,
    /// The file of a stress test.
    Stress,
}

/// One text, parsed, before it is laid over others.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer(pub(super) Tree);

impl Layer {
    /// The string at a dotted key.
    pub fn string(&self, key: &str) -> Option<&str> {
        self.0.string(key)
    }
}

/// Settings laid over one another so far, the defaults first.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    form: Form,
    pub(super) tree: Tree,
    shelf: Shelf,
    /// The defaults of each `[[case]]` of a stress file.
    case: Option<Entry>,
    sources: Sources,
    /// What is odd, such as old names of keys.
    pub warnings: Vec<SettingsProblem>,
}

impl Layers {
    /// The defaults alone.
    ///
    /// # Errors
    /// The defaults are no TOML, which a test keeps from happening.
    pub fn defaults(form: Form) -> Result<Self, Vec<SettingsProblem>> {
        let mut sources = Sources::default();
        let mut tree = Tree::parse(&mut sources, LayerOrigin::Default, DEFAULTS)?;
        let mut shelf = Shelf::default();
        let options = tree.remove(OPTIONS);
        if let Some(Node::Table(options)) = options.map(|entry| entry.value.into_inner()) {
            for choice in CHOICES {
                let parts = options.get(choice.role).map(|entry| entry.value.get_ref());
                let Some(Node::Table(parts)) = parts else { continue };
                for (part, entry) in &parts.0 {
                    shelf.keep(choice, part, choice.options, shared(entry, &options));
                }
            }
        }
        let stress = tree.remove(STRESS).map(|entry| entry.value.into_inner());
        let mut case = None;
        if let (Form::Stress, Some(Node::Table(mut stress))) = (form, stress) {
            case = stress.remove(CASE);
            for key in ["seed", "planner"] {
                tree.remove(key).into_iter().for_each(|entry| stress.insert(key, entry));
            }
            tree = stress;
        }
        Ok(Self { form, tree, shelf, case, sources, warnings: Vec::new() })
    }

    /// Parses a text and gives its keys their present names.
    ///
    /// # Errors
    /// Every mistake of syntax; keys that are there under two names.
    pub fn parse(
        &mut self,
        origin: LayerOrigin,
        text: &str,
    ) -> Result<Layer, Vec<SettingsProblem>> {
        let mut tree = Tree::parse(&mut self.sources, origin, text)?;
        self.renamed(&mut tree, "").map(|()| Layer(tree))
    }

    /// Lays a text over what there is.
    pub fn lay(&mut self, layer: Layer) {
        self.shelf.change(&mut self.tree, &layer.0);
        replace_alternatives(&mut self.tree, &layer.0);
        self.tree.lay(layer.0);
    }

    /// Gives each `[[case]]` of a stress file its defaults, and what it does not say of its own planner.
    pub fn fill_cases(&mut self) {
        let planner = self.tree.get(PLANNER).cloned();
        let cases = self.tree.0.get_mut(CASE).map(|entry| entry.value.get_mut());
        let Some(Node::Array(cases)) = cases else { return };
        for case in cases {
            let Node::Table(own) = case.get_mut() else { continue };
            let defaults = self.case.as_ref().map(|entry| entry.value.get_ref());
            let mut all =
                if let Some(Node::Table(all)) = defaults { all.clone() } else { Tree::default() };
            all.0.extend(planner.clone().map(|entry| (PLANNER.to_owned(), entry)));
            self.shelf.clone().change(&mut all, own);
            all.lay(std::mem::take(own));
            *own = all;
        }
    }

    /// Lays one `key=value` over what there is; the value is TOML, or else a plain string.
    ///
    /// # Errors
    /// It is no `key=value`.
    pub fn set(&mut self, set: &str) -> Result<(), Vec<SettingsProblem>> {
        let fault = |why: &str| vec![SettingsProblem::of_set(set, why)];
        let (key, value) = set.split_once('=').ok_or_else(|| fault("expected key=value"))?;
        let trimmed = key.trim();
        if trimmed.split('.').any(|part| part.trim().is_empty()) {
            return Err(fault("empty key"));
        }
        let start = self.sources.add(LayerOrigin::Set(set.to_owned()), set);
        let blanks = value.len() - value.trim_start().len();
        let value = value_of(value.trim(), start + key.len() + 1 + blanks);
        let mut tree = Tree::default();
        tree.insert(trimmed, Entry { key: start..start + key.len(), value });
        self.renamed(&mut tree, "")?;
        self.lay(Layer(tree));
        Ok(())
    }

    fn renamed(&mut self, tree: &mut Tree, within: &str) -> Result<(), Vec<SettingsProblem>> {
        let mut problems = Vec::new();
        rename(tree, within, &self.sources, &mut problems);
        let (warnings, errors): (Vec<_>, Vec<_>) =
            problems.into_iter().partition(|problem| problem.is_warning);
        self.warnings.extend(warnings);
        if errors.is_empty() { Ok(()) } else { Err(errors) }
    }

    /// Everything that is wrong with the keys and the kinds of values, in the order of the texts.
    /// `file` is named for keys that are missing in tables that no text has.
    pub fn problems(&self, schema: &Json, file: &str) -> Vec<SettingsProblem> {
        check(schema, (&self.tree, ""), &self.sources, file)
    }

    /// The settings as a type.
    ///
    /// # Errors
    /// The first value that the type does not take, at its place.
    pub fn read<T: DeserializeOwned>(&self, file: &str) -> Result<T, SettingsProblem> {
        serde_path_to_error::deserialize(self.tree.plain()).map_err(|error| {
            let path = error.path().to_string();
            let message = error.into_inner().message().to_owned();
            self.fault(&path, message, file)
        })
    }

    /// A problem with a key, at the place of its value, or of the nearest table above it; else in
    /// `file`.
    pub fn fault(&self, key: &str, message: impl Into<String>, file: &str) -> SettingsProblem {
        let mut at = key;
        loop {
            let span = self.tree.span_of(at);
            if let Some(span) = span.filter(|span| !self.sources.is_default(span)) {
                return SettingsProblem::at(&self.sources, &span, key, message);
            }
            match at.rsplit_once('.') {
                Some((above, _)) => at = above,
                None => return SettingsProblem::of_file(file, key, message),
            }
        }
    }

    /// The default options of a part, and nothing else.
    pub(super) fn options_of(mut self, within: &str, part: &str) -> Tree {
        let choice = CHOICES.iter().find(|choice| choice.options == within);
        let entry = choice.and_then(|choice| self.shelf.take(choice, part, choice.options));
        match entry.map(|entry| entry.value.into_inner()) {
            Some(Node::Table(table)) => table,
            Some(_) | None => Tree::default(),
        }
    }

    /// A mismatch at the place of its key.
    pub fn located(&self, Mismatch { at, expected, got }: Mismatch, file: &str) -> SettingsProblem {
        self.fault(&at, format!("expected {expected}, got {got}"), file)
    }

    /// What the settings are read as.
    pub fn form(&self) -> Form {
        self.form
    }

    /// Every key that holds a plain value or an array, and where it was written.
    pub fn origins(&self) -> Vec<(String, Written)> {
        let mut found = Vec::new();
        self.tree.each_leaf("", &mut |key, span| {
            found.extend(self.sources.written(span).map(|written| (key.to_owned(), written)));
        });
        found
    }

    /// A problem with a key of a layer that is not laid yet.
    pub fn fault_in(
        &self,
        layer: &Layer,
        key: &str,
        message: impl Into<String>,
    ) -> SettingsProblem {
        let span = layer.0.span_of(key).unwrap_or_default();
        SettingsProblem::at(&self.sources, &span, key, message)
    }

    /// Where a key was written.
    pub fn written(&self, key: &str) -> Option<Written> {
        self.sources.written(&self.tree.get(key)?.key)
    }

    /// The settings as TOML, each with its origin.
    pub fn show(&self, schema: &Json) -> String {
        show::toml(schema, &self.tree, &self.sources)
    }

    /// The settings as plain values.
    pub fn plain(&self) -> toml::Table {
        self.tree.plain()
    }
}

/// The options of a part with those that it shares with others: `shared = ["retry"]` stands for the
/// table `[options.retry]`.
fn shared(entry: &Entry, options: &Tree) -> Entry {
    let mut entry = entry.clone();
    let Node::Table(table) = entry.value.get_mut() else { return entry };
    let names = table.remove("shared").map(|names| names.value.get_ref().plain());
    for name in names.iter().filter_map(toml::Value::as_array).flatten() {
        let found = name.as_str().and_then(|name| Some((name, options.get(name)?)));
        if let Some((name, found)) = found {
            table.insert(name, found.clone());
        }
    }
    entry
}
