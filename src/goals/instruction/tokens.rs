//! An instruction's text as a row of phrases with meanings.

use std::ops::Range;

use super::super::{GoalObject, Reason};
use super::meaning::{Meaning, Ordinal};
use super::vocabulary::Vocabulary;
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
    /// Whether an article stands before it.
    pub(super) has_article: bool,
    /// Whether it leads to a place ("onto") and so describes no object.
    pub(super) is_directed: bool,
    /// Of "on the right": the same as a relation and a position, "on" and "the right".
    pub(super) parts: Vec<Token>,
}

impl Token {
    pub(super) fn is(&self, meaning: &Meaning) -> bool {
        self.meanings.contains(meaning)
    }

    pub(super) fn any(&self, is: impl Fn(&Meaning) -> bool) -> bool {
        self.meanings.iter().any(is)
    }
}

/// A word or a punctuation mark.
#[derive(Debug)]
struct Piece {
    text: String,
    span: Span,
    has_article: bool,
    /// What it means whatever stands around it: punctuation, or an object's exact name.
    fixed: Option<Meaning>,
}

/// Recognises phrases from left to right, the longest one first. Fillers are left out.
pub(super) fn tokens(
    text: &str,
    vocabulary: &Vocabulary,
    objects: &[GoalObject],
) -> Result<Vec<Token>, Fault> {
    let pieces = without_articles(pieces(text, objects), vocabulary);
    let mut found: Vec<Token> = Vec::new();
    let mut rest = pieces.as_slice();
    while let Some(piece) = rest.first() {
        let (n_words, meanings) = match &piece.fixed {
            Some(meaning) => (1, vec![meaning.clone()]),
            None => longest(rest, vocabulary).ok_or_else(|| unknown(piece, vocabulary))?,
        };
        let token = token(&rest[..n_words], meanings, vocabulary);
        if !token.is(&Meaning::Filler) {
            found.push(token);
        }
        rest = &rest[n_words..];
    }
    Ok(found)
}

fn token(pieces: &[Piece], meanings: Vec<Meaning>, vocabulary: &Vocabulary) -> Token {
    let first = pieces.first();
    let span = first.map_or(0, |piece| piece.span.start)..pieces.last().map_or(0, |p| p.span.end);
    let is_after = meanings.iter().any(|meaning| matches!(meaning, Meaning::After(_)));
    Token {
        span,
        has_article: first.is_some_and(|piece| piece.has_article),
        is_directed: pieces.iter().any(|piece| vocabulary.directions.contains(&piece.text)),
        parts: if is_after { parts(pieces, vocabulary) } else { Vec::new() },
        meanings,
    }
}

/// "on" and "right" of "on the right", where both have a meaning of their own.
fn parts(pieces: &[Piece], vocabulary: &Vocabulary) -> Vec<Token> {
    let words: Vec<String> = pieces.iter().map(|piece| piece.text.clone()).collect();
    let cut = |at: usize| {
        let relation = vocabulary.meanings(&words[..at])?;
        let position = vocabulary.meanings(&words[at..])?;
        let fits = relation.iter().any(|m| matches!(m, Meaning::Relation(_)))
            && position.iter().any(|m| matches!(m, Meaning::Before(_)));
        let tokens = || {
            vec![
                token(&pieces[..at], relation.clone(), vocabulary),
                token(&pieces[at..], position.clone(), vocabulary),
            ]
        };
        fits.then(tokens)
    };
    (1..words.len()).rev().find_map(cut).unwrap_or_default()
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
            ',' => Some(Meaning::Comma),
            '.' | ';' | '!' => Some(Meaning::Stop),
            '?' => Some(Meaning::QuestionMark),
            ':' => Some(Meaning::Colon),
            _ => None,
        };
        let is_silent =
            c.is_whitespace() || matches!(c, '-' | '–' | '—' | '"' | '“' | '”' | '(' | ')');
        if fixed.is_some() || !is_silent {
            let span = start..start + c.len_utf8();
            found.push(Piece { text: c.to_string(), span, has_article: false, fixed });
        }
    }
    found
}

fn is_word_char(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '\'' | '’')
}

/// A word with underscores is an object's exact name, or else several words.
fn push_word(found: &mut Vec<Piece>, text: &str, span: Range<usize>, objects: &[GoalObject]) {
    let word = &text[span.clone()];
    let named = objects.iter().find(|object| object.name == *word.to_lowercase());
    if let Some(object) = named.filter(|_| word.contains('_')) {
        let fixed = Some(Meaning::Named(object.name.clone()));
        found.push(Piece { text: word.to_lowercase(), span, has_article: false, fixed });
        return;
    }
    let mut start = span.start;
    for part in word.split('_') {
        let end = start + part.len();
        if !part.is_empty() {
            let text = part.to_lowercase().replace('’', "'");
            found.push(Piece { text, span: start..end, has_article: false, fixed: None });
        }
        start = end + 1;
    }
}

fn without_articles(pieces: Vec<Piece>, vocabulary: &Vocabulary) -> Vec<Piece> {
    let mut has_article = false;
    let mut kept = Vec::new();
    for piece in pieces {
        if piece.fixed.is_none() && vocabulary.articles.contains(&piece.text) {
            has_article = true;
            continue;
        }
        kept.push(Piece { has_article, ..piece });
        has_article = false;
    }
    kept
}

/// The longest phrase that may stand at the start of `rest`.
fn longest(rest: &[Piece], vocabulary: &Vocabulary) -> Option<(usize, Vec<Meaning>)> {
    let words: Vec<String> = rest
        .iter()
        .take_while(|piece| piece.fixed.is_none())
        .take(vocabulary.words_max)
        .map(|piece| piece.text.clone())
        .collect();
    for n_words in (1..=words.len()).rev() {
        let Some(meanings) = vocabulary.meanings(&words[..n_words]) else { continue };
        // "onto the peg [on the right]", but "[on] [the right] peg" and "[from] [the left] peg".
        let ends_phrase = |m: &Meaning| matches!(m, Meaning::After(_) | Meaning::FromSide(_));
        let is_whole =
            !runs_on(&words, n_words, vocabulary) && !starts_object(&rest[n_words..], vocabulary);
        if !meanings.iter().any(ends_phrase) || is_whole {
            return Some((n_words, meanings));
        }
    }
    let word = words.first()?;
    if let Ok(number) = word.parse() {
        return Some((1, vec![Meaning::Number(number)]));
    }
    let ends = ["st", "nd", "rd", "th"];
    let digits = ends.into_iter().find_map(|end| word.strip_suffix(end))?;
    Some((1, vec![Meaning::Ordinal(Ordinal::Nth(digits.parse().ok()?))]))
}

/// Whether a phrase within the first words goes on behind them: "on [right hand] side".
fn runs_on(words: &[String], n_words: usize, vocabulary: &Vocabulary) -> bool {
    let longer = |start: usize| {
        (n_words + 1..=words.len()).any(|end| vocabulary.phrases.contains_key(&words[start..end]))
    };
    (1..n_words).any(longer)
}

/// Whether a noun or a colour comes next.
fn starts_object(rest: &[Piece], vocabulary: &Vocabulary) -> bool {
    let words: Vec<String> = rest
        .iter()
        .take_while(|piece| piece.fixed.is_none() && !piece.has_article)
        .take(vocabulary.words_max)
        .map(|piece| piece.text.clone())
        .collect();
    let is_object = |meanings: Vec<Meaning>| {
        meanings
            .iter()
            .any(|m| matches!(m, Meaning::Noun { .. } | Meaning::Colour(_) | Meaning::Before(_)))
    };
    (1..=words.len()).any(|n_words| vocabulary.meanings(&words[..n_words]).is_some_and(is_object))
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
