//! Simulated scenes: types without a body, predicates that nothing labels.

use std::collections::BTreeSet;

use super::folder_files::FolderFiles;
use super::{DomainFinding, DomainFindingKind};
use crate::files::{FileRef, Folder};
#[cfg(feature = "sim")]
use crate::parts::PartError;
#[cfg(feature = "sim")]
use crate::run::ConfigError;

const LABELS: &str = "scenes/labels.toml";

pub(super) fn check(files: &FolderFiles<'_>, findings: &mut Vec<DomainFinding>) {
    let Some(perception) = &files.perception else { return };
    let kinds = body_kinds(files, findings);
    for spec in perception.types.iter().filter(|spec| !kinds.contains(spec.name.as_str())) {
        let name = &spec.name;
        let found = kinds.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
        findings.push(files.finding(
            DomainFindingKind::TypeWithoutBody,
            ("scenes", "bodies"),
            format!(
                "no scene has a body of the type {name}, only {found}: add one, or call the type in \
                 domain.pddl and perception.toml as the simulator calls its shape"
            ),
        ));
    }
    let file = files.folder.file(LABELS);
    let labels = tables(&file, "label", findings);
    let labelled: BTreeSet<&str> =
        labels.iter().filter_map(|label| label.get("predicate")?.as_str()).collect();
    for name in perception.observed_predicates().filter(|name| !labelled.contains(name.as_str())) {
        findings.push(files.finding(
            DomainFindingKind::PredicateWithoutLabel,
            (LABELS, "label"),
            format!(
                "nothing says where {name} really holds, so rendered examples cannot show it: add a \
                 [[label]] with predicate = \"{name}\" and its relation"
            ),
        ));
    }
}

/// What the simulator calls the bodies of all scenes.
fn body_kinds(files: &FolderFiles<'_>, findings: &mut Vec<DomainFinding>) -> BTreeSet<String> {
    let mut kinds = BTreeSet::new();
    for folder in ["scenes", "scenes/exemplar"] {
        let folder: Folder = files.folder.below(folder);
        for name in folder.names(".toml").unwrap_or_default() {
            let file = folder.file(&name);
            if file.to_string() == files.folder.file(LABELS).to_string() {
                continue;
            }
            unreadable(&file, findings);
            let bodies = tables(&file, "bodies", findings);
            let kind = |body: &toml::Value| {
                let own = body.get("type");
                let own = own.or_else(|| body.get("shape")?.get("kind"))?;
                Some(own.as_str()?.to_owned())
            };
            kinds.extend(bodies.iter().filter_map(kind));
        }
    }
    kinds
}

/// What the simulator says to a scene file: its form, and whether the scene can be built.
#[cfg(feature = "sim")]
fn unreadable(file: &FileRef, findings: &mut Vec<DomainFinding>) {
    match built(file) {
        Ok(()) => {}
        Err(ConfigError::Problems(problems) | ConfigError::Part(PartError::Problems(problems))) => {
            findings.extend(problems.iter().map(|p| DomainFinding::of_problem(p, file)));
        }
        Err(error) => {
            let message = error.to_string();
            let message = message.trim_start_matches(&format!("{file}:"));
            findings.push(DomainFinding::unreadable(file.to_string(), "", message));
        }
    }
}

/// Builds the scene of a file in a world of the defaults.
#[cfg(feature = "sim")]
fn built(file: &FileRef) -> Result<(), ConfigError> {
    use crate::hardware::sim::{ChangedScene, SimConfig};
    use crate::settings::{Form, Layers};

    let table: toml::Table = file.text()?.parse().map_err(|e: toml::de::Error| {
        ConfigError::Toml { path: file.to_string(), message: e.to_string() }
    })?;
    let mut defaults = Layers::defaults(Form::Run)?.plain();
    let mut sim = defaults.remove("sim").and_then(|sim| sim.try_into::<toml::Table>().ok());
    if let Some(sim) = &mut sim {
        sim.insert("scene".to_owned(), file.name.clone().into());
    }
    let sim = SimConfig::read(sim.as_ref(), file)?;
    Ok(ChangedScene::new(file, &table)?.check(&sim, 1)?)
}

/// Without the simulator nobody knows.
#[cfg(not(feature = "sim"))]
fn unreadable(_: &FileRef, _: &mut Vec<DomainFinding>) {}

/// The tables of an array in a TOML file; none where the file is not TOML, which is told.
fn tables(file: &FileRef, key: &str, findings: &mut Vec<DomainFinding>) -> Vec<toml::Value> {
    let text = match file.text() {
        Ok(text) => text,
        Err(error) => {
            findings.push(DomainFinding::unreadable(error.file, "", &error.reason));
            return Vec::new();
        }
    };
    let table = text.parse::<toml::Table>().unwrap_or_default();
    table.get(key).and_then(toml::Value::as_array).cloned().unwrap_or_default()
}
