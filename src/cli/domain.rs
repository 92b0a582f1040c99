//! `groundloop domain`: domain folders, checked.

use std::path::PathBuf;

use super::reports::DomainCheckReport;
use super::{Failure, exit, out};
use crate::domain_check::check_domain;
use crate::run::given_domain;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Say what a domain folder lacks: types that nobody sees, predicates that nobody ever says to hold …
    Check(Args),
}

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A domain folder, or the name of a shipped domain.
    #[arg(value_name = "NAME|DIR")]
    domain: PathBuf,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(verb: &Verb) -> Result<u8, Failure> {
    let Verb::Check(args) = verb;
    let folder = given_domain(&args.domain)?;
    let findings = check_domain(&folder);
    let is_right = findings.is_empty();
    if args.json {
        let folder = folder.to_string();
        out::json(&DomainCheckReport { folder, right: is_right, findings })?;
    } else {
        for finding in &findings {
            out::line(&finding.to_string());
        }
        let n = match findings.len() {
            0 => "nothing is missing".to_owned(),
            1 => "1 finding".to_owned(),
            n => format!("{n} findings"),
        };
        out::line(&format!("{folder}: {n}"));
    }
    Ok(if is_right { 0 } else { exit::CHECK_FAILED })
}
