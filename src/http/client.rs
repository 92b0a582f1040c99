//! The client: a thread with a runtime of its own that carries requests out.

use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Duration;

use reqwest::header::{DATE, HeaderMap, HeaderName, HeaderValue, RETRY_AFTER};
use reqwest::redirect::Policy;
use serde_json::Value;
use tokio::sync::mpsc;

use super::request::redacted;
use super::retry::{self, Fault};
use super::{Answers, Header, Method, Reply, Request, RetryPolicy, WebError, shown_url};
use crate::clock::monotonic_ns;
use crate::mismatch::quoted;

/// Most requests that wait for the client's thread; further ones are refused.
const REQUESTS_MAX: usize = 64;

/// Most characters of a server's message that an error repeats.
const MESSAGE_CHARS_MAX: usize = 300;

/// Sends requests; cheap to clone, and usable from any thread.
#[derive(Debug, Clone)]
pub struct Client {
    jobs: mpsc::Sender<Job>,
    answers: Option<Answers>,
}

/// One request on its way to the client's thread.
#[derive(Debug)]
struct Job {
    request: reqwest::Request,
    url: String,
    secrets: Vec<String>,
    answer: SyncSender<Result<Reply, WebError>>,
}

impl Client {
    /// Starts a client. It follows no redirects and uses no proxy; its thread ends with the last
    /// clone, and abandons what is still going on then.
    ///
    /// # Errors
    /// [`WebError::Client`] when the system gives no thread or socket.
    pub fn new(policy: &RetryPolicy) -> Result<Self, WebError> {
        let broken = |reason: String| WebError::Client { reason };
        let inner = reqwest_client(policy)?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(|e| broken(e.to_string()))?;
        let (jobs, mut waiting) = mpsc::channel::<Job>(REQUESTS_MAX);
        let policy = policy.clone();
        let work = async move {
            while let Some(job) = waiting.recv().await {
                tokio::spawn(carry_out(inner.clone(), policy.clone(), job));
            }
        };
        std::thread::Builder::new()
            .name("web".to_owned())
            .spawn(move || runtime.block_on(work))
            .map_err(|e| broken(e.to_string()))?;
        Ok(Self { jobs, answers: None })
    }

    /// The same client with a folder of recorded answers.
    pub fn with_answers(self, answers: Option<Answers>) -> Self {
        Self { answers, ..self }
    }

    /// Whether there is a folder of recorded answers, so that a key may not be needed.
    pub fn has_answers(&self) -> bool {
        self.answers.is_some()
    }

    /// The answer to a request: a recorded one, else what `ask` gets, which is recorded where there is
    /// a folder for it. `ask` may send several requests; it must refuse what is not worth keeping.
    ///
    /// # Errors
    /// As [`Answers::answer`].
    pub fn answer<E: From<WebError>>(
        &self,
        request: &Request,
        ask: impl FnOnce() -> Result<Value, E>,
    ) -> Result<Value, E> {
        match &self.answers {
            Some(answers) => answers.answer(request, ask),
            None => ask(),
        }
    }

    /// Sends a request and waits for the reply, trying again where that may help.
    ///
    /// # Errors
    /// [`WebError`] once no further attempt is worth it or a bound is met.
    pub fn send(&self, request: &Request) -> Result<Reply, WebError> {
        let (answer, answered) = sync_channel(1);
        let job = Job {
            request: prepared(request)?,
            url: shown_url(&request.url),
            secrets: request.hidden_words(),
            answer,
        };
        let broken = |reason: &str| WebError::Client { reason: reason.to_owned() };
        match self.jobs.try_send(job) {
            Ok(()) => answered.recv().unwrap_or_else(|_ended| Err(broken("its thread has ended"))),
            Err(mpsc::error::TrySendError::Full(_)) => {
                Err(broken(&format!("{REQUESTS_MAX} requests wait already")))
            }
            Err(mpsc::error::TrySendError::Closed(_)) => Err(broken("its thread has ended")),
        }
    }
}

/// The client of the library underneath.
fn reqwest_client(policy: &RetryPolicy) -> Result<reqwest::Client, WebError> {
    if rustls::crypto::ring::default_provider().install_default().is_err() {
        tracing::trace!("the process has a cryptography provider already");
    }
    let builder = || {
        reqwest::Client::builder()
            .no_proxy()
            .redirect(Policy::none())
            .retry(reqwest::retry::never())
            .connect_timeout(Duration::from_millis(policy.connect_ms))
            .read_timeout(Duration::from_millis(policy.read_ms))
            .user_agent(concat!("groundloop/", env!("CARGO_PKG_VERSION")))
    };
    // A machine without certificates can still talk to its own servers without TLS.
    builder().build().or_else(|error| {
        tracing::warn!(error = innermost(&error), "no certificates: https will not work");
        let fault = |e: reqwest::Error| WebError::Client { reason: innermost(&e) };
        builder().tls_certs_only([]).build().map_err(fault)
    })
}

/// Checks a request and writes it down once for all attempts.
fn prepared(request: &Request) -> Result<reqwest::Request, WebError> {
    let bad = |what: String, expected: &str, got: String| WebError::Request {
        what,
        expected: expected.to_owned(),
        got,
    };
    let is_web = |url: &reqwest::Url| matches!(url.scheme(), "http" | "https");
    let url = reqwest::Url::parse(&request.url).ok().filter(is_web);
    let url = url.ok_or_else(|| {
        bad("url".to_owned(), "an address that begins with http:// or https://", {
            shown_url(&request.url)
        })
    })?;
    let method = match request.method {
        Method::Get => reqwest::Method::GET,
        Method::Post => reqwest::Method::POST,
    };
    let mut prepared = reqwest::Request::new(method, url);
    if let Some(body) = &request.body {
        let json = HeaderValue::from_static("application/json");
        prepared.headers_mut().insert(reqwest::header::CONTENT_TYPE, json);
        *prepared.body_mut() = Some(body.to_string().into());
    }
    for header in &request.headers {
        let (name, value) = header_of(header).ok_or_else(|| {
            let expected = "a header that HTTP allows: printable characters only";
            bad(format!("header {}", quoted(&header.name)), expected, "others".to_owned())
        })?;
        prepared.headers_mut().insert(name, value);
    }
    Ok(prepared)
}

fn header_of(header: &Header) -> Option<(HeaderName, HeaderValue)> {
    let name = header.name.parse().ok()?;
    let mut value: HeaderValue = header.value.parse().ok()?;
    value.set_sensitive(header.is_secret);
    Some((name, value))
}

async fn carry_out(client: reqwest::Client, policy: RetryPolicy, job: Job) {
    let result = within_deadline(&client, &policy, &job).await;
    if job.answer.send(result).is_err() {
        tracing::debug!("nobody waits for this reply any more");
    }
}

/// All attempts, cut off at the deadline.
async fn within_deadline(
    client: &reqwest::Client,
    policy: &RetryPolicy,
    job: &Job,
) -> Result<Reply, WebError> {
    let mut progress = Progress { attempts: 0, last: "the first attempt".to_owned() };
    let total = Duration::from_millis(policy.total_ms);
    let done = tokio::time::timeout(total, attempts(client, policy, job, &mut progress)).await;
    done.unwrap_or_else(|_elapsed| Err(progress.deadline(policy, &job.url)))
}

/// How far a request has got.
struct Progress {
    attempts: u32,
    /// How the last attempt failed.
    last: String,
}

impl Progress {
    fn deadline(&self, policy: &RetryPolicy, url: &str) -> WebError {
        WebError::Deadline {
            url: url.to_owned(),
            total_ms: policy.total_ms,
            attempts: self.attempts,
            last: self.last.clone(),
        }
    }
}

async fn attempts(
    client: &reqwest::Client,
    policy: &RetryPolicy,
    job: &Job,
    progress: &mut Progress,
) -> Result<Reply, WebError> {
    let started_ns = monotonic_ns();
    let mut n_server_faults = 0;
    loop {
        progress.attempts += 1;
        tracing::debug!(url = job.url, attempt = progress.attempts, "asking");
        let fault = match attempt(client, policy, job).await {
            Ok(reply) => return Ok(reply),
            Err(fault) => fault,
        };
        if matches!(fault, Fault::Status { status: 500..=502 | 504.., .. }) {
            n_server_faults += 1;
        }
        let error = told(&fault, policy, job, progress.attempts);
        let pause = retry::pause_ms(policy, &fault, progress.attempts, n_server_faults);
        let Some(pause_ms) = pause else { return Err(error) };
        progress.last = format!("attempt {} ended with: {error}", progress.attempts);
        tracing::debug!(%error, pause_ms, "another attempt");
        let elapsed_ms = (monotonic_ns() - started_ns) / 1_000_000;
        if elapsed_ms.saturating_add(pause_ms) >= policy.total_ms {
            // Waiting could not help any more.
            return Err(progress.deadline(policy, &job.url));
        }
        tokio::time::sleep(Duration::from_millis(pause_ms)).await;
    }
}

async fn attempt(
    client: &reqwest::Client,
    policy: &RetryPolicy,
    job: &Job,
) -> Result<Reply, Fault> {
    let broken = |e: reqwest::Error| {
        // A connection that does not open in time is as good as none.
        if e.is_timeout() && !e.is_connect() {
            Fault::Silent
        } else {
            Fault::Broken { reason: innermost(&e) }
        }
    };
    let Some(request) = job.request.try_clone() else {
        return Err(Fault::Broken { reason: "the request cannot be repeated".to_owned() });
    };
    let mut response = client.execute(request).await.map_err(broken)?;
    let status = response.status();
    let retry_after_ms = retry_after_of(response.headers());
    let mut bytes: Vec<u8> = Vec::new();
    while let Some(chunk) = response.chunk().await.map_err(broken)? {
        if bytes.len() + chunk.len() > policy.reply_bytes_max {
            return Err(Fault::TooLong);
        }
        bytes.extend_from_slice(&chunk);
    }
    let parsed: Result<Value, _> = serde_json::from_slice(&bytes);
    if !status.is_success() {
        let message = parsed.ok().as_ref().and_then(message_of);
        let message = message.unwrap_or_else(|| String::from_utf8_lossy(&bytes).into_owned());
        let message = shown(&message, &job.secrets);
        return Err(Fault::Status { status: status.as_u16(), message, retry_after_ms });
    }
    if bytes.is_empty() {
        return Ok(Reply { status: status.as_u16(), body: Value::Null });
    }
    parsed.map(|body| Reply { status: status.as_u16(), body }).map_err(|e| Fault::NotJson {
        reason: e.to_string(),
        message: shown(&String::from_utf8_lossy(&bytes), &job.secrets),
    })
}

fn retry_after_of(headers: &HeaderMap) -> Option<u64> {
    let text = |name| headers.get(name).and_then(|value: &HeaderValue| value.to_str().ok());
    retry::retry_after_ms(text(RETRY_AFTER)?, text(DATE))
}

/// Where servers put their message: `{"error": {"message": …}}`, `{"error": …}`, `{"message": …}`,
/// `{"detail": …}`, `{"msg": …}`.
fn message_of(body: &Value) -> Option<String> {
    let found = ["/error/message", "/error", "/message", "/detail", "/msg"]
        .into_iter()
        .find_map(|place| body.pointer(place).filter(|found| !found.is_null()))?;
    Some(found.as_str().map_or_else(|| found.to_string(), str::to_owned))
}

/// A server's text as an error shows it: on one line, without secrets, cut.
fn shown(text: &str, secrets: &[String]) -> String {
    let text = redacted(text, secrets);
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.is_empty() {
        return "(no message)".to_owned();
    }
    if line.chars().count() <= MESSAGE_CHARS_MAX {
        return line;
    }
    line.chars().take(MESSAGE_CHARS_MAX).chain(['…']).collect()
}

fn told(fault: &Fault, policy: &RetryPolicy, job: &Job, attempts: u32) -> WebError {
    let url = job.url.clone();
    match fault.clone() {
        Fault::Broken { reason } => WebError::NoConnection { url, attempts, reason },
        Fault::Silent => WebError::Silent { url, attempts, read_ms: policy.read_ms },
        Fault::Status { status, message, .. } => {
            WebError::Status { url, status, attempts, message }
        }
        Fault::NotJson { reason, message } => WebError::NotJson { url, reason, message },
        Fault::TooLong => WebError::TooLong { url, bytes_max: policy.reply_bytes_max },
    }
}

/// The reason at the bottom of an error; the texts above it repeat the URL with its query.
fn innermost(error: &reqwest::Error) -> String {
    let mut reason: &dyn std::error::Error = error;
    while let Some(source) = reason.source() {
        reason = source;
    }
    if std::ptr::eq(reason, std::ptr::from_ref::<reqwest::Error>(error)) {
        return if error.is_timeout() { "timed out".to_owned() } else { "failed".to_owned() };
    }
    reason.to_string()
}
