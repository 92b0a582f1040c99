//! `groundloop parts`: every registered part with its options.

use serde::Serialize;

use super::{Failure, out};
use crate::goals::GOALS;
use crate::hardware::{CAMERAS, ROBOTS};
use crate::mismatch::Mismatch;
use crate::parts::{PartOption, Registry, Role};
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

/// The parts of one kind.
#[derive(Debug, Serialize)]
struct Kind {
    #[serde(rename = "kind")]
    name: &'static str,
    /// The key that names a part of this kind.
    key: &'static str,
    /// The table with its options.
    options: &'static str,
    parts: Vec<Listed>,
}

/// One part.
#[derive(Debug, Serialize)]
struct Listed {
    name: &'static str,
    help: &'static str,
    options: Vec<PartOption>,
}

fn kind<T: Role + ?Sized>(registry: &Registry<T>) -> Kind {
    let listed = registry.0.iter().map(|part| Listed {
        name: part.name,
        help: part.help,
        options: part.described(),
    });
    Kind { name: T::NAME, key: T::KEY, options: T::OPTIONS, parts: listed.collect() }
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
        let names: Vec<&str> = kinds.iter().map(|kind| kind.name).collect();
        if !names.contains(&wanted.as_str()) {
            return Err(Failure::bad_input(Mismatch::new("KIND", names.join(" or "), wanted)));
        }
        kinds.retain(|kind| kind.name == *wanted);
    }
    if args.json {
        out::json(&serde_json::json!({ "kinds": kinds }))?;
        return Ok(0);
    }
    for (i, kind) in kinds.iter().enumerate() {
        if i > 0 {
            out::line("");
        }
        out::line(&format!("{}: {}, options in [{}]", kind.name, kind.key, kind.options));
        kind.parts.iter().for_each(print);
    }
    Ok(0)
}

fn print(part: &Listed) {
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

/// Words in lines of at most [`WIDTH`] columns; those after the first are indented.
fn paragraph(first: &str, indent: usize, text: &str) {
    let mut line = first.to_owned();
    let mut is_empty = true;
    for word in text.split_whitespace() {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
            out::line(line.trim_end());
            (line, is_empty) = (" ".repeat(indent), true);
        }
        if !is_empty {
            line.push(' ');
        }
        line.push_str(word);
        is_empty = false;
    }
    out::line(line.trim_end());
}
