//! Every phrase that means something, from the domain's language and the objects in view.

use std::collections::{BTreeMap, BTreeSet};

use super::super::language::{Language, misfit};
use super::super::{GoalError, GoalObject};
use crate::pddl::Name;

/// What a phrase means; indices point into the lists of [`Language`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Meaning {
    Filler,
    Separator,
    /// `.` or `;`: ends a sentence.
    Stop,
    HeadingEnd,
    All,
    Pronoun,
    Source,
    Number(usize),
    Colour(Name),
    Noun {
        noun_idx: usize,
        many: bool,
    },
    Everything(usize),
    /// A position before its noun, or alone.
    Before(usize),
    /// A position after its noun.
    After(usize),
    Relation(usize),
    Property(usize),
    Sequence(usize),
    Stacks,
    Named(Name),
}

/// Phrases (as lists of lower-case words without articles) and what they mean.
#[derive(Debug)]
pub(super) struct Vocabulary {
    pub(super) articles: BTreeSet<String>,
    pub(super) phrases: BTreeMap<Vec<String>, Vec<Meaning>>,
    /// Length of the longest phrase in words.
    pub(super) words_max: usize,
}

impl Vocabulary {
    /// Collects the phrases; object names join last, where their words are not known otherwise.
    pub(super) fn new(language: &Language, objects: &[GoalObject]) -> Result<Self, GoalError> {
        let articles = language.articles.iter().map(|word| word.to_lowercase()).collect();
        let mut vocabulary = Self { articles, phrases: BTreeMap::new(), words_max: 1 };
        for (key, phrases, meaning) in entries(language) {
            for phrase in phrases {
                vocabulary.add(key, phrase, meaning.clone())?;
            }
        }
        let colours = objects.iter().filter_map(|object| object.colour.as_ref());
        for colour in colours.chain(language.colours.keys()) {
            vocabulary.add("colours", colour.as_str(), Meaning::Colour(colour.clone()))?;
        }
        vocabulary.add_names(objects);
        Ok(vocabulary)
    }

    /// Every single word of every phrase.
    pub(super) fn words(&self) -> impl Iterator<Item = &str> {
        self.phrases.keys().flatten().chain(&self.articles).map(String::as_str)
    }

    fn add(&mut self, key: &str, phrase: &str, meaning: Meaning) -> Result<(), GoalError> {
        let mut words = split(phrase);
        words.retain(|word| !self.articles.contains(word));
        if words.is_empty() {
            return Err(misfit(format!("{key}: \"{phrase}\" has no word but articles")));
        }
        self.words_max = self.words_max.max(words.len());
        let meanings = self.phrases.entry(words).or_default();
        if meanings.contains(&meaning) {
            return Ok(());
        }
        if meanings.iter().any(|other| !may_share(other, &meaning)) {
            return Err(misfit(format!("{key}: \"{phrase}\" already means something else")));
        }
        meanings.push(meaning);
        Ok(())
    }

    /// Lets objects be called by their names ("cutting board" for `cutting_board`). A name made of
    /// known words ("red block") keeps the meaning of these words: it may fit several objects.
    fn add_names(&mut self, objects: &[GoalObject]) {
        let known: BTreeSet<String> = self.words().map(str::to_owned).collect();
        for object in objects {
            let words = split(object.name.as_str());
            if words.is_empty() || words.iter().all(|word| known.contains(word)) {
                continue;
            }
            self.words_max = self.words_max.max(words.len());
            let meanings = self.phrases.entry(words).or_default();
            if meanings.is_empty() {
                meanings.push(Meaning::Named(object.name.clone()));
            }
        }
    }
}

/// The words of a phrase or a name, in lower case.
pub(super) fn split(phrase: &str) -> Vec<String> {
    phrase
        .split(|c: char| !c.is_alphanumeric() && !matches!(c, '\'' | '&' | '+'))
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect()
}

/// Relations that share a phrase are told apart by the types of their objects; "one" may be a number
/// or, after a colour, an object.
fn may_share(left: &Meaning, right: &Meaning) -> bool {
    matches!(
        (left, right),
        (Meaning::Relation(_), Meaning::Relation(_))
            | (Meaning::Number(_), Meaning::Noun { many: false, .. })
            | (
                Meaning::Noun { many: false, .. },
                Meaning::Number(_) | Meaning::Noun { many: false, .. }
            )
            | (Meaning::Noun { many: true, .. }, Meaning::Noun { many: true, .. })
    )
}

type Entry<'a> = (&'static str, &'a [String], Meaning);

fn entries(language: &Language) -> Vec<Entry<'_>> {
    let mut list: Vec<Entry<'_>> = vec![
        ("fillers", &language.fillers, Meaning::Filler),
        ("separators", &language.separators, Meaning::Separator),
        ("heading_ends", &language.heading_ends, Meaning::HeadingEnd),
        ("all", &language.all, Meaning::All),
        ("pronouns", &language.pronouns, Meaning::Pronoun),
        ("sources", &language.sources, Meaning::Source),
    ];
    for (idx, word) in language.numbers.iter().enumerate() {
        list.push(("numbers", std::slice::from_ref(word), Meaning::Number(idx + 1)));
    }
    for (colour, words) in &language.colours {
        list.push(("colours", words, Meaning::Colour(colour.clone())));
    }
    if let Some(stacks) = &language.stacks {
        list.push(("stacks", &stacks.phrases, Meaning::Stacks));
    }
    for (noun_idx, noun) in language.nouns.iter().enumerate() {
        list.push(("noun", &noun.one, Meaning::Noun { noun_idx, many: false }));
        list.push(("noun", &noun.many, Meaning::Noun { noun_idx, many: true }));
        list.push(("noun", &noun.everything, Meaning::Everything(noun_idx)));
    }
    for (idx, position) in language.positions.iter().enumerate() {
        list.push(("position", &position.before, Meaning::Before(idx)));
        list.push(("position", &position.after, Meaning::After(idx)));
    }
    for (idx, relation) in language.relations.iter().enumerate() {
        list.push(("relation", &relation.phrases, Meaning::Relation(idx)));
    }
    for (idx, property) in language.properties.iter().enumerate() {
        list.push(("property", &property.phrases, Meaning::Property(idx)));
    }
    for (idx, sequence) in language.sequences.iter().enumerate() {
        list.push(("sequence", &sequence.phrases, Meaning::Sequence(idx)));
    }
    list
}
