//! A domain to start from: a small folder that explains itself, with its run file.

use std::fs;
use std::path::{Path, PathBuf};

use crate::files::{shipped_domains, shipped_names};
use crate::mismatch::{Mismatch, quoted};
use crate::pddl::Name;
use crate::run::ConfigError;

/// What stands for the domain's name in the files.
const PLACEHOLDER: &str = "NAME";

/// The files of the folder.
const FILES: [(&str, &str); 12] = [
    ("domain.pddl", include_str!("skeleton/domain.pddl")),
    ("completion.pddl", include_str!("skeleton/completion.pddl")),
    ("perception.toml", include_str!("skeleton/perception.toml")),
    ("language.toml", include_str!("skeleton/language.toml")),
    ("skills.toml", include_str!("skeleton/skills.toml")),
    ("problems/two-blocks.pddl", include_str!("skeleton/problems/two-blocks.pddl")),
    ("scenes/evaluation.toml", include_str!("skeleton/scenes/evaluation.toml")),
    ("scenes/labels.toml", include_str!("skeleton/scenes/labels.toml")),
    ("scenes/start.toml", include_str!("skeleton/scenes/start.toml")),
    ("scenes/exemplar/a_tower.toml", include_str!("skeleton/scenes/exemplar/a_tower.toml")),
    ("scenes/exemplar/b_beside.toml", include_str!("skeleton/scenes/exemplar/b_beside.toml")),
    ("scenes/exemplar/c_behind.toml", include_str!("skeleton/scenes/exemplar/c_behind.toml")),
];

/// Its run file, beside the folder.
const RUN_FILE: &str = include_str!("skeleton/run.toml");

/// The set-up of its camera: the folder of labelled examples that its run file names.
pub const SET_UP: &str = "sim_640x480";

/// A domain that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewDomain {
    /// Its folder.
    pub folder: PathBuf,
    /// Its run file.
    pub run_file: PathBuf,
}

/// Writes the skeleton of a domain: the folder `NAME` and the run file `NAME.toml`. It has no labelled examples
/// yet.
///
/// # Errors
/// [`ConfigError`]: a name that is no name of a domain, or taken; what cannot be written.
pub fn write_skeleton(name: &str, beside: &Path) -> Result<NewDomain, ConfigError> {
    let folder = beside.join(name);
    let run_file = beside.join(format!("{name}.toml"));
    check_name(name)?;
    for path in [&folder, &run_file] {
        if path.exists() {
            let reason = "it is there already; take another name, or another folder with --in";
            return Err(fault(path, &reason));
        }
    }
    for (file, text) in FILES {
        write(&folder.join(file), &text.replace(PLACEHOLDER, name))?;
    }
    write(&run_file, &RUN_FILE.replace(PLACEHOLDER, name))?;
    Ok(NewDomain { folder, run_file })
}

/// A name must be one of PDDL and of a file, and none that a shipped domain or run file has.
fn check_name(name: &str) -> Result<(), ConfigError> {
    let is_name = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "-_".contains(c))
        && Name::new(name).as_str() == name;
    if !is_name {
        let expected = "a small letter, then small letters, digits, - and _";
        return Err(Mismatch::new("NAME", expected, quoted(name)).into());
    }
    if shipped_domains().iter().chain(&shipped_names()).any(|taken| taken == name) {
        let expected = "a name that no shipped domain or run file has";
        return Err(Mismatch::new("NAME", expected, quoted(name)).into());
    }
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<(), ConfigError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|e| fault(folder, &e))?;
    }
    fs::write(path, text).map_err(|e| fault(path, &e))
}

fn fault(path: &Path, reason: &dyn std::fmt::Display) -> ConfigError {
    ConfigError::File { path: path.display().to_string(), reason: reason.to_string() }
}
