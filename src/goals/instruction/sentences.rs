//! Sentences: headings, colons and rows of clauses, in every reading.

use std::collections::BTreeMap;

use super::super::{Language, Reason};
use super::clauses::{ClauseParser, after_separators};
use super::meaning::{Meaning, Verb};
use super::noun_phrases::{Described, NounParser};
use super::refusals;
use super::syntax::{Clause, ClauseKind, Form, Mood, NounPhrase};
use super::tokens::Token;
use super::{Fault, Span};

/// Most readings of an instruction that are looked at.
pub(super) const READINGS_MAX: usize = 64;
/// Most phrases of a sentence.
const SENTENCE_PHRASES_MAX: usize = 160;

/// All readings of an instruction, as rows of clauses.
pub(super) fn readings(
    tokens: &[Token],
    text: &str,
    language: &Language,
) -> Result<Vec<Vec<Clause>>, Fault> {
    let mut readings: Vec<Vec<Clause>> = vec![Vec::new()];
    let ends = |token: &Token| token.is(&Meaning::Stop) || token.is(&Meaning::QuestionMark);
    for sentence in tokens.split_inclusive(ends) {
        let n_words = sentence.len() - usize::from(sentence.last().is_some_and(ends));
        let (words, end) = sentence.split_at(n_words);
        let reader = Sentence::new(words, text, language);
        refusals::of_kind(words, end.first(), text)?;
        let mut more = reader.readings(words)?;
        // "Make sure that red is on blue and blue is on green" wishes for both.
        if words.first().is_some_and(|token| token.any(|m| matches!(m, Meaning::Opener(_)))) {
            more.iter_mut().flatten().for_each(wished);
        }
        readings = product(&readings, &more);
        if readings.len() > READINGS_MAX {
            return Err(reader.too_many());
        }
    }
    Ok(readings)
}

fn wished(clause: &mut Clause) {
    clause.is_command = true;
    if clause.mood == Mood::State {
        clause.mood = Mood::Wish;
    }
}

fn product(left: &[Vec<Clause>], right: &[Vec<Clause>]) -> Vec<Vec<Clause>> {
    left.iter()
        .flat_map(|first| right.iter().map(move |second| [first.as_slice(), second].concat()))
        .take(READINGS_MAX + 1)
        .collect()
}

/// Reads one sentence.
#[derive(Debug, Clone, Copy)]
struct Sentence<'a> {
    whole: &'a [Token],
    text: &'a str,
    language: &'a Language,
}

impl<'a> Sentence<'a> {
    fn new(whole: &'a [Token], text: &'a str, language: &'a Language) -> Self {
        Self { whole, text, language }
    }

    fn parser(&self, tokens: &'a [Token]) -> ClauseParser<'a> {
        let counts_from_left = self.language.counts_from_left;
        ClauseParser { nouns: NounParser { tokens, counts_from_left } }
    }

    fn span(&self) -> Span {
        let start = self.whole.first().map_or(0, |token| token.span.start);
        start..self.whole.last().map_or(start, |token| token.span.end)
    }

    fn too_many(&self) -> Fault {
        let reason = Reason::TooManyReadings { readings_max: READINGS_MAX };
        Fault { span: self.span(), reason }
    }

    /// The readings of a sentence or of what stands behind a colon.
    fn readings(&self, tokens: &'a [Token]) -> Result<Vec<Vec<Clause>>, Fault> {
        if tokens.len() > SENTENCE_PHRASES_MAX {
            let reason =
                Reason::LongSentence { phrases: tokens.len(), phrases_max: SENTENCE_PHRASES_MAX };
            return Err(Fault { span: self.span(), reason });
        }
        let is_number = |token: &Token| token.any(|m| matches!(m, Meaning::Number(_)));
        // "1." before an item of a list.
        if tokens.is_empty() || tokens.len() == 1 && tokens.iter().all(is_number) {
            return Ok(vec![Vec::new()]);
        }
        match tokens.iter().position(|token| token.is(&Meaning::Colon)) {
            None => self.clauses(tokens),
            Some(at) => self.colon(&tokens[..at], &tokens[at + 1..], &tokens[at]),
        }
    }

    /// What stands before a colon and behind it.
    fn colon(
        &self,
        head: &'a [Token],
        body: &'a [Token],
        colon: &Token,
    ) -> Result<Vec<Vec<Clause>>, Fault> {
        let parser = self.parser(head);
        let start = parser.after_openers(0);
        if start == head.len() {
            return self.readings(body);
        }
        let listed = self.parser(body).plain_list(0).filter(|(_, end)| *end == body.len());
        let (heading, rest) = self.heading(head, start);
        if let (Some((sequence_idx, word)), true) = (parser.sequence(rest), rest + 1 == head.len())
        {
            let Some((objects, end)) = listed else { return self.readings(body) };
            let kind = ClauseKind::Chain { sequence_idx, word, objects };
            let span = parser.nouns.span(0, rest).start..self.parser(body).nouns.span(0, end).end;
            let (mood, form) = (Mood::Wish, Form::Chain);
            let chain = Clause { mood, form, is_command: true, kind, span };
            return Ok(vec![heading.into_iter().chain([chain]).collect()]);
        }
        if let Some((objects, _)) = listed {
            let completed = self.completed(head, start, &objects);
            if !completed.is_empty() {
                return Ok(completed);
            }
        }
        if rest == head.len() {
            let heading: Vec<Clause> = heading.into_iter().collect();
            return Ok(product(&[heading], &self.readings(body)?));
        }
        // A head that is understood for itself leaves the colon without a meaning.
        self.clauses(head)?;
        let expected = "a list of the objects that are meant, or a full stop instead of the colon";
        let reason = Reason::OutOfPlace { word: ":".to_owned(), expected };
        Err(Fault { span: colon.span.clone(), reason })
    }

    /// The heading at the start of a head, and the place after it.
    fn heading(&self, head: &'a [Token], start: usize) -> (Option<Clause>, usize) {
        let parser = self.parser(head);
        let longest = parser.headings(start).into_iter().max_by_key(|(_, end)| *end);
        if let Some((clause, end)) = longest {
            return (Some(clause), end);
        }
        let is_verb = |m: &Meaning| matches!(m, Meaning::Verb(verb) if *verb != Verb::Swap);
        let has_verb = head.get(start).is_some_and(|token| token.any(is_verb));
        let next = start + usize::from(has_verb);
        let objects = parser.nouns.noun_phrase(next, Described::ByClauses, usize::MAX);
        let type_only = objects
            .into_iter()
            .find(|(object, _)| object.is_type_only() && (object.is_open_list() || has_verb));
        (None, type_only.map_or(next, |(_, end)| end))
    }

    /// "Put these on the table:", "on the table:", "slice all:" with the objects of the list.
    fn completed(
        &self,
        head: &'a [Token],
        start: usize,
        objects: &[NounPhrase],
    ) -> Vec<Vec<Clause>> {
        let parser = self.parser(head);
        let mut found = Vec::new();
        let rows = self.rows(head).unwrap_or_default();
        for mut clauses in rows {
            let themes = clauses.last_mut().and_then(|clause| match &mut clause.kind {
                ClauseKind::Place { themes, .. } | ClauseKind::Has { themes, .. } => Some(themes),
                ClauseKind::GoesOn { .. }
                | ClauseKind::Chain { .. }
                | ClauseKind::Take { .. }
                | ClauseKind::Swap { .. }
                | ClauseKind::Heading { .. } => None,
            });
            if let Some(themes) = themes
                && let [object] = themes.as_slice()
                && object.is_open_list()
                && object.except.is_empty()
            {
                *themes = objects.to_vec();
                found.push(clauses);
            }
        }
        if found.is_empty() {
            let open = parser.without_themes(start, objects).into_iter();
            found.extend(open.map(|clause| vec![clause]));
        }
        found
    }

    /// The readings of a row of clauses; if there is none, why.
    fn clauses(&self, tokens: &'a [Token]) -> Result<Vec<Vec<Clause>>, Fault> {
        let rows = self.rows(tokens)?;
        if rows.is_empty() {
            return Err(refusals::of_row(tokens, self.parser(tokens), self.text, self.language));
        }
        Ok(rows)
    }

    fn rows(&self, tokens: &'a [Token]) -> Result<Vec<Vec<Clause>>, Fault> {
        let mut memo = BTreeMap::new();
        let rows = rows_from(self.parser(tokens), (0, Form::None, false), &mut memo);
        if rows.len() > READINGS_MAX { Err(self.too_many()) } else { Ok(rows) }
    }
}

/// Every row of clauses from a place on.
fn rows_from(
    parser: ClauseParser<'_>,
    state: (usize, Form, bool),
    memo: &mut BTreeMap<(usize, Form, bool), Vec<Vec<Clause>>>,
) -> Vec<Vec<Clause>> {
    if let Some(known) = memo.get(&state) {
        return known.clone();
    }
    let (at, before, after_comma) = state;
    let n_tokens = parser.nouns.tokens.len();
    let mut found: Vec<Vec<Clause>> = Vec::new();
    for (clauses, end) in parser.clauses(at, before, after_comma) {
        let (next, only_comma) = after_separators(parser.nouns.tokens, end);
        let form = clauses.last().map_or(before, |clause| clause.form);
        let rest = if next == n_tokens {
            vec![Vec::new()]
        } else {
            rows_from(parser, (next, form, only_comma), memo)
        };
        let room = (READINGS_MAX + 1).saturating_sub(found.len());
        let rows = rest.into_iter().take(room);
        found.extend(rows.map(|row| [clauses.as_slice(), row.as_slice()].concat()));
    }
    memo.insert(state, found.clone());
    found
}
