//! Why a sentence is not understood, as near to its words as can be told.

#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a phrase has many meanings, and each place of the grammar asks for a few"
)]

use super::super::language::Language;
use super::super::{Reason, Unsupported};
use super::clauses::{ClauseParser, after_separators};
use super::meaning::{Copula, Meaning, Refusal};
use super::noun_phrases::{Described, NounParser, relations};
use super::syntax::Form;
use super::tokens::Token;
use super::{Fault, Span};

/// Questions, conditions, alternatives, prohibitions: known, and not carried out.
pub(super) fn of_kind(words: &[Token], end: Option<&Token>, text: &str) -> Result<(), Fault> {
    let refused = |span: &Span, kind: Unsupported| {
        let phrase = text[span.clone()].to_owned();
        Err(Fault { span: span.clone(), reason: Reason::Refused { phrase, kind } })
    };
    let Some(first) = words.first() else { return Ok(()) };
    let is_request = words.iter().take(2).any(|token| token.is(&Meaning::Opener(true)));
    let asks = first.is(&Meaning::Copula(Copula::State)) || first.is(&Meaning::Relative);
    if let Some(token) = words.iter().find(|token| refusal(token).is_some())
        && let Some(kind) = refusal(token)
    {
        return refused(&token.span, kind);
    }
    if asks {
        return refused(&first.span, Unsupported::Question);
    }
    if let Some(mark) = end.filter(|token| token.is(&Meaning::QuestionMark))
        && !is_request
    {
        return refused(&mark.span, Unsupported::Question);
    }
    Ok(())
}

fn refusal(token: &Token) -> Option<Unsupported> {
    token.meanings.iter().find_map(|meaning| match meaning {
        Meaning::Refused(refusal) => Some(match refusal {
            Refusal::Negation => Unsupported::Negation,
            Refusal::Alternative => Unsupported::Alternative,
            Refusal::Question => Unsupported::Question,
            Refusal::Condition => Unsupported::Condition,
            Refusal::Vague => Unsupported::Vague,
        }),
        _ => None,
    })
}

/// Why a row of clauses has no reading.
pub(super) fn of_row(
    tokens: &[Token],
    parser: ClauseParser<'_>,
    text: &str,
    language: &Language,
) -> Fault {
    let is_beside =
        |token: &&Token| token.any(|m| matches!(m, Meaning::Inexpressible | Meaning::Beside(_)));
    if let Some(token) = tokens.iter().find(is_beside) {
        let reason = Reason::Inexpressible {
            phrase: text[token.span.clone()].to_owned(),
            can_say: can_say(language),
        };
        return Fault { span: token.span.clone(), reason };
    }
    let at = parser.after_openers(furthest(tokens, parser));
    Diagnosis { tokens, nouns: parser.nouns, text, language }.of_clause(at)
}

/// The start of the first clause that is not understood.
fn furthest(tokens: &[Token], parser: ClauseParser<'_>) -> usize {
    let mut open = vec![(0, Form::None)];
    let mut seen = std::collections::BTreeSet::new();
    let mut furthest = 0;
    while let Some((at, form)) = open.pop() {
        if at >= tokens.len() || !seen.insert((at, form)) {
            continue;
        }
        furthest = furthest.max(at);
        for (clauses, end) in parser.clauses(at, form, false) {
            let form = clauses.last().map_or(form, |clause| clause.form);
            open.push((after_separators(tokens, end).0, form));
        }
    }
    furthest
}

/// The phrases that a domain has for what can be wished, one for each predicate.
fn can_say(language: &Language) -> Vec<String> {
    let relations = language.relations.iter().filter_map(|r| r.phrases.first());
    let properties = language.properties.iter().filter_map(|p| p.phrases.first());
    relations.chain(properties).cloned().collect()
}

struct Diagnosis<'a> {
    tokens: &'a [Token],
    nouns: NounParser<'a>,
    text: &'a str,
    language: &'a Language,
}

impl Diagnosis<'_> {
    fn words(&self, span: &Span) -> String {
        self.text[span.clone()].to_owned()
    }

    fn of_clause(&self, at: usize) -> Fault {
        let is_verb = |token: &Token| token.any(|m| matches!(m, Meaning::Verb(_)));
        let at = at + usize::from(self.tokens.get(at).is_some_and(is_verb));
        let Some(token) = self.tokens.get(at) else {
            let token = self.tokens.last();
            let span = token.map_or(0..0, |token| token.span.clone());
            return self.no_object("after", &span);
        };
        let plain = |at: usize| self.nouns.noun_phrase(at, Described::ByClauses, usize::MAX).pop();
        if let Some((object, next)) = plain(at) {
            return self.after_object(&object.span, next);
        }
        let is_said = |m: &Meaning| matches!(m, Meaning::Property(_));
        if token.any(is_said) {
            return self.no_object("after", &token.span);
        }
        if !relations(token).is_empty() {
            let side = if plain(at + 1).is_some() { "before" } else { "after" };
            return self.no_object(side, &token.span);
        }
        self.out_of_place(token, "an object or a relation")
    }

    /// What follows an object is not understood.
    fn after_object(&self, object: &Span, at: usize) -> Fault {
        let plain = |at: usize| self.nouns.noun_phrase(at, Described::ByClauses, usize::MAX).pop();
        let next = self.tokens.get(at);
        let is_end = |token: &Token| {
            [Meaning::Comma, Meaning::And, Meaning::Sequel].iter().any(|end| token.is(end))
        };
        match next {
            None => self.nothing_said(object),
            Some(token) if is_end(token) => match plain(at + 1) {
                Some((other, next)) if self.tokens.get(next).is_some() => {
                    self.after_object(&other.span, next)
                }
                Some((other, _)) => self.no_relation(object, &other.span),
                None => self.nothing_said(object),
            },
            Some(token) => {
                if let Some((other, _)) = plain(at) {
                    return self.no_relation(object, &other.span);
                }
                if !relations(token).is_empty() {
                    return match plain(at + 1) {
                        None => self.no_object("after", &token.span),
                        Some((landmark, next)) => match self.tokens.get(next) {
                            None => self.nothing_said(object),
                            Some(_) => self.after_object(&landmark.span, next),
                        },
                    };
                }
                self.out_of_place(token, "what is wished of the object before it")
            }
        }
    }

    fn nothing_said(&self, object: &Span) -> Fault {
        let reason = Reason::NothingSaid { phrase: self.words(object) };
        Fault { span: object.clone(), reason }
    }

    fn no_object(&self, side: &'static str, word: &Span) -> Fault {
        Fault { span: word.clone(), reason: Reason::NoObject { side, word: self.words(word) } }
    }

    fn out_of_place(&self, token: &Token, expected: &'static str) -> Fault {
        let reason = Reason::OutOfPlace { word: self.words(&token.span), expected };
        Fault { span: token.span.clone(), reason }
    }

    fn no_relation(&self, left: &Span, right: &Span) -> Fault {
        let relation = self.language.relations.iter().flat_map(|r| &r.phrases).next();
        let reason = Reason::NoRelation {
            left: self.words(left),
            right: self.words(right),
            relation: relation.cloned().unwrap_or_default(),
        };
        Fault { span: right.clone(), reason }
    }
}
