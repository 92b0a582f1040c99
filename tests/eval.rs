//! `groundloop eval prodg-v`: the recorded dev results to the digit where the data set is there, and
//! whole, partial and broken checkouts made here.
#![expect(clippy::unwrap_used, reason = "a test file")]

mod common;

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use common::{data, project};
use serde_json::{Value, json};
use tempfile::TempDir;

/// The verb on a checkout, with further arguments: exit code, standard output, standard error.
fn eval(checkout: &Path, args: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("groundloop").unwrap();
    command.current_dir(project("")).args(["eval", "prodg-v", "--data"]).arg(checkout).args(args);
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// The report as JSON; nothing else may be on standard output.
#[track_caller]
fn report(checkout: &Path, args: &[&str]) -> Value {
    let args: Vec<&str> = args.iter().copied().chain(["--json"]).collect();
    let (code, stdout, stderr) = eval(checkout, &args);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    serde_json::from_str(&stdout).unwrap()
}

/// The fields of a JSON object that are asked for.
fn only(value: &Value, keys: &[&str]) -> Value {
    keys.iter().map(|key| ((*key).to_owned(), value[key].clone())).collect()
}

#[test]
fn recorded_states_counts_and_successes_are_those_of_the_reference() {
    let Some(checkout) = data("prodgv", "photographs and recorded results") else { return };
    let targets = fs::read_to_string(checkout.join("targets_s2s.json")).unwrap();
    let targets: Value = serde_json::from_str(&targets).unwrap();
    let args = ["--grounder", "s2s", "--detections", "recorded", "--goals", "recorded"];
    let report = report(&checkout, &[&args[..], &["--details"]].concat());
    let domains = report["domains"].as_object().unwrap();
    assert_eq!(domains.len(), 3);
    for (name, domain) in domains {
        let target = &targets[name];
        assert_eq!(domain["differs_from_recorded"], 0, "{name}");
        assert_eq!(domain["pairs"], target["n_pairs"], "{name}");
        let keys = ["tp", "fp", "fn"];
        assert_eq!(only(domain, &keys), only(target, &keys), "{name}");
        let keys = ["exemplar", "test", "tp", "fp", "fn"];
        let details = domain["details"].as_array().unwrap();
        let counted = details.iter().filter(|pair| pair["evaluated"] == true);
        let mut pairs: Vec<String> = counted.map(|p| only(p, &keys).to_string()).collect();
        let wanted = target["pairs"].as_array().unwrap().iter().map(|p| {
            let pair = json!({"exemplar": p["ex"], "test": p["test"], "tp": p["tp"],
                              "fp": p["fp"], "fn": p["fn"]});
            only(&pair, &keys).to_string()
        });
        let mut wanted: Vec<String> = wanted.collect();
        pairs.sort();
        wanted.sort();
        assert_eq!(pairs, wanted, "{name}");
        assert_eq!(domain["problem_valid"], json!([30, 30]), "{name}");
    }
    let figure = |key: &str| ["cooking", "blocksworld", "hanoi"].map(|d| &domains[d][key]);
    assert_eq!(figure("success"), [&json!([9, 12]), &json!([12, 14]), &json!([13, 20])]);
    assert_eq!(figure("plan_valid_pairs"), [&json!([12, 12]), &json!([13, 14]), &json!([15, 20])]);
    assert_eq!(figure("exact_states"), [&json!(12), &json!(13), &json!(13)]);
    let stages = |name: &str| -> Vec<(u64, u64, String)> {
        let failures = domains[name]["failures"].as_array().unwrap();
        let text = |f: &Value| f["stage"].as_str().unwrap().to_owned();
        let number = |f: &Value, key: &str| f[key].as_u64().unwrap();
        failures.iter().map(|f| (number(f, "exemplar"), number(f, "test"), text(f))).collect()
    };
    let expect = |list: &[(u64, u64, &str)]| -> Vec<(u64, u64, String)> {
        list.iter().map(|(e, t, stage)| (*e, *t, (*stage).to_owned())).collect()
    };
    assert_eq!(stages("cooking"), expect(&[(8, 10, "goal"), (10, 8, "goal"), (10, 9, "goal")]));
    assert_eq!(stages("blocksworld"), expect(&[(5, 3, "grounding"), (7, 3, "goal")]));
    let (missed, weak) = ("detection", "grounding");
    let hanoi = [(2, 7, missed), (3, 2, weak), (3, 5, weak), (3, 7, missed), (3, 10, weak)];
    let hanoi = [&hanoi[..], &[(5, 7, missed), (10, 7, missed)]].concat();
    assert_eq!(stages("hanoi"), expect(&hanoi));
}

/// Without the rule for pairs every ordered pair would count, and the figures would be these.
#[test]
fn all_ordered_pairs_are_carried_out_and_fewer_are_counted() {
    let Some(checkout) = data("prodgv", "photographs and recorded results") else { return };
    let report = report(&checkout, &["--details"]);
    for (name, precision, recall) in
        [("cooking", 0.823, 0.871), ("blocksworld", 0.811, 0.600), ("hanoi", 0.887, 0.817)]
    {
        let details = report["domains"][name]["details"].as_array().unwrap();
        assert_eq!(details.len(), 30);
        let sum = |key: &str| details.iter().map(|p| p[key].as_f64().unwrap()).sum::<f64>();
        let (tp, fp, fn_) = (sum("tp"), sum("fp"), sum("fn"));
        assert!((tp / (tp + fp) - precision).abs() < 6e-4, "{name}: {}", tp / (tp + fp));
        assert!((tp / (tp + fn_) - recall).abs() < 6e-4, "{name}: {}", tp / (tp + fn_));
    }
}

#[test]
fn other_detections_goals_and_noise_are_measured_too() {
    let Some(checkout) = data("prodgv", "photographs and recorded results") else { return };
    let report = |args: &[&str]| report(&checkout, args)["domains"].clone();
    let annotated = report(&["--detections", "annotated", "--domain", "hanoi"]);
    let keys = ["tp", "fp", "fn", "exact_states"];
    let expect = json!({"tp": 478, "fp": 52, "fn": 16, "exact_states": 15});
    assert_eq!(only(&annotated["hanoi"], &keys), expect);
    let truth = report(&["--goals", "truth", "--domain", "cooking"]);
    assert_eq!(truth["cooking"]["success"], json!([12, 12]));
    let repaired = report(&["--repair-goals", "true", "--domain", "blocksworld"]);
    assert_eq!(repaired["blocksworld"]["success"], json!([13, 14]));
    assert_eq!(repaired["blocksworld"]["goals_repaired"], 1);
    let lexicon = report(&["--goals", "lexicon", "--domain", "blocksworld"]);
    assert_eq!(lexicon["blocksworld"]["success"], json!([13, 14]));
    let seen = report(&["--detections", "colour", "--domain", "blocksworld"]);
    assert_eq!(seen["blocksworld"]["exact_states"], 13);
    let noisy = ["--jitter-px", "5", "--seeds", "4", "--domain", "hanoi"];
    let jitter = &report(&noisy)["hanoi"]["jitter"];
    let exact = jitter["exact_states"].as_f64().unwrap();
    assert!((4.0..9.0).contains(&exact), "{jitter}");
    assert_eq!(*jitter, report(&noisy)["hanoi"]["jitter"], "the same seeds give the same figures");
}

#[test]
fn the_joint_grounder_reaches_what_the_detections_allow() {
    let Some(checkout) = data("prodgv", "photographs and recorded results") else { return };
    let report = report(&checkout, &["--grounder", "s2s-joint"]);
    assert_eq!(report["repair_goals"], true, "only the reference takes goals as they are");
    for (name, n_right, n_success) in
        [("cooking", 12, 9), ("blocksworld", 14, 14), ("hanoi", 16, 16)]
    {
        let domain = &report["domains"][name];
        let number = |value: &Value| value.as_u64().unwrap();
        assert!(number(&domain["exact_states"]) >= n_right, "{name}: {domain}");
        assert!(number(&domain["success"][0]) >= n_success, "{name}: {domain}");
    }
    // A disk that was not detected leaves a gap: what depends on it is unknown, and not predicted.
    let hanoi = &report["domains"]["hanoi"];
    assert!(hanoi["unknown"].as_u64() > Some(0) && hanoi["doubts"].as_u64() > Some(0), "{hanoi}");
    assert!(hanoi["inferred"].as_u64() > Some(0) && hanoi["fp"] == 0, "{hanoi}");
}

#[test]
fn the_joint_grounder_stays_ahead_when_boxes_are_noisy() {
    let Some(checkout) = data("prodgv", "photographs and recorded results") else { return };
    for sigma in ["1", "2", "3", "5"] {
        let noisy = |grounder: &str| {
            let args = ["--grounder", grounder, "--jitter-px", sigma, "--seeds", "20"];
            report(&checkout, &args)["domains"].clone()
        };
        let (plain, joint) = (noisy("s2s"), noisy("s2s-joint"));
        for name in ["cooking", "blocksworld", "hanoi"] {
            for key in ["exact_states", "f1"] {
                let [plain, joint] = [&plain, &joint].map(|d| d[name]["jitter"][key].as_f64());
                assert!(joint >= plain, "{name}, {sigma} px: {key} {joint:?}, alone {plain:?}");
            }
        }
    }
}

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
        ("(:goal (and (on blue_block red_block) (on red_block blue_block)))", "no plan"),
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
