//! `groundloop domain check`: shipped domains lack nothing, and each thing that is missing is told by file and
//! field. `groundloop new domain`: what it writes passes, and runs.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs;
use std::path::Path;

use crate::common::{project, schema};
use assert_cmd::cargo::cargo_bin_cmd;
use groundloop::domain_check::check_domain;
use groundloop::files::{Folder, shipped_domains};
use serde_json::Value;
use tempfile::TempDir;

/// Exit code, standard output and standard error of a call from a folder.
fn call(folder: &Path, args: &[&str]) -> (Option<i32>, String, String) {
    let output = cargo_bin_cmd!("groundloop").current_dir(folder).args(args).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn shipped_domains_lack_nothing() {
    for name in shipped_domains() {
        for folder in [
            Folder::Disk(project("domains").join(&name)),
            Folder::Embedded(format!("domains/{name}")),
        ] {
            assert_eq!(check_domain(&folder), [], "{folder}");
        }
    }
}

/// A new domain, called `pile`, in a folder of its own.
fn new_domain() -> TempDir {
    let root = TempDir::new().unwrap();
    let (code, _, said) = call(root.path(), &["new", "domain", "pile"]);
    assert_eq!(code, Some(0), "{said}");
    root
}

#[test]
fn a_new_domain_is_checked_rendered_and_run() {
    let root = new_domain();
    let (code, said, _) = call(root.path(), &["domain", "check", "pile"]);
    assert_eq!((code, said.as_str()), (Some(0), "pile: nothing is missing\n"));
    let image = root.path().join("pile/exemplar/sim_640x480/a_tower.png");
    let before = fs::read(&image).unwrap();
    fs::remove_dir_all(root.path().join("pile/exemplar")).unwrap();
    let (code, said, _) = call(root.path(), &["domain", "check", "pile"]);
    assert!(code == Some(6) && said.contains("exemplar render"), "{said}");
    let render = ["exemplar", "render", "pile.toml", "--folder", "sim_640x480"];
    let (code, said, errors) = call(root.path(), &render);
    assert!(code == Some(0) && said.lines().count() == 3, "{said}{errors}");
    assert!(before == fs::read(&image).unwrap(), "rendered as it was");
    for args in [&["domain", "check", "pile"][..], &["exemplar", "check", "pile.toml"]] {
        let (code, said, errors) = call(root.path(), args);
        assert_eq!(code, Some(0), "{said}{errors}");
    }
    let (code, said, errors) = call(root.path(), &["run", "pile.toml", "--seed", "2"]);
    assert!(code == Some(0) && said.contains("reached"), "{said}{errors}");
    let problem = ["--domain", "pile", "--problem", "pile/problems/two-blocks.pddl"];
    let (code, said, errors) = call(root.path(), &[&["plan"][..], &problem].concat());
    assert!(code == Some(0) && said.contains("(put-on "), "{said}{errors}");
}

#[test]
fn a_new_domain_takes_no_name_that_is_taken_or_none() {
    let root = new_domain();
    for (name, expect) in [
        ("pile", "pile: it is there already"),
        ("hanoi", "a name that no shipped domain or run file has"),
        ("../up", "a small letter, then small letters"),
        ("Pile", "a small letter, then small letters"),
        ("", "a small letter, then small letters"),
    ] {
        let (code, _, said) = call(root.path(), &["new", "domain", name]);
        assert!(code == Some(2) && said.contains(expect), "{name}: {said}");
    }
    let (code, _, said) = call(root.path(), &["new", "domain", "pile", "--in", "other"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(root.path().join("other/pile.toml").is_file());
}

/// What the check says of a domain in whose files texts are replaced for as long.
#[track_caller]
fn said(root: &Path, changes: &[(&str, &str, &str)]) -> String {
    let folder = root.join("pile");
    let mut before = Vec::new();
    for (file, from, to) in changes {
        let path = folder.join(file);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{file}: {from}");
        fs::write(&path, text.replace(from, to)).unwrap();
        before.push((path, text));
    }
    let findings = check_domain(&Folder::Disk(folder));
    assert!(!findings.is_empty(), "{changes:?}");
    let (code, said, _) = call(root, &["domain", "check", "pile", "--json"]);
    assert_eq!(code, Some(6));
    let json: Value = serde_json::from_str(&said).unwrap();
    schema::obeys("domain-check", &json);
    assert_eq!(json["right"], false);
    for (path, text) in before.into_iter().rev() {
        fs::write(path, text).unwrap();
    }
    let kinds = json["findings"].as_array().unwrap().iter().map(|f| f["kind"].as_str().unwrap());
    let told = findings.iter().map(|finding| {
        let text = finding.to_string().replace(&format!("{}/", root.display()), "");
        assert_eq!(text.lines().count(), 1, "{text}");
        text
    });
    let lines = kinds.zip(told).map(|(kind, told)| format!("{kind}: {told}\n"));
    lines.collect::<Vec<_>>().concat()
}

#[test]
fn each_thing_that_is_missing_is_told_by_file_and_field() {
    let root = new_domain();
    let said = |changes: &[(&str, &str, &str)]| said(root.path(), changes);
    let one = |file, from, to| said(&[(file, from, to)]);
    let all = [
        one("domain.pddl", "(:types block arm-type", "(:types block tray arm-type"),
        said(&[(
            "perception.toml",
            "[colours]\n",
            "[[type]]\nname = \"arm-type\"\nnaming = { order = \"left_to_right\", template = \"arm\" }\n\n\
             [colours]\n",
        )]),
        one("domain.pddl", "(clear ?x - block)  ", "(wet ?x - block) (clear ?x - block)"),
        one(
            "completion.pddl",
            "(:derived (clear ?x - block)\n",
            "(:derived (on-table ?x - block)\n",
        ),
        one("skills.toml", "name = \"take-off\"", "name = \"take\""),
        said(&[(
            "domain.pddl",
            "(:action put-down",
            "(:action wait :parameters () :precondition (and) :effect (and))\n  (:action put-down",
        )]),
        one("language.toml", "fillers = [", "fillers = [\"on top of\", \"the\", "),
        one("language.toml", "\"Put all blocks", "\"Wibble all blocks"),
        one("language.toml", "[\"clear\", \"free\"]", "[]"),
        one("language.toml", "yellow = []\n", ""),
        one("scenes/labels.toml", "predicate = \"on\"", "predicate = \"clear\""),
        said(&[
            ("exemplar/sim_640x480/a_tower.pddl", "(on green_block yellow_block)", ""),
            ("exemplar/sim_640x480/a_tower.pddl", "(on yellow_block red_block)", ""),
            ("exemplar/sim_640x480/b_beside.pddl", "(on red_block blue_block)", ""),
        ]),
        one("scenes/start.toml", "colour =", "color ="),
        one("scenes/exemplar/b_beside.toml", "[-0.098, 0.0]", "[-0.11, 0.0]"),
        one("problems/two-blocks.pddl", "red_block green_block", "red_block"),
        said(&[
            ("perception.toml", "predicate = \"holding\"", "predicate = \"hold\""),
            ("language.toml", "type = \"block\"", "type = \"blok\""),
            ("skills.toml", "object = \"?x\", onto", "object = \"?z\", onto"),
        ]),
    ];
    insta::assert_snapshot!(all.join("\n"));
}

#[test]
fn a_folder_without_a_domain_is_no_domain() {
    let root = TempDir::new().unwrap();
    let (code, _, said) = call(root.path(), &["domain", "check", "nowhere"]);
    assert!(code == Some(2) && said.contains("a folder with a domain.pddl"), "{said}");
}
