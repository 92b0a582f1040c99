//! Goals of kind "instruction": an offline parser for sentences, driven by `language.toml`.
//!
//! Words → phrases (longest match) → clauses (a small grammar, in every reading) → atoms over seen and
//! expected objects → checks. Nothing here knows a domain; nothing is guessed: a word without a meaning,
//! an object without a statement, two readings that differ and two statements that exclude each other
//! are errors.

mod contradictions;
mod meaning;
mod words;
mod vocabulary;
mod spelling;
mod tokens;
mod syntax;
mod noun_phrases;
mod clauses;
mod wishes;
mod refusals;
mod sentences;
mod positions;
mod claim;
mod told;
mod claims;
mod descriptions;
mod referents;
mod resolve;

#[cfg(test)]
mod tests;

use std::ops::Range;

use super::language::misfit;
use super::{
    GoalError, GoalObject, GoalSource, GoalView, Language, Misunderstood, ParsedGoal, Reason,
};
use crate::parts::{Part, PartContext, PartError, no_options};
use crate::pddl::Domain;
pub(super) use contradictions::first_circle;
use resolve::Resolver;
use syntax::{Clause, Mood};
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
    language.check(domain).map_err(|mismatch| misfit(mismatch.to_string()))?;
    let vocabulary = Vocabulary::new(language, view.objects)?;
    let reader = Reader { text: instruction, domain, language, vocabulary: &vocabulary, view };
    reader.understand().map_err(|fault| {
        let example = language.examples.first().cloned();
        let instruction = instruction.to_owned();
        Misunderstood { instruction, span: fault.span, reason: fault.reason, example }.into()
    })
}

/// Everything that a reading rests on.
#[derive(Debug, Clone, Copy)]
struct Reader<'a> {
    text: &'a str,
    domain: &'a Domain,
    language: &'a Language,
    vocabulary: &'a Vocabulary,
    view: GoalView<'a>,
}

impl<'a> Reader<'a> {
    /// The goal of the one reading that there is.
    fn understand(&self) -> Result<ParsedGoal, Fault> {
        let text = self.text;
        if text.len() > INSTRUCTION_BYTES_MAX {
            let reason = Reason::TooLong { bytes: text.len(), bytes_max: INSTRUCTION_BYTES_MAX };
            return Err(Fault { span: 0..0, reason });
        }
        let tokens = tokens::tokens(text, self.vocabulary, self.view.objects)?;
        let readings = sentences::readings(&tokens, text, self.language)?;
        let mut understood: Vec<Resolver<'a>> = Vec::new();
        let mut faults: Vec<Fault> = Vec::new();
        for clauses in &readings {
            match self.read(clauses) {
                Ok(more) => understood.extend(more),
                Err(fault) => faults.push(fault),
            }
        }
        self.only(understood, faults)
    }

    /// The only reading; several are told, and for none the fault that says most.
    fn only(
        &self,
        understood: Vec<Resolver<'a>>,
        mut faults: Vec<Fault>,
    ) -> Result<ParsedGoal, Fault> {
        // More may be seen, and then another reading may turn out to be meant.
        let waits = faults.iter().position(|f| matches!(f.reason, Reason::NotSeen { .. }));
        if let Some(idx) = waits {
            return Err(faults.swap_remove(idx));
        }
        let mut different: Vec<Resolver<'a>> = Vec::new();
        for reading in understood {
            if different.iter().all(|other| other.content() != reading.content()) {
                different.push(reading);
            }
        }
        let mut different = different.into_iter();
        match (different.next(), different.next()) {
            (Some(only), None) => Ok(only.finish()),
            (Some(first), Some(second)) => {
                let [first, second] = [first, second].map(|r| r.finish().goal.to_string());
                let reason = Reason::TwoReadings { first, second };
                Err(Fault { span: 0..self.text.trim_end().len(), reason })
            }
            (None, _) => Err(most_telling(faults).unwrap_or_else(|| self.empty())),
        }
    }

    fn empty(&self) -> Fault {
        Fault { span: 0..self.text.trim_end().len(), reason: Reason::Empty {} }
    }

    /// What a row of clauses asks for; twice where "on it" may mean two objects.
    fn read(&self, clauses: &[Clause]) -> Result<Vec<Resolver<'a>>, Fault> {
        self.moods_agree(clauses)?;
        let moved = self.read_as(clauses, false);
        let has_choice = match &moved {
            Ok(reading) => reading.has_choice,
            Err(fault) => matches!(fault.reason, Reason::WrongTypes { .. }),
        };
        if !has_choice {
            return moved.map(|reading| vec![reading]);
        }
        match (moved, self.read_as(clauses, true)) {
            (Ok(first), Ok(second)) => Ok(vec![first, second]),
            (Ok(only), Err(_)) | (Err(_), Ok(only)) => Ok(vec![only]),
            (Err(fault), Err(_)) => Err(fault),
        }
    }

    fn read_as(&self, clauses: &[Clause], it_is_landmark: bool) -> Result<Resolver<'a>, Fault> {
        let speech = (self.domain, self.language);
        let mut resolver =
            Resolver::new(self.text, speech, self.vocabulary, self.view, it_is_landmark);
        resolver.read(clauses)?;
        if resolver.claims.is_empty() {
            return Err(self.empty());
        }
        contradictions::check(&resolver.ground_atoms(), self.language)?;
        resolver.check_denials()?;
        resolver.check_stacks(clauses)?;
        Ok(resolver)
    }

    /// What is said to be so is no wish among wishes.
    fn moods_agree(&self, clauses: &[Clause]) -> Result<(), Fault> {
        let is_state = |clause: &&Clause| clause.mood == Mood::State;
        let Some(state) = clauses.iter().find(is_state) else { return Ok(()) };
        if !clauses.iter().any(|clause| clause.is_command) {
            return Ok(());
        }
        let span = state.span.clone();
        let reason = Reason::StateAmongWishes { phrase: self.text[span.clone()].to_owned() };
        Err(Fault { span, reason })
    }
}

/// A contradiction or a description that does not fit says more than words in the wrong place.
fn most_telling(faults: Vec<Fault>) -> Option<Fault> {
    let is_of_scene = |reason: &Reason| {
        matches!(
            reason,
            Reason::NoneFits { .. } | Reason::Ambiguous { .. } | Reason::CannotTell { .. }
        )
    };
    let contradicts =
        |reason: &Reason| matches!(reason, Reason::Contradiction { .. } | Reason::Circle { .. });
    let rank = |fault: &Fault| (!is_of_scene(&fault.reason), !contradicts(&fault.reason));
    faults.into_iter().min_by_key(rank)
}
