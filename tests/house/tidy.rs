//! The repository checks itself: headers, leftovers, complete folders, tables, lengths, links.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{files_below, folders_in, in_project, project};
use groundloop::files::FileRef;
use groundloop::goals::GOALS;
use groundloop::perception::detectors::DETECTORS;
use groundloop::perception::grounders::GROUNDERS;
use groundloop::perception::model::FEATURES;
use groundloop::planners::PLANNERS;
use groundloop::run::{DomainFolder, load_run};
use groundloop::skills::SKILLS;
use groundloop::stress::load_stress;
use groundloop::sweep::SweepSpec;
use groundloop::transport::topics::TOPICS;

/// Most lines of a file.
const LINES_MAX: usize = 500;

/// Longer files, with the most lines that they may have, and why they are not two.
const LONGER: &[(&str, usize, &str)] =
    &[("tests/house/cli.rs", 650, "the program's whole face: one test per thing that it says")];

/// Folders with Rust code.
const CODE: &[&str] = &["benches", "examples", "sim", "src", "tests"];

/// All Rust files of the project.
fn rust_files() -> Vec<PathBuf> {
    let folders = CODE.iter().map(|folder| project(folder)).filter(|folder| folder.is_dir());
    folders.flat_map(|folder| files_below(&folder, "rs")).collect()
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

/// Fails with everything that is untidy.
#[track_caller]
fn none(faults: &[String]) {
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn every_file_says_what_it_is() {
    let files = rust_files();
    assert!(files.len() > 100);
    let bare = files.iter().filter(|path| !read(path).starts_with("//! "));
    none(&bare.map(|path| in_project(path)).collect::<Vec<_>>());
}

#[test]
fn nothing_is_left_for_later() {
    // In two parts each, so that this file passes.
    let marks = [["FIX", "ME"], ["TO", "DO"], ["XX", "X"], ["dbg", "!("], ["todo", "!("]];
    let marks = marks.map(|parts| parts.concat());
    let texts = ["configs", "domains"].iter().flat_map(|folder| {
        ["toml", "pddl", "json"].iter().flat_map(|e| files_below(&project(folder), e))
    });
    let pages = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", ".ci/run"].map(project);
    let mut faults = Vec::new();
    for path in rust_files().into_iter().chain(texts).chain(pages) {
        for (i, line) in read(&path).lines().enumerate() {
            if let Some(mark) = marks.iter().find(|mark| line.contains(*mark)) {
                faults.push(format!("{}:{}: {mark}", in_project(&path), i + 1));
            }
        }
    }
    none(&faults);
}

#[test]
fn no_file_is_too_long_to_read() {
    let mut faults = Vec::new();
    for path in rust_files() {
        let (shown, n_lines) = (in_project(&path), read(&path).lines().count());
        match LONGER.iter().find(|(longer, ..)| *longer == shown) {
            None if n_lines > LINES_MAX => {
                faults.push(format!("{shown}: {n_lines} lines, expected at most {LINES_MAX}"));
            }
            Some((_, lines_max, _)) if n_lines > *lines_max => {
                faults.push(format!("{shown}: {n_lines} lines, expected at most {lines_max}"));
            }
            Some(_) if n_lines <= LINES_MAX => {
                faults.push(format!("{shown} is short enough: strike the exception out"));
            }
            _ => {}
        }
    }
    for (path, _, reason) in LONGER {
        assert!(project(path).is_file() && !reason.is_empty(), "{path}");
    }
    none(&faults);
}

/// A domain with scenes can be simulated, and then has all that an episode needs.
#[test]
fn every_domain_folder_is_complete() {
    let folders = folders_in(&project("domains"));
    let simulated = |path: &&PathBuf| path.join("scenes").is_dir();
    assert!(folders.len() >= 3 && folders.iter().filter(simulated).count() >= 2);
    for path in folders {
        let shown = in_project(&path);
        let mut files = vec!["domain.pddl", "completion.pddl", "perception.toml", "language.toml"];
        let mut filled = vec![("problems", "pddl")];
        if simulated(&&path) {
            files.extend(["skills.toml", "scenes/labels.toml"]);
            filled.extend([("scenes", "toml"), ("exemplar", "json")]);
        }
        for file in files {
            assert!(path.join(file).is_file(), "{shown}/{file} is missing");
        }
        for (folder, ending) in filled {
            let files = files_below(&path.join(folder), ending);
            assert!(!files.is_empty(), "{shown}/{folder} has no *.{ending}");
        }
        let folder = DomainFolder::read(&path).unwrap();
        assert_eq!(folder.warnings, Vec::<String>::new(), "{shown}");
        let name = path.file_name().unwrap().to_str().unwrap();
        assert_eq!(folder.domain.name.as_str(), name, "the folder has the domain's name");
    }
}

#[test]
fn every_run_file_loads() {
    let files = files_below(&project("configs"), "toml");
    assert!(files.len() >= 6);
    for path in files {
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.parent().unwrap().ends_with("sweeps") {
            SweepSpec::read(&FileRef::disk(&path)).unwrap_or_else(|e| panic!("{e}"));
        } else if name.starts_with("stress") {
            let stress = load_stress(&path).unwrap_or_else(|e| panic!("{e}"));
            for case in &stress.case {
                DomainFolder::find(&case.domain, &stress.origin.folder)
                    .unwrap_or_else(|e| panic!("{e}"));
            }
        } else if name != "defaults.toml" {
            let run = load_run(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
            run.domain_folder().unwrap_or_else(|e| panic!("{e}"));
        }
        let first = read(&path).lines().next().unwrap_or_default().to_owned();
        assert!(first.starts_with("# "), "{} says what it is in its first line", in_project(&path));
    }
}

#[test]
fn tables_of_parts_are_in_alphabetical_order() {
    for names in [
        DETECTORS.names().collect::<Vec<_>>(),
        GOALS.names().collect(),
        GROUNDERS.names().collect(),
        PLANNERS.names().collect(),
        SKILLS.names().collect(),
        FEATURES.iter().map(|feature| feature.name).collect(),
    ] {
        assert!(!names.is_empty());
        assert!(names.is_sorted_by(|a, b| a < b), "{names:?}");
    }
}

/// What a page links to, and the source files that it names.
fn named_files(page: &str) -> Vec<String> {
    let mut found = Vec::new();
    let links = page.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    let links = links.map(|(target, _)| target.split('#').next().unwrap_or_default());
    let links = links.filter(|target| !target.is_empty() && !target.contains("://"));
    found.extend(links.map(str::to_owned));
    // Fenced blocks have three backticks in a row, which leaves the count of the others even.
    let code = page.split('`').skip(1).step_by(2);
    let is_place = |c: char| c.is_alphanumeric() || "_-./".contains(c);
    let is_rust = |code: &&str| Path::new(code).extension().is_some_and(|e| e == "rs");
    let files = code.filter(is_rust).filter(|code| code.chars().all(is_place));
    found.extend(files.map(str::to_owned));
    found
}

#[test]
fn links_and_names_of_files_lead_somewhere() {
    let names: Vec<PathBuf> = rust_files();
    let mut n_named = 0;
    for page in ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md"] {
        for name in named_files(&read(&project(page))) {
            let there = project(&name).exists()
                || project("src").join(&name).exists()
                || (!name.contains('/') && names.iter().any(|path| path.ends_with(&name)));
            assert!(there, "{page} names {name}, which is not there");
            n_named += 1;
        }
    }
    assert!(n_named > 10);
}

/// Examples that a run file's first lines show must be commands that exist.
#[test]
fn files_that_pages_tell_people_to_run_are_there() {
    for page in ["README.md", "ARCHITECTURE.md"] {
        for word in read(&project(page)).split_whitespace() {
            let word = word.trim_matches(['`', '"', '\'', '(', ')', ',', ';', ':', '.']);
            let is_place = |c: char| c.is_alphanumeric() || "_-./".contains(c);
            let shipped = ["configs/", "domains/", "tests/"].iter().any(|f| word.starts_with(f));
            if shipped && word.chars().all(is_place) {
                assert!(project(word).exists(), "{page} names {word}, which is not there");
            }
        }
    }
}

/// Names of public types in a Rust text.
fn public_types(text: &str) -> Vec<&str> {
    let kinds = ["pub struct ", "pub enum ", "pub trait ", "pub type "];
    let lines = text.lines().map(str::trim_start);
    let named = lines.filter_map(|line| kinds.iter().find_map(|kind| line.strip_prefix(kind)));
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    named.map(|rest| rest.split(|c| !is_part(c)).next().unwrap_or_default()).collect()
}

#[test]
fn a_public_type_name_means_one_thing() {
    assert_eq!(public_types("pub struct A<T> {\n  pub enum B {\npub(super) struct C;"), ["A", "B"]);
    let mut homes: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for path in files_below(&project("src"), "rs") {
        for name in public_types(&read(&path)) {
            homes.entry(name.to_owned()).or_default().push(in_project(&path));
        }
    }
    assert!(homes.len() > 100);
    let shared = homes.iter().filter(|(_, files)| files.len() > 1);
    none(&shared.map(|(name, files)| format!("{name}: {}", files.join(", "))).collect::<Vec<_>>());
}

/// A topic that is declared is in `TOPICS`, and in the table of ARCHITECTURE.
#[test]
fn every_topic_is_in_the_tables() {
    let declared = read(&project("src/transport/topics.rs"));
    let n_declared = declared.lines().filter(|line| line.contains(": Topic = ")).count();
    assert_eq!(n_declared, TOPICS.len(), "TOPICS in src/transport/topics.rs lacks a topic");
    let text = read(&project("ARCHITECTURE.md"));
    let rows: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("| `")).collect();
    for topic in TOPICS {
        let named = format!("`{}`", topic.name);
        let has_row = rows.iter().any(|row| {
            let first = row.split(" | ").next().unwrap();
            format!("`{first}").contains(&named)
        });
        assert!(has_row, "ARCHITECTURE.md: the table of topics lacks {named}");
    }
}
