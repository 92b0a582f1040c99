//! Which module may name what: the invariants of `ARCHITECTURE.md` that can be checked by reading.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

mod circles;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::common::{files_below, in_project, project};
use circles::Modules;

/// Who alone may name an outside crate: name, folders that are read, beginnings of paths.
const OWNERS: &[(&str, &str, &[&str])] = &[
    ("cdr_encoding", "src", &["src/hardware/recording/ros.rs"]),
    ("clap", "src", &["src/cli/"]),
    ("comfy_table", "src", &["src/cli/"]),
    ("console", "src", &["src/cli/"]),
    ("groundloop_sim", "src", &["src/hardware/sim/"]),
    ("iceoryx2", "src", &["src/transport/"]),
    ("indicatif", "src", &["src/cli/"]),
    ("mcap", "src", &["src/hardware/recording/"]),
    ("prost", "src", &["src/hardware/recording/foxglove.rs"]),
    ("ractor", "src", &["src/actors/"]),
    (
        "rapier3d",
        "sim/src",
        &[
            "sim/src/bodies.rs",
            "sim/src/convert.rs",
            "sim/src/fingers.rs",
            "sim/src/grip.rs",
            "sim/src/hold.rs",
            "sim/src/world.rs",
        ],
    ),
    ("reqwest", "src", &["src/http/"]),
    ("rustix::time", "sim/src", &[]),
    ("rustix::time", "src", &["src/clock/"]),
    ("rustls", "src", &["src/http/"]),
    ("serde_saphyr", "src", &["src/hardware/calibration/file.rs"]),
    ("std::time::Instant", "src", &["src/clock/"]),
    ("tracing_subscriber", "src", &["src/cli/out.rs"]),
];

/// Modules that compute values from values.
const PURE: &[&str] = &[
    "executive",
    "geometry",
    "hardware/encodings",
    "logic",
    "messages",
    "pddl",
    "perception/fusion",
    "perception/grounders",
    "perception/model",
    "perception/tracking",
    "picture",
    "planning",
    "replanning",
    "scene",
];

/// What reads files, clocks or dice, waits, or starts something.
const IMPURE: &[&str] = &[
    "rand",
    "rand_chacha",
    "reqwest",
    "rustix",
    "std::env",
    "std::fs",
    "std::net",
    "std::process",
    "std::thread",
    "std::time",
    "tokio",
];

/// A line of code: its number, and its text without strings and comments.
type Line = (usize, String);

/// The code of a Rust text: comments and the insides of strings are blank.
fn code(text: &str) -> Vec<Line> {
    let mut lines = Vec::new();
    let mut kept = String::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if c == '"' {
            string_length(rest)
        } else if let Some(raw) = rest.strip_prefix("r#\"") {
            3 + raw.find("\"#").unwrap() + 2
        } else if ["'\"'", "'\\\"'"].iter().any(|quote| rest.starts_with(quote)) {
            rest[1..].find('\'').unwrap() + 2
        } else {
            kept.push(c);
            rest = &rest[c.len_utf8()..];
            continue;
        };
        kept.extend(rest[..skipped].chars().filter(|c| *c == '\n'));
        rest = &rest[skipped..];
    }
    lines.extend(kept.lines().map(str::to_owned).enumerate().map(|(i, line)| (i + 1, line)));
    lines
}

/// How long the string is that a text begins with, quotes and all.
fn string_length(text: &str) -> usize {
    let mut escaped = false;
    for (i, c) in text.char_indices().skip(1) {
        match c {
            '"' if !escaped => return i + 1,
            '\\' => escaped = !escaped,
            _ => escaped = false,
        }
    }
    text.len()
}

#[test]
fn code_is_told_from_strings_and_comments() {
    let text = "use a; // use b\nlet c = \"use \\\" d\"; use e;\nf(r#\"use \"g\"#, '\"', h)\n";
    let code: Vec<String> = code(text).into_iter().map(|(_, line)| line).collect();
    assert_eq!(code, ["use a; ", "let c = ; use e;", "f(, , h)"]);
}

#[test]
fn names_are_told_from_parts_of_names() {
    for line in ["use std::fs::read;", "use std::fs;", "x(std::fs::read(y))"] {
        assert!(names(line, "std::fs"), "{line}");
    }
    for line in ["use std::fsync;", "use mystd::fs;", "use crate::std::fs;", "let tokio_fs = 1;"] {
        assert!(!names(line, "std::fs") && !names(line, "tokio"), "{line}");
    }
    let lines = [(7, "use crate::pddl::Atom; fn f(x: crate::scene::Facts)".to_owned())];
    assert_eq!(uses(&lines), [(7, "pddl".to_owned()), (7, "scene".to_owned())]);
    assert_eq!(module_of("src/pddl/parse/domain.rs"), "pddl");
}

/// The code of a file.
fn code_of(path: &Path) -> Vec<Line> {
    code(&fs::read_to_string(path).unwrap())
}

/// Whether a path such as `std::fs` stands in a line, as whole words.
fn names(line: &str, path: &str) -> bool {
    let part_of_name = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(path).any(|(at, _)| {
        let (before, after) = (&line[..at], &line[at + path.len()..]);
        let is_path = !before.ends_with("::") || before.ends_with(" ::");
        is_path && !before.ends_with(part_of_name) && !after.starts_with(part_of_name)
    })
}

/// The module of `lib.rs` that a file belongs to.
fn module_of(path: &str) -> &str {
    let below = path.strip_prefix("src/").unwrap();
    below.split(['/', '.']).next().unwrap()
}

/// Whether a file of the source is a test and nothing else.
fn is_test(path: &str) -> bool {
    path.ends_with("/tests.rs") || path.contains("/tests/")
}

/// Fails with every line that breaks a rule.
#[track_caller]
fn none(faults: &[String]) {
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn outside_crates_are_named_by_their_owners_only() {
    let mut faults = Vec::new();
    for (name, folder, owners) in OWNERS {
        let mut owned: BTreeSet<&str> = BTreeSet::new();
        for path in files_below(&project(folder), "rs") {
            let shown = in_project(&path);
            let owner = owners.iter().find(|owner| shown.starts_with(**owner));
            for (number, line) in code_of(&path).iter().filter(|(_, line)| names(line, name)) {
                owned.extend(owner);
                if owner.is_none() {
                    faults.push(format!("{shown}:{number}: {name} here: {}", line.trim()));
                }
            }
        }
        let stale = owners.iter().filter(|owner| !owned.contains(*owner));
        // A clock type that nobody uses needs no owner.
        let stale = stale.filter(|_| !name.starts_with("std::"));
        faults.extend(stale.map(|owner| format!("{owner} does not name {name} any more")));
    }
    none(&faults);
}

#[test]
fn the_simulator_knows_nothing_of_the_rest() {
    let manifest = fs::read_to_string(project("sim/Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    for table in ["dependencies", "dev-dependencies", "build-dependencies"] {
        let names = manifest.get(table).and_then(toml::Value::as_table).into_iter().flatten();
        for (name, _) in names {
            assert!(!name.starts_with("groundloop"), "sim/Cargo.toml: {table}: {name}");
        }
    }
    let mut faults = Vec::new();
    for path in files_below(&project("sim/src"), "rs") {
        let lines = code_of(&path);
        let named = lines.iter().filter(|(_, line)| names(line, "groundloop"));
        faults.extend(named.map(|(number, _)| format!("{}:{number}", in_project(&path))));
        let read = |name: &&&str| lines.iter().any(|(_, line)| names(line, name));
        for name in IMPURE.iter().filter(|name| **name != "rand_chacha").filter(read) {
            faults.push(format!("{}: {name}", in_project(&path)));
        }
    }
    none(&faults);
}

#[test]
fn the_core_does_no_io() {
    let mut faults = Vec::new();
    for module in PURE {
        let files = files_below(&project("src").join(module), "rs");
        assert!(!files.is_empty(), "src/{module}/ is gone: name its successor");
        for path in files {
            for (number, line) in code_of(&path) {
                if let Some(name) = IMPURE.iter().find(|name| names(&line, name)) {
                    faults.push(format!("{}:{number}: {name}", in_project(&path)));
                }
            }
        }
    }
    none(&faults);
}

/// Modules of `lib.rs` in reading order.
fn modules() -> Vec<String> {
    let lines = code_of(&project("src/lib.rs"));
    let names = lines.iter().filter_map(|(_, line)| line.strip_prefix("pub mod "));
    names.map(|name| name.trim_end_matches(';').to_owned()).collect()
}

/// What a code names of this crate: line number and module.
fn uses(lines: &[Line]) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (number, line) in lines {
        for (at, _) in line.match_indices("crate::") {
            let rest = &line[at + "crate::".len()..];
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            found.push((*number, rest[..end].to_owned()));
        }
    }
    found
}

/// The lines before the tests that stand at the end of a file.
fn before_tests(lines: &[Line]) -> &[Line] {
    let begin = |pair: &[Line]| pair[0].1 == "#[cfg(test)]" && pair[1].1 == "mod tests {";
    &lines[..lines.windows(2).position(begin).unwrap_or(lines.len())]
}

#[test]
fn a_module_uses_only_what_stands_before_it() {
    let order = modules();
    let place = |module: &str| order.iter().position(|m| m == module);
    let mut faults = Vec::new();
    for path in files_below(&project("src"), "rs") {
        let shown = in_project(&path);
        if is_test(&shown) {
            continue; // a test may look down from anywhere
        }
        let from = module_of(&shown);
        let Some(from_place) = place(from) else { continue };
        for (number, to) in uses(before_tests(&code_of(&path))) {
            let Some(to_place) = place(&to) else {
                faults.push(format!("{shown}:{number}: write crate::module::…, one to a line"));
                continue;
            };
            if to_place > from_place {
                faults.push(format!("{shown}:{number}: {from} stands before {to} in lib.rs"));
            }
        }
    }
    none(&faults);
}

/// The code of a crate's files that are no tests, by their paths below its folder.
fn source(folder: &str) -> Vec<(String, String)> {
    let root = project(folder);
    let files = files_below(&root, "rs").into_iter().filter(|path| !is_test(&in_project(path)));
    let read = |path: std::path::PathBuf| {
        let below = path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned();
        let lines: Vec<String> = code_of(&path).into_iter().map(|(_, line)| line).collect();
        (below, lines.join("\n"))
    };
    files.map(read).collect()
}

/// Within every folder, files and folders use each other in one direction only.
#[test]
fn there_are_no_circles_between_files() {
    for folder in ["src", "sim/src"] {
        none(&Modules::read(&source(folder)).circles());
    }
}

#[test]
fn circles_are_found_through_exports_and_folders() {
    let file = |path: &str, code: &str| (path.to_owned(), code.to_owned());
    let lib = file("lib.rs", "mod a;\nmod b;\nmod c;\npub use c::Thing;");
    let c = file("c.rs", "pub struct Thing;");
    let circles = |a: &str, b: &str| {
        let files = [lib.clone(), file("a/mod.rs", "mod x;\npub use x::X;"), c.clone()];
        let inner = [file("a/x.rs", a), file("b.rs", b)];
        Modules::read(&[&files[..], &inner].concat()).circles()
    };
    let to_b = "use crate::{\n    b::{self, B as Other},\n    Thing,\n};";
    assert_eq!(circles(to_b, "pub struct B;"), [] as [&str; 0]);
    for back in ["use crate::a::X;", "use super::a;", "fn f() -> crate::a::X {}"] {
        assert_eq!(circles(to_b, back).len(), 1, "{back}");
    }
    let in_tests = "pub struct B;\n#[cfg(test)]\nmod tests {\n    use crate::a::X;\n}";
    assert_eq!(circles(to_b, in_tests), [] as [&str; 0]);
    assert_eq!(circles("use super::Own;", "use crate::Thing;"), [] as [&str; 0], "its own folder");
}

#[test]
fn every_folder_of_the_source_is_in_the_reading_order() {
    let order = modules();
    for folder in crate::common::folders_in(&project("src")) {
        let name = folder.file_name().unwrap().to_str().unwrap();
        assert!(order.iter().any(|m| m == name), "src/{name} is not a `pub mod` of lib.rs");
    }
    let room = |folder: &str| folder.split('/').next().unwrap_or_default().to_owned();
    assert!(PURE.iter().all(|folder| order.contains(&room(folder))));
    assert!(OWNERS.is_sorted() && PURE.is_sorted() && IMPURE.is_sorted());
}

#[test]
fn shared_memory_holds_no_pointer_and_no_machine_sized_number() {
    let path = project("src/transport/wire.rs");
    for (number, line) in code_of(&path) {
        let field = line.trim().strip_prefix("pub ").filter(|line| line.contains(": "));
        let field = field.filter(|field| !field.starts_with("const ") && !field.starts_with("fn "));
        for bad in ["usize", "isize", "bool", "char", "String", "Vec", "Box", "Option", "&", "*"] {
            let here = field.is_some_and(|field| match bad {
                "&" | "*" => field.contains(bad),
                bad => names(field, bad),
            });
            assert!(!here, "src/transport/wire.rs:{number}: {bad} in a record: {}", line.trim());
        }
    }
}
