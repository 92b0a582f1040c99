//! What is wished of objects: a property, one place, or places one after the other.

#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a phrase has many meanings, and each place of the grammar asks for a few"
)]

use super::clauses::ClauseParser;
use super::meaning::{Copula, Meaning};
use super::noun_phrases::{Described, LIST_MAX, Parses, relations};
use super::syntax::{Head, Link, NounPhrase, Thing, Trait, Wish};

impl ClauseParser<'_> {
    pub(super) fn traits(&self, at: usize) -> Vec<Trait> {
        let Some(token) = self.token(at) else { return Vec::new() };
        let word = || token.span.clone();
        let property = |meaning: &Meaning| match meaning {
            Meaning::Property(idx) => Some(Trait { property_idx: *idx, word: word() }),
            _ => None,
        };
        token.meanings.iter().filter_map(property).collect()
    }

    /// What is wished from `at` on: a property, one place, or with `is_chain` several.
    pub(super) fn wishes(&self, at: usize, described: Described, is_chain: bool) -> Parses<Wish> {
        let at = at + usize::from(self.is(at, &Meaning::Participle));
        let mut found = Vec::new();
        let directed = |at: usize| self.token(at).is_some_and(|token| token.is_directed);
        for what in self.traits(at) {
            let is_directed = directed(at);
            found.push((Wish { links: Vec::new(), ends: Some(what), is_directed }, at + 1));
        }
        let mut open: Parses<Vec<Link>> = vec![(Vec::new(), at)];
        while let Some((links, next)) = open.pop() {
            let turns = !links.is_empty() && !directed(at) && directed(next);
            for (link, end) in self.links(next, described).into_iter().filter(|_| !turns) {
                let longer = [links.as_slice(), &[link]].concat();
                let is_directed = directed(at);
                if is_chain && longer.len() < LIST_MAX {
                    open.push((longer.clone(), self.after_link(end)));
                    // "move red on green to the table" leads to one place.
                    let turns = !is_directed && directed(end);
                    let ends = self.traits(end).into_iter().filter(|_| !turns);
                    let wish = |what| Wish { links: longer.clone(), ends: Some(what), is_directed };
                    found.extend(ends.map(|what| (wish(what), end + 1)));
                }
                found.push((Wish { links: longer, ends: None, is_directed }, end));
            }
        }
        found
    }

    /// "…, which is" between two relations that may both be wished for.
    pub(super) fn after_link(&self, at: usize) -> usize {
        if self.is(at, &Meaning::Comma) && self.is(at + 1, &Meaning::Relative) {
            let is_state = self.is(at + 2, &Meaning::Copula(Copula::State));
            return at + 2 + usize::from(is_state);
        }
        at
    }

    /// A relation to an object, or to a position alone ("on the right").
    pub(super) fn links(&self, at: usize, described: Described) -> Parses<Link> {
        let mut found = Vec::new();
        let Some(token) = self.token(at) else { return found };
        let relation_idxs = relations(token);
        if !relation_idxs.is_empty() {
            for (landmark, end) in self.nouns.noun_phrase(at + 1, described, 0) {
                let (relation_idxs, word) = (relation_idxs.clone(), token.span.clone());
                found.push((Link { relation_idxs, word, landmark }, end));
            }
        }
        if let [relation, position] = token.parts.as_slice() {
            let pick = position.meanings.iter().find_map(|meaning| match meaning {
                Meaning::Before(pick) => Some(*pick),
                _ => None,
            });
            let thing = Thing { pick, has_article: position.has_article, ..Thing::default() };
            let landmark = NounPhrase::new(Head::Thing(thing), position.span.clone());
            let (relation_idxs, word) = (relations(relation), relation.span.clone());
            found.push((Link { relation_idxs, word, landmark }, at + 1));
        }
        found
    }
}
