//! Every phrase that means something, from the domain's language and the objects in view.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

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

impl Meaning {
    /// The key of `language.toml` that phrases of this meaning stand below.
    fn key(&self) -> &'static str {
        match self {
            Self::Filler => "fillers",
            Self::Separator | Self::Stop => "separators",
            Self::HeadingEnd => "heading_ends",
            Self::All => "all",
            Self::Pronoun => "pronouns",
            Self::Source => "sources",
            Self::Number(_) => "numbers",
            Self::Colour(_) => "colours",
            Self::Noun { .. } | Self::Everything(_) | Self::Named(_) => "noun",
            Self::Before(_) | Self::After(_) => "position",
            Self::Relation(_) => "relation",
            Self::Property(_) => "property",
            Self::Sequence(_) => "sequence",
            Self::Stacks => "stacks",
        }
    }
}

/// A phrase of `language.toml` that cannot mean what it is to mean.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WordFault {
    /// The key that it stands below.
    pub key: &'static str,
    /// The phrase.
    pub phrase: String,
    /// The key below which it means something else already; `None`: it has no word but articles.
    pub other: Option<&'static str>,
}

impl fmt::Display for WordFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, phrase, .. } = self;
        match self.other {
            None => write!(f, "{key}: \"{phrase}\" has no word but articles"),
            Some(_) => write!(f, "{key}: \"{phrase}\" already means something else"),
        }
    }
}

/// Every phrase of a language that cannot mean what it is to mean, in the order of its lists.
pub fn word_faults(language: &Language) -> Vec<WordFault> {
    let articles = language.articles.iter().map(|word| word.to_lowercase()).collect();
    let mut vocabulary = Vocabulary { articles, phrases: BTreeMap::new(), words_max: 1 };
    let mut faults = Vec::new();
    vocabulary.fill(language, std::iter::empty(), &mut faults);
    faults
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
        let colours = objects.iter().filter_map(|object| object.colour.as_ref());
        let mut faults = Vec::new();
        vocabulary.fill(language, colours, &mut faults);
        if let Some(fault) = faults.into_iter().next() {
            return Err(misfit(fault.to_string()));
        }
        vocabulary.add_names(objects);
        Ok(vocabulary)
    }

    /// Takes in every phrase of the language, and these colours; what it cannot take is a fault.
    fn fill<'a>(
        &mut self,
        language: &'a Language,
        colours: impl Iterator<Item = &'a Name>,
        faults: &mut Vec<WordFault>,
    ) {
        for (key, phrases, meaning) in entries(language) {
            let added = phrases.iter().map(|phrase| self.add(key, phrase, meaning.clone()));
            faults.extend(added.filter_map(Result::err));
        }
        for colour in colours.chain(language.colours.keys()) {
            let meaning = Meaning::Colour(colour.clone());
            faults.extend(self.add("colours", colour.as_str(), meaning).err());
        }
    }

    /// Every single word of every phrase.
    pub(super) fn words(&self) -> impl Iterator<Item = &str> {
        self.phrases.keys().flatten().chain(&self.articles).map(String::as_str)
    }

    fn add(&mut self, key: &'static str, phrase: &str, meaning: Meaning) -> Result<(), WordFault> {
        let fault = |other| WordFault { key, phrase: phrase.to_owned(), other };
        let mut words = split(phrase);
        words.retain(|word| !self.articles.contains(word));
        if words.is_empty() {
            return Err(fault(None));
        }
        self.words_max = self.words_max.max(words.len());
        let meanings = self.phrases.entry(words).or_default();
        if meanings.contains(&meaning) {
            return Ok(());
        }
        if let Some(other) = meanings.iter().find(|other| !may_share(other, &meaning)) {
            return Err(fault(Some(other.key())));
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
