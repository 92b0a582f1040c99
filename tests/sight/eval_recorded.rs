//! `groundloop eval prodg-v` on the data set itself, where it is there: the recorded results to the
//! digit, and what the project's own grounder and detector reach.

use std::fs;

use crate::common::data;
use crate::common::eval::{only, report};
use serde_json::{Value, json};

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
    assert!(
        hanoi["unknown"].as_u64() > Some(0) && hanoi["anomalies"].as_u64() > Some(0),
        "{hanoi}"
    );
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
