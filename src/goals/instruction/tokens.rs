//! An instruction's text as a row of phrases with meanings.

use std::ops::Range;

use super::super::{GoalObject, Reason};
use super::vocabulary::{Meaning, Vocabulary};
use super::{Fault, Span, spelling};

/// How many similar words an error offers.
const CLOSE_WORDS_MAX: usize = 3;

/// One phrase that was recognised.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Token {
    /// What it may mean; never empty.
    pub(super) meanings: Vec<Meaning>,
    /// Its place in the text.
    pub(super) span: Span,
}

impl Token {
    pub(super) fn is(&self, meaning: &Meaning) -> bool {
        self.meanings.contains(meaning)
    }
}

/// A word or a punctuation mark.
#[derive(Debug)]
struct Piece {
    text: String,
    span: Span,
    /// What it means whatever stands around it: punctuation, or an object's exact name.
    fixed: Option<Meaning>,
}

/// Recognises phrases from left to right, the longest one first. Fillers are left out.
pub(super) fn tokens(
    text: &str,
    vocabulary: &Vocabulary,
    objects: &[GoalObject],
) -> Result<Vec<Token>, Fault> {
    let mut pieces = pieces(text, objects);
    pieces.retain(|piece| piece.fixed.is_some() || !vocabulary.articles.contains(&piece.text));
    let mut found: Vec<Token> = Vec::new();
    let mut rest = pieces.as_slice();
    while let Some(piece) = rest.first() {
        if let Some(meaning) = &piece.fixed {
            found.push(Token { meanings: vec![meaning.clone()], span: piece.span.clone() });
            rest = &rest[1..];
            continue;
        }
        let (n_words, meanings) =
            longest(rest, vocabulary, &found).ok_or_else(|| unknown(piece, vocabulary))?;
        let span = piece.span.start..rest[n_words - 1].span.end;
        if !meanings.contains(&Meaning::Filler) {
            found.push(Token { meanings, span });
        }
        rest = &rest[n_words..];
    }
    Ok(found)
}

fn pieces(text: &str, objects: &[GoalObject]) -> Vec<Piece> {
    let mut found = Vec::new();
    let mut chars = text.char_indices().peekable();
    while let Some((start, c)) = chars.next() {
        if is_word_char(c) {
            let mut end = start + c.len_utf8();
            while let Some((at, next)) = chars.next_if(|(_, next)| is_word_char(*next)) {
                end = at + next.len_utf8();
            }
            push_word(&mut found, text, start..end, objects);
            continue;
        }
        let fixed = match c {
            ',' => Some(Meaning::Separator),
            '.' | ';' | '!' | '?' => Some(Meaning::Stop),
            ':' => Some(Meaning::HeadingEnd),
            _ => None,
        };
        let is_silent =
            c.is_whitespace() || matches!(c, '-' | '–' | '—' | '"' | '“' | '”' | '(' | ')');
        if fixed.is_some() || !is_silent {
            found.push(Piece { text: c.to_string(), span: start..start + c.len_utf8(), fixed });
        }
    }
    found
}

fn is_word_char(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '\'')
}

/// A word with underscores is an object's exact name, or else several words.
fn push_word(found: &mut Vec<Piece>, text: &str, span: Range<usize>, objects: &[GoalObject]) {
    let word = &text[span.clone()];
    let named = objects.iter().find(|object| object.name == *word.to_lowercase());
    if let Some(object) = named.filter(|_| word.contains('_')) {
        let fixed = Some(Meaning::Named(object.name.clone()));
        found.push(Piece { text: word.to_lowercase(), span, fixed });
        return;
    }
    let mut start = span.start;
    for part in word.split('_') {
        let end = start + part.len();
        if !part.is_empty() {
            found.push(Piece { text: part.to_lowercase(), span: start..end, fixed: None });
        }
        start = end + 1;
    }
}

/// The longest phrase that may stand at the start of `rest`.
fn longest(
    rest: &[Piece],
    vocabulary: &Vocabulary,
    before: &[Token],
) -> Option<(usize, Vec<Meaning>)> {
    let words: Vec<String> = rest
        .iter()
        .take_while(|piece| piece.fixed.is_none())
        .take(vocabulary.words_max)
        .map(|piece| piece.text.clone())
        .collect();
    for n_words in (1..=words.len()).rev() {
        let Some(meanings) = vocabulary.phrases.get(&words[..n_words]) else { continue };
        let is_after = meanings.iter().any(|meaning| matches!(meaning, Meaning::After(_)));
        if !is_after || may_follow_noun(&rest[n_words..], vocabulary, before) {
            return Some((n_words, meanings.clone()));
        }
    }
    let number = words.first()?.parse().ok()?;
    Some((1, vec![Meaning::Number(number)]))
}

/// Tells "onto the peg [on the right]" from "all disks [on] [the right] peg" and from "all disks
/// [on] [the right]": a position after its noun comes late in its statement and ends its object.
fn may_follow_noun(rest: &[Piece], vocabulary: &Vocabulary, before: &[Token]) -> bool {
    let after_noun = before.last().is_some_and(|token| {
        token.meanings.iter().any(|meaning| matches!(meaning, Meaning::Noun { .. }))
    });
    let after_relation = before
        .iter()
        .rev()
        .take_while(|token| !token.is(&Meaning::Separator) && !token.is(&Meaning::Stop))
        .any(|token| {
            let is_relation =
                |meaning: &Meaning| matches!(meaning, Meaning::Relation(_) | Meaning::Source);
            token.meanings.iter().any(is_relation)
        });
    let before_noun = rest.first().is_some_and(|piece| {
        let next = vocabulary.phrases.get(std::slice::from_ref(&piece.text));
        piece.fixed.is_none()
            && next.is_some_and(|meanings| {
                let is_object =
                    |m: &Meaning| matches!(m, Meaning::Noun { .. } | Meaning::Colour(_));
                meanings.iter().any(is_object)
            })
    });
    after_noun && after_relation && !before_noun
}

fn unknown(piece: &Piece, vocabulary: &Vocabulary) -> Fault {
    let longer = vocabulary.phrases.keys().filter(|phrase| phrase.contains(&piece.text));
    let phrases: Vec<String> = longer.take(CLOSE_WORDS_MAX).map(|words| words.join(" ")).collect();
    if !phrases.is_empty() {
        let reason = Reason::PartOfPhrase { word: piece.text.clone(), phrases };
        return Fault { span: piece.span.clone(), reason };
    }
    let close = spelling::close(&piece.text, vocabulary.words(), CLOSE_WORDS_MAX);
    Fault {
        span: piece.span.clone(),
        reason: Reason::UnknownWord { word: piece.text.clone(), close },
    }
}
