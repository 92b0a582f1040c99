//! The program as people call it: exit codes, messages, and what stands on standard output.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::report::{is_a_report, keys};
use crate::common::{SMALL_CAMERA, copy_folder, one_object, project, schema, unique_run};
use assert_cmd::cargo::cargo_bin_cmd;
use serde_json::{Value, json};

/// What a call of the program came to.
struct Ran {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

/// Calls the program in a folder.
fn call_in(folder: &Path, args: &[&str]) -> Ran {
    let output = cargo_bin_cmd!("groundloop").current_dir(folder).args(args).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    let code = output.status.code();
    Ran { code, stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// Calls the program in the project's folder.
fn call(args: &[&str]) -> Ran {
    call_in(&project(""), args)
}

/// The call must fail with this code, say all this on standard error, and nothing elsewhere.
#[track_caller]
fn refused_in(folder: &Path, args: &[&str], code: i32, said: &[&str]) {
    let ran = call_in(folder, args);
    assert_eq!(ran.code, Some(code), "{args:?}: {}", ran.stderr);
    for text in said {
        assert!(ran.stderr.contains(text), "{args:?}: no {text:?} in:\n{}", ran.stderr);
    }
    assert_eq!(ran.stdout, "", "{args:?}");
    assert!(!ran.stderr.contains("panicked"), "{args:?}: {}", ran.stderr);
}

#[track_caller]
fn refused(args: &[&str], said: &[&str]) {
    refused_in(&project(""), args, 2, said);
}

fn strings(value: &Value) -> Vec<&str> {
    value.as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect()
}

/// `run` arguments for a run file with a small camera and these settings.
fn run_args<'a>(name: &'a str, sets: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    let sets = SMALL_CAMERA.iter().chain(sets).flat_map(|set| ["--set", *set]);
    ["run", name].into_iter().chain(sets).chain(more.iter().copied()).collect()
}

/// Three blocks and a goal for them: an episode of a second.
const THREE_BLOCKS: [&str; 2] =
    ["sim.scene=scenes/three_blocks.toml", "goal.text=red over blue over green"];

/// A folder with a shipped run file in which one piece of text is another.
fn with_run_file(from: &str, to: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(project("configs/blocksworld.toml")).unwrap();
    assert!(text.contains(from), "{from:?} is not in the run file");
    fs::write(folder.path().join("bad.toml"), text.replacen(from, to, 1)).unwrap();
    folder
}

/// A folder with a copy of the blocksworld domain.
fn with_domain() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let domain = folder.path().join("blocksworld");
    copy_folder(&project("domains/blocksworld"), &domain);
    (folder, domain)
}

// ── bad input ───────────────────────────────────────────────────────────────────────────────────

#[test]
fn everything_that_is_wrong_with_a_run_file_is_shown_in_its_line() {
    let folder = with_run_file("domain = ", "sed = 2\n[limits]\ncycles_max = \"many\"\n#");
    let ran = call_in(folder.path(), &["run", "bad.toml"]);
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""));
    insta::assert_snapshot!(ran.stderr, @r#"
    bad.toml: error: missing key: domain
    bad.toml:7:1: error: sed: unknown key; did you mean seed?
      |
    7 | sed = 2
      | ^^^
    bad.toml:9:14: error: limits.cycles_max: expected an integer, 0 or more, got "many"
      |
    9 | cycles_max = "many"
      |              ^^^^^^
    "#);
}

#[test]
fn malformed_toml_is_shown_in_its_line() {
    let folder = with_run_file("domain = ", "domain = = ");
    let ran = call_in(folder.path(), &["run", "bad.toml"]);
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""));
    insta::assert_snapshot!(ran.stderr, @r#"
    bad.toml:7:10: error: extra `=`, expected nothing
      |
    7 | domain = = "blocksworld"
      |          ^
    bad.toml:7:12: error: unexpected key or value, expected newline, `#`
      |
    7 | domain = = "blocksworld"
      |            ^
    "#);
}

#[test]
fn settings_that_make_no_sense_are_named() {
    let run = |set: &'static str| run_args("configs/blocksworld.toml", &[], &["--set", set]);
    for (set, said) in [
        ("camera", "--set camera: expected key=value"),
        ("=1", "--set =1: empty key"),
        ("seed.x=1", "--set seed: expected an integer, 0 or more, got a table"),
        ("sede=1", "--set sede: unknown key; did you mean seed?"),
        ("seed=abc", "--set seed: expected an integer, 0 or more, got the string \"abc\""),
        ("camera.rate_hz=-1", "--set camera.rate_hz: expected a number from 0.01 to 10000, got -1"),
        ("camera.kind=radar", "camera.kind: expected \"external\" or \"images\""),
        ("goal.kind=telepathy", "--set goal.kind: expected \"image\" or \"instruction\""),
        ("perception.detector=eyes", "perception.detector: expected \"annotated\" or \"colour\""),
        ("planner.name=oracle", "planner.name: expected \"embedded\" or \"fast-downward\", got"),
        ("robot.kind=none", "clock: expected \"realtime\""),
        ("sim.scene=nowhere.toml", "nowhere.toml: No such file"),
        ("sim.camera.width=0", "sim.camera"),
        ("domain=cookery", "domain: expected a folder with a domain.pddl"),
        ("perception.exemplar.folder=none", "exemplar/none: No such file"),
    ] {
        refused(&run(set), &[said]);
    }
}

#[test]
fn a_run_file_that_is_not_there_is_named() {
    refused(&["run", "nowhere.toml"], &["error: nowhere.toml: no such file; shipped are"]);
    refused(&["run", "blockworld"], &["did you mean the shipped \"blocksworld\"?"]);
}

#[test]
fn unknown_flags_and_verbs_are_refused() {
    refused(&["run", "--wibble"], &["unexpected argument '--wibble'"]);
    refused(&["wibble"], &["unrecognized subcommand 'wibble'"]);
    refused(&["run", "configs/blocksworld.toml", "--episodes", "0"], &["0 is not in 1..=1000000"]);
}

#[test]
fn a_word_that_the_domain_does_not_know_is_underlined() {
    let args = run_args("configs/blocksworld.toml", &["goal.text=red over wibble"], &[]);
    let ran = call(&args);
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""));
    insta::assert_snapshot!(ran.stderr, @r#"
    instruction:1:10: error: "wibble" is not a word of this domain
      | red over wibble
      |          ^^^^^^
      = example: Create a stack of blocks: red over blue over green.
    "#);
}

#[test]
fn a_goal_in_pddl_is_underlined() {
    let sets = ["goal.kind=logical", "goal.text=(and (on red_block) (clear red_block))"];
    let ran = call(&run_args("configs/blocksworld.toml", &sets, &[]));
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""));
    insta::assert_snapshot!(ran.stderr, @r#"
    configs/blocksworld.toml: goal.text:1:6: error: expected 2 arguments of `on`, got 1
     --> in goal
      |
    1 | (and (on red_block) (clear red_block))
      |      ^^^^^^^^^^^^^^
    "#);
}

#[test]
fn malformed_pddl_is_underlined() {
    let (folder, domain) = with_domain();
    let path = domain.join("domain.pddl");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen(":action stack", ":actoin stack", 1)).unwrap();
    let problem = project("domains/blocksworld/problems/two-blocks.pddl");
    let problem = problem.to_str().unwrap();
    let ran = call_in(
        folder.path(),
        &["plan", "--domain", "blocksworld", "--problem", problem, "--json"],
    );
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""));
    insta::assert_snapshot!(ran.stderr, @r#"
    blocksworld/domain.pddl:27:3: error: expected one of :requirements :types :constants :predicates :functions :derived :action, got a list that begins with `:actoin`
       |
    27 |   (:actoin stack
       |   ^^^^^^^^^^^^^^
       = help: did you mean `:action`?
    "#);

    // The same words from `run`.
    let config = project("configs/blocksworld.toml");
    let again = call_in(
        folder.path(),
        &["run", config.to_str().unwrap(), "--set", "domain=blocksworld", "--json"],
    );
    assert_eq!((again.code, again.stderr), (Some(2), ran.stderr));
}

#[test]
fn a_problem_of_another_domain_is_underlined() {
    let args = ["plan", "--domain", "domains/hanoi", "--problem"];
    let args = [&args[..], &["domains/blocksworld/problems/two-blocks.pddl"]].concat();
    let ran = call(&args);
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""));
    insta::assert_snapshot!(ran.stderr, @r#"
    domains/blocksworld/problems/two-blocks.pddl:3:12: error: expected the domain `hanoi`, got `blocksworld`
      |
    3 |   (:domain blocksworld)
      |            ^^^^^^^^^^^
      = help: the domain file that was read defines `hanoi`; give the one this problem belongs to
    "#);
}

#[test]
fn labelled_examples_that_are_broken_are_named() {
    let (folder, domain) = with_domain();
    let examples = domain.join("exemplar/sim_320x240");
    let config = project("configs/blocksworld.toml");
    let sets = [&SMALL_CAMERA[..], &["domain=blocksworld"]].concat();
    let sets = sets.iter().flat_map(|set| ["--set", *set]);
    let args: Vec<&str> = ["run", config.to_str().unwrap()].into_iter().chain(sets).collect();

    let image = examples.join("b_high_tower.png");
    let bytes = fs::read(&image).unwrap();
    fs::write(&image, &bytes[..bytes.len() / 2]).unwrap();
    refused_in(folder.path(), &args, 2, &["b_high_tower.png: "]);
    fs::remove_file(&image).unwrap();
    refused_in(folder.path(), &args, 2, &["b_high_tower.json: its image is missing"]);
    fs::write(&image, &bytes).unwrap();

    let boxes = examples.join("b_high_tower.json");
    let text = fs::read_to_string(&boxes).unwrap();
    fs::write(&boxes, text.replacen('[', "{", 1)).unwrap();
    refused_in(folder.path(), &args, 2, &["b_high_tower.json: ", "line 2"]);
    fs::write(&boxes, &text).unwrap();

    let state = examples.join("b_high_tower.pddl");
    let text = fs::read_to_string(&state).unwrap();
    fs::write(&state, text.replacen("(on ", "(over ", 1)).unwrap();
    refused_in(folder.path(), &args, 2, &["b_high_tower.pddl:", ": error: ", "over", "^^^^"]);

    fs::remove_dir_all(&examples).unwrap();
    refused_in(folder.path(), &args, 2, &["exemplar/sim_320x240: No such file"]);
    fs::create_dir(&examples).unwrap();
    refused_in(folder.path(), &args, 2, &["sim_320x240: no labelled example (*.json)"]);
}

#[test]
fn a_camera_of_another_ratio_than_the_examples_is_refused() {
    let args = ["run", "configs/blocksworld.toml", "--set", SMALL_CAMERA[1]];
    refused(&args, &["sim.camera: expected 640x480 pixels like", "got 640x240 (2.667): crop to"]);
}

/// A run without its camera ends by itself, and says how to get one.
#[test]
fn a_camera_that_is_not_there_is_missed() {
    let run = unique_run("absent");
    let args = [
        "run",
        "configs/photo_blocksworld.toml",
        "--run",
        &run,
        "--set",
        "camera.wait_s=0.5",
        "--set",
        "perception.exemplar={folder=\"sim_320x240\"}",
    ];
    let said = ["camera/main/rgb for 0.5 s (camera.wait_s)", "groundloop camera images"];
    refused_in(&project(""), &args, 5, &said);
}

#[test]
fn photographs_without_their_folder_are_refused() {
    let run = ["run", "configs/photo_blocksworld.toml"];
    refused(&run, &["perception.exemplar: expected --data DIR"]);
    refused(&[&run[..], &["--data", "nowhere"]].concat(), &["nowhere/data/blocksworld/"]);
}

#[test]
fn a_camera_without_images_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let camera = ["camera", "images", ".", "--run", "none"];
    refused_in(folder.path(), &camera, 2, &["no image (jpg, jpeg, png) here"]);
    fs::write(folder.path().join("a.png"), "not a picture").unwrap();
    refused_in(folder.path(), &camera, 2, &["a.png: "]);
    refused_in(folder.path(), &[&camera[..], &["--fps", "0"]].concat(), 2, &["--fps: expected"]);
}

// ── plan, validate ──────────────────────────────────────────────────────────────────────────────

const SUSSMAN: &str = "domains/blocksworld/problems/three-blocks-sussman.pddl";

#[test]
fn a_plan_is_found_and_accepted() {
    let ran = call(&["plan", "--domain", "domains/blocksworld", "--problem", SUSSMAN, "--json"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
    let answer = one_object(&ran.stdout);
    schema::obeys("plan", &answer);
    assert_eq!(keys(&answer)[..5], ["verdict", "reason", "cost", "optimal", "lower_bound"]);
    assert_eq!(keys(&answer)[5..], ["unproven", "proof", "plan", "expanded", "time_us"]);
    assert_eq!((&answer["verdict"], &answer["reason"]), (&json!("solved"), &json!(null)));
    assert_eq!(answer["cost"], 6.0);
    assert_eq!(keys(&answer["time_us"]), ["parse", "plan", "total"]);
    let steps = strings(&answer["plan"]);
    assert_eq!(steps.len(), 6);

    // A domain may be named by its file too; without --json the plan is the output.
    let file = "domains/blocksworld/domain.pddl";
    let ran = call(&["plan", "--domain", file, "--problem", SUSSMAN]);
    assert_eq!(ran.stdout, format!("{}\n; cost = 6\n", steps.join("\n")));

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plan");
    let check = |text: &str, more: &[&str]| {
        fs::write(&path, text).unwrap();
        let plan = path.to_str().unwrap();
        let args = ["validate", "--domain", file, "--problem", SUSSMAN, "--plan", plan];
        call(&[&args[..], more].concat())
    };
    let good = check(&ran.stdout, &[]);
    assert_eq!((good.code, good.stdout.as_str()), (Some(0), "plan valid: 6 steps, cost 6\n"));
    let good = one_object(&check(&ran.stdout, &["--json"]).stdout);
    let expected = json!({
        "valid": true, "cost": 6.0, "steps": 6, "step_idx": null, "reason": null
    });
    assert_eq!(good, expected);
    schema::obeys("validate", &good);

    let swapped = [steps[1], steps[0], steps[2], steps[3], steps[4], steps[5]].join("\n");
    let bad = check(&swapped, &[]);
    assert_eq!(bad.code, Some(6));
    assert!(bad.stdout.starts_with("plan invalid: step 1: "), "{}", bad.stdout);
    let short = check(&steps[..5].join("\n"), &["--json"]);
    assert_eq!(short.code, Some(6));
    let short = one_object(&short.stdout);
    schema::obeys("validate", &short);
    assert_eq!((&short["valid"], &short["step_idx"]), (&json!(false), &json!(null)));

    let garbled = check("(stack red_block", &[]);
    assert_eq!((garbled.code, garbled.stdout.as_str()), (Some(2), ""));
    assert!(garbled.stderr.contains("plan:1:1: error: "), "{}", garbled.stderr);
}

/// A problem of the blocksworld in a file: its goal is the given one.
fn problem_with_goal(goal: &str) -> tempfile::NamedTempFile {
    let text = fs::read_to_string(project(SUSSMAN)).unwrap();
    let start = text.find("(:goal").unwrap();
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), format!("{}(:goal {goal}))", &text[..start])).unwrap();
    file
}

#[test]
fn what_cannot_be_is_proven_unsolvable() {
    let problem = problem_with_goal("(and (on red_block blue_block) (clear blue_block))");
    let problem = problem.path().to_str().unwrap();
    let args = ["plan", "--domain", "domains/blocksworld", "--problem", problem];
    refused_in(&project(""), &args, 3, &["unsolvable: "]);
    let ran = call(&[&args[..], &["--json"]].concat());
    assert_eq!(ran.code, Some(3));
    let answer = one_object(&ran.stdout);
    schema::obeys("plan", &answer);
    assert_eq!((&answer["verdict"], &answer["cost"]), (&json!("unsolvable"), &json!(null)));
    assert_eq!((&answer["plan"], &answer["proof"]), (&json!(null), &json!("exhausted")));
    let reason = answer["reason"].as_str().unwrap();
    assert!(reason.starts_with("the search is exhausted after "), "{reason}");
}

#[test]
fn a_search_that_is_too_long_names_its_limit() {
    let args = ["plan", "--domain", "domains/blocksworld", "--problem", SUSSMAN];
    let limits = ["--optimal-expansions", "2", "--expansions", "2"];
    let said = ["out-of-budget: greedy_expansions_max = 2 (--expansions N raises this limit)"];
    refused_in(&project(""), &[&args[..], &limits].concat(), 4, &said);
}

// ── ground ──────────────────────────────────────────────────────────────────────────────────────

/// `ground` arguments: the labelled example `name`, in itself.
struct GroundCall {
    files: [String; 3],
}

impl GroundCall {
    fn new(name: &str) -> Self {
        let stem = format!("domains/blocksworld/exemplar/sim_640x480/{name}");
        Self { files: ["png", "json", "pddl"].map(|ending| format!("{stem}.{ending}")) }
    }

    fn call(&self, image: &str, more: &[&str]) -> Ran {
        let [picture, boxes, state] = &self.files;
        let args = ["ground", "--domain", "domains/blocksworld", "--image", image];
        let example = ["--exemplar-image", picture, "--exemplar-boxes", boxes];
        call(&[&args[..], &example, &["--exemplar-state", state], more].concat())
    }
}

#[test]
fn a_labelled_image_gives_its_facts_and_a_plan() {
    let ground = GroundCall::new("a_tower_and_singles");
    let instruction = ["--instruction", "red over blue", "--json"];
    let ran = ground.call(&ground.files[0], &instruction);
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
    let answer = one_object(&ran.stdout);
    schema::obeys("ground", &answer);
    let expected = "objects outside facts unknown anomalies goal verdict reason plan";
    assert_eq!(keys(&answer).join(" "), expected);
    let objects = answer["objects"].as_array().unwrap();
    assert_eq!(objects.len(), 8);
    assert!(objects.iter().all(|o| keys(o) == ["name", "type", "box", "score"]));
    let facts: Vec<String> =
        answer["facts"].as_array().unwrap().iter().map(|f| strings(f).join(" ")).collect();
    insta::assert_snapshot!(facts.join("\n"), @r#"
    clear cyan_block
    clear green_block
    clear orange_block
    clear pink_block
    clear purple_block
    handempty arm
    on blue_block red_block
    on green_block blue_block
    on purple_block yellow_block
    ontable cyan_block
    ontable orange_block
    ontable pink_block
    ontable red_block
    ontable yellow_block
    "#);
    assert_eq!(answer["unknown"], json!([]));
    assert_eq!(answer["goal"], "(on red_block blue_block)");
    insta::assert_snapshot!(strings(&answer["plan"]).join("\n"), @r#"
    (unstack green_block blue_block arm)
    (put_down green_block arm)
    (unstack blue_block red_block arm)
    (put_down blue_block arm)
    (pick_up red_block arm)
    (stack red_block blue_block arm)
    "#);
}

#[test]
fn what_a_sentence_is_read_as_is_one_object() {
    let args = ["goal", "--domain", "domains/blocksworld", "--instruction", "red over blue"];
    let ran = call(&[&args[..], &["--objects", "red_block:block", "--json"]].concat());
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
    let answer = one_object(&ran.stdout);
    schema::obeys("goal", &answer);
    assert_eq!(answer["goal"], "(on red_block blue_block)");
    assert_eq!(answer["phrases"][0], json!({"text": "red", "means": "red_block"}));
    assert_eq!(answer["expected"], json!([{"name": "blue_block", "type": "block"}]));
}

#[test]
fn an_image_that_does_not_fit_is_refused() {
    let ground = GroundCall::new("b_high_tower");
    let ran = ground.call("docs/replanning.png", &["--json"]);
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""));
    let expected = "docs/replanning.png: expected 640x480 pixels like the labelled example, or ";
    assert!(ran.stderr.contains(expected), "{}", ran.stderr);
    let ran = ground.call("nowhere.png", &["--json"]);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("nowhere.png: No such file"), "{}", ran.stderr);
}

#[test]
fn a_truncated_image_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let ground = GroundCall::new("b_high_tower");
    let whole = image::open(project(&ground.files[0])).unwrap();
    for ending in ["jpg", "png"] {
        let path = folder.path().join("cut").with_extension(ending);
        whole.save(&path).unwrap();
        let path_text = path.to_str().unwrap();
        assert_eq!(ground.call(path_text, &[]).code, Some(0), "{ending}");
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let ran = ground.call(path_text, &["--json"]);
        assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""), "{ending}");
        assert!(ran.stderr.contains(path_text), "{}", ran.stderr);
    }
}

#[test]
fn a_goal_about_something_else_is_refused() {
    let ground = GroundCall::new("c_close_and_apart");
    let call = |more: &[&str]| {
        let ran = ground.call(&ground.files[0], more);
        assert_eq!(ran.stdout, "", "{more:?}");
        (ran.code, ran.stderr)
    };
    let (code, said) = call(&["--instruction", "stack the wibble", "--json"]);
    assert_eq!(code, Some(2));
    assert!(said.contains("\"wibble\"") && said.contains("^^^^^^"), "{said}");
    let (code, said) = call(&["--goal", "(on red_block)", "--json"]);
    assert_eq!(code, Some(2));
    assert!(said.contains("--goal:1:"), "{said}");
    let both = ["--goal", "(and)", "--instruction", "red over blue"];
    assert_eq!(call(&both).0, Some(2));
}

// ── run ─────────────────────────────────────────────────────────────────────────────────────────

#[test]
fn an_episode_is_reported_as_one_object() {
    let args = run_args("configs/blocksworld.toml", &THREE_BLOCKS, &["--seed", "3", "--json"]);
    let ran = call(&args);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let report = one_object(&ran.stdout);
    schema::obeys("run", &report);
    is_a_report(&report);
    assert_eq!((&report["verdict"], &report["seed"]), (&json!("reached"), &json!(3)));
    assert_eq!(report["goal"], "(and (on red_block blue_block) (on blue_block green_block))");
    assert_eq!(report["goal_in_simulator"], json!(true));
    // What people read goes to standard error.
    for mark in ["state", "plan", "skill", "done", "end     reached"] {
        assert!(ran.stderr.contains(&format!(" {mark}")), "{mark}: {}", ran.stderr);
    }
}

#[test]
fn an_episode_is_told_with_a_table_at_its_end() {
    let ran = call(&run_args("configs/blocksworld.toml", &THREE_BLOCKS, &[]));
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
    for text in ["skill ", "(stack red_block blue_block arm)", "frame → command, replan"] {
        assert!(ran.stdout.contains(text), "{text}: {}", ran.stdout);
    }
    assert!(!ran.stdout.contains('\x1b'), "colours are for terminals: {}", ran.stdout);
    assert!(ran.stdout.contains("reached: the goal holds"), "{}", ran.stdout);
}

#[test]
fn several_episodes_are_reported_as_one_object() {
    let more = ["--episodes", "2", "--json"];
    let ran = call(&run_args("configs/blocksworld.toml", &THREE_BLOCKS, &more));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let object = one_object(&ran.stdout);
    schema::obeys("run", &object);
    assert_eq!(keys(&object), ["episodes"]);
    let episodes = object["episodes"].as_array().unwrap();
    episodes.iter().for_each(is_a_report);
    let seeds: Vec<&Value> = episodes.iter().map(|e| &e["seed"]).collect();
    assert_eq!(seeds, [&json!(1), &json!(2)]);

    let ran = call(&run_args("configs/blocksworld.toml", &THREE_BLOCKS, &more[..2]));
    let told = "reached 2/2, the goal holds in the simulator in 2/2\n";
    assert!(ran.stdout.ends_with(told), "{}", ran.stdout);
}

#[test]
fn an_episode_without_a_plan_tells_it_by_its_exit_code() {
    let goal = "goal.text=(and (on red_block blue_block) (clear blue_block))";
    let sets = [THREE_BLOCKS[0], "goal.kind=logical", goal];
    let ran = call(&run_args("configs/blocksworld.toml", &sets, &["--json"]));
    assert_eq!(ran.code, Some(3), "{}", ran.stderr);
    assert_eq!(one_object(&ran.stdout)["verdict"], "unsolvable");
    let sets = [&THREE_BLOCKS[..], &["limits.cycles_max=5"]].concat();
    let ran = call(&run_args("configs/blocksworld.toml", &sets, &["--json"]));
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    let report = one_object(&ran.stdout);
    assert_eq!(report["verdict"], "gave-up");
    assert!(report["reason"].as_str().unwrap().contains("limits.cycles_max"), "{report}");
}

#[test]
fn a_picture_of_what_was_understood_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let more = ["--snapshot", path.to_str().unwrap(), "--json"];
    let ran = call(&run_args("configs/blocksworld.toml", &THREE_BLOCKS, &more));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let picture = image::open(&path).unwrap();
    // The frame, and what is said about it beside or below.
    assert!(picture.width() >= 320 && picture.height() >= 240, "{picture:?}");
    assert!(picture.width() > 320 || picture.height() > 240);
    assert!(fs::metadata(&path).unwrap().len() > 10_000);
}

/// A folder stands where the picture would: it is told in the end, and the episode is what it is.
#[test]
fn a_picture_that_fails_in_mid_episode_does_not_end_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    fs::create_dir(&path).unwrap();
    let more = ["--snapshot", path.to_str().unwrap(), "--json"];
    let ran = call(&run_args("configs/blocksworld.toml", &THREE_BLOCKS, &more));
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert_eq!(one_object(&ran.stdout)["verdict"], "reached");
    assert!(ran.stderr.contains("error: the picture is not written: "), "{}", ran.stderr);
}

/// What nobody can read was not written.
#[test]
fn output_to_a_full_disk_fails() {
    for args in
        [&["parts", "--json"][..], &["config", "show", "blocksworld"], &["doctor", "--json"]]
    {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_groundloop"));
        let output = command.current_dir(project("")).args(args).stdout(full).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{args:?}: {said}");
        assert!(said.contains("error: standard output: "), "{args:?}: {said}");
    }
}

#[test]
fn a_picture_that_cannot_be_written_is_an_error() {
    let more = ["--snapshot", "nowhere/picture.png", "--json"];
    let ran = call(&run_args("configs/blocksworld.toml", &THREE_BLOCKS, &more));
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("nowhere/picture.png"), "{}", ran.stderr);
}

// ── help ────────────────────────────────────────────────────────────────────────────────────────

#[test]
fn help_stays_as_it_is() {
    for (name, args) in [("help", &["--help"][..]), ("help_run", &["run", "--help"])] {
        let ran = call(args);
        assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
        insta::assert_snapshot!(name, ran.stdout);
    }
}
