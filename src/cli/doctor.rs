//! `groundloop doctor`: what may keep a run from working on this machine.

use std::path::PathBuf;

use super::out::Stream;
use super::reports::DoctorReport;
use super::{Failure, exit, out};
use crate::doctor::{DoctorFinding, Health, RunNeeds, examine};
use crate::run::load_run;
use crate::transport::BusCensus;

/// Columns in front of what was measured.
const INDENT: usize = 24;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A run file, or the name of a shipped one: what it needs is checked, too.
    config: Option<PathBuf>,
    /// Overrides a key of the run file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "config")]
    sets: Vec<String>,
    /// What `$data` stands for in the run file.
    #[arg(long, value_name = "DIR", requires = "config")]
    data: Option<PathBuf>,
    /// Removes what dead runs have left behind, before it looks.
    #[arg(long)]
    clean: bool,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let cleaned = if args.clean { Some(clean()?) } else { None };
    let needs = args.config.as_deref().map(|path| {
        let needs = load_run(path, &args.sets)
            .and_then(|config| RunNeeds::read(config, args.data.as_deref()));
        needs.map_err(|error| {
            let reason = error.to_string();
            let reason = reason.strip_prefix(&format!("{}: ", path.display())).unwrap_or(&reason);
            DoctorFinding::of_run_file(&path.display().to_string(), reason)
        })
    });
    let (needs, unreadable) = match needs {
        Some(Ok(needs)) => (Some(needs), None),
        Some(Err(finding)) => (None, Some(finding)),
        None => (None, None),
    };
    let mut findings = examine(needs.as_ref());
    findings.extend(unreadable);
    let count = |health: Health| findings.iter().filter(|f| f.health == health).count();
    let (n_faults, n_warnings) = (count(Health::Fault), count(Health::Warning));
    if args.json {
        let run_file = needs.map(|needs| needs.file);
        out::json(&DoctorReport { run_file, n_faults, n_warnings, cleaned, findings })?;
    } else {
        if let Some([n_files, bytes]) = cleaned {
            out::line(&format!("removed {n_files} files, {bytes} bytes"));
        }
        findings.iter().for_each(tell);
        out::line(&summary(n_faults, n_warnings));
    }
    Ok(if n_faults == 0 { 0 } else { exit::CHECK_FAILED })
}

/// Removes what is left behind: how many files, and their bytes.
fn clean() -> Result<[u64; 2], Failure> {
    let before = BusCensus::take()?;
    BusCensus::clean_up()?;
    let after = BusCensus::take()?;
    let n_files = before.leftovers.len().saturating_sub(after.leftovers.len());
    let bytes = before.leftover_bytes().saturating_sub(after.leftover_bytes());
    Ok([n_files as u64, bytes])
}

fn tell(finding: &DoctorFinding) {
    let DoctorFinding { check, health, measured, remedy } = finding;
    let word = console::style(format!("{:<8}", health.word()));
    let word = match health {
        Health::Ok => word.green(),
        Health::Warning => word.yellow(),
        Health::Fault => word.red(),
    };
    let word = word.force_styling(Stream::Output.has_colours());
    let indent = " ".repeat(INDENT);
    paragraph(&format!("{word} {check:<14} "), &indent, measured);
    if let Some(remedy) = remedy {
        paragraph(&format!("{indent}→ "), &format!("{indent}  "), remedy);
    }
}

/// Text beside what stands in front of its first line; words are never broken, so that commands can be copied.
fn paragraph(first: &str, indent: &str, text: &str) {
    let width = Stream::Output.columns().saturating_sub(INDENT).max(40);
    let options = textwrap::Options::new(width)
        .word_splitter(textwrap::WordSplitter::NoHyphenation)
        .word_separator(textwrap::WordSeparator::AsciiSpace)
        .break_words(false);
    for (i, line) in textwrap::wrap(text, options).iter().enumerate() {
        out::line(&format!("{}{line}", if i == 0 { first } else { indent }));
    }
}

fn summary(n_faults: usize, n_warnings: usize) -> String {
    let counted = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    match (n_faults, n_warnings) {
        (0, 0) => "all is well".to_owned(),
        (0, n) => counted(n, "warning"),
        (n, 0) => counted(n, "fault"),
        (n, m) => format!("{}, {}", counted(n, "fault"), counted(m, "warning")),
    }
}
