//! Noun phrases: every way in which words from some place on name objects.
//!
//! The functions give all readings with the place after each, so that the clause that they stand in
//! decides which of them there is room for.

#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a phrase has many meanings, and each place of the grammar asks for a few"
)]

use super::Span;
use super::meaning::{Copula, Meaning, Ordinal};
use super::syntax::{Description, Head, NounPhrase, Thing};
use super::tokens::Token;

/// Most descriptions of one object, and most of them within each other.
const DESCRIPTIONS_MAX: usize = 2;
const DEPTH_MAX: usize = 3;
/// Most objects of a list.
pub(super) const LIST_MAX: usize = 40;

/// What was read, and the place after it.
pub(super) type Parses<T> = Vec<(T, usize)>;

/// Which descriptions may follow an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Described {
    /// Clauses only: "that is on blue", "left of blue".
    ByClauses,
    /// Also "on blue" alone.
    ByAll,
}

/// Reads noun phrases from a row of tokens.
#[derive(Debug, Clone, Copy)]
pub(super) struct NounParser<'a> {
    pub(super) tokens: &'a [Token],
    /// Whether "peg 2" and "the second peg" are counted from the left.
    pub(super) counts_from_left: bool,
}

impl NounParser<'_> {
    pub(super) fn token(&self, at: usize) -> Option<&Token> {
        self.tokens.get(at)
    }

    pub(super) fn is(&self, at: usize, meaning: &Meaning) -> bool {
        self.token(at).is_some_and(|token| token.is(meaning))
    }

    pub(super) fn span(&self, from: usize, to: usize) -> Span {
        let start = self.token(from).map_or(0, |token| token.span.start);
        let end = to.checked_sub(1).and_then(|at| self.token(at)).map_or(start, |t| t.span.end);
        start..end.max(start)
    }

    /// Objects joined by commas and "and".
    pub(super) fn list(&self, at: usize, described: Described) -> Parses<Vec<NounPhrase>> {
        let mut found = Vec::new();
        let mut open: Parses<Vec<NounPhrase>> = vec![(Vec::new(), at)];
        while let Some((list, at)) = open.pop() {
            for (object, next) in self.noun_phrase(at, described, 0) {
                let mut longer = list.clone();
                longer.push(object);
                // "All except red and blue" leaves both out; "red on green and blue on the table" is two
                // statements: no list goes on behind either.
                let goes_on = |object: &NounPhrase| object.except.is_empty() && !object.is_placed;
                if longer.len() < LIST_MAX
                    && longer.last().is_some_and(goes_on)
                    && let Some(after) = self.list_separator(next)
                {
                    open.push((longer.clone(), after));
                }
                found.push((longer, next));
            }
            if found.len() > LIST_MAX * 4 {
                break;
            }
        }
        found
    }

    /// The place after ",", "and" or ", and".
    fn list_separator(&self, at: usize) -> Option<usize> {
        if self.is(at, &Meaning::Comma) {
            return Some(if self.is(at + 1, &Meaning::And) { at + 2 } else { at + 1 });
        }
        self.is(at, &Meaning::And).then_some(at + 1)
    }

    pub(super) fn noun_phrase(
        &self,
        at: usize,
        described: Described,
        depth: usize,
    ) -> Parses<NounPhrase> {
        let mut found: Parses<NounPhrase> = Vec::new();
        let mut open: Parses<NounPhrase> = self.core(at).into_iter().collect();
        while let Some((object, next)) = open.pop() {
            let can_be_described = !matches!(object.head, Head::It | Head::They | Head::Listed);
            if can_be_described && object.descriptions.len() < DESCRIPTIONS_MAX && depth < DEPTH_MAX
            {
                let is_said = |token: &Token| {
                    let beside = |m: &Meaning| matches!(m, Meaning::Beside(_));
                    token.is(&Meaning::Comma)
                        || token.is(&Meaning::Relative)
                        || token.is(&Meaning::Participle)
                        || token.any(beside)
                };
                let is_placed = !self.token(next).is_some_and(is_said);
                for (description, after) in self.description(next, described, depth) {
                    let mut longer = object.clone();
                    longer.is_placed |= is_placed;
                    longer.descriptions.push(description);
                    longer.span.end = self.span(at, after).end;
                    open.push((longer, after));
                }
            }
            if object.except.is_empty() && self.is(next, &Meaning::Exception) {
                found.extend(self.excepted(&object, next + 1));
            }
            found.push((object, next));
        }
        found
    }

    /// "all blocks" with "except red and blue".
    pub(super) fn excepted(&self, object: &NounPhrase, at: usize) -> Parses<NounPhrase> {
        let is_whole = match &object.head {
            Head::Thing(thing) => thing.is_plural() && !thing.is_listed,
            Head::Rest => true,
            Head::It | Head::They | Head::Listed | Head::Named(_) => false,
        };
        if !is_whole {
            return Vec::new();
        }
        let lists = self.list(at, Described::ByClauses).into_iter();
        lists
            .map(|(except, next)| {
                let span = object.span.start..self.span(at, next).end;
                (NounPhrase { except, span, ..object.clone() }, next)
            })
            .collect()
    }

    /// An object without its descriptions.
    fn core(&self, at: usize) -> Option<(NounPhrase, usize)> {
        let token = self.token(at)?;
        let one = |head: Head| Some((NounPhrase::new(head, token.span.clone()), at + 1));
        for meaning in &token.meanings {
            match meaning {
                Meaning::Pronoun => return one(Head::It),
                Meaning::PluralPronoun if self.core(at + 1).is_some() => return self.both(at + 1),
                Meaning::PluralPronoun => return one(Head::They),
                Meaning::Rest => return one(Head::Rest),
                Meaning::Named(name) => return one(Head::Named(name.clone())),
                // "the stack" is a thing, "stack" something to do.
                Meaning::Everything(idx)
                    if token.has_article || !token.any(|m| matches!(m, Meaning::Verb(_))) =>
                {
                    let thing = Thing { all: true, noun_idx: Some(*idx), ..Thing::default() };
                    return one(Head::Thing(thing));
                }
                _ => {}
            }
        }
        self.thing(at)
    }

    /// "both disks" are two; of "both the red and the blue block" the list says which.
    fn both(&self, at: usize) -> Option<(NounPhrase, usize)> {
        let (mut object, next) = self.core(at)?;
        if let Head::Thing(thing) = &mut object.head
            && thing.is_plural()
        {
            thing.number = thing.number.or(Some(2));
        }
        Some((object, next))
    }

    fn thing(&self, start: usize) -> Option<(NounPhrase, usize)> {
        let mut thing = Thing { has_article: self.token(start)?.has_article, ..Thing::default() };
        let mut at = start;
        while let Some(token) = self.token(at) {
            if !extend(&mut thing, token, at == start) {
                break;
            }
            at += 1;
            if thing.noun_idx.is_some() {
                break;
            }
        }
        if at == start {
            return None;
        }
        at = self.after_noun(&mut thing, at);
        let span = self.span(start, at);
        if thing.is_listed && !thing.has_content() && thing.noun_idx.is_none() {
            return Some((NounPhrase::new(Head::Listed, span), at));
        }
        let is_object = thing.noun_idx.is_some() || thing.has_content();
        // "all but two" names no object; a number alone neither.
        is_object.then(|| (NounPhrase::new(Head::Thing(thing), span), at))
    }

    /// "2" of "peg 2", "from the right" of "the first peg from the right", "on the right" of "the peg on
    /// the right".
    fn after_noun(&self, thing: &mut Thing, mut at: usize) -> usize {
        if let Some(token) = self.token(at)
            && thing.noun_idx.is_some()
        {
            let number = token.meanings.iter().find_map(|meaning| match meaning {
                Meaning::Number(number) => Some(*number),
                _ => None,
            });
            let position = token.meanings.iter().find_map(|meaning| match meaning {
                Meaning::After(pick) => Some(*pick),
                _ => None,
            });
            if let Some(number) = number
                && self.counts_from_left
                && !thing.many
                && !thing.has_content()
            {
                thing.place = Some((Ordinal::Nth(number), None));
                at += 1;
            } else if let Some(pick) = position
                && thing.pick.is_none()
                && thing.place.is_none()
                && !thing.is_plural()
            {
                thing.pick = Some(pick);
                return at + 1;
            }
        }
        let side = self.token(at).and_then(|token| {
            token.meanings.iter().find_map(|meaning| match meaning {
                Meaning::FromSide(side) => Some(*side),
                _ => None,
            })
        });
        if let (Some(side), Some((_, from @ None))) = (side, &mut thing.place) {
            *from = Some(side);
            at += 1;
        }
        at
    }

    /// What tells an object from others, from `at` on.
    fn description(&self, at: usize, described: Described, depth: usize) -> Parses<Description> {
        let mut found = Vec::new();
        let Some(token) = self.token(at) else { return found };
        let comma = usize::from(token.is(&Meaning::Comma));
        if self.is(at + comma, &Meaning::Relative) {
            let mut inner = at + comma + 1;
            let is_copula = |t: &Token| t.is(&Meaning::Copula(Copula::State));
            let has_copula = self.token(inner).is_some_and(is_copula);
            inner += usize::from(has_copula);
            inner += usize::from(self.is(inner, &Meaning::Participle));
            // "which is on blue,": a clause between commas ends with one.
            let close = |(description, next): (Description, usize)| {
                let has_end = comma == 1 && self.is(next, &Meaning::Comma);
                (description, next + usize::from(has_end))
            };
            found.extend(self.said_of(inner, depth).into_iter().map(close));
            return found;
        }
        if token.is(&Meaning::Participle) {
            return self.said_of(at + 1, depth);
        }
        if token.any(|meaning| matches!(meaning, Meaning::Beside(_)))
            || described == Described::ByAll
        {
            found.extend(self.said_of(at, depth));
        }
        found
    }

    /// "on the blue block", "on the table", "left of blue", "from the left peg".
    fn said_of(&self, at: usize, depth: usize) -> Parses<Description> {
        let mut found = Vec::new();
        let Some(token) = self.token(at) else { return found };
        let start = token.span.start;
        if token.is_directed {
            let is_beside = |m: &Meaning| matches!(m, Meaning::Beside(_));
            if !token.any(is_beside) {
                return found;
            }
        }
        let relation_idxs = relations(token);
        let landmarks = || self.noun_phrase(at + 1, Described::ByAll, depth + 1);
        if !relation_idxs.is_empty() {
            found.extend(landmarks().into_iter().map(|(landmark, next)| {
                let span = start..landmark.span.end;
                let (relation_idxs, landmark) = (relation_idxs.clone(), Box::new(landmark));
                (Description::Related { relation_idxs, landmark, span }, next)
            }));
        }
        for meaning in &token.meanings {
            match meaning {
                Meaning::Property(property_idx) => {
                    let (property_idx, span) = (*property_idx, token.span.clone());
                    found.push((Description::Has { property_idx, span }, at + 1));
                }
                Meaning::Beside(side) => {
                    found.extend(landmarks().into_iter().map(|(landmark, next)| {
                        let span = start..landmark.span.end;
                        let (side, landmark) = (*side, Box::new(landmark));
                        (Description::Beside { side, landmark, span }, next)
                    }));
                }
                _ => {}
            }
        }
        found
    }

    /// "from the left peg", after the objects that are moved.
    pub(super) fn source(&self, at: usize) -> Parses<Description> {
        if !self.is(at, &Meaning::Source) {
            return Vec::new();
        }
        let start = self.span(at, at + 1).start;
        let landmarks = self.noun_phrase(at + 1, Described::ByClauses, 1).into_iter();
        landmarks
            .map(|(landmark, next)| {
                let span = start..landmark.span.end;
                (Description::At { landmark: Box::new(landmark), span }, next)
            })
            .collect()
    }
}

/// The relations that a token may mean.
pub(super) fn relations(token: &Token) -> Vec<usize> {
    let relation = |meaning: &Meaning| match meaning {
        Meaning::Relation(idx) => Some(*idx),
        _ => None,
    };
    token.meanings.iter().filter_map(relation).collect()
}

/// Takes one more token into an object; whether it fitted.
fn extend(thing: &mut Thing, token: &Token, is_first: bool) -> bool {
    let is_noun = |meaning: &Meaning| matches!(meaning, Meaning::Noun { .. });
    // An article begins another object, but "all the disks" is one.
    if token.has_article
        && !is_first
        && (thing.has_content() && !thing.all || thing.number.is_some())
    {
        return false;
    }
    let has_content = thing.has_content() || thing.is_listed;
    for meaning in &token.meanings {
        match meaning {
            Meaning::All if !thing.all && !thing.has_content() => thing.all = true,
            Meaning::Listed if is_first => thing.is_listed = true,
            Meaning::Other if !thing.is_other => thing.is_other = true,
            Meaning::Colour(colour) if thing.colour.is_none() => {
                thing.colour = Some(colour.clone());
            }
            Meaning::Before(pick) if thing.pick.is_none() && thing.place.is_none() => {
                thing.pick = Some(*pick);
            }
            Meaning::Ordinal(ordinal) if thing.place.is_none() && thing.pick.is_none() => {
                thing.place = Some((*ordinal, None));
            }
            Meaning::Property(idx)
                if !token.is_directed && thing.colour.is_none() && token.has_article =>
            {
                thing.attributes.push((*idx, token.span.clone()));
            }
            Meaning::Noun { noun_idx, many }
                if has_content || token.has_article || token.meanings.iter().all(is_noun) =>
            {
                thing.noun_idx = Some(*noun_idx);
                thing.many = *many;
            }
            Meaning::Everything(idx) if thing.all || thing.is_other => {
                thing.noun_idx = Some(*idx);
                thing.all = true;
            }
            Meaning::Number(number) if thing.number.is_none() && thing.colour.is_none() => {
                if has_content && token.any(is_noun) {
                    continue;
                }
                thing.number = Some(*number);
            }
            _ => continue,
        }
        return true;
    }
    false
}
