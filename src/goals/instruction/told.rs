//! A goal told back in the words of its domain.

use super::super::Language;
use super::claim::{Arg, Claim};
use super::vocabulary::split;
use crate::pddl::Name;

/// One claim as a clause: "red block over green block", "every disk not on right peg".
pub(super) fn claim(claim: &Claim, language: &Language) -> String {
    let args: Vec<String> = claim.args.iter().map(argument).collect();
    let phrase = phrase(&claim.predicate, language);
    let not = if claim.is_denied { "not " } else { "" };
    match args.as_slice() {
        [a, b] => format!("{a} {not}{phrase} {b}"),
        [a] => format!("{a} {not}{phrase}"),
        _ => format!("{not}{phrase}"),
    }
}

fn argument(arg: &Arg) -> String {
    let words = |name: &Name| name.as_str().replace('_', " ");
    match arg {
        Arg::One(name) => words(name),
        Arg::Every(type_name) => format!("every {}", words(type_name)),
    }
}

/// The first phrase for a predicate that leads nowhere ("on", not "onto"); else its name.
fn phrase(predicate: &Name, language: &Language) -> String {
    let directions = super::super::english().map(|e| e.directions.as_slice()).unwrap_or_default();
    let relations = language.relations.iter().filter(|r| !r.swap && r.predicate == *predicate);
    let properties = language.properties.iter().filter(|p| p.predicate == *predicate);
    let phrases = relations.flat_map(|r| &r.phrases).chain(properties.flat_map(|p| &p.phrases));
    let still = |phrase: &&String| {
        !split(phrase)
            .iter()
            .any(|word| directions.contains(word) || language.directions.contains(word))
    };
    phrases.clone().find(still).cloned().unwrap_or_else(|| predicate.to_string())
}
