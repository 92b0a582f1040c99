//! Goals of kind `language_model` against servers that answer well, badly, or not at all.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::Path;

use crate::common::{Process, project};
use groundloop::goals::{GOALS, GoalError, GoalInputs, GoalObject, ParsedGoal};
use groundloop::parts::{PartChoice, PartContext, PartError};
use groundloop::run::DomainFolder;
use serde_json::{Value, json};
use tokio::runtime::Runtime;
use wiremock::matchers::{header, method, path};
use wiremock::{Mock, MockServer, ResponseTemplate};

const SAID: &str = "Stack red over blue.";
const GOOD: &str = "(and (on red_block blue_block))";

/// A server of the OpenAI kind with answers by turns; the last one goes on.
struct Server {
    runtime: Runtime,
    server: MockServer,
}

impl Server {
    fn start(answers: Vec<ResponseTemplate>) -> Self {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .unwrap();
        let last = answers.len().saturating_sub(1);
        let server = runtime.block_on(async {
            let server = MockServer::start().await;
            for (i, answer) in answers.into_iter().enumerate() {
                let mock = Mock::given(method("POST"))
                    .and(path("/v1/chat/completions"))
                    .and(header("Authorization", "Bearer sesame"))
                    .respond_with(answer);
                let mock = if i < last { mock.up_to_n_times(1) } else { mock };
                mock.mount(&server).await;
            }
            server
        });
        Self { runtime, server }
    }

    fn url(&self) -> String {
        format!("{}/v1", self.server.uri())
    }

    /// The bodies of all requests so far.
    fn asked(&self) -> Vec<Value> {
        let requests = self.runtime.block_on(self.server.received_requests()).unwrap();
        requests.iter().map(|request| request.body_json().unwrap()).collect()
    }
}

/// A reply of the common form.
fn says(content: impl Into<Value>) -> ResponseTemplate {
    let message = json!({"role": "assistant", "content": content.into()});
    ResponseTemplate::new(200).set_body_json(json!({
        "choices": [{"index": 0, "finish_reason": "stop", "message": message}],
        "usage": {"prompt_tokens": 300, "completion_tokens": 9},
    }))
}

fn status(code: u16, message: &str) -> ResponseTemplate {
    ResponseTemplate::new(code).set_body_json(json!({"error": {"message": message, "code": code}}))
}

fn block(name: &str, x: f64) -> GoalObject {
    let pixel_box = Some([x, 0.0, x + 9.0, 9.0].into());
    let colour = name.strip_suffix("_block").map(Into::into);
    GoalObject { name: name.into(), type_name: "block".into(), colour, pixel_box }
}

/// Reads the instruction over a red and a blue block.
fn read_in(
    url: &str,
    options: &str,
    folder: &Path,
    instruction: &str,
) -> Result<ParsedGoal, GoalError> {
    let environment = |name: &str| (name == "MODEL_KEY").then(|| "sesame".to_owned());
    read_with(url, options, folder, instruction, environment)
}

fn read_with(
    url: &str,
    options: &str,
    folder: &Path,
    instruction: &str,
    environment: fn(&str) -> Option<String>,
) -> Result<ParsedGoal, GoalError> {
    let domain = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    // Pauses are short, so that no test waits for long.
    let common = format!(
        "url = '{url}'\nmodel = 'm'\nkey_env = 'MODEL_KEY'\n\
         retry = {{ backoff_ms_min = 1, backoff_ms_max = 2, total_ms = 20000 }}\n{options}"
    );
    let options: toml::Table = common.parse().unwrap();
    let choice = PartChoice::new("goal.kind", "language_model");
    let choice = choice.with_options(Some(&options), folder.join("run.toml"));
    let inputs = GoalInputs {
        perception: Some(&domain.perception),
        ..GoalInputs::words("run.toml: goal.text", instruction, domain.language.as_ref())
    };
    let source = GOALS.build(&PartContext { choice: &choice, inputs, environment })?;
    assert!(!format!("{source:?}").contains("sesame"));
    let result = source.read(&domain.domain, &[block("blue_block", 50.0), block("red_block", 0.0)]);
    if let Err(error) = &result {
        assert!(!error.render().contains("sesame"), "{error}");
    }
    result
}

const LLAMA: &str = "dialect = 'llamacpp'";

fn read(server: &Server, options: &str) -> Result<ParsedGoal, GoalError> {
    read_in(&server.url(), options, Path::new(""), SAID)
}

#[test]
fn good_answers_are_goals_in_every_dialect() {
    let fenced = format!("Here is the goal:\n```pddl\n(:goal {GOOD})\n```\n");
    let quoted = json!({ "goal": GOOD }).to_string();
    for (dialect, form, answers) in [
        ("llamacpp", "grammar", [GOOD, &fenced]),
        ("vllm", "structured_outputs", [GOOD, &fenced]),
        ("openai", "response_format", [&quoted, GOOD]),
        ("ollama", "response_format", [&quoted, &fenced]),
    ] {
        for answer in answers {
            let server = Server::start(vec![says(answer)]);
            let goal = read(&server, &format!("dialect = '{dialect}'")).unwrap();
            assert_eq!(goal.goal.to_string(), GOOD, "{dialect}: {answer}");
            assert_eq!(goal.expected, []);
            assert_eq!(goal.notes, ["read by m, answer 1"]);
            let asked = server.asked();
            assert_eq!(asked.len(), 1);
            assert!(asked[0].get(form).is_some(), "{dialect}: {}", asked[0]);
            assert_eq!((&asked[0]["model"], &asked[0]["temperature"]), (&json!("m"), &json!(0.0)));
        }
    }
}

#[test]
fn what_stays_the_same_stands_first() {
    let server = Server::start(vec![says(GOOD)]);
    let folder = Path::new("");
    for said in [SAID, "Put blue on red."] {
        read_in(&server.url(), LLAMA, folder, said).unwrap();
    }
    let asked = server.asked();
    let turns = |i: usize| asked[i]["messages"].as_array().unwrap().clone();
    let (first, second) = (turns(0), turns(1));
    assert_eq!(first[..3], second[..3]);
    let text = |turn: &Value| turn["content"].as_str().unwrap().to_owned();
    let rules = text(&first[0]);
    assert!(rules.contains("(on ?x - block ?y - block)") && rules.contains("block - object"));
    // The first example of the domain's language.toml, in the grammar's layout.
    assert!(text(&first[1]).contains("Instruction: Create a stack of blocks: red over blue"));
    assert_eq!(text(&first[2]), "(and (on red_block blue_block) (on blue_block green_block))");
    let last = "Objects: red_block - block, blue_block - block\n\
                Instruction: Put blue on red.\nGoal:";
    assert_eq!(text(&second[3]), last, "from left to right");
    let grammar = asked[0]["grammar"].as_str().unwrap();
    assert!(grammar.contains("\"red_block\" | \"blue_block\""), "{grammar}");
}

#[test]
fn an_example_can_be_given() {
    let server = Server::start(vec![says(GOOD)]);
    let example = "example = { instruction = 'all down', goal = '(forall (?b - block)\n\
                   (ontable ?b))', objects = ['x:block', 'y:block'] }";
    read(&server, &format!("{LLAMA}\n{}", example.replace('\n', " "))).unwrap();
    let turns = server.asked()[0]["messages"].clone();
    let said = "Objects: x - block, y - block\nInstruction: all down\nGoal:";
    assert_eq!(turns[1]["content"], said);
    assert_eq!(turns[2]["content"], "(and (forall (?x - block) (ontable ?x)))");
    let bad = "example = { instruction = 'x', goal = '(over a b)' }";
    let error = read(&server, &format!("{LLAMA}\n{bad}")).unwrap_err();
    assert!(error.render().contains("goal.options.example.goal:1:2"), "{}", error.render());
}

#[test]
fn what_is_wrong_is_told_to_the_model() {
    for (bad, wanted) in [
        (json!("(on red_block blue_block green_block)"), "on"),
        (json!("(on red_block pink_block)"), "unknown object `pink_block`"),
        (json!("(forall (?x - brick) (clear ?x))"), "brick"),
        (
            json!("```\n(on red_block blue_block)\n```\n```\n(on blue_block red_block)\n```"),
            "several goals",
        ),
        (json!("(and (on red_block blue_block) (not (on red_block blue_block)))"), "and for (not"),
        (json!("(forall (?x) (ontable ?x))"), "write (?x - block)"),
        (json!("{\"goal\": \"(on red_bl"), "expected JSON"),
        (json!(null), "the answer is empty"),
        (json!("I am only a language model."), "got no form"),
        (json!("(and (on red_block blue_block) (on blue_block red_block))"), "circle"),
    ] {
        let server = Server::start(vec![says(bad.clone()), says(GOOD)]);
        let goal = read(&server, LLAMA).unwrap();
        assert_eq!((goal.goal.to_string().as_str(), goal.notes.len()), (GOOD, 1));
        assert_eq!(goal.notes[0], "read by m, answer 2");
        let asked = server.asked();
        let turns = asked[1]["messages"].as_array().unwrap();
        let n = asked[0]["messages"].as_array().unwrap().len();
        assert_eq!(turns.len(), n + 2, "the answer and what is wrong with it");
        assert_eq!(turns[n]["content"], bad.as_str().unwrap_or_default());
        let told = turns[n + 1]["content"].as_str().unwrap();
        assert!(told.contains("no valid goal") && told.contains(wanted), "{bad}: {told}");
    }
}

#[test]
fn answers_that_stay_wrong_end_at_their_bound() {
    let server = Server::start(vec![says("(on red_block)")]);
    let error = read(&server, &format!("{LLAMA}\nattempts_max = 2")).unwrap_err();
    assert!(matches!(error, GoalError::GaveUp { .. }), "{error}");
    let said = error.to_string();
    assert!(said.contains("goal.options.attempts_max = 2") && said.contains("goal:1:"), "{said}");
    assert_eq!(server.asked().len(), 2);
}

#[test]
fn a_contradiction_that_stays_is_repaired_and_told() {
    let server = Server::start(vec![says("(and (on red_block blue_block) (clear blue_block))")]);
    let goal = read(&server, LLAMA).unwrap();
    assert_eq!(server.asked().len(), 3, "first the model may correct itself");
    assert_eq!(goal.goal.to_string(), GOOD);
    assert!(goal.notes[1].starts_with("dropped: (clear blue_block) excludes"), "{:?}", goal.notes);
}

#[test]
fn unseen_objects_that_are_said_are_expected() {
    let goal = "(and (on red_block green_block))";
    let server = Server::start(vec![says(goal)]);
    let said = "Put the red block on the green one.";
    let parsed = read_in(&server.url(), LLAMA, Path::new(""), said).unwrap();
    assert_eq!(parsed.goal.to_string(), goal);
    let expected: Vec<&str> = parsed.expected.iter().map(|typed| typed.name.as_str()).collect();
    assert_eq!(expected, ["green_block"]);
    assert_eq!(parsed.phrases[0].text, "red block");
    let grammar = server.asked()[0]["grammar"].as_str().unwrap().to_owned();
    assert!(grammar.contains("\"red_block\" | \"blue_block\" | \"green_block\""), "{grammar}");
}

#[test]
fn a_busy_server_is_asked_again() {
    let busy = || status(429, "slow down").insert_header("Retry-After", "0");
    for busy in [busy(), status(503, "Loading model"), status(500, "hiccup")] {
        let server = Server::start(vec![busy, says(GOOD)]);
        assert_eq!(read(&server, LLAMA).unwrap().goal.to_string(), GOOD);
        assert_eq!(server.asked().len(), 2);
    }
    let later = status(429, "come back tomorrow").insert_header("Retry-After", "86400");
    let server = Server::start(vec![later]);
    let error = read(&server, LLAMA).unwrap_err();
    assert!(matches!(error, GoalError::GaveUp { .. }), "{error}");
    assert!(error.to_string().contains("come back tomorrow"), "{error}");
    assert_eq!(server.asked().len(), 1);
}

#[test]
fn a_broken_server_is_given_up_and_a_refusal_is_final() {
    let server = Server::start(vec![status(500, "image input is not supported")]);
    let error = read(&server, LLAMA).unwrap_err();
    assert!(matches!(error, GoalError::GaveUp { .. }), "{error}");
    assert_eq!(server.asked().len(), 3);

    let server = Server::start(vec![status(400, "failed to parse grammar")]);
    let error = read(&server, LLAMA).unwrap_err();
    assert!(matches!(error, GoalError::Part(PartError::Options { .. })), "{error}");
    assert!(error.to_string().contains("failed to parse grammar"), "{error}");
    assert_eq!(server.asked().len(), 1);

    let server = Server::start(vec![status(401, "the key sesame is not known")]);
    let error = read(&server, LLAMA).unwrap_err();
    assert!(matches!(&error, GoalError::Key { variable, .. } if variable == "MODEL_KEY"));
    assert!(error.to_string().contains("MODEL_KEY holds a key that is refused"), "{error}");
    assert_eq!(server.asked().len(), 1);

    let server = Server::start(vec![ResponseTemplate::new(200).set_body_json(json!({"id": 1}))]);
    let error = read(&server, LLAMA).unwrap_err();
    assert!(error.to_string().contains("choices[0].message.content"), "{error}");
}

/// An address where nobody listens.
fn nowhere() -> String {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    format!("http://127.0.0.1:{port}/v1")
}

#[test]
fn no_server_is_told_as_missing() {
    let error = read_in(&nowhere(), LLAMA, Path::new(""), SAID).unwrap_err();
    assert!(matches!(error, GoalError::Part(PartError::Missing { .. })), "{error}");
    assert!(error.to_string().contains("start its server or set goal.options.url"), "{error}");
}

/// Answers connections on a thread, each after its request's head.
fn raw_server(serve: fn(TcpStream)) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/v1", listener.local_addr().unwrap());
    let work = move || {
        for mut stream in listener.incoming().flatten() {
            let mut head = Vec::new();
            let mut byte = [0];
            while !head.ends_with(b"\r\n\r\n") && stream.read_exact(&mut byte).is_ok() {
                head.extend(byte);
            }
            serve(stream);
        }
    };
    // It ends with the test's process.
    drop(std::thread::Builder::new().spawn(work).unwrap());
    url
}

#[test]
fn a_slow_drip_ends_at_the_deadline() {
    let url = raw_server(|mut stream| {
        drop(stream.write_all(b"HTTP/1.1 200 OK\r\ncontent-length: 1000000000\r\n\r\n"));
        while stream.write_all(b" ").is_ok() {}
    });
    let domain = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    let options = format!(
        "url = '{url}'\nmodel = 'm'\n{LLAMA}\n\
         retry = {{ total_ms = 200, reply_bytes_max = 1000000000 }}"
    );
    let options: toml::Table = options.parse().unwrap();
    let choice = PartChoice::new("goal.kind", "language_model");
    let choice = choice.with_options(Some(&options), "run.toml");
    let inputs = GoalInputs::words("run.toml", SAID, domain.language.as_ref());
    let context = PartContext { choice: &choice, inputs, environment: |_| None };
    let source = GOALS.build(&context).unwrap();
    let error = source.read(&domain.domain, &[block("red_block", 0.0)]).unwrap_err();
    assert!(matches!(error, GoalError::GaveUp { .. }), "{error}");
    assert!(error.to_string().contains("not answered within 200 ms"), "{error}");
}

/// Calls `groundloop goal` with a model.
#[track_caller]
fn goal_verb(url: &str, more: &str, code: i32, wanted: &str) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("options.toml");
    let options = format!("url = '{url}'\nmodel = 'm'\n{LLAMA}\n{more}\n[retry]\nread_ms = 20000");
    std::fs::write(&file, options).unwrap();
    let args = ["goal", "--domain", "domains/blocksworld", "--instruction", SAID, "--json"];
    let model = ["--kind", "language_model", "--options", file.to_str().unwrap()];
    let seen = ["--objects", "red_block:block@0,0,9,9 blue_block:block"];
    let ended = Process::start(&[&args[..], &model, &seen].concat()).end();
    assert_eq!(ended.status.code(), Some(code), "{}", ended.stderr);
    let said = if code == 0 { &ended.stdout } else { &ended.stderr };
    assert!(said.contains(wanted), "{said}");
}

#[test]
fn exit_codes_tell_missing_from_wrong_from_given_up() {
    let keyless = |answer: ResponseTemplate| {
        let server = Server::start(Vec::new());
        server
            .runtime
            .block_on(Mock::given(method("POST")).respond_with(answer).mount(&server.server));
        server
    };
    let good = keyless(says(GOOD));
    goal_verb(&good.url(), "", 0, &format!("\"goal\":\"{GOOD}\""));
    goal_verb(&nowhere(), "", 5, "is missing: start its server");
    goal_verb(&good.url(), "key_env = 'GROUNDLOOP_NO_SUCH_KEY'", 2, "GROUNDLOOP_NO_SUCH_KEY");
    goal_verb(&keyless(status(401, "no")).url(), "", 2, "goal.options.key_env");
    goal_verb(&keyless(says("(")).url(), "", 4, "goal.options.attempts_max = 3");
}

#[cfg(feature = "sim")]
mod episodes {
    //! The loop with a model: one question per episode, and a stop that does not wait for it.

    use super::*;
    use crate::common::{SMALL_CAMERA, TestRun, small};
    use rustix::process::Signal;

    #[test]
    fn an_episode_asks_once_and_decides_as_with_the_goal_itself() {
        let answer = "(and (on red_block blue_block) (on blue_block green_block))";
        let server = Server::start(Vec::new());
        let mock = Mock::given(method("POST")).respond_with(says(answer));
        server.runtime.block_on(mock.mount(&server.server));
        let scene = "sim.scene=scenes/three_blocks.toml";
        let logical = small(
            "blocksworld.toml",
            &[scene, "goal.kind=logical", &format!("goal.text={answer}")],
        );
        let url = format!("goal.options.url={}", server.url());
        let model = small(
            "blocksworld.toml",
            &[
                scene,
                "goal.kind=language_model",
                "goal.text=red over blue over green",
                &url,
                "goal.options.model=m",
                "goal.options.dialect=llamacpp",
            ],
        );
        let logical = TestRun::new().run(logical).unwrap();
        let model = TestRun::new().run(model).unwrap();
        assert_eq!(model.report.verdict, "reached");
        assert_eq!(model.report.decision_hash, logical.report.decision_hash);
        assert_eq!(server.asked().len(), 1);
    }

    #[test]
    fn a_stop_does_not_wait_for_the_model() {
        // Takes the request and says nothing until the client hangs up.
        let url = raw_server(|mut stream| drop(stream.read_to_end(&mut Vec::new())));
        let url = format!("goal.options.url={url}");
        let sets = [
            "goal.kind=language_model",
            &url,
            "goal.options.model=m",
            "goal.options.dialect=llamacpp",
        ];
        let sets = SMALL_CAMERA.iter().chain(&sets).flat_map(|set| ["--set", *set]);
        let args: Vec<&str> = ["--log", "debug", "run", "configs/blocksworld.toml", "--json"]
            .into_iter()
            .chain(sets)
            .collect();
        let mut run = Process::start(&args);
        run.wait_for_line("asking");
        run.signal(Signal::INT);
        let ended = run.end();
        assert_eq!(ended.status.code(), Some(130), "{}", ended.stderr);
    }
}
