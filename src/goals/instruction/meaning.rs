//! What phrases may mean: the classes of words that the grammar knows.

use super::super::language::Pick;
use crate::pddl::Name;

/// What a phrase means; indices point into the lists of `Language`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Meaning {
    Filler,
    /// Before a wish; `true`: a question mark may follow.
    Opener(bool),
    Verb(Verb),
    Copula(Copula),
    Participle,
    Relative,
    Comma,
    /// "and".
    And,
    /// "then".
    Sequel,
    /// `.` or `;`: ends a sentence.
    Stop,
    QuestionMark,
    Colon,
    HeadingEnd,
    All,
    Listed,
    Pronoun,
    PluralPronoun,
    Exception,
    Rest,
    Other,
    Source,
    Number(usize),
    Ordinal(Ordinal),
    FromSide(RowSide),
    SwappedWith,
    Refused(Refusal),
    Beside(RowSide),
    Inexpressible,
    Colour(Name),
    Noun {
        noun_idx: usize,
        many: bool,
    },
    Everything(usize),
    /// A position before its noun, or alone.
    Before(Pick),
    /// A position after its noun.
    After(Pick),
    Relation(usize),
    Property(usize),
    Sequence(usize),
    Stacks,
    Named(Name),
}

/// What kinds of verbs there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verb {
    Place,
    Take,
    Build,
    Keep,
    Swap,
}

/// What links a subject to what is said of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Copula {
    /// "should be".
    Wish,
    /// "is".
    State,
    /// "must not be".
    Denial,
}

/// A place in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ordinal {
    Nth(usize),
    Last,
}

/// A side in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RowSide {
    Left,
    Right,
}

/// Words that are understood and not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Refusal {
    Negation,
    Alternative,
    Question,
    Condition,
    Vague,
}
