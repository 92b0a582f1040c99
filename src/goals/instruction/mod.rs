//! Goals of kind "instruction": an offline parser for sentences, driven by `language.toml`.
//!
//! Words → phrases (longest match) → statements (small grammar) → atoms over seen and expected
//! objects → checks. Nothing here knows a domain; nothing is guessed: a word without a meaning, an
//! object without a statement or two statements that exclude each other are errors.

mod contradictions;
mod grammar;
mod positions;
mod resolve;
mod spelling;
mod tokens;
mod vocabulary;

#[cfg(test)]
mod tests;

use std::ops::Range;

use super::language::misfit;
use super::{GoalError, GoalObject, GoalSource, GoalView, Language, Misunderstood, ParsedGoal, Reason};
use crate::parts::{Part, PartContext, PartError, no_options};
use crate::pddl::Domain;
pub(super) use contradictions::first_circle;
use resolve::Resolver;
use vocabulary::Vocabulary;
pub use vocabulary::{WordFault, word_faults};

/// Most bytes of an instruction.
pub const INSTRUCTION_BYTES_MAX: usize = 4096;

/// A place in the instruction, in bytes.
type Span = Range<usize>;

/// What is wrong, and where.
#[derive(Debug)]
struct Fault {
    span: Span,
    reason: Reason,
}

/// The goal source of kind "instruction".
#[derive(Debug)]
struct Instruction {
    text: String,
    language: Language,
}

/// The entry of the table of goal sources.
pub(super) const PART: Part<dyn GoalSource> = Part {
    name: "instruction",
    help: "a sentence, read offline with the words of the domain's language.toml",
    options: no_options,
    build,
};

fn build(context: &PartContext<'_, dyn GoalSource>) -> Result<Box<dyn GoalSource>, PartError> {
    let language = context.inputs.language.cloned().ok_or_else(|| PartError::Inputs {
        reason: "a goal of kind \"instruction\" needs the domain's language.toml".to_owned(),
    })?;
    Ok(Box::new(Instruction { text: context.inputs.text.to_owned(), language }))
}

impl GoalSource for Instruction {
    fn read_in(&self, domain: &Domain, view: GoalView<'_>) -> Result<ParsedGoal, GoalError> {
        parse_in(&self.text, domain, &self.language, view)
    }
}

/// Reads an instruction as a goal over `objects` and objects that are expected to turn up.
///
/// # Errors
/// [`GoalError::Language`] when the language does not fit the domain, [`GoalError::Instruction`]
/// when the words are not understood, are ambiguous or contradict each other.
pub fn parse(
    instruction: &str,
    domain: &Domain,
    language: &Language,
    objects: &[GoalObject],
) -> Result<ParsedGoal, GoalError> {
    parse_in(instruction, domain, language, objects.into())
}

/// Reads an instruction as a goal over what is seen and objects that are expected to turn up.
///
/// # Errors
/// See [`parse`].
pub fn parse_in(
    instruction: &str,
    domain: &Domain,
    language: &Language,
    view: GoalView<'_>,
) -> Result<ParsedGoal, GoalError> {
    let objects = view.objects;
    language.check(domain).map_err(|mismatch| misfit(mismatch.to_string()))?;
    let vocabulary = Vocabulary::new(language, objects)?;
    understand(instruction, domain, language, &vocabulary, objects).map_err(|fault| {
        let example = language.examples.first().cloned();
        let instruction = instruction.to_owned();
        Misunderstood { instruction, span: fault.span, reason: fault.reason, example }.into()
    })
}

fn understand(
    text: &str,
    domain: &Domain,
    language: &Language,
    vocabulary: &Vocabulary,
    objects: &[GoalObject],
) -> Result<ParsedGoal, Fault> {
    if text.len() > INSTRUCTION_BYTES_MAX {
        let reason = Reason::TooLong { bytes: text.len(), bytes_max: INSTRUCTION_BYTES_MAX };
        return Err(Fault { span: 0..0, reason });
    }
    let tokens = tokens::tokens(text, vocabulary, objects)?;
    let parsed = grammar::parse(&tokens, text, language)?;
    if parsed.statements.is_empty() {
        return Err(Fault { span: 0..text.trim_end().len(), reason: Reason::Empty {} });
    }
    let mut resolver = Resolver::new(text, domain, language, objects);
    for statement in &parsed.statements {
        resolver.state(statement)?;
    }
    let atoms = resolver.ground_atoms();
    contradictions::check(&atoms, language)?;
    resolver.note_stacks(&atoms, &parsed);
    Ok(resolver.finish(&parsed.sources))
}
