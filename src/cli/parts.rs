//! `groundloop parts`: every registered part with its options.

use super::reports::{ListedPart, PartKind, PartsReport};
use super::{Failure, out};
use crate::goals::GOALS;
use crate::hardware::{CAMERAS, ROBOTS};
use crate::mismatch::Mismatch;
use crate::parts::{Registry, Role};
use crate::perception::detectors::DETECTORS;
use crate::perception::grounders::GROUNDERS;
use crate::planners::PLANNERS;
use crate::skills::SKILLS;

/// Columns of a line.
const WIDTH: usize = 80;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Only the parts of this kind: camera, detector, goal, grounder, planner, robot or skill.
    kind: Option<String>,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

fn kind<T: Role + ?Sized>(registry: &Registry<T>) -> PartKind {
    let listed = registry.0.iter().map(|part| ListedPart {
        name: part.name,
        help: part.help,
        options: part.described(),
    });
    PartKind { kind: T::NAME, key: T::KEY, options: T::OPTIONS, parts: listed.collect() }
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let mut kinds = vec![
        kind(&CAMERAS),
        kind(&DETECTORS),
        kind(&GOALS),
        kind(&GROUNDERS),
        kind(&PLANNERS),
        kind(&ROBOTS),
        kind(&SKILLS),
    ];
    if let Some(wanted) = &args.kind {
        let names: Vec<&str> = kinds.iter().map(|kind| kind.kind).collect();
        if !names.contains(&wanted.as_str()) {
            return Err(Failure::bad_input(Mismatch::new("KIND", names.join(" or "), wanted)));
        }
        kinds.retain(|kind| kind.kind == *wanted);
    }
    if args.json {
        out::json(&PartsReport { kinds })?;
        return Ok(0);
    }
    for (i, kind) in kinds.iter().enumerate() {
        if i > 0 {
            out::line("");
        }
        out::line(&format!("{}: {}, options in [{}]", kind.kind, kind.key, kind.options));
        kind.parts.iter().for_each(print);
    }
    Ok(0)
}

fn print(part: &ListedPart) {
    paragraph(&format!("  {:<15} ", part.name), 18, part.help);
    for option in &part.options {
        let default = match (&option.default, option.required) {
            (Some(default), _) => format!(", {default} without it"),
            (None, true) => ", required".to_owned(),
            (None, false) => String::new(),
        };
        let meaning = option.meaning.replace('\n', " ");
        let stop = if meaning.is_empty() || meaning.ends_with('.') { "" } else { "." };
        let text = format!("{} ({}{default}) {meaning}{stop}", option.name, option.kind);
        paragraph("      ", 10, text.trim_end());
    }
}

/// Words in lines of at most [`WIDTH`] columns; those after the first are indented. A word is never
/// broken, so that keys and commands can be copied.
fn paragraph(first: &str, indent: usize, text: &str) {
    let indent = " ".repeat(indent);
    let options = textwrap::Options::new(WIDTH)
        .initial_indent(first)
        .subsequent_indent(&indent)
        .wrap_algorithm(textwrap::WrapAlgorithm::FirstFit)
        .word_splitter(textwrap::WordSplitter::NoHyphenation)
        .word_separator(textwrap::WordSeparator::AsciiSpace)
        .break_words(false);
    for line in textwrap::wrap(text, options) {
        out::line(line.trim_end());
    }
}
