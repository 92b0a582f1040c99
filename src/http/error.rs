//! Why there is no reply.

use thiserror::Error;

/// A request failed for good. No message holds anything secret.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum WebError {
    /// The client or the request cannot be made.
    #[error("{what}: expected {expected}, got {got}")]
    Request {
        /// The part: "url", "header Authorization".
        what: String,
        /// What may stand there.
        expected: String,
        /// What does.
        got: String,
    },
    /// The client does not work.
    #[error("the HTTP client does not work: {reason}")]
    Client {
        /// Why.
        reason: String,
    },
    /// No connection, or it broke, at each attempt.
    #[error("{url}: no connection after {attempts} attempt(s): {reason}; is the server running?")]
    NoConnection {
        /// Where, without secrets.
        url: String,
        /// How often it was tried.
        attempts: u32,
        /// Of the last attempt.
        reason: String,
    },
    /// The server was silent for too long at each attempt.
    #[error(
        "{url}: no reply after {attempts} attempt(s), each silent for {read_ms} ms; raise read_ms \
         or give the server less to do"
    )]
    Silent {
        /// Where, without secrets.
        url: String,
        /// How often it was tried.
        attempts: u32,
        /// The bound.
        read_ms: u64,
    },
    /// The deadline over all attempts has passed, or would pass in the pause asked for.
    #[error(
        "{url}: not answered within {total_ms} ms ({attempts} attempt(s)): {last}; raise total_ms"
    )]
    Deadline {
        /// Where, without secrets.
        url: String,
        /// The bound.
        total_ms: u64,
        /// How often it was tried.
        attempts: u32,
        /// What was going on.
        last: String,
    },
    /// The server refused.
    #[error("{url}: status {status} after {attempts} attempt(s): {message}{}", advice(*status))]
    Status {
        /// Where, without secrets.
        url: String,
        /// HTTP status code of the last attempt.
        status: u16,
        /// How often it was tried.
        attempts: u32,
        /// What the server said, cut.
        message: String,
    },
    /// The server's reply is no JSON.
    #[error("{url}: expected JSON: {reason}: {message}")]
    NotJson {
        /// Where, without secrets.
        url: String,
        /// The parser's reason.
        reason: String,
        /// The reply, cut.
        message: String,
    },
    /// There is no recorded answer, and the server may not be asked.
    #[error(
        "{url}: no recorded answer {key} in {folder}: leave out --offline (services.offline) once, \
         while the service is there, or take the folder that has this answer"
    )]
    NotRecorded {
        /// Where, without secrets.
        url: String,
        /// What the answer would be called: the hash of the question.
        key: String,
        /// Where it was looked for.
        folder: String,
    },
    /// The server's reply is too long.
    #[error("{url}: expected a reply of at most {bytes_max} bytes (reply_bytes_max), got more")]
    TooLong {
        /// Where, without secrets.
        url: String,
        /// The bound.
        bytes_max: usize,
    },
}

impl WebError {
    /// Whether the service cannot be reached or does not answer: another time it may.
    pub fn is_absent(&self) -> bool {
        match self {
            Self::NoConnection { .. }
            | Self::Silent { .. }
            | Self::Deadline { .. }
            | Self::NotRecorded { .. } => true,
            Self::Status { status, .. } => matches!(status, 429 | 500..),
            Self::Request { .. }
            | Self::Client { .. }
            | Self::NotJson { .. }
            | Self::TooLong { .. } => false,
        }
    }

    /// Whether the server wants another key, or any.
    pub fn is_unauthorised(&self) -> bool {
        matches!(self, Self::Status { status: 401 | 403, .. })
    }
}

/// What to do about a status.
fn advice(status: u16) -> &'static str {
    match status {
        300..=399 => "; give the url that it has moved to",
        400 | 422 => "; the server does not take this request: check its dialect and model",
        401 | 403 => "; check the key",
        404 | 405 => "; check the url and the model's name",
        429 => "; the server wants fewer requests: raise total_ms or wait",
        500.. => "; see the server's log",
        _ => "",
    }
}
