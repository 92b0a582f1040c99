//! Layers: merge laws, origins, old names, kinds that are chosen, faults at their places.

use proptest::prelude::*;
use serde_json::json;

use super::sources::Sources;
use super::tree::Tree;
use super::*;

fn tree(text: &str) -> Tree {
    Tree::parse(&mut Sources::default(), LayerOrigin::Default, text).unwrap()
}

fn laid(under: &Tree, over: &Tree) -> Tree {
    let mut all = under.clone();
    all.lay(over.clone());
    all
}

/// The defaults with texts over them, and settings over those.
fn layers(texts: &[&str], sets: &[&str]) -> Layers {
    let mut layers = Layers::defaults(Form::Run).unwrap();
    for (idx, text) in texts.iter().enumerate() {
        let layer = layers.parse(LayerOrigin::File(format!("{idx}.toml")), text).unwrap();
        layers.lay(layer);
    }
    for set in sets {
        layers.set(set).unwrap();
    }
    layers
}

fn at(layers: &Layers, key: &str) -> String {
    let value = key.split('.').fold(toml::Value::Table(layers.plain()), |v, k| v[k].clone());
    format!("{value} {}", layers.written(key).unwrap())
}

#[test]
fn the_uppermost_layer_that_has_a_key_says_its_value_and_origin() {
    let base = "seed = 2\n[limits]\ncycles_max = 3\nfailures_max = 3\n";
    let over = "\n[limits]\ncycles_max = 4\n";
    let layers = layers(&[base, over], &["limits.revisits_max=5", "goal.text=Red on blue."]);
    assert_eq!(at(&layers, "clock"), "\"lockstep\" default");
    assert_eq!(at(&layers, "seed"), "2 0.toml:1");
    assert_eq!(at(&layers, "limits.failures_max"), "3 0.toml:4");
    assert_eq!(at(&layers, "limits.cycles_max"), "4 1.toml:3");
    assert_eq!(at(&layers, "limits.revisits_max"), "5 --set");
    assert_eq!(at(&layers, "goal.text"), "\"Red on blue.\" --set", "what is no TOML is a string");
}

#[test]
fn arrays_are_replaced_as_a_whole() {
    let base = "[[fault]]\nat_s = 1.0\n[[fault]]\nat_s = 2.0\n[planner]\nrungs = [\"search\"]\n";
    let layers = layers(&[base, "[[fault]]\nat_s = 3.0\n"], &[]);
    assert_eq!(layers.plain()["fault"].as_array().unwrap().len(), 1);
    assert_eq!(layers.plain()["planner"]["rungs"].as_array().unwrap().len(), 1);
}

#[test]
fn a_kind_that_is_chosen_brings_its_own_tables() {
    let url = "[perception]\ndetector = \"http\"\n[perception.options]\nurl = \"u\"\n";
    let http = layers(&[url], &[]);
    assert_eq!(at(&http, "perception.options.url"), "\"u\" 0.toml:4");
    assert_eq!(at(&http, "perception.options.score_min"), "0.25 default");
    assert_eq!(at(&http, "perception.options.retry.attempts_max"), "4 default");
    let again = layers(&[url], &["perception.detector=http"]);
    assert_eq!(again.plain(), http.plain(), "a choice made twice changes nothing");
    let colour = layers(&[url], &["perception.detector=colour"]);
    assert!(colour.written("perception.options").is_none(), "the options are not colour's");
    let back = layers(&[url], &["perception.detector=colour", "perception.detector=http"]);
    assert_eq!(back.plain(), http.plain());
    let still = layers(&[], &["robot.kind=none"]);
    assert!(still.written("robot.motion").is_none());
}

#[test]
fn keys_that_stand_for_one_another_are_not_mixed() {
    let single = "[perception.exemplar]\nimage = \"i\"\nboxes = \"b\"\nstate = \"s\"\nnumber = 1\n";
    let pooled = layers(&[single], &["perception.exemplar.folder=sim"]);
    assert_eq!(pooled.plain()["perception"]["exemplar"].as_table().unwrap().len(), 1);
    let other = layers(&["perception.exemplar.folder = \"sim\"", single], &[]);
    assert_eq!(other.plain()["perception"]["exemplar"].as_table().unwrap().len(), 4);
    let number = layers(&[single], &["perception.exemplar.number=2"]);
    assert_eq!(at(&number, "perception.exemplar.image"), "\"i\" 0.toml:2");
}

#[test]
fn old_names_of_keys_are_read_with_a_warning() {
    let old = "[limits]\nlooks_max = 3\n[robot.hull]\nbelow_m = 0.5\n\
               [perception]\ndetector = \"http\"\noptions.patience = { total_ms = 9 }\n";
    let layers = layers(&[old], &["perception.beside=true", "limits.late_plans_max=7"]);
    assert_eq!(at(&layers, "limits.observing_s_max"), "0.3 0.toml:2");
    assert_eq!(at(&layers, "robot.self_filter.below_m"), "0.5 0.toml:4");
    assert_eq!(at(&layers, "robot.self_filter.above_m"), "0.6 default");
    assert_eq!(at(&layers, "perception.options.retry.total_ms"), "9 0.toml:7");
    assert_eq!(at(&layers, "perception.detector_mode"), "\"async\" --set");
    let said: Vec<String> = layers.warnings.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(said.join("\n"), @r#"
    0.toml:2:1: warning: limits.looks_max: renamed: write limits.observing_s_max = 0.3
    0.toml:7:9: warning: perception.options.patience: renamed: write perception.options.retry
    0.toml:3:8: warning: robot.hull: renamed: write robot.self_filter
    warning: --set perception.beside: renamed: write perception.detector_mode = "async"
    warning: --set limits.late_plans_max: renamed: write limits.planner_timeouts_max
    "#);
    let both = "limits = { looks_max = 3, observing_s_max = 4 }";
    let mut other = Layers::defaults(Form::Run).unwrap();
    let error = other.parse(LayerOrigin::File("x.toml".to_owned()), both).unwrap_err();
    assert_eq!(
        error[0].message,
        "this is the old name of limits.observing_s_max, which is here too"
    );
}

#[test]
fn options_of_a_part_are_checked_with_their_keys() {
    #[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct Options {
        url: String,
        tokens_max: u32,
    }
    let read = |text: &str| {
        let given: toml::Table = text.parse().unwrap();
        read_options::<Options>("goal.options", "oracle", &given)
    };
    let options = read("url = 'u'\ntokens_max = 3").unwrap();
    assert_eq!((options.url.as_str(), options.tokens_max), ("u", 3));
    insta::assert_snapshot!(read("tokens_max = -1\nurls = 'u'").unwrap_err(), @r"
    missing key: goal.options.url; goal.options.tokens_max: expected an integer, 0 or more, got -1; goal.options.urls: unknown key; did you mean url?
    ");
    let file = "tokens_max = 5_000_000_000\npatience = 2\n";
    let schema = schemars::SchemaGenerator::subschema_for::<Options>;
    let problems = options_file(("goal.options", "oracle", schema), "o.toml", file).unwrap_err();
    let said: Vec<String> = problems.iter().map(SettingsProblem::render).collect();
    insta::assert_snapshot!(said.join("\n"), @r"
    o.toml: error: missing key: goal.options.url
    o.toml:1:14: error: goal.options.tokens_max: expected an integer, 0 or more, got 5_000_000_000
      |
    1 | tokens_max = 5_000_000_000
      |              ^^^^^^^^^^^^^
    o.toml:2:1: error: goal.options.retry: unknown key; known here: url, tokens_max
      |
    2 | patience = 2
      | ^^^^^^^^
    ");
}

#[test]
fn words_that_are_near_are_found() {
    let known = ["rate_hz", "kind", "wait_s", "observing_s_max"];
    for (word, near) in [
        ("rate", Some("rate_hz")),
        ("rate_hz_", Some("rate_hz")),
        ("knid", Some("kind")),
        ("observing_max", Some("observing_s_max")),
        ("zebra", None),
        ("", None),
    ] {
        assert_eq!(did_you_mean(word, known), near, "{word}");
    }
}

#[test]
fn all_faults_are_found_at_once() {
    let schema = json!({
        "type": "object",
        "additionalProperties": false,
        "required": ["a", "b"],
        "properties": {
            "a": { "type": "integer", "minimum": 1 },
            "b": { "type": "string" },
            "c": { "anyOf": [{ "$ref": "#/$defs/C" }, { "type": "null" }] },
            "d": { "type": "array", "items": { "oneOf": [
                { "type": "object", "properties": { "kind": { "const": "x" }, "n": { "type": "number" } },
                  "required": ["kind", "n"], "additionalProperties": false },
                { "type": "object", "properties": { "kind": { "const": "y" } },
                  "required": ["kind"], "additionalProperties": false }
            ] } },
        },
        "$defs": { "C": { "oneOf": [{ "const": "red" }, { "const": "blue" }] } },
    });
    let text = "a = 0\nbb = 'x'\nc = 'rde'\nd = [{ kind = 'x', m = 1 }, { kind = 'z' }, {}, 3]\n";
    let mut sources = Sources::default();
    let tree = Tree::parse(&mut sources, LayerOrigin::File("f.toml".to_owned()), text).unwrap();
    let problems = check::check(&schema, (&tree, ""), &sources, "f.toml");
    let said: Vec<String> = problems.iter().map(SettingsProblem::render).collect();
    insta::assert_snapshot!(said.join("\n"), @r#"
    f.toml: error: missing key: b
    f.toml:1:5: error: a: expected an integer, 1 or more, got 0
      |
    1 | a = 0
      |     ^
    f.toml:2:1: error: bb: unknown key; known here: a, b, c, d
      |
    2 | bb = 'x'
      | ^^
    f.toml:3:5: error: c: expected "red" or "blue", got 'rde'; did you mean "red"?
      |
    3 | c = 'rde'
      |     ^^^^^
    f.toml:4:6: error: d[0]: missing key: n
      |
    4 | d = [{ kind = 'x', m = 1 }, { kind = 'z' }, {}, 3]
      |      ^^^^^^^^^^^^^^^^^^^^^
    f.toml:4:20: error: d[0].m: unknown key; known here: kind, n
      |
    4 | d = [{ kind = 'x', m = 1 }, { kind = 'z' }, {}, 3]
      |                    ^
    f.toml:4:38: error: d[1].kind: expected "x" or "y", got 'z'
      |
    4 | d = [{ kind = 'x', m = 1 }, { kind = 'z' }, {}, 3]
      |                                      ^^^
    f.toml:4:45: error: d[2]: missing key: kind
      |
    4 | d = [{ kind = 'x', m = 1 }, { kind = 'z' }, {}, 3]
      |                                             ^^
    "#);
}

/// Small trees over few keys, so that they meet. As in every schema, a key holds either a table or
/// something else.
fn trees() -> impl Strategy<Value = String> {
    let leaf = || ("[x-z]", prop_oneof!["[0-9]", "\"[a-c]\"", "\\[[0-3]\\]"]);
    let entries = |leaves: Vec<(String, String)>| {
        let leaves: std::collections::BTreeMap<_, _> = leaves.into_iter().collect();
        leaves.iter().map(|(key, value)| format!("{key} = {value}")).collect::<Vec<_>>().join(", ")
    };
    let table =
        prop::collection::vec(leaf(), 0..3).prop_map(move |e| format!("{{ {} }}", entries(e)));
    let table = table.prop_recursive(3, 16, 3, move |inner| {
        prop::collection::vec(prop_oneof![leaf().prop_map(|e| e), ("[a-c]", inner)], 0..4)
            .prop_map(move |e| format!("{{ {} }}", entries(e)))
    });
    table.prop_map(|table| format!("a = {table}"))
}

proptest! {
    #[test]
    fn extending_is_associative((a, b, c) in (trees(), trees(), trees())) {
        let (a, b, c) = (tree(&a), tree(&b), tree(&c));
        prop_assert_eq!(laid(&laid(&a, &b), &c), laid(&a, &laid(&b, &c)));
    }

    #[test]
    fn extending_nothing_or_oneself_changes_nothing(a in trees()) {
        let a = tree(&a);
        prop_assert_eq!(laid(&a, &Tree::default()), a.clone());
        prop_assert_eq!(laid(&Tree::default(), &a), a.clone());
        prop_assert_eq!(laid(&a, &a), a);
    }

    /// Whatever files say, and whichever kinds they choose, a setting has the last word.
    #[test]
    fn a_setting_wins(
        kinds in prop::collection::vec(prop_oneof!["sim", "none"], 0..4),
        value in 1_u32..1000,
    ) {
        let text = |(idx, kind): (usize, &String)| {
            format!("limits.cycles_max = {idx}\nrobot.kind = \"{kind}\"\nrobot.motion.speed_m_s = {idx}\n")
        };
        let texts: Vec<String> = kinds.iter().enumerate().map(text).collect();
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        let cycles = format!("limits.cycles_max={value}");
        let layers = layers(&texts, &[&cycles, "robot.kind=sim", "robot.motion.speed_m_s=0.5"]);
        prop_assert_eq!(at(&layers, "limits.cycles_max"), format!("{value} --set"));
        prop_assert_eq!(at(&layers, "robot.motion.speed_m_s"), "0.5 --set");
        prop_assert_eq!(at(&layers, "robot.motion.travel_z_m"), "0.55 default");
    }

    /// Files that extend one another are laid in their order: a chain in which a base is replaced by
    /// what it resolves to comes to the same, kinds that are chosen and dropped again included.
    #[test]
    fn a_base_may_be_replaced_by_what_it_resolves_to(
        kinds in prop::collection::vec(prop_oneof![Just(Some("sim")), Just(Some("none")), Just(None)], 3),
    ) {
        let text = |(idx, kind): (usize, Option<&str>)| {
            let kind = kind.map(|kind| format!("robot.kind = \"{kind}\"\n")).unwrap_or_default();
            format!("{kind}robot.motion.speed_m_s = {idx}.5\nseed = {idx}\n")
        };
        let texts: Vec<String> = kinds.iter().copied().enumerate().map(text).collect();
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        let all = layers(&texts, &[]);
        let base = layers(&texts[..2], &[]).plain().to_string();
        let flat = layers(&[&base, texts[2]], &[]);
        if kinds[2].is_none() || kinds[2] == layers(&texts[..2], &[]).tree.string("robot.kind") {
            prop_assert_eq!(all.plain(), flat.plain());
        }
    }

    #[test]
    fn no_text_is_a_panic(text in "\\PC*") {
        let mut layers = Layers::defaults(Form::Run).unwrap();
        let file = LayerOrigin::File("f.toml".to_owned());
        if let Ok(layer) = layers.parse(file, &text) {
            layers.lay(layer);
        }
        drop(layers.set(&text));
        let problems = layers.problems(&json!({ "type": "object", "properties": {}, "additionalProperties": false }), "f.toml");
        prop_assert!(problems.iter().all(|problem| !problem.render().is_empty()));
    }
}
