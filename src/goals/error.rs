//! Why a goal was not understood, pointing at the words.

use std::fmt;
use std::ops::Range;

use thiserror::Error;

use crate::parts::PartError;
use crate::pddl::{Name, PddlError};

/// A goal cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum GoalError {
    /// The source cannot be made, or its service does not take its options.
    #[error(transparent)]
    Part(#[from] PartError),
    /// The domain's `language.toml` is wrong.
    #[error("{file}: {message}")]
    Language {
        /// The path as it was given.
        file: String,
        /// What is wrong; names the key.
        message: String,
    },
    /// The PDDL goal is wrong.
    #[error(transparent)]
    Logical {
        /// The parser's error.
        #[from]
        source: PddlError,
    },
    /// The instruction cannot be understood.
    #[error("{reason}")]
    Instruction {
        /// What was not understood, and where.
        reason: Box<Misunderstood>,
    },
    /// The key of a service is missing or refused.
    #[error("the environment variable {variable} {reason}")]
    Key {
        /// Environment variable that should hold the key.
        variable: String,
        /// What was expected and what was found.
        reason: String,
    },
    /// A bound was met before there was a goal.
    #[error("no goal from {what} ({bound}): {reason}")]
    GaveUp {
        /// What was asked.
        what: String,
        /// The key of the bound.
        bound: String,
        /// What it came to.
        reason: String,
    },
    /// A goal image shows no goal.
    #[error("goal image {path}: {reason}")]
    Image {
        /// The photograph.
        path: String,
        /// What was expected and what was found.
        reason: String,
    },
    /// More must be seen first.
    #[error("the goal cannot be told yet: {reason}")]
    NotYet {
        /// What is missing.
        reason: String,
    },
}

impl GoalError {
    /// Whether what is said of objects is not so in what is seen; another state may tell otherwise.
    pub fn depends_on_facts(&self) -> bool {
        let Self::Instruction { reason } = self else { return false };
        matches!(
            reason.reason,
            Reason::NoneFits { .. }
                | Reason::CannotTell { .. }
                | Reason::Ambiguous { .. }
                | Reason::TwoReadings { .. }
                | Reason::WrongNumber { .. }
        )
    }

    /// Whether objects not seen yet are all that is missing, so that another look may help.
    pub fn may_resolve_later(&self) -> bool {
        match self {
            Self::Instruction { reason } => matches!(reason.reason, Reason::NotSeen { .. }),
            Self::NotYet { .. } => true,
            Self::Part(_)
            | Self::Language { .. }
            | Self::Logical { .. }
            | Self::Key { .. }
            | Self::GaveUp { .. }
            | Self::Image { .. } => false,
        }
    }

    /// Whether a service is not there that may be there another time.
    pub fn is_absent(&self) -> bool {
        matches!(self, Self::Part(PartError::Missing { .. }))
    }

    /// The error as several lines of plain text, with the words underlined where there are any.
    pub fn render(&self) -> String {
        match self {
            Self::Instruction { reason } => reason.render(),
            Self::Logical { source } => source.render(),
            Self::Part(_)
            | Self::Language { .. }
            | Self::Key { .. }
            | Self::GaveUp { .. }
            | Self::Image { .. }
            | Self::NotYet { .. } => self.to_string(),
        }
    }
}

impl From<GoalError> for PartError {
    fn from(error: GoalError) -> Self {
        match error {
            GoalError::Part(error) => error,
            GoalError::Language { .. }
            | GoalError::Logical { .. }
            | GoalError::Instruction { .. }
            | GoalError::Key { .. }
            | GoalError::GaveUp { .. }
            | GoalError::Image { .. }
            | GoalError::NotYet { .. } => Self::Inputs { reason: error.render() },
        }
    }
}

impl From<Misunderstood> for GoalError {
    fn from(reason: Misunderstood) -> Self {
        Self::Instruction { reason: Box::new(reason) }
    }
}

/// Which words of an instruction are not understood, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Misunderstood {
    /// The whole instruction.
    pub instruction: String,
    /// The words, in bytes of the instruction.
    pub span: Range<usize>,
    /// What is wrong with them.
    pub reason: Reason,
    /// A sentence that would be understood.
    pub example: Option<String>,
}

/// What is wrong with some words of an instruction.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Reason {
    /// The instruction says nothing.
    #[error("the instruction says nothing about any object")]
    Empty {},
    /// The instruction is too long.
    #[error("expected at most {bytes_max} bytes of instruction, got {bytes}")]
    TooLong {
        /// Its length.
        bytes: usize,
        /// The limit.
        bytes_max: usize,
    },
    /// A word is not in the domain's language.
    #[error("\"{word}\" is not a word of this domain{}", did_you_mean(close))]
    UnknownWord {
        /// As it was written.
        word: String,
        /// Known words that come close, best first.
        close: Vec<String>,
    },
    /// A word is only known as part of longer phrases.
    #[error("\"{word}\" alone means nothing here; it is known in {}", quoted(phrases, ", "))]
    PartOfPhrase {
        /// As it was written.
        word: String,
        /// Some of the phrases, without articles.
        phrases: Vec<String>,
    },
    /// An object stands there without any statement about it.
    #[error("nothing is said about \"{phrase}\"")]
    NothingSaid {
        /// The object's words.
        phrase: String,
    },
    /// Two objects follow each other without a relation between them.
    #[error("expected a relation between \"{left}\" and \"{right}\", such as \"{relation}\"")]
    NoRelation {
        /// The first object's words.
        left: String,
        /// The second object's words.
        right: String,
        /// A relation word of the domain.
        relation: String,
    },
    /// A relation or property lacks an object.
    #[error("expected an object {side} \"{word}\"")]
    NoObject {
        /// "before" or "after".
        side: &'static str,
        /// The words of the relation, as they were written.
        word: String,
    },
    /// A word stands where it means nothing.
    #[error("\"{word}\" makes no sense here: expected {expected}")]
    OutOfPlace {
        /// As it was written.
        word: String,
        /// What was expected.
        expected: &'static str,
    },
    /// A relation or property is not for these objects.
    #[error("\"{word}\" cannot be said of {given}: expected {wanted}")]
    WrongTypes {
        /// The words of the relation, as they were written.
        word: String,
        /// The types of the objects.
        given: String,
        /// What the domain's predicates take.
        wanted: String,
    },
    /// Several objects fit the words.
    #[error("\"{phrase}\" may be any of {}", list(candidates))]
    Ambiguous {
        /// As they were written.
        phrase: String,
        /// The objects that fit.
        candidates: Vec<Name>,
    },
    /// The words need objects that have not been seen.
    #[error("\"{phrase}\" cannot be told yet: {seen} of {wanted} {type_name} objects seen")]
    NotSeen {
        /// As they were written.
        phrase: String,
        /// The type looked for.
        type_name: Name,
        /// How many such objects were seen.
        seen: usize,
        /// How many are needed at least.
        wanted: usize,
    },
    /// Too few or too many objects for a position or a number.
    #[error("\"{phrase}\" does not fit: there are {seen} such objects")]
    WrongNumber {
        /// As they were written.
        phrase: String,
        /// How many objects fit the rest of the words.
        seen: usize,
    },
    /// Two statements exclude each other.
    #[error("{first} and {second} contradict each other: {because}")]
    Contradiction {
        /// A ground atom.
        first: String,
        /// Another.
        second: String,
        /// The rule of the domain's language they break.
        because: String,
    },
    /// What is said cannot be carried out as a goal.
    #[error("\"{phrase}\" {kind}")]
    Refused {
        /// As it was written.
        phrase: String,
        /// Why not.
        kind: Unsupported,
    },
    /// A place that no predicate of the domain says.
    #[error("this domain cannot say \"{phrase}\"; it can say {}", can_say.join(", "))]
    Inexpressible {
        /// As it was written.
        phrase: String,
        /// Phrases for what can be said.
        can_say: Vec<String>,
    },
    /// No object is as it is described.
    #[error("no object fits \"{phrase}\"{}", as_head(head))]
    NoneFits {
        /// As it was written.
        phrase: String,
        /// What fits without the description.
        head: Vec<Name>,
    },
    /// What is seen does not tell which object is meant.
    #[error("nothing seen tells which object \"{phrase}\" is")]
    CannotTell {
        /// As it was written.
        phrase: String,
    },
    /// A pronoun has nothing to stand for, or several things.
    #[error("\"{phrase}\" has nothing to stand for: {expected}")]
    NoAntecedent {
        /// As it was written.
        phrase: String,
        /// What must stand before it.
        expected: &'static str,
    },
    /// The instruction may mean two goals.
    #[error("this may mean {first}, or {second}: say which")]
    TwoReadings {
        /// One goal, as PDDL.
        first: String,
        /// The other.
        second: String,
    },
    /// The instruction has more readings than are looked at.
    #[error("this may mean more than {readings_max} things: say it in shorter sentences")]
    TooManyReadings {
        /// The limit.
        readings_max: usize,
    },
    /// A sentence is too long.
    #[error("expected at most {phrases_max} phrases in a sentence, got {phrases}")]
    LongSentence {
        /// Its length.
        phrases: usize,
        /// The limit.
        phrases_max: usize,
    },
    /// A heading counts other than what is described.
    #[error("\"{phrase}\" is said, {described} described")]
    WrongCount {
        /// As it was written.
        phrase: String,
        /// How many there are.
        described: usize,
    },
    /// A statement of what is stands among wishes.
    #[error("\"{phrase}\" says what is, among what is wished for: say \"should be\"")]
    StateAmongWishes {
        /// As it was written.
        phrase: String,
    },
    /// A chain of statements returns to where it started.
    #[error("the statements go in a circle: {circle}")]
    Circle {
        /// The objects, first one repeated at the end.
        circle: String,
    },
}

/// What a goal cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Unsupported {
    /// "don't".
    #[error("denies or forbids: a goal says what holds in the end, such as \"must not be\"")]
    Negation,
    /// "or".
    #[error("leaves a choice: say which")]
    Alternative,
    /// "is … ?".
    #[error("asks: a goal is a wish, no question")]
    Question,
    /// "if".
    #[error("sets a condition: a goal holds whatever was before")]
    Condition,
    /// "some".
    #[error("does not say which objects are meant: name them")]
    Vague,
}

impl Misunderstood {
    /// The first place as (line, column), both from 1, columns in characters.
    pub fn line_column(&self) -> (usize, usize) {
        let before = self.instruction.get(..self.span.start).unwrap_or(&self.instruction);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }

    /// Several lines of plain text: the reason, the instruction with the words underlined, an
    /// example.
    pub fn render(&self) -> String {
        let (line_number, column) = self.line_column();
        let line = self.instruction.lines().nth(line_number - 1).unwrap_or_default();
        let words = self.instruction.get(self.span.clone()).unwrap_or_default();
        let width = words.lines().next().unwrap_or_default().chars().count().max(1);
        // Tabs are shown as one space so that the marks stand below the words.
        let shown = line.replace('\t', " ");
        let mut text = format!(
            "instruction:{line_number}:{column}: error: {}\n  | {shown}\n  | {}{}",
            self.reason,
            " ".repeat(column - 1),
            "^".repeat(width)
        );
        if let Some(example) = &self.example {
            text.push_str("\n  = example: ");
            text.push_str(example);
        }
        text
    }
}

impl fmt::Display for Misunderstood {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (line, column) = self.line_column();
        write!(f, "instruction:{line}:{column}: {}", self.reason)
    }
}

fn did_you_mean(close: &[String]) -> String {
    if close.is_empty() {
        return String::new();
    }
    format!("; did you mean {}?", quoted(close, " or "))
}

fn quoted(words: &[String], between: &str) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(between)
}

fn as_head(names: &[Name]) -> String {
    if names.is_empty() {
        return String::new();
    }
    format!(": {} is not so", list(names))
}

fn list(names: &[Name]) -> String {
    names.iter().map(Name::as_str).collect::<Vec<_>>().join(", ")
}
