//! Clauses: what is said of noun phrases between two separators.
//!
//! As with noun phrases, every reading is given. Where a place may be what is wished for or what
//! describes an object, both readings come out; the scene may rule one out, and if it does not, the
//! instruction is refused.

#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a phrase has many meanings, and each place of the grammar asks for a few"
)]

use super::Span;
use super::meaning::{Copula, Meaning, Verb};
use super::noun_phrases::{Described, LIST_MAX, NounParser, Parses};
use super::syntax::{Clause, ClauseKind, Description, Form, Head, Mood, NounPhrase, Thing};
use super::tokens::Token;

/// Reads clauses from a row of tokens without colons and full stops.
#[derive(Debug, Clone, Copy)]
pub(super) struct ClauseParser<'a> {
    pub(super) nouns: NounParser<'a>,
}

impl<'a> ClauseParser<'a> {
    pub(super) fn token(&self, at: usize) -> Option<&'a Token> {
        self.nouns.tokens.get(at)
    }

    pub(super) fn is(&self, at: usize, meaning: &Meaning) -> bool {
        self.nouns.is(at, meaning)
    }

    fn verb(&self, at: usize) -> Option<Verb> {
        self.token(at)?.meanings.iter().find_map(|meaning| match meaning {
            Meaning::Verb(verb) => Some(*verb),
            _ => None,
        })
    }

    fn copula(&self, at: usize) -> Option<Copula> {
        self.token(at)?.meanings.iter().find_map(|meaning| match meaning {
            Meaning::Copula(copula) => Some(*copula),
            _ => None,
        })
    }

    /// Whether a clause may end here.
    pub(super) fn is_boundary(&self, at: usize) -> bool {
        let ends = [Meaning::Comma, Meaning::And, Meaning::Sequel];
        self.token(at).is_none_or(|token| ends.iter().any(|end| token.is(end)))
    }

    /// The place after words such as "I want you to", "please" and "first,".
    pub(super) fn after_openers(&self, mut at: usize) -> usize {
        loop {
            let Some(token) = self.token(at) else { return at };
            let is_opener = token.any(|meaning| matches!(meaning, Meaning::Opener(_)));
            // "First put red on blue": where it is no place in a row.
            let is_count = token.any(|m| matches!(m, Meaning::Ordinal(_)));
            let before_verb = self.verb(at + 1).is_some() || self.is(at + 1, &Meaning::Comma);
            if is_opener || token.is(&Meaning::Sequel) {
                at += 1;
                at += usize::from(self.is(at, &Meaning::Comma));
            } else if is_count && before_verb {
                at += 1 + usize::from(self.is(at + 1, &Meaning::Comma));
            } else {
                return at;
            }
        }
    }

    /// The clauses that may start at a place: one, or a heading with one. `before` is how the clause
    /// before it is made, `after_comma` whether only a comma stands between.
    pub(super) fn clauses(
        &self,
        at: usize,
        before: Form,
        after_comma: bool,
    ) -> Parses<Vec<Clause>> {
        let start = self.after_openers(at);
        let mut found: Parses<Vec<Clause>> = Vec::new();
        for (heading, next) in self.headings(start) {
            if self.is_boundary(next) {
                found.push((vec![heading.clone()], next));
            }
            for (clause, end) in self.statements(next, Form::None) {
                found.push((vec![heading.clone(), clause], end));
            }
        }
        let statements = self.statements(start, before).into_iter();
        found.extend(statements.map(|(clause, end)| (vec![clause], end)));
        if after_comma {
            found.extend(self.wishes(start, Described::ByClauses, true).into_iter().map(
                |(wish, end)| {
                    let kind = ClauseKind::GoesOn { links: wish.links, ends: wish.ends };
                    (vec![self.clause(kind, (start, end), Form::Chain)], end)
                },
            ));
        }
        found.retain(|(_, end)| self.is_boundary(*end));
        let mut kept: Parses<Vec<Clause>> = Vec::new();
        for (clauses, end) in found {
            let same = |(other, at): &(Vec<Clause>, usize)| {
                let kinds = other.iter().map(|clause| (&clause.mood, &clause.kind));
                *at == end && kinds.eq(clauses.iter().map(|clause| (&clause.mood, &clause.kind)))
            };
            if !kept.iter().any(same) {
                kept.push((clauses, end));
            }
        }
        let mut found = kept;
        let is_wish = start > at;
        for clause in found.iter_mut().flat_map(|(clauses, _)| clauses) {
            clause.is_command |= is_wish;
            if is_wish && clause.mood == Mood::State {
                clause.mood = Mood::Wish;
            }
        }
        found
    }

    fn clause(&self, kind: ClauseKind, (from, to): (usize, usize), form: Form) -> Clause {
        let span: Span = self.nouns.span(from, to);
        let is_command = matches!(form, Form::Place | Form::Closed);
        Clause { mood: Mood::Wish, form, is_command, kind, span }
    }

    /// "Build two towers of blocks with", "two stacks", "move the blocks so that".
    pub(super) fn headings(&self, at: usize) -> Parses<Clause> {
        let mut found = Vec::new();
        let verb = self.verb(at).filter(|verb| *verb != Verb::Swap);
        let mut next = at + usize::from(verb.is_some());
        let number = self.token(next).and_then(|token| {
            token.meanings.iter().find_map(|meaning| match meaning {
                Meaning::Number(number) => Some(*number),
                _ => None,
            })
        });
        let has_article = self.token(next).is_some_and(|token| token.has_article);
        let counted = next + usize::from(number.is_some());
        let is_stacks = self.is(counted, &Meaning::Stacks);
        let mut n_stacks = None;
        if is_stacks {
            n_stacks = number.map(|number| (number, self.nouns.span(next, counted + 1)));
            next = counted + 1;
        }
        // "of three blocks": what the stacks are made of.
        let of_type = self.nouns.noun_phrase(next, Described::ByClauses, usize::MAX).pop();
        let of_type = of_type.filter(|(object, _)| is_heading(object, is_stacks));
        let n_objects =
            of_type.as_ref().filter(|_| is_stacks).and_then(|(object, _)| match &object.head {
                Head::Thing(thing) => Some((thing.number?, object.span.clone())),
                Head::It | Head::They | Head::Rest | Head::Listed | Head::Named(_) => None,
            });
        let ends: Vec<usize> =
            [Some(next), of_type.map(|(_, end)| end)].into_iter().flatten().collect();
        for end in ends {
            let (n_stacks, n_objects) = (n_stacks.clone(), n_objects.clone());
            let kind = ClauseKind::Heading { n_stacks, n_objects };
            let clause = || self.clause(kind.clone(), (at, end), Form::None);
            if self.is(end, &Meaning::HeadingEnd) {
                found.push((clause(), end + 1));
            } else if is_stacks && (verb.is_some() || has_article || number.is_some()) {
                found.push((clause(), end));
            }
        }
        found
    }

    fn statements(&self, at: usize, before: Form) -> Parses<Clause> {
        let mut found = self.inverted(at);
        found.extend(self.sequences(at));
        found.extend(self.property_first(at));
        match self.verb(at) {
            Some(Verb::Place) => {
                found.extend(self.placed(at, at + 1, false));
                found.extend(self.bare_chain(at, at + 1));
            }
            Some(Verb::Take) => found.extend(self.taken(at)),
            Some(Verb::Build) => {
                found.extend(self.chained(at, at + 1));
                let mut placed = self.placed(at, at + 1, false);
                // "Stack red on green on blue" is a chain, since names are not described in passing.
                placed.retain(|(clause, _)| !describes_bare(clause));
                found.extend(placed);
                found.extend(self.sequences(at + 1));
            }
            Some(Verb::Keep) => found.extend(self.chained(at, at + 1)),
            Some(Verb::Swap) => found.extend(self.swapped(at)),
            None => {
                found.extend(self.subject_first(at));
                match before {
                    Form::Place => {
                        found.extend(self.placed(at, at, false));
                        found.extend(self.bare_chain(at, at));
                    }
                    Form::None | Form::Chain | Form::Subject => {
                        found.extend(self.chained(at, at));
                    }
                    Form::Closed => {}
                }
            }
        }
        if let Some(Verb::Build | Verb::Keep | Verb::Place) = self.verb(at) {
            for (clause, _) in &mut found {
                clause.is_command = true;
            }
        }
        found
    }

    /// Objects and the one place where they are to be: "put red on blue".
    fn placed(&self, start: usize, at: usize, needs_direction: bool) -> Parses<Clause> {
        let mut found = Vec::new();
        for (themes, next) in self.moved(at) {
            for (wish, end) in self.wishes(next, Described::ByAll, false) {
                if needs_direction && !wish.is_directed {
                    continue;
                }
                for (themes, end) in self.after_wish(&themes, end) {
                    let kind = wish.clone().of(themes);
                    found.push((self.clause(kind, (start, end), Form::Place), end));
                }
            }
        }
        found
    }

    /// The objects of a verb, with where they come from.
    fn moved(&self, at: usize) -> Parses<Vec<NounPhrase>> {
        let mut found = Vec::new();
        for (themes, next) in self.nouns.list(at, Described::ByAll) {
            for (source, end) in self.nouns.source(next) {
                found.push((described_all(&themes, &source), end));
            }
            found.push((themes, next));
        }
        found
    }

    /// "… from the left peg" and "… except red" after the place.
    fn after_wish(&self, themes: &[NounPhrase], at: usize) -> Parses<Vec<NounPhrase>> {
        let mut found = vec![(themes.to_vec(), at)];
        let sources = self.nouns.source(at).into_iter();
        found.extend(sources.map(|(source, end)| (described_all(themes, &source), end)));
        let comma = usize::from(self.is(at, &Meaning::Comma));
        if let [object] = themes
            && self.is(at + comma, &Meaning::Exception)
        {
            let excepted = self.nouns.excepted(object, at + comma + 1).into_iter();
            found.extend(excepted.map(|(object, end)| (vec![object], end)));
        }
        found
    }

    /// "take red off blue": a later clause says where to; "take red to the left peg".
    fn taken(&self, at: usize) -> Parses<Clause> {
        let mut found: Parses<Clause> = Vec::new();
        for (themes, next) in self.moved(at + 1) {
            let kind = ClauseKind::Take { themes };
            found.push((self.clause(kind, (at, next), Form::Closed), next));
        }
        found.extend(self.placed(at, at + 1, true));
        found
    }

    /// Objects in relations one after the other: "red on blue on green".
    fn chained(&self, start: usize, at: usize) -> Parses<Clause> {
        let mut found = Vec::new();
        for (themes, next) in self.nouns.list(at, Described::ByClauses) {
            let next = next + usize::from(self.is(next, &Meaning::Participle));
            for (wish, end) in self.wishes(next, Described::ByClauses, true) {
                for (themes, end) in self.after_wish(&themes, end) {
                    let kind = wish.clone().of(themes);
                    found.push((self.clause(kind, (start, end), Form::Chain), end));
                }
            }
        }
        found
    }

    /// "put red on blue on the table": among names alone, places may follow each other, too.
    fn bare_chain(&self, start: usize, at: usize) -> Parses<Clause> {
        let mut found = self.chained(start, at);
        found.retain(|(clause, _)| match &clause.kind {
            ClauseKind::Place { themes, links, ends } => {
                let is_long = links.len() + usize::from(ends.is_some()) > 1;
                let landmarks = links.iter().map(|link| &link.landmark);
                is_long && themes.iter().chain(landmarks).all(NounPhrase::is_bare)
            }
            ClauseKind::GoesOn { .. }
            | ClauseKind::Has { .. }
            | ClauseKind::Chain { .. }
            | ClauseKind::Take { .. }
            | ClauseKind::Swap { .. }
            | ClauseKind::Heading { .. } => false,
        });
        for (clause, _) in &mut found {
            clause.form = Form::Place;
        }
        found
    }

    /// "red should be on blue", "the red block is clear", "red must not be on the table".
    fn subject_first(&self, at: usize) -> Parses<Clause> {
        let mut found = Vec::new();
        for (themes, next) in self.nouns.list(at, Described::ByAll) {
            let Some(copula) = self.copula(next) else { continue };
            if themes.iter().any(NounPhrase::is_bare_and_placed) {
                continue;
            }
            let next = next + 1 + usize::from(self.is(next + 1, &Meaning::Participle));
            let mut wishes = self.wishes(next, Described::ByAll, false);
            if copula != Copula::Denial {
                wishes.extend(self.wishes(next, Described::ByClauses, true));
            }
            for (wish, end) in wishes {
                for (themes, end) in self.after_wish(&themes, end) {
                    let kind = wish.clone().of(themes);
                    let mut clause = self.clause(kind, (at, end), Form::Subject);
                    clause.mood = match copula {
                        Copula::Wish => Mood::Wish,
                        Copula::State => Mood::State,
                        Copula::Denial => Mood::Denial,
                    };
                    clause.is_command = copula != Copula::State;
                    found.push((clause, end));
                }
            }
        }
        found
    }

    /// "on green put red", "on the left peg: red".
    fn inverted(&self, at: usize) -> Parses<Clause> {
        let mut found = Vec::new();
        for (wish, next) in self.wishes(at, Described::ByClauses, false) {
            let has_verb = matches!(self.verb(next), Some(Verb::Place | Verb::Build));
            let next = next + usize::from(has_verb);
            for (themes, end) in self.nouns.list(next, Described::ByClauses) {
                // "clear red" begins with the property itself.
                if wish.links.is_empty() && !has_verb {
                    continue;
                }
                let kind = wish.clone().of(themes);
                found.push((self.clause(kind, (at, end), Form::Place), end));
            }
        }
        found
    }

    /// A head without objects, "on the table:", with those of the list behind the colon.
    pub(super) fn without_themes(&self, at: usize, objects: &[NounPhrase]) -> Vec<Clause> {
        let next = at + usize::from(self.verb(at).is_some_and(|verb| verb != Verb::Swap));
        let is_whole = |end: usize| end == self.nouns.tokens.len();
        let wishes = self.wishes(next, Described::ByAll, false).into_iter();
        wishes
            .filter(|(_, end)| is_whole(*end))
            .map(|(wish, end)| self.clause(wish.of(objects.to_vec()), (at, end), Form::Place))
            .collect()
    }

    /// "clear red and blue", "slice the carrot".
    fn property_first(&self, at: usize) -> Parses<Clause> {
        let at_verb =
            at + usize::from(matches!(self.verb(at), Some(Verb::Place | Verb::Build | Verb::Keep)));
        let mut found = Vec::new();
        for what in self.traits(at_verb) {
            for (themes, end) in self.moved(at_verb + 1) {
                if themes.iter().any(NounPhrase::is_bare_and_placed) {
                    continue;
                }
                for (themes, end) in self.after_wish(&themes, end) {
                    let kind = ClauseKind::Has { themes, what: what.clone() };
                    found.push((self.clause(kind, (at, end), Form::Closed), end));
                }
            }
        }
        found
    }

    /// "from top to bottom red, blue", "red, blue from top to bottom".
    fn sequences(&self, at: usize) -> Parses<Clause> {
        let mut found = Vec::new();
        let chain = |(sequence_idx, word): (usize, Span), objects| ClauseKind::Chain {
            sequence_idx,
            word,
            objects,
        };
        if let Some(sequence) = self.sequence(at)
            && let Some((objects, end)) = self.plain_list(at + 1)
        {
            found.push((self.clause(chain(sequence, objects), (at, end), Form::Chain), end));
        }
        if let Some((objects, end)) = self.plain_list(at)
            && let Some(sequence) = self.sequence(end)
        {
            let clause = self.clause(chain(sequence, objects), (at, end + 1), Form::Chain);
            found.push((clause, end + 1));
        }
        found
    }

    pub(super) fn sequence(&self, at: usize) -> Option<(usize, Span)> {
        let token = self.token(at)?;
        token.meanings.iter().find_map(|meaning| match meaning {
            Meaning::Sequence(idx) => Some((*idx, token.span.clone())),
            _ => None,
        })
    }

    /// "red, green and blue": commas, and at most one "and", before the last object; or "and" alone.
    pub(super) fn plain_list(&self, at: usize) -> Option<(Vec<NounPhrase>, usize)> {
        let mut objects = Vec::new();
        let mut ands: Vec<bool> = Vec::new();
        let mut at = at;
        loop {
            let (object, next) =
                self.nouns.noun_phrase(at, Described::ByClauses, usize::MAX).pop()?;
            objects.push(object);
            let comma = usize::from(self.is(next, &Meaning::Comma));
            let is_and =
                self.is(next + comma, &Meaning::And) || self.is(next + comma, &Meaning::Sequel);
            let after = next + comma + usize::from(is_and);
            let is_last = after == next
                || objects.len() >= LIST_MAX
                || self.nouns.noun_phrase(after, Described::ByClauses, usize::MAX).is_empty();
            if is_last {
                let (_, inner) = ands.split_last().unwrap_or((&false, &[]));
                let is_regular = inner.iter().all(|and| !and) || ands.iter().all(|and| *and);
                return is_regular.then_some((objects, next));
            }
            ands.push(is_and);
            at = after;
        }
    }

    fn swapped(&self, at: usize) -> Parses<Clause> {
        let mut found = Vec::new();
        for (first, next) in self.nouns.noun_phrase(at + 1, Described::ByClauses, 0) {
            if !self.is(next, &Meaning::And) && !self.is(next, &Meaning::SwappedWith) {
                continue;
            }
            for (second, end) in self.nouns.noun_phrase(next + 1, Described::ByClauses, 0) {
                let kind = ClauseKind::Swap { both: Box::new([first.clone(), second]) };
                found.push((self.clause(kind, (at, end), Form::Closed), end));
            }
        }
        found
    }
}

/// Whether words name what a heading is about, and no object of their own.
fn is_heading(object: &NounPhrase, is_stacks: bool) -> bool {
    match &object.head {
        Head::Thing(thing) => {
            let is_bare = Thing { all: false, ..thing.clone() };
            let is_type = !is_bare.has_content();
            object.except.is_empty() && is_type && (thing.is_plural() || is_stacks)
        }
        Head::Listed => true,
        Head::It | Head::They | Head::Rest | Head::Named(_) => false,
    }
}

/// The place after commas, "and" and "then", and whether a comma is all that stands there.
pub(super) fn after_separators(tokens: &[Token], at: usize) -> (usize, bool) {
    let is_separator = |token: &&Token| {
        [Meaning::Comma, Meaning::And, Meaning::Sequel].iter().any(|end| token.is(end))
    };
    let n = tokens[at..].iter().take_while(is_separator).count();
    let only_comma = n == 1 && tokens[at].is(&Meaning::Comma);
    (at + n, only_comma)
}

/// Whether a place describes a bare name, with no direction that tells the goal from it.
fn describes_bare(clause: &Clause) -> bool {
    let ClauseKind::Place { themes, links, .. } = &clause.kind else { return false };
    let landmarks = links.iter().map(|link| &link.landmark);
    themes.iter().chain(landmarks).any(NounPhrase::is_bare_and_placed)
}

/// The same objects, each with one description more.
fn described_all(themes: &[NounPhrase], description: &Description) -> Vec<NounPhrase> {
    let described = |object: &NounPhrase| {
        let mut object = object.clone();
        if !matches!(object.head, Head::It | Head::They | Head::Listed) {
            object.descriptions.push(description.clone());
        }
        object
    };
    themes.iter().map(described).collect()
}
