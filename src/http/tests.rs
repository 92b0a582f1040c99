//! The client against servers that behave and servers that do not.

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};

use serde_json::json;
use wiremock::matchers::{header, method};
use wiremock::{Mock, MockServer, ResponseTemplate};

use super::*;

/// Quick, so that no test waits for long.
fn quick() -> RetryPolicy {
    RetryPolicy { backoff_ms_min: 1, backoff_ms_max: 2, total_ms: 20_000, ..RetryPolicy::default() }
}

fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap()
}

/// Sends one request with a key to a server that answers in these ways, one after the other; the
/// last one goes on. Gives the result and how many requests came.
fn ask(policy: &RetryPolicy, answers: Vec<ResponseTemplate>) -> (Result<Reply, WebError>, usize) {
    let runtime = runtime();
    let n_answers = answers.len();
    let server = runtime.block_on(async {
        let server = MockServer::start().await;
        for (i, answer) in answers.into_iter().enumerate() {
            let mock = Mock::given(method("POST")).respond_with(answer);
            let mock = if i + 1 < n_answers { mock.up_to_n_times(1) } else { mock };
            mock.mount(&server).await;
        }
        server
    });
    let request = Request::post(&format!("{}/v1?key=hush", server.uri()), json!({"a": 1}))
        .with(Header::secret("Authorization", "Bearer sesame"));
    let result = Client::new(policy).unwrap().send(&request);
    let n_requests = runtime.block_on(server.received_requests()).unwrap().len();
    (result, n_requests)
}

fn status(status: u16) -> ResponseTemplate {
    ResponseTemplate::new(status)
}

fn good() -> ResponseTemplate {
    status(200).set_body_json(json!({"b": 2}))
}

#[test]
fn a_good_reply_comes_back_from_inside_and_outside_a_runtime() {
    let runtime = runtime();
    let server = runtime.block_on(MockServer::start());
    let mock = Mock::given(header("Token", "t")).respond_with(good());
    runtime.block_on(mock.mount(&server));
    let client = Client::new(&quick()).unwrap();
    let request = Request::get(&server.uri()).with(Header::plain("Token", "t"));
    let wanted = Reply { status: 200, body: json!({"b": 2}) };
    assert_eq!(client.send(&request).unwrap(), wanted);
    let inside = runtime.block_on(async { client.send(&request) });
    assert_eq!(inside.unwrap(), wanted);
}

#[test]
fn what_may_pass_is_tried_again() {
    for first in
        [status(429), status(503), status(500), status(429).insert_header("Retry-After", "0")]
    {
        let (result, n_requests) = ask(&quick(), vec![first, good()]);
        assert_eq!((result.unwrap().status, n_requests), (200, 2));
    }
    let (result, n_requests) = ask(&quick(), vec![status(503)]);
    let error = result.unwrap_err();
    assert!(matches!(error, WebError::Status { status: 503, attempts: 4, .. }), "{error}");
    assert_eq!(n_requests, 4);
    let (result, n_requests) = ask(&quick(), vec![status(500)]);
    assert!(matches!(result.unwrap_err(), WebError::Status { status: 500, .. }));
    assert_eq!(n_requests, 3, "a 500 may be permanent");
}

#[test]
fn wrong_requests_are_not_repeated_and_say_what_the_server_said() {
    for code in [400, 401, 403, 404, 422] {
        let body = json!({"error": {"message": "key sesame is\nnot known"}});
        let (result, n_requests) = ask(&quick(), vec![status(code).set_body_json(body)]);
        let error = result.unwrap_err();
        assert_eq!(n_requests, 1);
        let told = error.to_string();
        assert!(told.contains(&format!("status {code}")), "{told}");
        assert!(told.contains("key [hidden] is not known"), "{told}");
        assert!(!told.contains("hush") && !told.contains("sesame"), "{told}");
        assert_eq!(error.is_unauthorised(), code == 401 || code == 403);
        assert!(!error.is_absent());
    }
}

#[test]
fn a_pause_beyond_the_deadline_is_not_waited_for() {
    for asked in ["3600", "Thu, 31 Dec 2099 00:00:00 GMT"] {
        let answer = status(429).insert_header("Retry-After", asked);
        let (result, n_requests) = ask(&quick(), vec![answer]);
        let error = result.unwrap_err();
        assert!(matches!(error, WebError::Deadline { attempts: 1, .. }), "{error}");
        assert!(error.to_string().contains("429") && error.is_absent(), "{error}");
        assert_eq!(n_requests, 1);
    }
}

#[test]
fn replies_that_are_no_json_or_too_long_are_told() {
    let (result, n_requests) = ask(&quick(), vec![status(200).set_body_string("{\"a\": ")]);
    assert!(matches!(result.unwrap_err(), WebError::NotJson { .. }));
    assert_eq!(n_requests, 1);
    let policy = RetryPolicy { reply_bytes_max: 10, ..quick() };
    let (result, _) = ask(&policy, vec![status(200).set_body_string("x".repeat(11))]);
    assert!(result.unwrap_err().to_string().contains("at most 10 bytes"));
    let long = "y".repeat(5000);
    let (result, _) = ask(&quick(), vec![status(404).set_body_string(long)]);
    assert!(result.unwrap_err().to_string().len() < 500);
}

#[test]
fn nobody_listens() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let url = format!("http://127.0.0.1:{port}/v1?key=hush");
    let error = Client::new(&quick()).unwrap().send(&Request::get(&url)).unwrap_err();
    assert!(matches!(error, WebError::NoConnection { attempts: 4, .. }), "{error}");
    assert!(error.to_string().contains("refused") && !error.to_string().contains("hush"));
    assert!(error.is_absent());
}

/// Serves connections on a thread, each from after the request's head until the client hangs up.
fn raw_server(n_connections: usize, serve: fn(TcpStream)) -> (String, std::thread::JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let after_head = move |mut stream: TcpStream| {
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.extend(byte);
        }
        serve(stream);
    };
    let work = move || listener.incoming().take(n_connections).flatten().for_each(after_head);
    (url, std::thread::Builder::new().spawn(work).unwrap())
}

#[test]
fn a_slow_drip_ends_at_the_deadline() {
    // Each byte resets the clock of silence; only the deadline over everything ends this.
    let (url, server) = raw_server(1, |mut stream| {
        let head = b"HTTP/1.1 200 OK\r\ncontent-length: 100000000\r\n\r\n";
        stream.write_all(head).unwrap();
        while stream.write_all(b" ").is_ok() {}
    });
    let policy =
        RetryPolicy { total_ms: 200, reply_bytes_max: usize::MAX, attempts_max: 1, ..quick() };
    let error = Client::new(&policy).unwrap().send(&Request::get(&url)).unwrap_err();
    assert!(matches!(error, WebError::Deadline { attempts: 1, .. }), "{error}");
    server.join().unwrap();
}

#[test]
fn silence_is_tried_again_within_bounds() {
    let (url, server) = raw_server(2, |mut stream| {
        // Reads until the client hangs up.
        drop(stream.read_to_end(&mut Vec::new()));
    });
    let policy = RetryPolicy { read_ms: 50, attempts_max: 2, ..quick() };
    let error = Client::new(&policy).unwrap().send(&Request::get(&url)).unwrap_err();
    assert!(matches!(error, WebError::Silent { attempts: 2, read_ms: 50, .. }), "{error}");
    server.join().unwrap();
}

#[test]
fn a_broken_reply_is_tried_again() {
    let (url, server) = raw_server(2, |mut stream| {
        stream.write_all(b"HTTP/1.1 200 OK\r\ncontent-length: 9\r\n\r\n{").unwrap();
    });
    let policy = RetryPolicy { attempts_max: 2, ..quick() };
    let error = Client::new(&policy).unwrap().send(&Request::get(&url)).unwrap_err();
    assert!(matches!(error, WebError::NoConnection { attempts: 2, .. }), "{error}");
    server.join().unwrap();
}

#[test]
fn secrets_are_not_shown() {
    let request = Request {
        secrets: vec!["body-key".to_owned()],
        ..Request::post("https://me:pw@host:1/x?api_key=q#f", json!({"api_key": "body-key"}))
            .with(Header::secret("Token", "t0ken"))
            .with(Header::plain("Accept", "text"))
    };
    let shown = format!("{request:?}");
    for secret in ["pw", "api_key", "body-key", "t0ken"] {
        assert!(!shown.contains(secret), "{shown}");
    }
    assert!(shown.contains("https://host:1/x") && shown.contains("Accept: text"), "{shown}");
    let error = Client::new(&quick()).unwrap().send(&Request::get("ftp://h/?key=k")).unwrap_err();
    let wanted = "url: expected an address that begins with http:// or https://, got ftp://h/";
    assert_eq!(error.to_string(), wanted);
}

#[test]
fn misspelt_bounds_are_refused() {
    let error = toml::from_str::<RetryPolicy>("totl_ms = 5").unwrap_err();
    assert!(error.to_string().contains("unknown field `totl_ms`"), "{error}");
}
