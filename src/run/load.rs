//! Reading run files: the defaults, the files that a file extends, the file, `--set`.

use std::path::Path;
use std::sync::Arc;

use serde::de::DeserializeOwned;

use super::find::{find_given, find_run_file};
use super::schema::run_schema;
use super::{ConfigError, RunConfig};
use crate::files::FileRef;
use crate::mismatch::Mismatch;
use crate::pddl::SourceText;
use crate::settings::{Form, Layer, LayerOrigin, Layers, SettingsProblem};

/// Most files that extend one another.
const EXTENDS_MAX: usize = 16;

/// Reads a text file.
///
/// # Errors
/// [`ConfigError::File`] naming the file.
pub fn read_text(path: &Path) -> Result<String, ConfigError> {
    Ok(FileRef::disk(path).text()?)
}

/// Reads a PDDL file, in any encoding that [`SourceText::decode`] knows.
///
/// # Errors
/// [`ConfigError::File`] naming the file, [`ConfigError::Pddl`] naming line and column.
pub fn read_pddl(path: &Path) -> Result<SourceText, ConfigError> {
    Ok(SourceText::decode(path.display().to_string(), FileRef::disk(path).bytes()?)?)
}

/// A file with all that it is laid over, before it is read as a type.
#[derive(Debug, Clone, PartialEq)]
pub struct Layered {
    /// The file that was asked for, on top of the others.
    pub file: FileRef,
    /// The defaults, the files that it extends, the file itself, and every `--set`.
    pub layers: Layers,
}

impl Layered {
    /// The same for a run file or the file of a stress test, whichever it is.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_any(path: &Path, sets: &[String]) -> Result<Self, ConfigError> {
        let text = given(path)?.text()?;
        let has_cases = text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("case"));
        Self::read(path, sets, if has_cases { Form::Stress } else { Form::Run })
    }

    /// Finds a file by its path or as a shipped one, and lays it over what it extends.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file; [`ConfigError::Problems`] for bad syntax, with every place.
    pub fn read(path: &Path, sets: &[String], form: Form) -> Result<Self, ConfigError> {
        let file = given(path)?;
        let mut layers = Layers::defaults(form)?;
        let mut chain: Vec<(FileRef, Layer)> = Vec::new();
        let mut next = Some(file.clone());
        while let Some(file) = next.take() {
            let layer = layers.parse(LayerOrigin::File(file.to_string()), &file.text()?)?;
            if let Some(base) = layer.string("extends") {
                let fault = |reason: String| {
                    vec![layers.fault_in(&layer, "extends", format!("{base}: {reason}"))]
                };
                let found = find_run_file(base, Some(&file.folder)).map_err(fault)?;
                let seen = chain.iter().map(|(file, _)| file).chain([&file]);
                if seen.clone().any(|seen| *seen == found) {
                    let names: Vec<String> =
                        seen.chain([&found]).map(ToString::to_string).collect();
                    return Err(fault(format!("a circle: {}", names.join(" extends "))).into());
                }
                if chain.len() >= EXTENDS_MAX {
                    return Err(fault(format!("more than {EXTENDS_MAX} files in a row")).into());
                }
                next = Some(found);
            }
            chain.push((file, layer));
        }
        chain.into_iter().rev().for_each(|(_, layer)| layers.lay(layer));
        for set in sets {
            layers.set(set)?;
        }
        layers.fill_cases();
        Ok(Self { file, layers })
    }

    /// The settings as a run file.
    ///
    /// # Errors
    /// [`ConfigError::Problems`]: everything that is wrong, each at its place.
    pub fn run(&self) -> Result<RunConfig, ConfigError> {
        let mut run = self.typed(&run_schema(), RunConfig::mismatches)?;
        self.file.clone_into(&mut run.origin);
        run.resolved = self.layers.plain().to_string();
        run.layers = Some(Arc::new(self.layers.clone()));
        Ok(run)
    }

    /// The settings as a type.
    ///
    /// # Errors
    /// [`ConfigError::Problems`]: everything that is wrong, each at its place.
    pub(crate) fn typed<T: DeserializeOwned>(
        &self,
        schema: &serde_json::Value,
        mismatches: impl Fn(&T) -> Vec<Mismatch>,
    ) -> Result<T, ConfigError> {
        let file = self.file.to_string();
        let problems = self.layers.problems(schema, &file);
        if !problems.is_empty() {
            return Err(problems.into());
        }
        let value: T = self.layers.read(&file).map_err(|problem| vec![problem])?;
        let located = mismatches(&value).into_iter();
        let problems: Vec<SettingsProblem> =
            located.map(|m| self.layers.located(m, &file)).collect();
        if problems.is_empty() { Ok(value) } else { Err(problems.into()) }
    }
}

fn given(path: &Path) -> Result<FileRef, ConfigError> {
    find_given(path)
        .map_err(|reason| ConfigError::File { path: path.display().to_string(), reason })
}

/// Reads a run file by its path, or a shipped one by its name, and applies `key=value` settings over
/// it, in order.
///
/// # Errors
/// [`ConfigError`]: everything that is wrong with its keys and values, each with file and line.
pub fn load_run(path: &Path, sets: &[String]) -> Result<RunConfig, ConfigError> {
    let layered = Layered::read(path, sets, Form::Run)?;
    for warning in &layered.layers.warnings {
        tracing::warn!("{warning}");
    }
    layered.run()
}
