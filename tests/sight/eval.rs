//! `groundloop eval prodg-v` on whole, partial and broken checkouts that are made here.
#![expect(clippy::unwrap_used, reason = "a test file")]

use std::fs;
use std::path::Path;

use crate::common::eval::{eval, only, report};
use crate::common::project;
use serde_json::{Value, json};
use tempfile::TempDir;

/// A photograph of blocks: who stands where. Columns from the left, heights from the table, counted
/// in blocks of 20 pixels.
type Stacks = &'static [&'static [&'static str]];

const STACKS: [(u32, Stacks); 4] = [
    (1, &[&["blue_block", "red_block"], &["green_block"]]),
    (2, &[&["red_block", "green_block"], &["blue_block"]]),
    (4, &[&["green_block"], &["blue_block"], &["red_block"]]),
    (12, &[&["green_block"], &["blue_block", "red_block"]]),
];

/// A small checkout of one domain, written by this test.
struct Checkout(TempDir);

impl Checkout {
    /// Four problems with all that is recorded of them. In problem 2 the one `on` is listed twice;
    /// problem 4 has none; there is a problem file with another name, which is not one.
    fn new() -> Self {
        let checkout = Self(TempDir::new().unwrap());
        let domain = fs::read_to_string(project("domains/blocksworld/domain.pddl")).unwrap();
        checkout.write("data/blocksworld/domain.pddl", &domain);
        checkout.write("data/blocksworld/problems/problem1_old.pddl", "not a problem");
        for (number, stacks) in STACKS {
            checkout.write_problem(number, stacks);
            for (exemplar, _) in STACKS.iter().filter(|(exemplar, _)| *exemplar != number) {
                checkout.record((*exemplar, number), stacks);
            }
        }
        checkout
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn write(&self, file: &str, text: &str) {
        let path = self.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    fn remove(&self, path: &str) {
        let path = self.path().join(path);
        if path.is_dir() {
            fs::remove_dir_all(path).unwrap();
        } else {
            fs::remove_file(path).unwrap();
        }
    }

    fn write_problem(&self, number: u32, stacks: Stacks) {
        let data = |kind: &str, end: &str| format!("data/blocksworld/{kind}/problem{number}.{end}");
        let names = stacks.concat().join(" ");
        let twice = if number == 2 { on(stacks) } else { String::new() };
        let problem = format!(
            "(define (problem p) (:domain blocksworld) (:objects {names} - block bot - robot)
            ; (:init is not here)\n(:init {} {} {twice} (handempty bot)) (:goal {GOAL}))",
            on(stacks),
            derived(stacks),
        );
        self.write(&data("problems", "pddl"), &problem);
        self.write(&data("annotated_bboxes", "json"), &boxes(stacks, 0.0));
        self.write(&data("instructions", "txt"), "Put blue over red.");
        let path = self.path().join(data("observations", "jpg"));
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        photograph(stacks).save(path).unwrap();
    }

    /// Records boxes that are half a pixel off, the facts that hold, and a fenced goal.
    fn record(&self, (e, t): (u32, u32), stacks: Stacks) {
        let results = |kind: &str, stem: &str, end: &str| {
            format!("results/reported_results/blocksworld/{kind}/{stem}_ex{e}_test{t}.{end}")
        };
        self.write(&results("objdet", "objdet", "json"), &boxes(stacks, 0.5));
        let names = stacks.concat().join(" - block\n");
        let objects = format!("(:objects\n{names} - block\n)");
        self.write(&results("object_stubs", "objects_stub", "pddl"), &objects);
        let facts = if e == 4 { String::new() } else { on(stacks) };
        self.write(&results("init_stubs", "initstate", "pddl"), &format!("(:init {facts})"));
        let goal = format!("```pddl\n(:goal (:goal {GOAL}))\n``` (:goal (and))");
        self.write(&results("goal_stubs", "goal_stub", "pddl"), &goal);
    }
}

const GOAL: &str = "(and (on blue_block red_block))";

fn on(stacks: Stacks) -> String {
    let pairs = stacks.iter().flat_map(|stack| stack.windows(2));
    pairs.map(|pair| format!("(on {} {})", pair[1], pair[0])).collect::<Vec<_>>().join(" ")
}

fn derived(stacks: Stacks) -> String {
    let stack = |stack: &&[&str]| {
        format!("(ontable {}) (clear {})", stack.first().unwrap(), stack.last().unwrap())
    };
    stacks.iter().map(stack).collect::<Vec<_>>().join(" ")
}

/// Left edge, upper edge, side.
fn place(column: usize, height: usize) -> [usize; 3] {
    [20 + 45 * column, 100 - 20 * height, 20]
}

fn boxes(stacks: Stacks, off: f64) -> String {
    let mut boxes = serde_json::Map::new();
    for (column, stack) in stacks.iter().enumerate() {
        for (height, name) in stack.iter().enumerate() {
            let [x, y, side] = place(column, height).map(|v| v as f64);
            boxes.insert((*name).to_owned(), json!([x + off, y + off, x + side, y + side]));
        }
    }
    Value::from(boxes).to_string()
}

fn photograph(stacks: Stacks) -> image::RgbImage {
    let mut photograph = image::RgbImage::from_pixel(180, 140, image::Rgb([96, 98, 101]));
    for (column, stack) in stacks.iter().enumerate() {
        for (height, name) in stack.iter().enumerate() {
            let colour = match name.split('_').next().unwrap() {
                "red" => [220, 30, 30],
                "green" => [40, 170, 60],
                _ => [30, 60, 220],
            };
            let [left, top, side] = place(column, height).map(|v| v as u32);
            for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
                photograph.put_pixel(left + x, top + y, image::Rgb(colour));
            }
        }
    }
    photograph
}

/// The report's part of the small checkout's domain.
#[track_caller]
fn blocks(checkout: &Checkout, args: &[&str]) -> Value {
    report(checkout.path(), args)["domains"]["blocksworld"].clone()
}

#[test]
fn a_whole_checkout_is_evaluated_by_the_rule_for_pairs() {
    let checkout = Checkout::new();
    let whole = report(checkout.path(), &[]);
    let keys = ["grounder", "detections", "goals", "planner"];
    let parts = json!({"grounder": "s2s", "detections": "recorded", "goals": "recorded",
                       "planner": "embedded"});
    assert_eq!(only(&whole, &keys), parts);
    let domain = &whole["domains"]["blocksworld"];
    let keys = ["pairs", "tp", "fp", "fn", "precision", "recall", "exact_states"];
    let expect = json!({"pairs": 6, "tp": 6, "fp": 0, "fn": 0, "precision": 1.0, "recall": 1.0,
                        "exact_states": 6});
    assert_eq!(only(domain, &keys), expect, "problem 4 has no `on`: six of twelve pairs count");
    let keys = ["problem_valid", "plan_valid_pairs", "plan_valid_all", "success"];
    let expect = json!({"problem_valid": [12, 12], "plan_valid_pairs": [6, 6],
                        "plan_valid_all": [12, 12], "success": [6, 6]});
    assert_eq!(only(domain, &keys), expect);
    assert_eq!(domain["differs_from_recorded"], 0);
    assert_eq!((&domain["failures"], &domain["left_out"]), (&json!([]), &json!([])));
}

#[test]
fn the_printed_tables() {
    let checkout = Checkout::new();
    // A second detection on the lone block, and a goal that is not what is meant.
    let results = "results/reported_results/blocksworld";
    let mut boxes: Value = serde_json::from_str(&boxes(STACKS[1].1, 0.5)).unwrap();
    boxes["pink_block"] = json!([65.0, 80.5, 85.0, 100.0]);
    checkout.write(&format!("{results}/objdet/objdet_ex1_test2.json"), &boxes.to_string());
    let names = boxes.as_object().unwrap().keys().cloned().collect::<Vec<_>>().join(" ");
    let objects = format!("(:objects {names} - block)");
    checkout.write(&format!("{results}/object_stubs/objects_stub_ex1_test2.pddl"), &objects);
    let goal = "(:goal (on red_block blue_block))";
    checkout.write(&format!("{results}/goal_stubs/goal_stub_ex2_test12.pddl"), goal);
    let args = ["--jitter-px", "1", "--seeds", "2"];
    let (code, stdout, stderr) = eval(checkout.path(), &args);
    assert_eq!((code, stderr.as_str()), (0, ""));
    insta::assert_snapshot!(stdout);
}

#[test]
fn partial_checkouts_use_what_is_there() {
    let checkout = Checkout::new();
    checkout.remove("results/reported_results/blocksworld/objdet/objdet_ex1_test2.json");
    checkout.remove("results/reported_results/blocksworld/goal_stubs/goal_stub_ex1_test12.pddl");
    checkout.remove("data/blocksworld/annotated_bboxes/problem4.json");
    checkout.remove("data/blocksworld/observations/problem1.jpg");
    let domain = blocks(&checkout, &[]);
    assert_eq!((&domain["pairs"], &domain["success"]), (&json!(4), &json!([4, 4])));
    let left_out = [
        "problem 4 has no annotated boxes",
        "exemplar 1, test 2: detections not recorded",
        "exemplar 1, test 12: goal not recorded",
    ];
    assert_eq!(domain["left_out"], json!(left_out));

    checkout.remove("results");
    let domain = blocks(&checkout, &[]);
    assert_eq!((&domain["pairs"], &domain["precision"]), (&json!(0), &Value::Null));
    assert_eq!(domain["left_out"].as_array().unwrap().len(), 7);
    // The data alone is enough for everything that is not recorded.
    let domain = blocks(&checkout, &["--detections", "annotated", "--goals", "lexicon"]);
    assert_eq!((&domain["pairs"], &domain["success"]), (&json!(6), &json!([6, 6])));
    assert_eq!(domain["differs_from_recorded"], Value::Null);

    for number in [2, 4, 12] {
        checkout.remove(&format!("data/blocksworld/problems/problem{number}.pddl"));
    }
    let domain = blocks(&checkout, &[]);
    assert_eq!((&domain["pairs"], &domain["plan_valid_all"]), (&json!(0), &json!([0, 0])));
}

#[test]
fn a_missed_object_misses_every_listed_fact_and_an_invented_one_is_wrong() {
    let checkout = Checkout::new();
    let results = "results/reported_results/blocksworld";
    let record = |boxes: &Value| {
        checkout.write(&format!("{results}/objdet/objdet_ex1_test2.json"), &boxes.to_string());
        let names = boxes.as_object().unwrap().keys().cloned().collect::<Vec<_>>().join(" ");
        let objects = format!("(:objects {names} - block)");
        checkout.write(&format!("{results}/object_stubs/objects_stub_ex1_test2.pddl"), &objects);
    };
    let seen: Value = serde_json::from_str(&boxes(STACKS[1].1, 0.5)).unwrap();
    let mut fewer = seen.clone();
    fewer.as_object_mut().unwrap().remove("green_block");
    record(&fewer);
    let domain = blocks(&checkout, &[]);
    assert_eq!(only(&domain, &["tp", "fp", "fn"]), json!({"tp": 5, "fp": 0, "fn": 2}));
    assert_eq!(domain["failures"][0]["stage"], "detection");
    assert_eq!(domain["failures"][0]["why"], "green_block is not detected");
    assert_eq!(domain["differs_from_recorded"], 1);

    // On top of the lone block, where nothing is.
    let mut more = seen;
    more["pink_block"] = json!([65.0, 80.5, 85.0, 100.0]);
    record(&more);
    let domain = blocks(&checkout, &["--details"]);
    assert_eq!(only(&domain, &["tp", "fp", "fn"]), json!({"tp": 6, "fp": 1, "fn": 0}));
    assert_eq!(domain["failures"][0]["why"], "pink_block is not there");
    assert_eq!(domain["details"][0]["wrong"], json!(["(on pink_block blue_block)"]));
}

#[test]
fn each_evaluated_test_is_drawn_on_request() {
    let checkout = Checkout::new();
    let pictures = checkout.path().join("pictures");
    let report = report(checkout.path(), &["--pictures", pictures.to_str().unwrap()]);
    assert_eq!(report["domains"]["blocksworld"]["pairs"], 6);
    let mut drawn: Vec<String> = fs::read_dir(&pictures)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    drawn.sort();
    let pair = |(e, t)| format!("blocksworld_ex{e}_test{t}.png");
    assert_eq!(drawn, [(12, 1), (12, 2), (1, 12), (1, 2), (2, 1), (2, 12)].map(pair));
    assert!(image::open(pictures.join(&drawn[0])).unwrap().width() > 1000);
}

#[test]
fn goals_that_cannot_be_read_are_failures_of_the_goal() {
    let checkout = Checkout::new();
    let stub = "results/reported_results/blocksworld/goal_stubs/goal_stub_ex1_test2.pddl";
    for (goal, expect) in [
        ("", "expected a goal"),
        ("I cannot help with that.", "goal"),
        ("(:goal (on blue_block", "goal"),
        ("(:goal (over blue_block red_block))", "over"),
        ("(:goal (on blue_block))", "on"),
        ("(:goal (on blue_block mauve_block))", "mauve_block"),
        ("(:goal (and (on blue_block red_block) (on red_block blue_block)))", "unsolvable"),
        ("(:goal (on blue_block green_block))", "(on blue_block red_block) does not hold"),
    ] {
        checkout.write(stub, goal);
        let domain = blocks(&checkout, &[]);
        let failures = domain["failures"].as_array().unwrap();
        assert_eq!((failures.len(), &domain["success"]), (1, &json!([5, 6])), "{goal}");
        assert_eq!(failures[0]["stage"], "goal", "{goal}: {}", failures[0]);
        let why = failures[0]["why"].as_str().unwrap();
        assert!(why.contains(expect) && !why.contains('\n'), "{goal}: {why}");
        assert_eq!(domain["exact_states"], 6, "{goal}: the state has nothing to do with it");
    }
}

#[test]
fn broken_files_are_told_with_file_and_field() {
    let results = "results/reported_results/blocksworld";
    let pair = |kind: &str, stem: &str| format!("{results}/{kind}/{stem}_ex1_test2");
    let boxes = "data/blocksworld/annotated_bboxes/problem2.json".to_owned();
    let problem = "data/blocksworld/problems/problem2.pddl".to_owned();
    let photo = "data/blocksworld/observations/problem2.jpg".to_owned();
    let objdet = format!("{}.json", pair("objdet", "objdet"));
    let objects = format!("{}.pddl", pair("object_stubs", "objects_stub"));
    let init = format!("{}.pddl", pair("init_stubs", "initstate"));
    for (file, text, expect) in [
        (&boxes, "{", "line 1"),
        (&boxes, "[]", "expected a map"),
        (&boxes, r#"{"red_block": [1, 2, 3]}"#, "red_block: expected [x1, y1, x2, y2]"),
        (&boxes, r#"{"red_block": [5, 2, 3, 4]}"#, "red_block: expected [x1, y1, x2, y2]"),
        (&boxes, r#"{"red_block": "here"}"#, "got \"here\""),
        (&boxes, r#"{"red_block": [1, 2, 1e999, 4]}"#, "number out of range"),
        (&boxes, r#"{"pink_block": [1, 2, 3, 4]}"#, "pink_block: expected an object that the"),
        (&boxes, r#"{"a": [1, 2, 3, 4], "A": [1, 2, 3, 4]}"#, "a: expected one box per object"),
        (&problem, "(define (problem", "1:"),
        (&problem, "(define (problem p) (:domain hanoi))", "expected the domain `blocksworld`"),
        (&photo, "no picture", "problem2.jpg"),
        (&objdet, "{}}", "line 1"),
        (&objdet, r#"{"red_block": [1, 2, 3, null]}"#, "red_block: expected [x1"),
        (&objects, "(:objects red_block - robot", "1:"),
        (&objects, "(:objects red_block - disk)", "disk"),
        (&objects, "(:objects red_block - block)", "_block: expected an object with a type"),
        (&init, "(:init (on red_block", "1:"),
        (&init, "on red", "expected a form (:init …)"),
    ] {
        let checkout = Checkout::new();
        checkout.write(file, text);
        let (code, stdout, stderr) = eval(checkout.path(), &["--json"]);
        assert_eq!((code, stdout.as_str()), (2, ""), "{file}: {text}: {stderr}");
        let name = Path::new(file).file_name().unwrap().to_str().unwrap();
        assert!(stderr.contains(name) && stderr.contains(expect), "{file}: {text}: {stderr}");
        assert!(!stderr.contains("panicked"), "{stderr}");
    }
}

#[test]
fn settings_that_cannot_be_are_told() {
    let checkout = Checkout::new();
    checkout.write("options.toml", "[perception.options]\nmodel = 1\n[gaol]\n");
    let options = checkout.path().join("options.toml");
    for (args, expect) in [
        (&["--domain", "mikado"][..], "data: domain: expected blocksworld, got mikado"),
        (&["--grounder", "guess"], "--grounder: expected s2s"),
        (&["--detections", "guess"], "--detections: expected recorded or annotated or "),
        (&["--goals", "guess"], "--goals: expected recorded or truth or lexicon or "),
        (&["--planner", "guess"], "--planner: expected embedded"),
        (&["--jitter-px=-1"], "--jitter-px: expected a number from 0 upwards, got -1"),
        (&["--jitter-px", "inf"], "--jitter-px: expected a number from 0 upwards"),
        (&["--jitter-px", "1", "--seeds", "0"], "--seeds"),
        (&["--seeds", "3"], "--jitter-px"),
        (&["--domains", "/nowhere"], "/nowhere/blocksworld/domain.pddl"),
        (&["--options", options.to_str().unwrap()], "unknown field `gaol`"),
    ] {
        let (code, _, stderr) = eval(checkout.path(), args);
        assert!(code == 2 && stderr.contains(expect), "{args:?}: {stderr}");
    }
    let (code, _, stderr) = eval(Path::new("/nowhere"), &[]);
    assert!(code == 2 && stderr.contains("/nowhere/data: "), "{stderr}");
    let empty = TempDir::new().unwrap();
    fs::create_dir(empty.path().join("data")).unwrap();
    let (code, _, stderr) = eval(empty.path(), &[]);
    assert!(code == 2 && stderr.contains("expected folders with a domain.pddl"), "{stderr}");
}

/// No fact speaks of the lone block: the reference's metric does not notice that it is missed, or
/// that another one is invented apart from all others.
#[test]
fn a_strictly_right_state_has_the_right_objects_too() {
    let checkout = Checkout::new();
    let counts = |domain: &Value| only(domain, &["exact_states", "strict_states"]);
    let whole = blocks(&checkout, &[]);
    assert_eq!(counts(&whole), json!({"exact_states": 6, "strict_states": 6}));

    let results = "results/reported_results/blocksworld";
    let seen: Value = serde_json::from_str(&boxes(STACKS[1].1, 0.5)).unwrap();
    let mut fewer = seen.clone();
    fewer.as_object_mut().unwrap().remove("blue_block");
    let mut more = seen;
    more["pink_block"] = json!([150.0, 20.0, 170.0, 40.0]);
    for (boxes, fault) in [(fewer, "blue_block is not detected"), (more, "pink_block is not there")]
    {
        checkout.write(&format!("{results}/objdet/objdet_ex1_test2.json"), &boxes.to_string());
        let names = boxes.as_object().unwrap().keys().cloned().collect::<Vec<_>>().join(" ");
        let objects = format!("(:objects {names} - block)");
        checkout.write(&format!("{results}/object_stubs/objects_stub_ex1_test2.pddl"), &objects);
        let domain = blocks(&checkout, &["--details"]);
        assert_eq!(counts(&domain), json!({"exact_states": 6, "strict_states": 5}));
        let pair = &domain["details"][0];
        assert_eq!(pair["object_faults"], json!([fault]));
        assert_eq!(
            only(pair, &["wrong", "missing", "strictly_right"]),
            json!({"wrong": [], "missing": [], "strictly_right": false})
        );
        assert_eq!(domain["details"][1]["strictly_right"], true);
    }
}
