//! `language.toml`: words that mean nothing, or two things.

use super::folder_files::FolderFiles;
use super::{DomainFinding, DomainFindingKind};
use crate::goals::instruction::{WordFault, parse, word_faults};
use crate::goals::{GoalError, Language, Reason};
use crate::mismatch::quoted;
use crate::pddl::Name;

const FILE: &str = "language.toml";

pub(super) fn check(files: &FolderFiles<'_>, findings: &mut Vec<DomainFinding>) {
    let Some(language) = &files.language else { return };
    let faults = word_faults(language);
    let is_whole = faults.is_empty();
    findings.extend(faults.into_iter().map(|fault| word(files, &fault)));
    empty_lists(files, language, findings);
    nouns(files, language, findings);
    if is_whole {
        examples(files, language, findings);
    }
}

fn word(files: &FolderFiles<'_>, WordFault { key, phrase, other }: &WordFault) -> DomainFinding {
    match other {
        Some(other) => files.finding(
            DomainFindingKind::OverlappingWords,
            (FILE, *key),
            format!("\"{phrase}\" stands below {other}, too: keep it in one of the two lists"),
        ),
        None => files.finding(
            DomainFindingKind::WordWithoutMeaning,
            (FILE, *key),
            format!("\"{phrase}\" is made of articles, which are left out: take it away"),
        ),
    }
}

/// Relations, properties, sequences and nouns without a phrase.
fn empty_lists(files: &FolderFiles<'_>, language: &Language, findings: &mut Vec<DomainFinding>) {
    let relations = language.relations.iter().map(|r| ("relation", &r.predicate, &r.phrases));
    let properties = language.properties.iter().map(|p| ("property", &p.predicate, &p.phrases));
    let sequences = language.sequences.iter().map(|s| ("sequence", &s.predicate, &s.phrases));
    let nouns = language.nouns.iter().map(|n| ("noun", &n.type_name, &n.one));
    let lists = relations.chain(properties).chain(sequences).chain(nouns);
    for (key, of, _) in lists.filter(|(.., phrases)| phrases.is_empty()) {
        let message = format!("there is no word for {of}: list some, or take the table away");
        let kind = DomainFindingKind::WordWithoutMeaning;
        findings.push(files.finding(kind, (FILE, key), message));
    }
}

/// Nouns for what nobody sees, and colours of nameable objects that cannot be said.
fn nouns(files: &FolderFiles<'_>, language: &Language, findings: &mut Vec<DomainFinding>) {
    let Some(perception) = &files.perception else { return };
    let kind = DomainFindingKind::WordWithoutMeaning;
    let types = &files.domain.types;
    for noun in &language.nouns {
        let implied = perception.implied.iter().map(|implied| &implied.type_name);
        let mut seen = perception.types.iter().map(|spec| &spec.name).chain(implied);
        if !seen.any(|name| types.is_a(name, &noun.type_name)) {
            let message = format!(
                "the words for {} mean nothing, since perception.toml has no such object: add a \
                 [[type]] there, or take the [[noun]] away",
                noun.type_name
            );
            findings.push(files.finding(kind, (FILE, "noun.type"), message));
        }
        let says_colours = noun.name.as_ref().is_some_and(|name| name.contains("{colour}"));
        let spec = perception.type_spec(&noun.type_name).filter(|_| says_colours);
        let colours: &[Name] = spec.map(|spec| spec.colours.as_slice()).unwrap_or_default();
        for colour in colours.iter().filter(|c| !language.colours.contains_key(*c)) {
            let message = format!(
                "perception.toml has the type {} in {colour}, which is no word here: add {colour} = []",
                noun.type_name
            );
            findings.push(files.finding(kind, (FILE, "colours"), message));
        }
    }
}

/// The example sentences, which people are shown as understood; read as before the first frame.
fn examples(files: &FolderFiles<'_>, language: &Language, findings: &mut Vec<DomainFinding>) {
    for (idx, text) in language.examples.iter().enumerate() {
        let Err(error) = parse(text, &files.domain, language, &[]) else { continue };
        let is_of_scene = match &error {
            GoalError::Instruction { reason } => depends_on_scene(&reason.reason),
            GoalError::Part(_)
            | GoalError::Language { .. }
            | GoalError::Logical { .. }
            | GoalError::Key { .. }
            | GoalError::GaveUp { .. }
            | GoalError::Image { .. }
            | GoalError::NotYet { .. } => false,
        };
        if is_of_scene {
            continue;
        }
        let message =
            format!("{} is not understood: {error}; add the words, or change it", quoted(text));
        let kind = DomainFindingKind::WordWithoutMeaning;
        findings.push(files.finding(kind, (FILE, format!("examples[{idx}]")), message));
    }
}

/// Whether other objects in view might let the sentence be understood.
fn depends_on_scene(reason: &Reason) -> bool {
    matches!(reason, Reason::NotSeen { .. })
}
