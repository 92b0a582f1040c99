//! Labelled examples: predicates that no example of a camera shows, one way or the other.

use super::folder_files::FolderFiles;
use super::{DomainFinding, DomainFindingKind};
use crate::perception::model::Exemplar;
use crate::perception::self_check::{TaughtPredicate, taught};
use crate::run::{ConfigError, DomainFolder, ExemplarConfig};

pub(super) fn check(files: &FolderFiles<'_>, findings: &mut Vec<DomainFinding>) {
    // What keeps the folder from being read is told already.
    let Ok(domain) = DomainFolder::read_files(files.folder) else { return };
    let set_ups = files.folder.below("exemplar").folder_names();
    if set_ups.is_empty() {
        findings.push(files.finding(
            DomainFindingKind::NoExample,
            ("exemplar", ""),
            "there are no labelled examples, so nothing can be seen: make those of scenes/exemplar with \
             groundloop exemplar render RUNFILE --folder NAME",
        ));
    }
    for set_up in set_ups {
        let at = format!("exemplar/{set_up}");
        match ExemplarConfig::in_folder(&set_up).read(&domain, None) {
            Ok(examples) => {
                let exemplars: Vec<&Exemplar> = examples.iter().map(|(_, e)| e).collect();
                for taught in taught(&domain.domain, &domain.perception, &exemplars) {
                    untaught(files, &at, &taught, findings);
                }
            }
            Err(error) => findings.push(unreadable(files, &at, &error)),
        }
    }
}

fn unreadable(files: &FolderFiles<'_>, at: &str, error: &ConfigError) -> DomainFinding {
    let message = format!("{error}; render the examples anew where the domain has changed since");
    files.finding(DomainFindingKind::Unreadable, (at, ""), message)
}

fn untaught(
    files: &FolderFiles<'_>,
    at: &str,
    TaughtPredicate { predicate, n_positive, n_negative }: &TaughtPredicate,
    findings: &mut Vec<DomainFinding>,
) {
    for (n, not) in [(n_positive, ""), (n_negative, " not")] {
        if *n == 0 {
            findings.push(files.finding(
                DomainFindingKind::PredicateUntaught,
                (at, predicate.as_str()),
                format!(
                    "no labelled example shows {predicate}{not} to hold: add a scene to scenes/exemplar \
                     that does, and render the examples anew"
                ),
            ));
        }
    }
}
