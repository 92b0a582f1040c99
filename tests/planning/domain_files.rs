//! Domains by their names, and what is wrong in a domain's files or named in vain, told at its line.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs;
use std::path::Path;

use crate::common::project;
use assert_cmd::cargo::cargo_bin_cmd;
use tempfile::TempDir;

/// Exit code, standard output and standard error of a call from a folder.
fn call(folder: &Path, args: &[&str]) -> (Option<i32>, String, String) {
    let output = cargo_bin_cmd!("groundloop").current_dir(folder).args(args).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// A folder with the blocksworld domain, as `blocksworld`, and the file of its disturbed run.
fn copied() -> TempDir {
    let folder = TempDir::new().unwrap();
    let to = folder.path().join("blocksworld");
    fs::create_dir_all(to.join("scenes")).unwrap();
    for file in [
        "domain.pddl",
        "completion.pddl",
        "perception.toml",
        "language.toml",
        "skills.toml",
        "scenes/five_blocks.toml",
    ] {
        fs::copy(project("domains/blocksworld").join(file), to.join(file)).unwrap();
    }
    let run = project("configs/blocksworld_disturbed.toml");
    fs::copy(run, folder.path().join("disturbed.toml")).unwrap();
    folder
}

/// What `config check` says of the disturbed run when a text in one of its files is another one.
#[track_caller]
fn said(file: &str, from: &str, to: &str) -> String {
    let folder = copied();
    let path = folder.path().join(file);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from}");
    fs::write(&path, text.replacen(from, to, 1)).unwrap();
    let args = ["config", "check", "disturbed.toml", "--set", "domain=blocksworld"];
    let (code, _, said) = call(folder.path(), &args);
    assert_eq!(code, Some(2), "{said}");
    said
}

#[test]
fn what_is_misspelt_in_a_domain_is_told_at_its_line_with_what_is_near() {
    let perception = |from, to| said("blocksworld/perception.toml", from, to);
    let skills = |from, to| said("blocksworld/skills.toml", from, to);
    let scene = |from, to| said("blocksworld/scenes/five_blocks.toml", from, to);
    let said = [
        perception("prompt =", "promt ="),
        perception("\"mask_relation\"", "\"mask_relatoin\""),
        perception("predicate = \"holding\"", "predicate = \"hold\""),
        perception("type = \"robot\"", "type = \"robto\""),
        said("blocksworld/language.toml", "acyclic =", "acyklic ="),
        said("blocksworld/language.toml", "type = \"block\"", "type = \"blok\""),
        said("blocksworld/language.toml", "predicate = \"on\"", "predicate = \"om\""),
        skills("\nsequence", "\nseqence"),
        skills("object =", "objekt ="),
        skills("\"place\"", "\"plaze\""),
        skills("name = \"stack\"", "name = \"stak\""),
        scene("colour", "color"),
        scene("size_m", "size"),
        scene("stack_height_max", "height_max"),
        scene("\"#c8322d\"", "\"red\""),
    ];
    insta::assert_snapshot!("misspelt_in_a_domain", said.join("\n"));
}

#[test]
fn what_a_fault_names_in_vain_is_told_at_its_line() {
    let run = |from, to| said("disturbed.toml", from, to);
    let said = [
        run("object = \"red_block\"", "object = \"red_blok\""),
        run("\"knock_over\", object = \"yellow_block\"", "\"beside_peg\", object = \"peg\""),
        run("during = \"stack\"", "during = \"stak\""),
        run("nth = 2", "nth = 0"),
        run("at_s = 2.0", "at_s = -2.0"),
    ];
    insta::assert_snapshot!("named_by_faults", said.join("\n"));
}

#[test]
fn what_shipped_files_name_is_there() {
    let folder = TempDir::new().unwrap();
    let mut n_with_faults = 0;
    for entry in fs::read_dir(project("configs")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        // Sweeps are of another form: tests/closed_loop/sweep.rs.
        if path.is_file() && name != "defaults" {
            let (code, _, said) = call(folder.path(), &["config", "check", name]);
            assert_eq!(code, Some(0), "{said}");
            n_with_faults += usize::from(fs::read_to_string(&path).unwrap().contains("[[fault]]"));
        }
    }
    assert!(n_with_faults >= 2);
}

#[test]
fn shipped_domains_are_found_by_name_wherever_one_is() {
    let folder = TempDir::new().unwrap();
    let problem = project("domains/blocksworld/problems/two-blocks.pddl");
    let problem = problem.to_str().unwrap();
    let plan = ["plan", "--domain", "blocksworld", "--problem", problem];
    let (code, said, errors) = call(folder.path(), &plan);
    assert_eq!(code, Some(0), "{errors}");
    assert!(said.contains("(stack "), "{said}");
    fs::write(folder.path().join("plan.pddl"), said).unwrap();
    let args = ["validate", "--domain", "blocksworld", "--problem", problem, "--plan", "plan.pddl"];
    assert_eq!(call(folder.path(), &args).0, Some(0));
    let goal = ["goal", "--domain", "hanoi", "--instruction", "Move all disks to the right peg."];
    let seen = "p1:peg@0,0,9,9 p2:peg@20,0,29,9 p3:peg@40,0,49,9 d1:disk d2:disk";
    let (code, said, errors) = call(folder.path(), &[&goal[..], &["--objects", seen]].concat());
    assert_eq!(code, Some(0), "{errors}");
    assert!(said.contains("p3"), "{said}");
    let stem = project("domains/blocksworld/exemplar/sim_320x240/d_touching");
    let file = |ending: &str| stem.with_extension(ending).to_str().unwrap().to_owned();
    let (image, boxes, state) = (file("png"), file("json"), file("pddl"));
    let example = ["--exemplar-image", &image, "--exemplar-boxes", &boxes, "--exemplar-state"];
    let ground = ["ground", "--domain", "blocksworld", "--image", &image];
    let (code, said, errors) = call(folder.path(), &[&ground[..], &example, &[&state]].concat());
    assert_eq!(code, Some(0), "{errors}");
    assert!(said.contains("fact    (on "), "{said}");
}

#[test]
fn a_folder_of_that_name_comes_before_the_shipped_one() {
    let folder = copied();
    let path = folder.path().join("blocksworld/domain.pddl");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("(domain blocksworld)", "(domain other)", 1)).unwrap();
    let problem = project("domains/blocksworld/problems/two-blocks.pddl");
    let args = ["plan", "--domain", "blocksworld", "--problem", problem.to_str().unwrap()];
    let (code, _, said) = call(folder.path(), &args);
    assert_eq!(code, Some(2));
    assert!(said.contains("expected the domain `other`"), "{said}");
}

#[test]
fn a_domain_that_there_is_not_is_told_with_those_that_there_are() {
    let folder = TempDir::new().unwrap();
    let problem = ["--problem", "p.pddl"];
    let example = ["--exemplar-image", "a", "--exemplar-boxes", "b", "--exemplar-state", "c"];
    let calls = [
        [&["plan", "--domain", "blockworld"], &problem[..]].concat(),
        [&["validate", "--domain", "blockworld", "--plan", "p"], &problem[..]].concat(),
        vec!["goal", "--domain", "blockworld", "--instruction", "red on blue"],
        [&["ground", "--domain", "blockworld", "--image", "i.png"], &example[..]].concat(),
    ];
    for args in calls {
        let (code, _, said) = call(folder.path(), &args);
        assert_eq!(code, Some(2), "{said}");
        assert_eq!(
            said,
            "error: --domain: expected a folder with a domain.pddl, or the name of a shipped domain \
             (blocksworld, cooking, hanoi, sorting), got blockworld; did you mean \"blocksworld\"?\n",
            "{args:?}"
        );
    }
}
