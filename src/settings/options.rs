//! The options of parts: `[perception.options]`, `[goal.options]` and `[planner.options]`.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::DeserializeOwned;
use toml::Spanned;

use super::bounds::bound_numbers;
use super::check::check;
use super::layers::{Form, Layers};
use super::problem::SettingsProblem;
use super::renamed::rename;
use super::sources::{LayerOrigin, Sources};
use super::tree::{Entry, Node, Tree};

/// The schema of a part's options.
type OptionsSchema = fn(&mut SchemaGenerator) -> Schema;

/// Options of a part from a file of their own, over the part's defaults.
///
/// `within` is where they stand in a run file: `perception.options`.
///
/// # Errors
/// Everything that is wrong with the file, at its place.
pub fn options_file(
    (within, part, schema): (&str, &str, OptionsSchema),
    file: &str,
    text: &str,
) -> Result<toml::Table, Vec<SettingsProblem>> {
    let mut sources = Sources::default();
    let tree = Tree::parse(&mut sources, LayerOrigin::File(file.to_owned()), text)?;
    laid((within, part), tree, &mut sources, &schema_of(schema), file)
}

/// A part's options as it declares them: what is given, over the part's defaults.
///
/// # Errors
/// Everything that is wrong, each with its key.
pub fn read_options<T: DeserializeOwned + JsonSchema>(
    within: &str,
    part: &str,
    given: &toml::Table,
) -> Result<T, String> {
    let mut sources = Sources::default();
    let given = plain_tree(given);
    let schema = schema_of(SchemaGenerator::subschema_for::<T>);
    let table = laid((within, part), given, &mut sources, &schema, "").map_err(|problems| {
        let said = problems.iter().map(SettingsProblem::keyed);
        said.collect::<Vec<_>>().join("; ")
    })?;
    serde_path_to_error::deserialize(table).map_err(|error| {
        let path = error.path().to_string();
        format!("{within}.{path}: {}", error.into_inner().message())
    })
}

fn schema_of(schema: OptionsSchema) -> serde_json::Value {
    let mut generator = SchemaGenerator::default();
    let mut schema = schema(&mut generator).to_value();
    if let Some(object) = schema.as_object_mut() {
        object.insert("$defs".to_owned(), generator.take_definitions(true).into());
    }
    bound_numbers(&mut schema);
    schema
}

/// The default options of a part.
pub fn default_options(within: &str, part: &str) -> toml::Table {
    Layers::defaults(Form::Run)
        .map(|defaults| defaults.options_of(within, part).plain())
        .unwrap_or_default()
}

fn laid(
    (within, part): (&str, &str),
    mut tree: Tree,
    sources: &mut Sources,
    schema: &serde_json::Value,
    file: &str,
) -> Result<toml::Table, Vec<SettingsProblem>> {
    let mut problems = Vec::new();
    rename(&mut tree, &format!("{within}."), sources, &mut problems);
    for warning in problems.iter().filter(|problem| problem.is_warning) {
        tracing::warn!("{}", warning.keyed());
    }
    problems.retain(|problem| !problem.is_warning);
    let mut all = Layers::defaults(Form::Run)?.options_of(within, part);
    all.lay(tree);
    problems.extend(check(schema, (&all, within), sources, file));
    if problems.is_empty() { Ok(all.plain()) } else { Err(problems) }
}

/// A table that was never a text.
fn plain_tree(table: &toml::Table) -> Tree {
    let entry = |(key, value): (&String, &toml::Value)| {
        (key.clone(), Entry { key: 0..0, value: Spanned::new(0..0, plain_node(value)) })
    };
    Tree(table.iter().map(entry).collect())
}

fn plain_node(value: &toml::Value) -> Node {
    match value {
        toml::Value::Table(table) => Node::Table(plain_tree(table)),
        toml::Value::Array(items) => {
            Node::Array(items.iter().map(|i| Spanned::new(0..0, plain_node(i))).collect())
        }
        leaf @ (toml::Value::String(_)
        | toml::Value::Integer(_)
        | toml::Value::Float(_)
        | toml::Value::Boolean(_)
        | toml::Value::Datetime(_)) => Node::Leaf(leaf.clone()),
    }
}
