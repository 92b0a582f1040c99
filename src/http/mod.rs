//! The one HTTP client: JSON out, JSON in, with bounds on everything.
//!
//! A call blocks its caller and works inside and outside of a tokio runtime: the requests run on a
//! thread of the client's own. Which failures are worth another attempt is `retry.rs`. What is
//! secret (keys in headers, bodies or queries) appears in no message and no `Debug` output. Answers may be
//! recorded and found again (`answers.rs`).

mod retry_policy;
mod request;
mod error;
mod answers;
mod retry;
mod client;
mod reach;
pub mod chat;

#[cfg(test)]
mod tests;

pub use answers::Answers;
pub use client::Client;
pub use error::WebError;
pub use reach::reachable;
pub use request::{Header, Method, Reply, Request, SentImage, shown_url};
pub use retry_policy::RetryPolicy;
