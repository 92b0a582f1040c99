//! Reading run files: syntax, `--set`, and the line of every error.

use std::path::Path;

use toml_edit::{DocumentMut, Item, Table};

use super::{ConfigError, RunConfig};

/// Reads a text file.
///
/// # Errors
/// [`ConfigError::File`] naming the file.
pub fn read_text(path: &Path) -> Result<String, ConfigError> {
    std::fs::read_to_string(path)
        .map_err(|e| ConfigError::File { path: path.display().to_string(), reason: e.to_string() })
}

/// Reads a run file and applies `key=value` settings over it, in order.
///
/// # Errors
/// [`ConfigError`] naming file and line for bad syntax, unknown keys and wrong types.
pub fn load_run(path: &Path, sets: &[String]) -> Result<RunConfig, ConfigError> {
    let text = read_text(path)?;
    // With --set, lines in messages are those of the text with the settings in it.
    let with = if sets.is_empty() { "" } else { " with --set" };
    let name = format!("{}{with}", path.display());
    let fault = |message: String| ConfigError::Toml { path: name.clone(), message };
    let mut document: DocumentMut =
        text.parse().map_err(|e: toml_edit::TomlError| fault(e.to_string()))?;
    for set in sets {
        apply(&mut document, set)?;
    }
    // Without --set the text is parsed as it stands, so that lines in messages are the file's.
    let text = if sets.is_empty() { text } else { document.to_string() };
    let mut run: RunConfig = toml::from_str(&text).map_err(|e| fault(e.to_string()))?;
    path.clone_into(&mut run.origin);
    run.resolved = text;
    run.check()?;
    Ok(run)
}

/// Applies one `a.b=value`; the value is TOML, or else a plain string.
fn apply(document: &mut DocumentMut, set: &str) -> Result<(), ConfigError> {
    let fault = |reason: &str| ConfigError::Set { text: set.to_owned(), reason: reason.to_owned() };
    let (key, text) = set.split_once('=').ok_or_else(|| fault("expected key=value"))?;
    let value: toml_edit::Value =
        text.trim().parse().unwrap_or_else(|_| toml_edit::Value::from(text.trim()));
    let mut parts: Vec<&str> = key.trim().split('.').collect();
    let last = parts.pop().filter(|last| !last.is_empty()).ok_or_else(|| fault("empty key"))?;
    let mut item: &mut Item = document.as_item_mut();
    for part in parts {
        let table = item.as_table_like_mut().ok_or_else(|| fault("not a table"))?;
        if !table.contains_key(part) {
            table.insert(part, Item::Table(Table::new()));
        }
        item = table.get_mut(part).ok_or_else(|| fault("not a table"))?;
    }
    let table = item.as_table_like_mut().ok_or_else(|| fault("not a table"))?;
    table.insert(last, Item::Value(value));
    Ok(())
}
