//! Recorded answers of services: asked for once, found again without server, key or image.
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{project, runtime};
use assert_cmd::Command;
use groundloop::http::Answers;
use groundloop::parts::{PartChoice, PartContext};
use groundloop::pddl::{SourceText, parse_problem};
use groundloop::perception::detectors::{DETECTORS, Detector, DetectorError, DetectorInputs};
use groundloop::perception::{Detections, ImageView};
use groundloop::run::{DomainFolder, load_run};
use serde_json::{Value, json};
use tokio::runtime::Runtime;
use wiremock::matchers::{method, path};
use wiremock::{Mock, MockServer, Request, Respond, ResponseTemplate};

const KEY: &str = "k3y-that-nobody-may-see";

/// A mock server on a runtime of its own.
struct Service {
    runtime: Runtime,
    server: MockServer,
}

impl Service {
    fn new(mocks: Vec<Mock>) -> Self {
        let runtime = runtime();
        let server = runtime.block_on(async {
            let server = MockServer::start().await;
            for mock in mocks {
                mock.mount(&server).await;
            }
            server
        });
        Self { runtime, server }
    }

    fn n_requests(&self) -> usize {
        self.runtime.block_on(self.server.received_requests()).unwrap().len()
    }
}

fn ok(body: &Value) -> ResponseTemplate {
    ResponseTemplate::new(200).set_body_json(body)
}

/// The recorded answers in a folder, none of which may hold the key or an image.
#[track_caller]
fn recorded(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files: Vec<PathBuf> = files.collect();
    for file in &files {
        let text = fs::read_to_string(file).unwrap();
        assert!(!text.contains(KEY), "{text}");
        assert!(!text.contains("iVBOR"), "a PNG as base64: {text}");
    }
    files
}

// ── goals ───────────────────────────────────────────────────────────────────────────────────────

/// A reply of a language model.
fn says(content: &str) -> ResponseTemplate {
    let message = json!({"role": "assistant", "content": content});
    ok(&json!({"choices": [{"index": 0, "finish_reason": "stop", "message": message}]}))
}

/// `groundloop goal`: exit code, standard output, standard error.
fn goal(options: &Path, key: Option<&str>, said: &str, more: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("groundloop").unwrap();
    command
        .current_dir(project(""))
        .env_remove("MODEL_KEY")
        .envs(key.map(|key| ("MODEL_KEY", key)));
    command.args(["goal", "--domain", "blocksworld", "--instruction", said]);
    command.args(["--objects", "red_block:block@0,0,9,9 blue_block:block@20,0,29,9"]);
    command.args(["--kind", "language_model", "--options"]).arg(options).args(more);
    ended(&mut command)
}

fn ended(command: &mut Command) -> (i32, String, String) {
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_goal_is_read_again_without_server_and_key() {
    let answer = |text, n| {
        let mock = Mock::given(path("/v1/chat/completions")).respond_with(says(text));
        if n == 0 { mock } else { mock.up_to_n_times(n) }
    };
    // The first answer is not valid; the model is told so and asked again.
    let server =
        Service::new(vec![answer("(on red_block)", 1), answer("(on red_block blue_block)", 0)]);
    let folder = tempfile::tempdir().unwrap();
    let (options, answers) = (folder.path().join("model.toml"), folder.path().join("answers"));
    let url = server.server.uri();
    let text =
        format!("url = '{url}/v1'\nmodel = 'm'\ndialect = 'llamacpp'\nkey_env = 'MODEL_KEY'\n");
    fs::write(&options, &text).unwrap();
    let kept = ["--answers", answers.to_str().unwrap()];
    let offline = [kept.as_slice(), &["--offline"]].concat();
    let first = goal(&options, Some(KEY), "red over blue", &kept);
    assert_eq!((first.0, server.n_requests()), (0, 2), "{}", first.2);
    assert!(first.1.contains("(on red_block blue_block)"), "{}", first.1);
    assert_eq!(goal(&options, None, "red over blue", &offline), first);
    assert_eq!(goal(&options, None, "red over blue", &kept), first);
    assert_eq!(server.n_requests(), 2);

    let (code, _, stderr) = goal(&options, None, "blue over red", &offline);
    assert_eq!(code, 5, "{stderr}");
    for said in ["the answer of m is missing", "no recorded answer", "leave out --offline"] {
        assert!(stderr.contains(said), "{said}: {stderr}");
    }
    let (code, _, stderr) = goal(&options, None, "blue over red", &kept);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("MODEL_KEY is empty or not set"), "{stderr}");

    // Damaged answers are asked for anew.
    let files = recorded(&answers);
    assert_eq!(files.len(), 2);
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        fs::write(&file, &text[..text.len() / 3]).unwrap();
    }
    assert_eq!(goal(&options, None, "red over blue", &offline).0, 5);
    assert_eq!(goal(&options, Some(KEY), "red over blue", &kept).0, 0);
    assert_eq!(goal(&options, None, "red over blue", &offline).0, 0);

    // What the setting was called before.
    fs::write(&options, format!("{text}cache = 'answers'\n")).unwrap();
    let (code, _, stderr) = goal(&options, Some(KEY), "red over blue", &[]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("goal.options.cache: ") && stderr.contains("services.answers"));
}

#[test]
fn run_files_name_one_folder_for_all_services() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.toml");
    let text = "extends = \"photo_blocksworld\"\n[services]\nanswers = \"kept\"\n";
    fs::write(&file, text).unwrap();
    let answers = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
        load_run(&file, &sets).map(|config| config.detector_choice().answers)
    };
    let kept = folder.path().join("kept");
    assert_eq!(answers(&[]).unwrap(), Some(Answers::new(&kept, false)));
    let offline = answers(&["services.offline=true"]).unwrap();
    assert_eq!(offline, Some(Answers::new(&kept, true)));

    // The old key is still read; offline without answers makes no sense.
    let model = "[goal]\nkind = \"language_model\"\n[goal.options]\nurl = \"http://127.0.0.1:9\"\n\
                 model = \"m\"\ndialect = \"openai\"\n";
    fs::write(&file, format!("extends = \"photo_blocksworld\"\n{model}cache = \"kept\"")).unwrap();
    assert_eq!(answers(&[]).unwrap(), Some(Answers::new(&kept, false)));
    fs::write(&file, "extends = \"photo_blocksworld\"\n[services]\noffline = true\n").unwrap();
    let error = answers(&[]).unwrap_err().to_string();
    assert!(error.contains("services.offline: expected false, or a folder"), "{error}");
}

/// The flags of `groundloop run` are the keys of its run file.
#[cfg(feature = "sim")]
#[test]
fn an_episode_without_its_recorded_goal_is_exit_code_5() {
    let folder = tempfile::tempdir().unwrap();
    let model = "goal.options={url=\"http://127.0.0.1:9\", model=\"m\", dialect=\"openai\"}";
    let mut command = Command::cargo_bin("groundloop").unwrap();
    command.current_dir(folder.path()).args(["run", "blocksworld", "--json"]);
    command.args(["--set", "goal.kind=language_model", "--set", model]);
    command.args(["--answers", "kept \"here\"", "--offline"]);
    let (code, _, stderr) = ended(&mut command);
    assert_eq!(code, 5, "{stderr}");
    let kept = folder.path().canonicalize().unwrap().join("kept \"here\"");
    let said = format!(" in {}: leave out --offline", kept.display());
    assert!(stderr.contains("no recorded answer") && stderr.contains(&said), "{stderr}");
}

// ── detectors ───────────────────────────────────────────────────────────────────────────────────

const SIDE: usize = 120;

fn detector(
    options: &str,
    answers: Answers,
    environment: fn(&str) -> Option<String>,
) -> Box<dyn Detector> {
    let folder = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    let options: toml::Table = options.parse().unwrap();
    let choice = PartChoice::new("test", "http").with_options(Some(&options), "");
    let choice = choice.with_answers(Some(answers));
    let inputs = DetectorInputs { domain: &folder.domain, perception: &folder.perception };
    DETECTORS.build(&PartContext { choice: &choice, inputs, environment }).unwrap()
}

fn look(detector: &mut dyn Detector, grey: u8) -> Result<Detections, DetectorError> {
    let rgb = vec![grey; 3 * SIDE * SIDE];
    let image = ImageView::new(SIDE, SIDE, &rgb).unwrap();
    detector.detect(&image, &["my cup".to_owned()])
}

/// A service answers for the types and for a phrase; afterwards nobody needs it.
#[track_caller]
fn replayed(dialect: &str, mocks: Vec<Mock>, n_requests: usize) {
    let service = Service::new(mocks);
    let url = service.server.uri();
    let options = format!(
        "dialect = \"{dialect}\"\nurl = \"{url}\"\nkey_env = \"TEST_KEY\"\n\
         poll = {{ interval_ms = 1, polls_max = 9 }}"
    );
    let folder = tempfile::tempdir().unwrap();
    let with_key = |_: &str| Some(KEY.to_owned());
    let mut online = detector(&options, Answers::new(folder.path(), false), with_key);
    let seen = look(&mut *online, 40).unwrap();
    assert_eq!((seen.objects.len(), seen.phrases.len()), (1, 1), "{dialect}");
    assert_eq!((service.n_requests(), recorded(folder.path()).len()), (n_requests, 2), "{dialect}");

    let mut offline = detector(&options, Answers::new(folder.path(), true), |_| None);
    assert_eq!(look(&mut *offline, 40).unwrap(), seen, "{dialect}");
    let error = look(&mut *offline, 41).unwrap_err();
    assert!(error.is_missing() && error.to_string().contains("no recorded answer"), "{error}");
    assert_eq!(service.n_requests(), n_requests, "{dialect}");
    // Another picture needs the service, and the service its key.
    let mut keyless = detector(&options, Answers::new(folder.path(), false), |_| None);
    let error = look(&mut *keyless, 41).unwrap_err().to_string();
    assert!(error.contains("TEST_KEY, which is not set"), "{error}");
}

#[test]
fn every_dialect_is_replayed() {
    let labels = ["colored block", "my cup"];
    let found = labels.map(|label| {
        json!({"label": label, "score": 0.9,
            "box": {"xmin": 10, "ymin": 20, "xmax": 50, "ymax": 50}})
    });
    let answer = ok(&Value::from(found.to_vec()));
    replayed("hugging_face", vec![Mock::given(method("POST")).respond_with(answer)], 2);

    let found = labels.map(|label| {
        json!({"class": label, "confidence": 0.912_345_678_901_234_5, "x": 30, "y": 35,
            "width": 40, "height": 30})
    });
    let answer = ok(&json!({ "predictions": found, "api_key": KEY }));
    replayed("roboflow", vec![Mock::given(method("POST")).respond_with(answer)], 2);

    // A task that is waited for: its answer is kept, not that it was running.
    let found =
        labels.map(|label| json!({"category": label, "score": 0.9, "bbox": [10, 20, 50, 50]}));
    let done = json!({"data": {"status": "success", "result": {"objects": found}}});
    let task = ok(&json!({"code": 0, "data": {"task_uuid": "t-1"}}));
    let status = || Mock::given(path("/v2/task_status/t-1"));
    let running = ok(&json!({"data": {"status": "running"}}));
    let mocks = vec![
        Mock::given(path("/v2/task/dinox/detection")).respond_with(task),
        status().respond_with(running).up_to_n_times(2),
        status().respond_with(ok(&done)),
    ];
    replayed("dino_x", mocks, 6);
}

/// A reply that nobody can read is no answer.
#[test]
fn what_cannot_be_read_is_not_recorded() {
    let service = Service::new(vec![Mock::given(method("POST")).respond_with(ok(&json!({})))]);
    let folder = tempfile::tempdir().unwrap();
    let options = format!("dialect = \"roboflow\"\nurl = \"{}\"", service.server.uri());
    let mut detector = detector(&options, Answers::new(folder.path(), false), |_| None);
    let error = look(&mut *detector, 40).unwrap_err().to_string();
    assert!(error.contains("predictions: expected a list"), "{error}");
    assert_eq!(recorded(folder.path()).len(), 0);
}

// ── photographs of cooking ──────────────────────────────────────────────────────────────────────

/// What stands where in a tiny picture: name, type, prompt, box.
type Things = Vec<(&'static str, &'static str, &'static str, [u32; 4])>;

/// What a service sees in a picture: names, prompts, boxes.
type Seen = Vec<(String, String, [f64; 4])>;

/// A kitchen with a cucumber on the tray or on the board.
fn kitchen(is_on_board: bool) -> Things {
    let cucumber = if is_on_board { [110, 32, 134, 40] } else { [74, 80, 98, 88] };
    vec![
        ("cucumber", "veggie", "vegetable", cucumber),
        ("counter", "location", "black tray", [10, 60, 150, 110]),
        ("cutting_board", "workspace", "wooden board", [95, 24, 155, 48]),
        ("bowl", "container", "bowl", [14, 90, 38, 108]),
        ("a_bot", "gripper", "robotic gripper", [4, 2, 34, 30]),
        ("b_bot", "gripper", "robotic gripper", [60, 2, 90, 22]),
        ("knife", "cuttool", "chopping knife", [62, 14, 92, 26]),
    ]
}

/// Draws each thing in a grey of its own.
fn picture(things: &Things, number: u8) -> image::RgbImage {
    let mut picture = image::RgbImage::from_pixel(160, 120, image::Rgb([number; 3]));
    for (i, (_, _, _, [x1, y1, x2, y2])) in things.iter().enumerate() {
        for (x, y) in (*x1..*x2).flat_map(|x| (*y1..*y2).map(move |y| (x, y))) {
            picture.put_pixel(x, y, image::Rgb([80 + 20 * i as u8; 3]));
        }
    }
    picture
}

/// A checkout of cooking without anything recorded: three problems, the first and the last alike.
fn checkout() -> (tempfile::TempDir, Vec<(Vec<u8>, Seen)>) {
    let checkout = tempfile::tempdir().unwrap();
    let write = |file: String, text: &str| {
        let path = checkout.path().join("data/cooking").join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    let domain = fs::read_to_string(project("domains/cooking/domain.pddl")).unwrap();
    write("domain.pddl".to_owned(), &domain);
    let mut pictures = Vec::new();
    for (number, is_on_board) in [(1, false), (2, true), (3, false)] {
        let things = kitchen(is_on_board);
        let objects: Vec<String> =
            things.iter().map(|(name, kind, ..)| format!("{name} - {kind}")).collect();
        let objects = objects.join(" ");
        let place = if is_on_board { "cutting_board" } else { "counter" };
        let problem = format!(
            "(define (problem p) (:domain cooking) (:objects {objects}) (:init (free a_bot) \
             (carry b_bot knife) (at bowl counter) (available cucumber) (available bowl) \
             (is-whole cucumber) (at cucumber {place})) (:goal (at cucumber cutting_board)))"
        );
        write(format!("problems/problem{number}.pddl"), &problem);
        let boxes: serde_json::Map<String, Value> =
            things.iter().map(|(name, _, _, edges)| ((*name).to_owned(), json!(edges))).collect();
        write(format!("annotated_bboxes/problem{number}.json"), &Value::from(boxes).to_string());
        write(format!("instructions/problem{number}.txt"), "Put the cucumber on the board.");
        let file = format!("observations/problem{number}.jpg");
        write(file.clone(), "");
        let path = checkout.path().join("data/cooking").join(file);
        picture(&things, number).save(&path).unwrap();
        let seen = things.into_iter().map(|(name, _, prompt, edges)| {
            (name.to_owned(), prompt.to_owned(), edges.map(f64::from))
        });
        pictures.push((pixels(&path), seen.collect()));
    }
    (checkout, pictures)
}

fn pixels(path: &Path) -> Vec<u8> {
    image::open(path).unwrap().to_rgb8().into_raw()
}

/// Answers for the picture that it is sent, in the words that it is asked in.
struct Sees(Vec<(Vec<u8>, Seen)>);

impl Respond for Sees {
    fn respond(&self, request: &Request) -> ResponseTemplate {
        use base64::Engine as _;
        let body: Value = request.body_json().unwrap();
        let text = body["inputs"].as_str().unwrap();
        let bytes = base64::engine::general_purpose::STANDARD.decode(text).unwrap();
        let sent = image::load_from_memory(&bytes).unwrap().to_rgb8().into_raw();
        let (_, seen) = self.0.iter().find(|(pixels, _)| *pixels == sent).unwrap();
        let asked = body["parameters"]["candidate_labels"].as_array().unwrap();
        let fits = |words: &str| asked.iter().find(|asked| asked.as_str() == Some(words)).cloned();
        let found = seen.iter().filter_map(|(name, prompt, [x1, y1, x2, y2])| {
            let label = fits(prompt).or_else(|| fits(&name.replace('_', " ")))?;
            Some(json!({"label": label, "score": 0.87,
                "box": {"xmin": x1, "ymin": y1, "xmax": x2, "ymax": y2}}))
        });
        ok(&Value::from(found.collect::<Vec<Value>>()))
    }
}

#[test]
fn cooking_is_evaluated_from_pixels_and_again_without_its_service() {
    let (checkout, pictures) = checkout();
    let service = Service::new(vec![Mock::given(method("POST")).respond_with(Sees(pictures))]);
    let options = checkout.path().join("options.toml");
    let text = format!(
        "[perception.options]\ndialect = \"hugging_face\"\nurl = \"{}\"\nkey_env = \"PATH\"\n",
        service.server.uri()
    );
    fs::write(&options, text).unwrap();
    let answers = checkout.path().join("answers");
    let args = [
        ["--domain", "cooking", "--detections", "http", "--goals", "truth"].as_slice(),
        &["--options", options.to_str().unwrap(), "--answers", answers.to_str().unwrap()],
    ]
    .concat();
    let offline = [args.as_slice(), &["--offline"]].concat();
    let (code, _, stderr) = crate::common::eval::eval(checkout.path(), &offline);
    assert_eq!(code, 5, "{stderr}");
    assert!(stderr.contains("no recorded answer") && stderr.contains("--offline"), "{stderr}");
    assert_eq!(service.n_requests(), 0);

    let first = crate::common::eval::report(checkout.path(), &args);
    let domain = &first["domains"]["cooking"];
    assert_eq!(domain["pairs"], 6, "{domain}");
    assert_eq!((&domain["precision"], &domain["recall"]), (&json!(1.0), &json!(1.0)), "{domain}");
    let n_requests = service.n_requests();
    assert_eq!(recorded(&answers).len(), n_requests, "the same question is asked once");
    assert!(n_requests >= 3);

    assert_eq!(crate::common::eval::report(checkout.path(), &offline), first);
    assert_eq!(service.n_requests(), n_requests);
}

/// The photographs themselves, with the annotated boxes as what a service sees.
#[test]
fn photographs_of_cooking_are_evaluated_as_with_the_boxes_themselves() {
    let Some(data) = crate::common::data("prodgv", "photographs of cooking through a service")
    else {
        return;
    };
    let folder = DomainFolder::read(&project("domains/cooking")).unwrap();
    let mut pictures = Vec::new();
    let boxes = fs::read_dir(data.join("data/cooking/annotated_bboxes")).unwrap();
    for path in boxes.map(|entry| entry.unwrap().path()) {
        let stem = path.file_stem().unwrap().to_str().unwrap();
        let in_data =
            |kind: &str, end: &str| data.join(format!("data/cooking/{kind}/{stem}.{end}"));
        let problem = fs::read_to_string(in_data("problems", "pddl")).unwrap();
        let source = SourceText::new(stem, problem);
        let problem = parse_problem(&source, &folder.domain).unwrap().value;
        let boxes: std::collections::BTreeMap<String, [f64; 4]> =
            serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        let seen = boxes.into_iter().map(|(name, edges)| {
            let typed = problem.objects.iter().find(|typed| typed.name == name.as_str()).unwrap();
            let spec = folder.perception.type_spec(&typed.types[0]).unwrap();
            (name, spec.prompt.clone().unwrap(), edges)
        });
        pictures.push((pixels(&in_data("observations", "jpg")), seen.collect()));
    }
    let service = Service::new(vec![Mock::given(method("POST")).respond_with(Sees(pictures))]);
    let kept = tempfile::tempdir().unwrap();
    let options = kept.path().join("options.toml");
    let url = service.server.uri();
    let text = format!("[perception.options]\ndialect = \"hugging_face\"\nurl = \"{url}\"\n");
    fs::write(&options, text).unwrap();
    let answers = kept.path().join("answers");
    let answers = answers.to_str().unwrap();
    for grounder in ["s2s", "s2s-joint"] {
        let of = |detections: &[&str]| {
            let args = ["--domain", "cooking", "--goals", "truth", "--grounder", grounder];
            let report = crate::common::eval::report(&data, &[&args, detections].concat());
            report["domains"]["cooking"].clone()
        };
        let options = options.to_str().unwrap();
        let service = ["--detections", "http", "--options", options, "--answers", answers];
        let (looked_at, given) = (of(&service), of(&["--detections", "annotated"]));
        let keys = ["pairs", "tp", "fp", "fn", "unknown", "exact_states", "success"];
        let [looked_at, given] =
            [looked_at, given].map(|domain| crate::common::eval::only(&domain, &keys));
        assert_eq!(looked_at, given, "{grounder}");
        assert_ne!(given["pairs"], 0, "{grounder}");
    }
}
