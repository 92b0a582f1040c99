//! The front end and the planner with texts of all kinds: what the fuzz target checks, on its seeds
//! and on texts made from them.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test file")]

use std::fs;
use std::path::Path;

use proptest::prelude::*;
use proptest::sample::Index;

#[path = "../../fuzz/check.rs"]
mod check;

fn seeds() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files.iter().map(|file| fs::read_to_string(file).unwrap()).collect()
}

/// The words and parentheses of a text.
fn tokens(text: &str) -> Vec<String> {
    let spaced = text.replace('(', " ( ").replace(')', " ) ").replace(check::SEPARATOR, " \u{1} ");
    let separator = format!("\n{}\n", check::SEPARATOR);
    spaced.split_whitespace().map(|word| word.replace('\u{1}', &separator)).collect()
}

#[test]
fn seeds_pass() {
    let seeds = seeds();
    assert!(seeds.len() >= 10);
    for seed in seeds {
        check::check(seed.as_bytes());
    }
}

proptest! {
    /// Words left out, repeated and taken from elsewhere: mostly wrong, never a panic, and what is
    /// read all the same obeys every law.
    #[test]
    fn mutated_seeds_break_nothing(
        seed in any::<Index>(),
        edits in proptest::collection::vec((0..4_u8, any::<Index>(), any::<Index>()), 1..6),
    ) {
        let seeds = seeds();
        let mut words = tokens(seed.get::<String>(&seeds));
        for (kind, at, from) in edits {
            if words.is_empty() {
                break;
            }
            let (at, from) = (at.index(words.len()), from.index(words.len()));
            match kind {
                0 => {
                    words.remove(at);
                }
                1 => words.insert(at, words[from].clone()),
                2 => words[at] = words[from].clone(),
                _ => words.swap(at, from),
            }
        }
        check::check(words.join(" ").as_bytes());
    }
}
