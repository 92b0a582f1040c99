//! What is missing in a domain folder, or at odds with another of its files.
//!
//! A folder that can be read can still describe a task that never gets anywhere: a type that nobody sees, a
//! predicate that nobody ever says to hold. Each such thing is told by file and field, with what to change.

mod finding;
mod folder_files;
mod sources;
mod words;
mod scenes;
mod examples;

pub use finding::{DomainFinding, DomainFindingKind};

use crate::files::Folder;
use folder_files::FolderFiles;

/// Checks a domain folder; nothing for one in which all goes together.
///
/// Scenes, skills and labelled examples are asked for where the folder has `scenes/`: a domain without is for
/// photographs.
pub fn check_domain(folder: &Folder) -> Vec<DomainFinding> {
    let mut findings = Vec::new();
    let Some(files) = FolderFiles::read(folder, &mut findings) else { return findings };
    sources::check(&files, &mut findings);
    words::check(&files, &mut findings);
    if files.is_simulated {
        scenes::check(&files, &mut findings);
        examples::check(&files, &mut findings);
    }
    findings
}
