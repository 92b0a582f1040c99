//! TOML files that stand alone: the files of a domain folder.

use schemars::{JsonSchema, SchemaGenerator};
use serde::de::DeserializeOwned;

use super::bounds::bound_numbers;
use super::check::check;
use super::problem::SettingsProblem;
use super::sources::{LayerOrigin, Sources};
use super::tree::Tree;
use crate::mismatch::Mismatch;

/// A TOML file that is laid over nothing, with the place of every key.
#[derive(Debug, Clone, PartialEq)]
pub struct TomlFile {
    name: String,
    tree: Tree,
    sources: Sources,
}

impl TomlFile {
    /// Parses a text; `name` is the file's in messages.
    ///
    /// # Errors
    /// Every mistake of syntax, with its place.
    pub fn parse(name: &str, text: &str) -> Result<Self, Vec<SettingsProblem>> {
        let mut sources = Sources::default();
        let tree = Tree::parse(&mut sources, LayerOrigin::File(name.to_owned()), text)?;
        Ok(Self { name: name.to_owned(), tree, sources })
    }

    /// The file as a type.
    ///
    /// # Errors
    /// Every unknown and missing key and every value of the wrong kind, each at its place; else the
    /// first value that the type does not take.
    pub fn read<T: DeserializeOwned + JsonSchema>(&self) -> Result<T, Vec<SettingsProblem>> {
        let mut schema = SchemaGenerator::default().into_root_schema_for::<T>().to_value();
        bound_numbers(&mut schema);
        let problems = check(&schema, (&self.tree, ""), &self.sources, &self.name);
        if !problems.is_empty() {
            return Err(problems);
        }
        serde_path_to_error::deserialize(self.tree.plain()).map_err(|error| {
            let path = error.path().to_string();
            vec![self.problem(&path, error.into_inner().message())]
        })
    }

    /// A mismatch at the place of its key. In an array of tables, a part of the key may be the name
    /// of an item: `type.block.naming`.
    pub fn located(&self, Mismatch { at, expected, got }: Mismatch) -> SettingsProblem {
        self.problem(&at, &format!("expected {expected}, got {got}"))
    }

    fn problem(&self, key: &str, message: &str) -> SettingsProblem {
        match self.tree.nearest_span(key) {
            Some(span) => SettingsProblem::at(&self.sources, &span, key, message),
            None => SettingsProblem::of_file(&self.name, key, message),
        }
    }
}
