//! Where shipped run files and domains are found: beside the file that names them, in the working
//! directory, in the binary.

use std::path::Path;

use super::ConfigError;
use crate::files::{FileRef, Folder, shipped_domains, shipped_names, shipped_sweeps};
use crate::mismatch::Mismatch;
use crate::settings::{did_you_mean, near_hint};

/// Finds a run file by its path, or by the name of a shipped one. `beside` is the folder of the file
/// that names it.
///
/// # Errors
/// A sentence that says what there is.
pub(super) fn find_run_file(name: &str, beside: Option<&Folder>) -> Result<FileRef, String> {
    find(name, beside, ("configs", &shipped_names()))
}

/// Finds a sweep file as it is given on the command line: by its path, or by the name of a shipped one.
///
/// # Errors
/// A sentence that says what there is.
pub(crate) fn find_sweep(path: &Path) -> Result<FileRef, String> {
    match path.to_str() {
        Some(name) => find(name, None, ("configs/sweeps", &shipped_sweeps())),
        None => on_disk(path),
    }
}

/// Finds a file by its path, or by its name in a shipped folder.
fn find(
    name: &str,
    beside: Option<&Folder>,
    (folder, names): (&str, &[String]),
) -> Result<FileRef, String> {
    let here = Folder::Disk("".into());
    let shipped = Folder::Embedded(folder.to_owned());
    let with_ending = format!("{name}.toml");
    let places = beside.into_iter().chain([&here]);
    let mut candidates: Vec<FileRef> =
        places.flat_map(|folder| [folder.file(name), folder.file(&with_ending)]).collect();
    candidates.push(here.below(folder).file(&with_ending));
    candidates.push(shipped.file(&with_ending));
    let below = name.strip_prefix(folder).and_then(|name| name.strip_prefix('/'));
    candidates.push(shipped.file(below.unwrap_or(name)));
    if let Some(found) = candidates.into_iter().find(FileRef::exists) {
        return Ok(found.normal());
    }
    let known = names.iter().map(String::as_str);
    Err(match did_you_mean(name.trim_end_matches(".toml"), known) {
        Some(near) => format!("no such file; did you mean the shipped \"{near}\"?"),
        None => format!("no such file; shipped are {}", names.join(", ")),
    })
}

/// Finds a domain folder by its path or name. `beside` is the folder of the file that names it.
pub(super) fn find_domain(name: &str, beside: &Folder) -> Option<Folder> {
    let here = Folder::Disk("".into());
    let below_domains = name.strip_prefix("domains/").unwrap_or(name).trim_end_matches('/');
    let shipped = Folder::Embedded(format!("domains/{below_domains}"));
    let mut candidates = Vec::new();
    for place in [beside, &here] {
        let Folder::Disk(path) = place else {
            candidates.push(shipped.clone());
            continue;
        };
        candidates.push(place.below(name));
        candidates.push(place.below("domains").below(name));
        candidates.extend(path.parent().map(|p| Folder::Disk(p.join("domains").join(name))));
    }
    candidates.push(shipped);
    candidates.into_iter().find(|folder| folder.file("domain.pddl").exists())
}

/// A domain folder as it is given on the command line: its path, or the name of a shipped one.
///
/// # Errors
/// [`ConfigError::Mismatch`] with the names of the shipped ones.
pub(crate) fn given_domain(path: &Path) -> Result<Folder, ConfigError> {
    let here = Folder::default();
    match path.to_str() {
        Some(name) => find_domain(name, &here).ok_or_else(|| no_domain("--domain", name)),
        None => Ok(Folder::Disk(path.to_owned())),
    }
}

/// There is no such domain; `key` names it.
pub(super) fn no_domain(key: &str, name: &str) -> ConfigError {
    let shipped = shipped_domains();
    let list = shipped.join(", ");
    let expected = format!("a folder with a domain.pddl, or the name of a shipped domain ({list})");
    let near = near_hint(name, shipped.iter().map(String::as_str));
    Mismatch::new(key, expected, format!("{name}{near}")).into()
}

/// A run file as it is given on the command line.
///
/// # Errors
/// As [`find_run_file`].
pub(super) fn find_given(path: &Path) -> Result<FileRef, String> {
    match path.to_str() {
        Some(name) => find_run_file(name, None),
        None => on_disk(path),
    }
}

/// A file whose path is no text.
fn on_disk(path: &Path) -> Result<FileRef, String> {
    if path.is_file() { Ok(FileRef::disk(path)) } else { Err("no such file".to_owned()) }
}
