//! Goals said in many ways: each sentence is read as its goal, and none is once a foreign phrase stands in
//! it.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::collections::BTreeSet;

use crate::common::project;
use groundloop::goals::instruction::parse_in;
use groundloop::goals::{GoalObject, GoalView};
use groundloop::logic::Facts;
use groundloop::pddl::{Atom, Condition, Literal, Name, Term};
use groundloop::run::DomainFolder;
use proptest::prelude::*;

/// Words that no domain has, and places that none of them can say.
const FOREIGN: &[&str] = &[
    "gently",
    "wobbly",
    "xyzzy",
    "next to",
    "beside",
    "behind",
    "or",
    "never",
    "if",
    "unless",
    "maybe",
    "some",
    "near",
    "twice",
    "except",
    "who",
    "between",
    "instead of",
    "without",
];

/// What is seen of a domain, and how its goals may be said.
struct Speech {
    folder: DomainFolder,
    objects: Vec<GoalObject>,
    facts: Facts,
    /// Objects that are moved, as they are called in sentences; and where to.
    themes: &'static [(&'static str, &'static str)],
    places: &'static [(&'static str, &'static str)],
    /// Words between the two.
    words: &'static [&'static str],
    predicate: &'static str,
    /// Phrases for a property of a theme, behind it.
    has: (&'static [&'static str], &'static str),
}

fn speech(
    domain: &str,
    objects: &[&str],
    themes: &'static [(&'static str, &'static str)],
    places: &'static [(&'static str, &'static str)],
    (words, predicate): (&'static [&'static str], &'static str),
    has: (&'static [&'static str], &'static str),
) -> Speech {
    let folder = DomainFolder::read(&project("domains").join(domain)).unwrap();
    let objects = objects.iter().enumerate().map(|(i, text)| {
        let (name, type_name) = text.split_once(':').unwrap();
        let x = 60.0 * i as f64;
        let pixel_box = Some([x, 0.0, x + 40.0, 40.0].into());
        GoalObject::new(&folder.perception, name.into(), type_name.into(), pixel_box)
    });
    let objects = objects.collect();
    Speech { folder, objects, facts: Facts::default(), themes, places, words, predicate, has }
}

const BLOCKS: &[(&str, &str)] = &[
    ("the red block", "red_block"),
    ("green", "green_block"),
    ("the blue cube", "blue_block"),
    ("yellow_block", "yellow_block"),
    ("the rightmost block", "pink_block"),
];
const DISKS: &[(&str, &str)] =
    &[("the red disk", "red_disk"), ("green", "green_disk"), ("the blue ring", "blue_disk")];
const PEGS: &[(&str, &str)] = &[
    ("the left peg", "left_peg"),
    ("the middle peg", "middle_peg"),
    ("the peg on the right", "right_peg"),
    ("the first peg from the right", "right_peg"),
    ("peg 2", "middle_peg"),
];
const FOOD: &[(&str, &str)] =
    &[("the tomato", "tomato"), ("carrot", "carrot"), ("the cucumber", "cucumber")];

fn speeches() -> Vec<Speech> {
    let blocks = ["red_block:block", "green_block:block", "blue_block:block", "yellow_block:block"];
    let blocks: Vec<&str> = blocks.into_iter().chain(["pink_block:block"]).collect();
    let pegs = ["left_peg:peg", "middle_peg:peg", "right_peg:peg"];
    let disks: Vec<&str> =
        pegs.into_iter().chain(["red_disk:disk", "green_disk:disk", "blue_disk:disk"]).collect();
    let food = ["tomato:veggie", "carrot:veggie", "cucumber:veggie", "bowl:container"];
    let food: Vec<&str> = food.into_iter().chain(["wooden_board:workspace"]).collect();
    let table = (&["on the table"][..], "ontable");
    vec![
        speech("blocksworld", &blocks, BLOCKS, BLOCKS, (&["on", "on top of", "onto"], "on"), table),
        speech("hanoi", &disks, DISKS, PEGS, (&["on", "onto", "to"], "on-peg"), (&[], "clear")),
        speech(
            "cooking",
            &food,
            FOOD,
            &[("the bowl", "bowl"), ("the dish", "bowl")],
            (&["in", "into"], "in"),
            (&[], "is-sliced"),
        ),
    ]
}

impl Speech {
    fn read(&self, sentence: &str) -> Result<BTreeSet<String>, String> {
        let view = GoalView { objects: &self.objects, facts: Some(&self.facts) };
        let language = self.folder.language.as_ref().unwrap();
        let parsed = parse_in(sentence, &self.folder.domain, language, view);
        parsed.map(|parsed| literals(&parsed.goal)).map_err(|error| error.render())
    }
}

/// The ground literals of a conjunction; a quantifier is kept as its text.
fn literals(goal: &Condition) -> BTreeSet<String> {
    if let Condition::And(parts) = goal {
        return parts.iter().flat_map(literals).collect();
    }
    BTreeSet::from([goal.to_string()])
}

fn atom(predicate: &str, args: &[&str]) -> String {
    let args = args.iter().map(|name| Term::Object(Name::new(name))).collect();
    Condition::Atom(Literal { predicate: predicate.into(), args }).to_string()
}

/// One statement of a goal, as it is said.
#[derive(Debug, Clone)]
struct Said {
    theme: usize,
    /// `None`: the property.
    place: Option<usize>,
    word: usize,
    form: usize,
    is_denied: bool,
}

fn said() -> impl Strategy<Value = Said> {
    let place = proptest::option::weighted(0.8, 0..9usize);
    (0..9usize, place, 0..9usize, 0..6usize, proptest::bool::weighted(0.15)).prop_map(
        |(theme, place, word, form, is_denied)| Said { theme, place, word, form, is_denied },
    )
}

/// A sentence for the statement, and the literal that it asks for.
fn sentence(speech: &Speech, said: &Said) -> Option<(String, String, Name)> {
    let (theme, theme_name) = speech.themes[said.theme % speech.themes.len()];
    let (what, wanted) = if let Some(idx) = said.place {
        let (place, place_name) = speech.places[idx % speech.places.len()];
        let word = speech.words[said.word % speech.words.len()];
        let wanted = atom(speech.predicate, &[theme_name, place_name]);
        (place_name != theme_name).then(|| (format!("{word} {place}"), wanted))?
    } else {
        let phrase = speech.has.0.first()?;
        ((*phrase).to_owned(), atom(speech.has.1, &[theme_name]))
    };
    if said.is_denied {
        let text = format!("{theme} must not be {what}");
        return Some((text, format!("(not {wanted})"), theme_name.into()));
    }
    let text = match said.form {
        0 => format!("put {theme} {what}"),
        1 => format!("{theme} should be {what}"),
        2 => format!("I want {theme} {what}"),
        3 => format!("take {theme} and put it {what}"),
        4 => format!("make sure that {theme} is {what}"),
        _ => format!("please move {theme} {what}"),
    };
    Some((text, wanted, theme_name.into()))
}

/// Statements about different objects, none of which another one speaks of, so that they agree.
fn text_of(speech: &Speech, all: &[Said]) -> Option<(String, BTreeSet<String>)> {
    let mut sentences = Vec::new();
    let mut wanted = BTreeSet::new();
    let mut used: BTreeSet<Name> = BTreeSet::new();
    for said in all {
        let Some((text, literal, theme)) = sentence(speech, said) else { continue };
        let landmark = said.place.map(|idx| Name::new(speech.places[idx % speech.places.len()].1));
        let is_block = landmark.as_ref().filter(|_| std::ptr::eq(speech.themes, speech.places));
        if used.contains(&theme) || is_block.is_some_and(|name| used.contains(name)) {
            continue;
        }
        used.insert(theme);
        used.extend(is_block.cloned());
        sentences.push(text);
        wanted.insert(literal);
    }
    (!sentences.is_empty()).then(|| (sentences.join(". ") + ".", wanted))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn what_is_said_of_a_goal_reads_as_that_goal(all in proptest::collection::vec(said(), 1..4)) {
        for speech in SPEECHES.iter() {
            let Some((text, wanted)) = text_of(speech, &all) else { continue };
            prop_assert_eq!(speech.read(&text), Ok(wanted), "{}", text);
        }
    }

    #[test]
    fn a_foreign_phrase_leaves_no_goal(
        all in proptest::collection::vec(said(), 1..3),
        phrase in 0..FOREIGN.len(),
        at in 0.0..1.0,
    ) {
        for speech in SPEECHES.iter() {
            let Some((text, _)) = text_of(speech, &all) else { continue };
            let mut words: Vec<&str> = text.split(' ').collect();
            let idx = (at * (words.len() + 1) as f64) as usize;
            words.insert(idx.min(words.len()), FOREIGN[phrase]);
            let text = words.join(" ");
            let read = speech.read(&text);
            prop_assert!(read.is_err(), "{}: {:?}", text, read);
        }
    }

    /// A chain said from either end, by a list or by relations.
    #[test]
    fn a_chain_is_read_from_either_end(
        order in Just(vec![0, 1, 2, 3, 4]).prop_shuffle(),
        n in 2..5usize,
        form in 0..6usize,
    ) {
        let speech = &SPEECHES[0];
        let down: Vec<&str> = order[..n].iter().map(|idx| ["red", "green", "blue", "yellow", "pink"][*idx]).collect();
        let up: Vec<&str> = down.iter().rev().copied().collect();
        let list = |names: &[&str]| {
            let (last, first) = names.split_last().unwrap();
            format!("{} and {last}", first.join(", "))
        };
        let text = match form {
            0 => format!("Create a stack of blocks: {}.", down.join(" over ")),
            1 => format!("Stack {} from top to bottom.", list(&down)),
            2 => format!("From bottom to top: {}.", list(&up)),
            3 => format!("Build a tower with {}", down.join(" on ")),
            4 => up.join(" under "),
            _ => format!("Make a tower of {n} blocks: {}", down.join(" on ")),
        };
        let atoms = down.windows(2).map(|pair| {
            let names: Vec<Name> = pair.iter().map(|c| Name::new(format!("{c}_block"))).collect();
            Atom { predicate: "on".into(), args: names }.to_string()
        });
        prop_assert_eq!(speech.read(&text), Ok(atoms.collect()), "{}", text);
    }
}

static SPEECHES: std::sync::LazyLock<Vec<Speech>> = std::sync::LazyLock::new(speeches);
