//! The lists of a language with what their phrases mean.

use super::super::Language;
use super::meaning::{Copula, Meaning, Ordinal, Refusal, RowSide, Verb};

/// A key of `language.toml`, its phrases, what they mean.
pub(super) type Entry<'a> = (&'static str, &'a [String], Meaning);

/// The classes of words that the grammar knows, whatever the domain.
pub(super) fn shared_entries(language: &Language) -> Vec<Entry<'_>> {
    let mut list: Vec<Entry<'_>> = vec![
        ("openers", &language.openers, Meaning::Opener(false)),
        ("requests", &language.requests, Meaning::Opener(true)),
        ("places", &language.places, Meaning::Verb(Verb::Place)),
        ("takes", &language.takes, Meaning::Verb(Verb::Take)),
        ("builds", &language.builds, Meaning::Verb(Verb::Build)),
        ("keeps", &language.keeps, Meaning::Verb(Verb::Keep)),
        ("swaps", &language.swaps, Meaning::Verb(Verb::Swap)),
        ("copulas", &language.copulas, Meaning::Copula(Copula::Wish)),
        ("states", &language.states, Meaning::Copula(Copula::State)),
        ("denials", &language.denials, Meaning::Copula(Copula::Denial)),
        ("participles", &language.participles, Meaning::Participle),
        ("relatives", &language.relatives, Meaning::Relative),
        ("sequels", &language.sequels, Meaning::Sequel),
        ("separators", &language.separators, Meaning::And),
        ("heading_ends", &language.heading_ends, Meaning::HeadingEnd),
        ("all", &language.all, Meaning::All),
        ("listed", &language.listed, Meaning::Listed),
        ("pronouns", &language.pronouns, Meaning::Pronoun),
        ("plural_pronouns", &language.plural_pronouns, Meaning::PluralPronoun),
        ("exceptions", &language.exceptions, Meaning::Exception),
        ("rest", &language.rest, Meaning::Rest),
        ("others", &language.others, Meaning::Other),
        ("sources", &language.sources, Meaning::Source),
        ("last", &language.last, Meaning::Ordinal(Ordinal::Last)),
        ("from_left", &language.from_left, Meaning::FromSide(RowSide::Left)),
        ("from_right", &language.from_right, Meaning::FromSide(RowSide::Right)),
        ("swapped_with", &language.swapped_with, Meaning::SwappedWith),
        ("negations", &language.negations, Meaning::Refused(Refusal::Negation)),
        ("alternatives", &language.alternatives, Meaning::Refused(Refusal::Alternative)),
        ("questions", &language.questions, Meaning::Refused(Refusal::Question)),
        ("conditions", &language.conditions, Meaning::Refused(Refusal::Condition)),
        ("vague", &language.vague, Meaning::Refused(Refusal::Vague)),
    ];
    for (idx, word) in language.numbers.iter().enumerate() {
        list.push(("numbers", std::slice::from_ref(word), Meaning::Number(idx + 1)));
    }
    for (idx, word) in language.ordinals.iter().enumerate() {
        let meaning = Meaning::Ordinal(Ordinal::Nth(idx + 1));
        list.push(("ordinals", std::slice::from_ref(word), meaning));
    }
    for position in &language.positions {
        list.push(("position", &position.before, Meaning::Before(position.pick)));
        list.push(("position", &position.after, Meaning::After(position.pick)));
    }
    list.push(("fillers", &language.fillers, Meaning::Filler));
    list
}

/// What a domain adds: its objects and what can be said of them.
pub(super) fn domain_entries(language: &Language) -> Vec<Entry<'_>> {
    let mut list: Vec<Entry<'_>> = Vec::new();
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

/// Shared words for places that a domain may say itself.
pub(super) fn weak_entries(language: &Language) -> Vec<Entry<'_>> {
    vec![
        ("left_of", &language.left_of, Meaning::Beside(RowSide::Left)),
        ("right_of", &language.right_of, Meaning::Beside(RowSide::Right)),
        ("inexpressible", &language.inexpressible, Meaning::Inexpressible),
    ]
}
