//! HTTP detectors against a mock server: what is sent, what is made of the answer, and every way in
//! which a service can fail.
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::io::{Read as _, Write as _};
use std::net::TcpListener;

use crate::common::{Process, project, runtime};
use groundloop::http::WebError;
use groundloop::parts::{PartChoice, PartContext};
use groundloop::perception::detectors::{DETECTORS, Detector, DetectorError, DetectorInputs};
use groundloop::perception::{Detections, ImageView, name_detections};
use groundloop::run::DomainFolder;
use serde_json::{Value, json};
use tokio::runtime::Runtime;
use wiremock::matchers::{body_partial_json, header, method, path};
use wiremock::{Mock, MockServer, ResponseTemplate};

const WIDTH: usize = 160;
const HEIGHT: usize = 120;
const KEY: &str = "k3y-that-nobody-may-see";

/// A dark frame with a red and a blue block.
fn frame() -> Vec<u8> {
    let mut rgb = vec![20; 3 * WIDTH * HEIGHT];
    for (x0, colour) in [(10, [210, 20, 20]), (100, [20, 40, 210])] {
        for (y, x) in (20..50).flat_map(|y| (x0..x0 + 40).map(move |x| (y, x))) {
            rgb[3 * (y * WIDTH + x)..][..3].copy_from_slice(&colour);
        }
    }
    rgb
}

/// A labelled picture.
const EXAMPLE: &str = "domains/blocksworld/exemplar/sim_320x240/a_tower_and_singles";

/// Quick attempts, and answers to nobody but the mock server.
const PATIENCE: &str = "retry = { backoff_ms_min = 1, backoff_ms_max = 2, attempts_max = 4 }\n";

fn build(options: &str) -> Result<Box<dyn Detector>, DetectorError> {
    let folder = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    let options: toml::Table = options.parse().unwrap();
    let choice = PartChoice::new("test", "http").with_options(Some(&options), "");
    let inputs = DetectorInputs { domain: &folder.domain, perception: &folder.perception };
    let environment = |name: &str| (name == "TEST_KEY").then(|| KEY.to_owned());
    Ok(DETECTORS.build(&PartContext { choice: &choice, inputs, environment })?)
}

fn look(options: &str, phrases: &[&str]) -> Result<Detections, DetectorError> {
    let rgb = frame();
    let image = ImageView::new(WIDTH, HEIGHT, &rgb).unwrap();
    let phrases: Vec<String> = phrases.iter().map(ToString::to_string).collect();
    build(&format!("{options}\n{PATIENCE}"))?.detect(&image, &phrases)
}

/// A mock server on a runtime of its own.
struct Service {
    runtime: Runtime,
    server: MockServer,
}

impl Service {
    fn new() -> Self {
        let runtime = runtime();
        let server = runtime.block_on(MockServer::start());
        Self { runtime, server }
    }

    fn mount(&self, mock: Mock) {
        self.runtime.block_on(mock.mount(&self.server));
    }

    /// Every request is answered alike; returns the options for the Hugging Face dialect.
    fn answering(response: ResponseTemplate) -> (Self, String) {
        let service = Self::new();
        service.mount(Mock::given(method("POST")).respond_with(response));
        let options = service.options("hugging_face");
        (service, options)
    }

    fn options(&self, dialect: &str) -> String {
        format!("dialect = {dialect:?}\nurl = {:?}\nkey_env = \"TEST_KEY\"", self.server.uri())
    }

    fn n_requests(&self) -> usize {
        self.runtime.block_on(self.server.received_requests()).unwrap().len()
    }

    /// The body of the first request.
    fn asked(&self) -> Value {
        let requests = self.runtime.block_on(self.server.received_requests()).unwrap();
        serde_json::from_slice(&requests[0].body).unwrap()
    }
}

fn ok(body: &Value) -> ResponseTemplate {
    ResponseTemplate::new(200).set_body_json(body)
}

/// Names and boxes, in the detector's order.
fn seen(detections: &Detections) -> Vec<(String, [f64; 4])> {
    let folder = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    let names = name_detections(&folder.perception, &detections.objects);
    names
        .iter()
        .map(ToString::to_string)
        .zip(detections.objects.iter().map(|d| d.pixel_box.into()))
        .collect()
}

/// The frame that a request carries is the one that was looked at.
#[track_caller]
fn is_the_frame(base64: &str) {
    use base64::Engine as _;
    let bytes = base64::engine::general_purpose::STANDARD.decode(base64).unwrap();
    assert_eq!(image::load_from_memory(&bytes).unwrap().to_rgb8().into_raw(), frame());
}

/// Two blocks whose boxes no two conventions write alike.
fn two_blocks() -> Vec<(String, [f64; 4])> {
    let red = ("red_block".to_owned(), [10.0, 20.0, 50.0, 50.0]);
    vec![red, ("blue_block".to_owned(), [100.0, 20.0, 140.0, 50.0])]
}

// ── good answers ────────────────────────────────────────────────────────────────────────────────

#[test]
fn hugging_face_gives_edges() {
    let service = Service::new();
    let edges = |x: u32| json!({"xmin": x, "ymin": 20, "xmax": x + 40, "ymax": 50});
    let answer = json!([
        {"label": "Colored Blocks", "score": 0.8, "box": edges(100)},
        {"label": "colored block", "score": 0.9, "box": edges(10)},
        {"label": "colored block", "score": 0.4, "box": edges(11)},
        {"label": "colored block", "score": 0.1, "box": edges(60)},
        {"label": "cup", "score": 0.9, "box": edges(60)},
    ]);
    let authorised = header("authorization", format!("Bearer {KEY}").as_str());
    service.mount(Mock::given(method("POST")).and(authorised).respond_with(ok(&answer)));
    let detections = look(&service.options("hugging_face"), &[]).unwrap();
    assert_eq!(seen(&detections), two_blocks());
    assert_eq!(detections.objects[0].score, 0.9);
    let asked = service.asked();
    assert_eq!(asked["parameters"], json!({"candidate_labels": ["colored block"]}));
    is_the_frame(asked["inputs"].as_str().unwrap());
}

#[test]
fn roboflow_gives_the_middle_and_the_size() {
    let service = Service::new();
    let block = |x: f64| {
        json!({"x": x, "y": 35, "width": 40, "height": 30, "confidence": 0.7,
        "class": "colored block"})
    };
    let answer = json!({"predictions": [block(30.0), block(120.0)]});
    let mock = Mock::given(path("/grounding_dino/infer"))
        .and(body_partial_json(json!({"text": ["colored block"], "api_key": KEY})));
    service.mount(mock.respond_with(ok(&answer)));
    let detections = look(&service.options("roboflow"), &[]).unwrap();
    assert_eq!(seen(&detections), two_blocks());
    is_the_frame(service.asked()["image"]["value"].as_str().unwrap());
}

/// The mock of a DINO-X server: a task that is not done for two questions.
fn dinox(status: &Value, n_waits: u64) -> (Service, String) {
    let service = Service::new();
    let token = || header("Token", KEY);
    let created = json!({"code": 0, "msg": "ok", "data": {"task_uuid": "a-1"}});
    let task = Mock::given(method("POST")).and(path("/v2/task/dinox/detection")).and(token());
    service.mount(task.respond_with(ok(&created)));
    for (word, n) in [("waiting", 1), ("running", n_waits.saturating_sub(1))] {
        let body = json!({"code": 0, "data": {"status": word}});
        let asked = Mock::given(method("GET")).and(path("/v2/task_status/a-1")).and(token());
        if n > 0 {
            service.mount(asked.respond_with(ok(&body)).up_to_n_times(n));
        }
    }
    let asked = Mock::given(method("GET")).and(path("/v2/task_status/a-1")).and(token());
    service.mount(asked.respond_with(ok(status)));
    let options = service.options("dino_x") + "\npoll = { interval_ms = 0, polls_max = 5 }";
    (service, options)
}

#[test]
fn dino_x_gives_edges_once_its_task_is_done() {
    let objects = json!([
        {"category": "colored block", "score": 0.9, "bbox": [10, 20, 50, 50]},
        {"category": "block", "bbox": [100, 20, 140, 50]},
    ]);
    let done = json!({"code": 0, "data": {"status": "success", "result": {"objects": objects}}});
    let (service, options) = dinox(&done, 3);
    let detections = look(&options, &[]).unwrap();
    assert_eq!(seen(&detections), two_blocks());
    assert_eq!(detections.objects[1].score, 1.0, "without a score it counts fully");
    let asked = service.asked();
    assert_eq!(asked["prompt"], json!({"type": "text", "text": "colored block"}));
    let image = asked["image"].as_str().unwrap();
    is_the_frame(image.strip_prefix("data:image/png;base64,").unwrap());
    assert_eq!(service.n_requests(), 1 + 4);
}

#[test]
fn a_task_of_dino_x_that_fails_or_never_ends_is_told() {
    let failed = json!({"code": 0, "data": {"status": "failed", "error": "too dark"}});
    let message = look(&dinox(&failed, 1).1, &[]).unwrap_err().to_string();
    assert!(message.contains("the task has failed: \"too dark\""), "{message}");
    let strange = json!({"code": 0, "data": {"status": "napping"}});
    let message = look(&dinox(&strange, 0).1, &[]).unwrap_err().to_string();
    assert!(message.contains("data.status: expected waiting, running, success"), "{message}");
    let error = look(&dinox(&strange, 9).1, &[]).unwrap_err();
    assert!(error.is_missing() && error.to_string().contains("5 questions"), "{error}");
    for created in
        [json!({"code": 10001, "msg": "no money"}), json!({"data": {"task_uuid": "../x"}})]
    {
        let (service, _) = Service::answering(ok(&created));
        let message = look(&service.options("dino_x"), &[]).unwrap_err().to_string();
        assert!(message.contains("no money") || message.contains("expected letters"), "{message}");
    }
}

#[test]
fn phrases_are_asked_for_by_themselves() {
    let service = Service::new();
    let place = |label: &str, x: u32| {
        json!([{"label": label, "score": 0.6,
            "box": {"xmin": x, "ymin": 20, "xmax": x + 40, "ymax": 50}}])
    };
    for (queries, answer) in [
        (json!(["colored block"]), place("colored block", 10)),
        (json!(["my cup", "left tray"]), place("Left trays", 100)),
    ] {
        let body = json!({"parameters": {"candidate_labels": queries}});
        service.mount(Mock::given(body_partial_json(body)).respond_with(ok(&answer)));
    }
    let detections = look(&service.options("hugging_face"), &["my cup", "left tray"]).unwrap();
    assert_eq!(seen(&detections), two_blocks()[..1]);
    let [place] = detections.phrases.as_slice() else { panic!("{detections:?}") };
    assert_eq!((place.phrase.as_str(), place.score), ("left tray", 0.6));
    assert_eq!(<[f64; 4]>::from(place.pixel_box), [100.0, 20.0, 140.0, 50.0]);
}

/// What is wrong with one box does not spoil the others.
#[test]
fn boxes_are_clipped_or_dropped() {
    let with = |edges: Value| json!({"label": "colored block", "score": 7, "box": edges});
    let edges =
        |a: f64, b: f64, c: f64, d: f64| json!({"xmin": a, "ymin": b, "xmax": c, "ymax": d});
    let answer = json!([
        with(edges(-5.0, 20.0, 50.0, 50.0)),
        with(edges(200.0, 20.0, 240.0, 50.0)),
        with(edges(50.0, 20.0, 10.0, 50.0)),
        with(json!(null)),
        with(json!({"xmin": 1, "ymin": null, "xmax": 5, "ymax": 5})),
        {"score": 0.9, "box": edges(1.0, 1.0, 9.0, 9.0)},
        {"label": "colored block", "score": "high", "box": edges(1.0, 1.0, 9.0, 9.0)},
        7,
    ]);
    let detections = look(&Service::answering(ok(&answer)).1, &[]).unwrap();
    assert_eq!(seen(&detections), [("red_block".to_owned(), [0.0, 20.0, 50.0, 50.0])]);
    assert_eq!(detections.objects[0].score, 1.0);
}

// ── failures ────────────────────────────────────────────────────────────────────────────────────

#[track_caller]
fn fails(response: ResponseTemplate, n_requests: usize, is_missing: bool, expect: &str) {
    let (service, options) = Service::answering(response);
    let error = look(&options, &[]).unwrap_err();
    let message = error.to_string();
    assert!(message.contains(expect), "{expect:?} is not in {message}");
    assert!(!message.contains(KEY), "{message}");
    assert_eq!(error.is_missing(), is_missing, "{message}");
    assert_eq!(service.n_requests(), n_requests, "{message}");
}

#[test]
fn answers_of_another_form_are_told() {
    fails(ok(&json!({"error": 1})), 1, false, "expected a list of {label, score, box}");
    fails(ResponseTemplate::new(200), 1, false, "expected a list");
    let cut = r#"[{"label": "colored block", "sco"#;
    fails(ResponseTemplate::new(200).set_body_string(cut), 1, false, "expected JSON");
    let html = "<html>maintenance</html>";
    fails(ResponseTemplate::new(200).set_body_string(html), 1, false, "expected JSON");
    let (service, _) = Service::answering(ok(&json!([])));
    let message = look(&service.options("roboflow"), &[]).unwrap_err().to_string();
    assert!(message.contains("predictions: expected a list"), "{message}");
}

#[test]
fn what_the_service_refuses_is_not_asked_again() {
    let refused = json!({"error": {"message": format!("no model for {KEY}")}});
    let response = ResponseTemplate::new(400).set_body_json(refused);
    fails(response, 1, false, "status 400 after 1 attempt(s): no model for [hidden]");
    fails(ResponseTemplate::new(401), 1, false, "perception.options.key_env: expected the name");
}

#[test]
fn a_service_that_keeps_failing_is_missing() {
    fails(ResponseTemplate::new(500), 3, true, "status 500 after 3 attempt(s)");
    fails(ResponseTemplate::new(503), 4, true, "status 503 after 4 attempt(s)");
    let later = ResponseTemplate::new(429).insert_header("Retry-After", "7200");
    fails(later, 1, true, "not answered within 120000 ms");
}

#[test]
fn a_busy_service_is_asked_again_when_it_says() {
    let service = Service::new();
    let busy = ResponseTemplate::new(429).insert_header("Retry-After", "0");
    service.mount(Mock::given(method("POST")).respond_with(busy).up_to_n_times(2));
    service.mount(Mock::given(method("POST")).respond_with(ok(&json!([]))));
    assert_eq!(look(&service.options("hugging_face"), &[]).unwrap(), Detections::default());
    assert_eq!(service.n_requests(), 3);
}

#[test]
fn a_slow_drip_ends_at_the_deadline() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let work = move || {
        let (mut stream, _) = listener.accept().unwrap();
        stream.read_exact(&mut [0; 16]).unwrap();
        stream.write_all(b"HTTP/1.1 200 OK\r\ncontent-length: 100000000000\r\n\r\n").unwrap();
        while stream.write_all(b" ").is_ok() {}
    };
    let server = std::thread::Builder::new().spawn(work).unwrap();
    let rgb = frame();
    let image = ImageView::new(WIDTH, HEIGHT, &rgb).unwrap();
    let bounds = "retry = { total_ms = 200, attempts_max = 1, reply_bytes_max = 1000000000000 }";
    let options = format!("dialect = \"hugging_face\"\nurl = {url:?}\n{bounds}");
    let error = build(&options).unwrap().detect(&image, &[]).unwrap_err();
    assert!(matches!(error, DetectorError::Service(WebError::Deadline { .. })), "{error}");
    assert!(error.is_missing());
    server.join().unwrap();
}

/// The port of a listener that has gone.
fn nobodys_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

#[test]
fn options_that_make_no_sense_are_named() {
    for (options, expect) in [
        ("", "missing key: perception.options.dialect"),
        ("dialect = \"telepathy\"", "or \"roboflow\", got \"telepathy\""),
        (
            "dialect = \"dino_x\"\nscor_min = 1",
            "perception.options.scor_min: unknown key; did you mean score_min?",
        ),
        (
            "dialect = \"dino_x\"\nscore_min = 2.0",
            "score_min: expected a number from 0 to 1, got 2",
        ),
        ("dialect = \"hugging_face\"", "perception.options.url: expected the address"),
        ("dialect = \"dino_x\"\nkey_env = \"NO_KEY\"", "got NO_KEY, which is not set"),
        (
            "dialect = \"dino_x\"\nretry = { total = 1 }",
            "perception.options.retry.total: unknown key; did you mean total_ms?",
        ),
    ] {
        let message = build(options).map(drop).unwrap_err().to_string();
        assert!(message.contains(expect), "{expect:?} is not in {message}");
    }
}

// ── the program ─────────────────────────────────────────────────────────────────────────────────

/// Runs `groundloop ground` on a shipped picture with a service at `url`.
fn ground(url: &str, goal: &str) -> crate::common::Ended {
    let folder = tempfile::tempdir().unwrap();
    let options = folder.path().join("service.toml");
    let bounds = "retry = { backoff_ms_min = 1, backoff_ms_max = 2 }";
    let text = format!("dialect = \"hugging_face\"\nurl = {url:?}\n{bounds}\n");
    std::fs::write(&options, text).unwrap();
    let [image, boxes, state] = ["png", "json", "pddl"].map(|end| format!("{EXAMPLE}.{end}"));
    let args = [
        ["ground", "--domain", "domains/blocksworld"].as_slice(),
        &["--image", &image, "--exemplar-image", &image, "--exemplar-boxes", &boxes],
        &["--exemplar-state", &state, "--json", "--detector", "http"],
        &["--detector-options", options.to_str().unwrap(), "--goal", goal],
    ];
    Process::start(&args.concat()).end()
}

#[test]
fn a_service_that_is_not_there_is_exit_code_5() {
    let url = format!("http://127.0.0.1:{}", nobodys_port());
    let ended = ground(&url, "(clear red_block)");
    assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
    assert!(ended.stderr.contains("is the server running?"), "{}", ended.stderr);
}

/// A goal names an object that no rule of the domain names; the service knows where it is.
#[test]
fn a_phrase_of_the_goal_becomes_a_name() {
    let service = Service::new();
    let found = |label: &str, edges: &Value| {
        json!({"label": label, "score": 0.9, "box": {"xmin": edges[0], "ymin": edges[1],
            "xmax": edges[2], "ymax": edges[3]}})
    };
    // Every block that the picture shows, so that nothing in it is unexplained.
    let boxes = std::fs::read_to_string(project(&format!("{EXAMPLE}.json"))).unwrap();
    let boxes: serde_json::Map<String, Value> = serde_json::from_str(&boxes).unwrap();
    let blocks: Vec<Value> = boxes.values().map(|edges| found("colored block", edges)).collect();
    let pink = [203.0, 131.0, 225.0, 156.0];
    for (queries, answer) in [
        (json!(["colored block"]), Value::from(blocks)),
        (json!(["my cup"]), json!([found("my cup", &json!([205, 130, 226, 156]))])),
    ] {
        let body = json!({"parameters": {"candidate_labels": queries}});
        service.mount(Mock::given(body_partial_json(body)).respond_with(ok(&answer)));
    }
    let ended = ground(&service.server.uri(), "(clear my_cup)");
    let report = ended.json();
    let objects = report["objects"].as_array().unwrap();
    let cup = objects.iter().find(|object| object["name"] == "my_cup").unwrap();
    assert_eq!((&cup["box"], objects.len()), (&json!(pink), 8));
    assert!(report["facts"].as_array().unwrap().contains(&json!(["clear", "my_cup"])), "{report}");
    assert_eq!(report["plan"], json!([]), "{}", ended.stderr);
}

// ── the loop ────────────────────────────────────────────────────────────────────────────────────

const PICTURE: &str = "domains/blocksworld/exemplar/sim_640x480/a_tower_and_singles";

/// A camera process that shows one shipped picture, and a run that asks a service about it.
fn run_with(service: &str, wait_s: &str, name: &str) -> (Process, Process) {
    let image = format!("{PICTURE}.png");
    let mut camera = Process::start(&["camera", "images", &image, "--fps", "20", "--run", name]);
    camera.wait_for_line("publishing images as camera main");
    let patience = "retry={attempts_max=1}";
    let options =
        format!("perception.options={{dialect=\"hugging_face\", url=\"{service}\", {patience}}}");
    let wait = format!("camera.wait_s={wait_s}");
    let settings = [
        "perception.exemplar={folder=\"sim_640x480\"}",
        "goal.text=red over blue over green",
        "perception.detector=http",
        &options,
        &wait,
    ];
    let args = ["run", "configs/photo_blocksworld.toml", "--json", "--run", name];
    let sets = settings.iter().flat_map(|set| ["--set", *set]);
    (camera, Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>()))
}

#[test]
fn a_run_looks_through_a_service() {
    let boxes = std::fs::read_to_string(project(&format!("{PICTURE}.json"))).unwrap();
    let boxes: serde_json::Map<String, Value> = serde_json::from_str(&boxes).unwrap();
    let found: Vec<Value> = boxes
        .values()
        .map(|edges| {
            let edges = json!({"xmin": edges[0], "ymin": edges[1], "xmax": edges[2],
                "ymax": edges[3]});
            json!({"label": "colored block", "score": 0.9, "box": edges})
        })
        .collect();
    let (service, _) = Service::answering(ok(&Value::from(found)));
    let name = crate::common::unique_run("service");
    let (_camera, run) = run_with(&service.server.uri(), "120.0", &name);
    let ended = run.end();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let report = ended.json();
    assert_eq!(report["verdict"], "planned", "{report}");
    // What the colour detector sees there, and what the labels say.
    let facts = std::fs::read_to_string(project(
        "tests/attach/snapshots/attach__external_camera__facts_of_a_tower_and_singles.snap",
    ));
    let seen = report["facts"].as_array().unwrap().iter().map(|fact| fact.as_str().unwrap());
    assert!(facts.unwrap().ends_with(&(seen.collect::<Vec<_>>().join("\n") + "\n")), "{report}");
}

#[test]
fn a_run_without_its_service_is_exit_code_5() {
    let url = format!("http://127.0.0.1:{}", nobodys_port());
    let name = crate::common::unique_run("no-service");
    let (_camera, run) = run_with(&url, "1.0", &name);
    let ended = run.end();
    assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
    for said in ["an answer of the detector http for 1 s (camera.wait_s)", "is the server running?"]
    {
        assert!(ended.stderr.contains(said), "{}", ended.stderr);
    }
}
