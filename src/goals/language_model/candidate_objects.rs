//! Which objects an instruction may speak of before anything has shown them.
//!
//! A model may not invent objects, but an instruction may name some that nobody has seen yet. With a
//! `language.toml` these are the names that its nouns give to unseen objects (`{colour}_{type}`), for
//! the colours and nouns that the instruction has in it. Without one they are `word_type` where the
//! instruction says "word type" ("red block": `red_block`).

use std::collections::BTreeSet;

use super::super::language::Noun;
use super::super::{GoalObject, Language};
use crate::pddl::{Domain, Name, Typed};

/// The unseen objects that an instruction may mean, without those that are seen or constant.
pub(super) fn unseen(
    instruction: &str,
    domain: &Domain,
    language: Option<&Language>,
    objects: &[GoalObject],
) -> Vec<Typed> {
    let said = words(instruction);
    let mut found: Vec<Typed> = match language {
        Some(language) => {
            let colours = colours_said(&said, language, objects);
            language.nouns.iter().flat_map(|noun| of_noun(noun, &said, &colours)).collect()
        }
        None => of_types(&said, domain),
    };
    let is_known = |name: &Name| {
        objects.iter().any(|object| object.name == *name)
            || domain.constants.iter().any(|constant| constant.name == *name)
    };
    let mut names: BTreeSet<Name> = BTreeSet::new();
    found.retain(|typed| !is_known(&typed.name) && names.insert(typed.name.clone()));
    found
}

/// Words in lower case, without a plural's s.
fn words(text: &str) -> Vec<String> {
    let words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(|word| singular(&word.to_lowercase())).collect()
}

fn singular(word: &str) -> String {
    let stem = word.strip_suffix('s').filter(|stem| stem.len() > 2 && !stem.ends_with('s'));
    stem.unwrap_or(word).to_owned()
}

/// Whether a phrase's words stand in a row in what is said.
fn says(said: &[String], phrase: &str) -> bool {
    let phrase = words(phrase);
    !phrase.is_empty() && said.windows(phrase.len()).any(|window| window == phrase.as_slice())
}

/// Colours that are said, by any of their words.
fn colours_said(said: &[String], language: &Language, objects: &[GoalObject]) -> BTreeSet<Name> {
    let listed = language.colours.iter().filter(|(colour, words)| {
        says(said, colour.as_str()) || words.iter().any(|word| says(said, word))
    });
    let seen = objects.iter().filter_map(|object| object.colour.as_ref());
    let seen = seen.filter(|colour| says(said, colour.as_str()));
    listed.map(|(colour, _)| colour).chain(seen).cloned().collect()
}

fn of_noun(noun: &Noun, said: &[String], colours: &BTreeSet<Name>) -> Vec<Typed> {
    let Some(template) = &noun.name else { return Vec::new() };
    let template = template.replace("{type}", noun.type_name.as_str());
    let typed = |name: String| Typed::new(name.as_str(), noun.type_name.clone());
    if template.contains("{colour}") {
        let fill = |colour: &Name| typed(template.replace("{colour}", colour.as_str()));
        return colours.iter().map(fill).collect();
    }
    let mut phrases = noun.one.iter().chain(&noun.many).map(String::as_str);
    let is_said = says(said, &template) || phrases.any(|phrase| says(said, phrase));
    is_said.then(|| typed(template)).into_iter().collect()
}

fn of_types(said: &[String], domain: &Domain) -> Vec<Typed> {
    let named = |pair: &[String]| match pair {
        [word, kind] => {
            let of_type = domain.types.parents.keys().find(|name| *name == kind.as_str());
            of_type.map(|name| Typed::new(format!("{word}_{name}").as_str(), name.clone()))
        }
        _ => None,
    };
    said.windows(2).filter_map(named).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::{SourceText, parse_domain};

    fn names(instruction: &str, language: Option<&str>, seen: &[&str]) -> Vec<String> {
        let text = "(define (domain d) (:types block bowl peg) (:predicates (on ?x ?y - block)))";
        let domain = parse_domain(&SourceText::new("d", text)).unwrap().value;
        let language = language.map(|text| Language::from_toml("language.toml", text).unwrap());
        let seen = seen.iter().map(|name| GoalObject {
            name: Name::new(name),
            type_name: "block".into(),
            colour: None,
            pixel_box: None,
        });
        let seen: Vec<GoalObject> = seen.collect();
        let found = unseen(instruction, &domain, language.as_ref(), &seen);
        found.iter().map(|t| format!("{}:{}", t.name, t.types[0])).collect()
    }

    #[test]
    fn with_a_language_its_nouns_and_the_colours_said_give_names() {
        let language = r#"
            examples = []
            colours = { red = [], blue = [], cyan = ["light blue"] }
            noun = [
                { type = "block", one = ["block"], many = ["blocks"], name = "{colour}_{type}" },
                { type = "bowl", one = ["bowl", "dish"], many = [], name = "bowl" },
                { type = "peg", one = ["peg"], many = [] },
            ]"#;
        let names = |said: &str, seen: &[&str]| names(said, Some(language), seen);
        assert_eq!(
            names("Red on the light blue one.", &[]),
            ["blue_block:block", "cyan_block:block", "red_block:block"]
        );
        assert_eq!(names("Put the red block into a dish on a peg", &["red_block"]), ["bowl:bowl"]);
        assert_eq!(names("put everything down", &[]), Vec::<String>::new());
    }

    #[test]
    fn without_a_language_a_word_before_a_type_gives_a_name() {
        let said = "put the Red block on big blocks, not on the table";
        assert_eq!(names(said, None, &[]), ["red_block:block", "big_block:block"]);
    }
}
