//! Every phrase that means something, from the domain's language, the shared words and the objects in
//! view.

#![expect(
    clippy::wildcard_enum_match_arm,
    reason = "a phrase has many meanings, and each place of the grammar asks for a few"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::super::language::{Language, Pick, english, misfit};
use super::super::{GoalError, GoalObject};
use super::meaning::{Meaning, Verb};
use super::words::{domain_entries, shared_entries, weak_entries};

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
            Some(other) => {
                write!(f, "{key}: \"{phrase}\" already means something else, below {other}")
            }
        }
    }
}

/// Every phrase of a language that cannot mean what it is to mean, in the order of its lists.
pub fn word_faults(language: &Language) -> Vec<WordFault> {
    let mut faults = Vec::new();
    if let Ok(english) = english() {
        Vocabulary::empty(language, english).fill(language, english, &[], &mut faults);
    }
    faults.into_iter().map(|(fault, _)| fault).collect()
}

/// Phrases (as lists of lower-case words without articles) and what they mean.
#[derive(Debug)]
pub(super) struct Vocabulary {
    pub(super) articles: BTreeSet<String>,
    pub(super) directions: BTreeSet<String>,
    pub(super) phrases: BTreeMap<Vec<String>, Vec<(&'static str, Meaning)>>,
    /// Length of the longest phrase in words.
    pub(super) words_max: usize,
}

/// A fault, and whether the phrase keeps its older meaning without harm.
type Tolerated = (WordFault, bool);

impl Vocabulary {
    /// Collects the phrases; object names join last, where their words are not known otherwise.
    pub(super) fn new(language: &Language, objects: &[GoalObject]) -> Result<Self, GoalError> {
        let english = english()?;
        let mut vocabulary = Self::empty(language, english);
        let mut faults = Vec::new();
        vocabulary.fill(language, english, objects, &mut faults);
        if let Some((fault, _)) = faults.into_iter().find(|(_, is_harmless)| !is_harmless) {
            return Err(misfit(fault.to_string()));
        }
        vocabulary.add_names(objects);
        Ok(vocabulary)
    }

    fn empty(language: &Language, english: &Language) -> Self {
        let lower = |lists: [&Vec<String>; 2]| {
            lists.into_iter().flatten().map(|word| word.to_lowercase()).collect()
        };
        Self {
            articles: lower([&language.articles, &english.articles]),
            directions: lower([&language.directions, &english.directions]),
            phrases: BTreeMap::new(),
            words_max: 1,
        }
    }

    /// Takes in the shared words, the domain's, the colours in view, and of the shared words for places
    /// those that the domain does not say itself.
    fn fill(
        &mut self,
        language: &Language,
        english: &Language,
        objects: &[GoalObject],
        faults: &mut Vec<Tolerated>,
    ) {
        for (key, phrases, meaning) in shared_entries(english) {
            for phrase in phrases {
                faults.extend(self.add(key, phrase, &meaning).err().map(|fault| (fault, false)));
            }
        }
        // A domain that lists a shared word again may not give it another class. The class that the
        // grammar knows stands; the domain's list is told by the check of the folder.
        for (key, phrases, meaning) in shared_entries(language) {
            for phrase in phrases {
                faults.extend(self.add(key, phrase, &meaning).err().map(|fault| (fault, true)));
            }
        }
        for (key, phrases, meaning) in domain_entries(language) {
            for phrase in phrases {
                faults.extend(self.add(key, phrase, &meaning).err().map(|fault| (fault, false)));
            }
        }
        let colours = objects.iter().filter_map(|object| object.colour.as_ref());
        for colour in colours.chain(language.colours.keys()) {
            let meaning = Meaning::Colour(colour.clone());
            let further = english.colour_words.get(colour).into_iter().flatten();
            for word in std::iter::once(colour.as_str()).chain(further.map(String::as_str)) {
                faults
                    .extend(self.add("colours", word, &meaning).err().map(|fault| (fault, false)));
            }
        }
        for (key, phrases, meaning) in weak_entries(english) {
            for phrase in phrases {
                if self.knows(phrase) {
                    continue;
                }
                faults.extend(self.add(key, phrase, &meaning).err().map(|fault| (fault, false)));
            }
        }
    }

    fn knows(&self, phrase: &str) -> bool {
        self.phrases.contains_key(&self.words_of(phrase))
    }

    fn words_of(&self, phrase: &str) -> Vec<String> {
        let mut words = split(phrase);
        words.retain(|word| !self.articles.contains(word));
        words
    }

    /// Every single word of every phrase.
    pub(super) fn words(&self) -> impl Iterator<Item = &str> {
        self.phrases.keys().flatten().chain(&self.articles).map(String::as_str)
    }

    fn add(&mut self, key: &'static str, phrase: &str, meaning: &Meaning) -> Result<(), WordFault> {
        let fault = |other| WordFault { key, phrase: phrase.to_owned(), other };
        let words = self.words_of(phrase);
        if words.is_empty() {
            return Err(fault(None));
        }
        self.words_max = self.words_max.max(words.len());
        let meanings = self.phrases.entry(words).or_default();
        if meanings.iter().any(|(_, other)| other == meaning) {
            return Ok(());
        }
        if let Some((other, _)) = meanings.iter().find(|(_, other)| !may_share(other, meaning)) {
            return Err(fault(Some(other)));
        }
        meanings.push((key, meaning.clone()));
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
                meanings.push(("names", Meaning::Named(object.name.clone())));
            }
        }
    }

    /// What a row of words means.
    pub(super) fn meanings(&self, words: &[String]) -> Option<Vec<Meaning>> {
        let meanings = self.phrases.get(words)?;
        Some(meanings.iter().map(|(_, meaning)| meaning.clone()).collect())
    }

    /// The phrases for a position before its noun, in words.
    pub(super) fn before(&self, pick: Pick) -> impl Iterator<Item = &Vec<String>> {
        let is_it = move |meanings: &[(&str, Meaning)]| {
            meanings.iter().any(|(_, meaning)| *meaning == Meaning::Before(pick))
        };
        self.phrases.iter().filter(move |(_, meanings)| is_it(meanings)).map(|(words, _)| words)
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
/// or, after a colour, an object; "stack" may be a verb or a noun; "but" and "both" and the like stand at
/// different places.
fn may_share(left: &Meaning, right: &Meaning) -> bool {
    let pair = |a: &Meaning, b: &Meaning| match a {
        Meaning::Relation(_) => matches!(b, Meaning::Relation(_) | Meaning::HeadingEnd),
        Meaning::Number(_) => matches!(b, Meaning::Noun { many: false, .. }),
        Meaning::Noun { many, .. } => {
            matches!(b, Meaning::Noun { many: other, .. } if many == other)
        }
        Meaning::Stacks | Meaning::Everything(_) => *b == Meaning::Verb(Verb::Build),
        Meaning::SwappedWith => matches!(b, Meaning::HeadingEnd | Meaning::Relation(_)),
        _ => false,
    };
    pair(left, right) || pair(right, left)
}
