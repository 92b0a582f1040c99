//! What is asked and what is answered.

use std::fmt;

use serde_json::Value;

/// What is put in place of something secret.
const HIDDEN: &str = "[hidden]";

/// How a request is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Ask only.
    Get,
    /// Send a body.
    Post,
}

/// One line of a request's head.
#[derive(Clone, PartialEq, Eq)]
pub struct Header {
    /// Field name, in any case.
    pub name: String,
    /// Field value; it may be a secret, and is never shown.
    pub value: String,
    /// Whether nobody may see the value.
    pub is_secret: bool,
}

impl Header {
    /// A header that anybody may see.
    pub fn plain(name: &str, value: &str) -> Self {
        Self { name: name.to_owned(), value: value.to_owned(), is_secret: false }
    }

    /// A header whose value is never shown.
    pub fn secret(name: &str, value: &str) -> Self {
        Self { name: name.to_owned(), value: value.to_owned(), is_secret: true }
    }
}

impl fmt::Debug for Header {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = if self.is_secret { HIDDEN } else { &self.value };
        write!(f, "{}: {value}", self.name)
    }
}

/// What to ask, whatever the number of attempts.
#[derive(Clone, PartialEq)]
pub struct Request {
    /// How.
    pub method: Method,
    /// Where, `http://…` or `https://…`; its query is never shown.
    pub url: String,
    /// Beside those that every request has.
    pub headers: Vec<Header>,
    /// What is sent; never shown.
    pub body: Option<Value>,
    /// Further words that no message may show, such as a key in the body or the query.
    pub secrets: Vec<String>,
    /// The images in the body, for records of what was asked.
    pub images: Vec<SentImage>,
}

/// An image in a request's body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SentImage {
    /// As it stands in the body: base64.
    pub text: String,
    /// What stands for it where the body is recorded; tells its content by a hash.
    pub name: String,
}

impl Request {
    /// A request without a body.
    pub fn get(url: &str) -> Self {
        Self {
            method: Method::Get,
            url: url.to_owned(),
            headers: Vec::new(),
            body: None,
            secrets: Vec::new(),
            images: Vec::new(),
        }
    }

    /// A request with a body.
    pub fn post(url: &str, body: Value) -> Self {
        Self { method: Method::Post, body: Some(body), ..Self::get(url) }
    }

    /// The same request with one more header.
    pub fn with(mut self, header: Header) -> Self {
        self.headers.push(header);
        self
    }

    /// All words that no message may show, longest first.
    pub(super) fn hidden_words(&self) -> Vec<String> {
        let of_headers = self.headers.iter().filter(|header| header.is_secret);
        // "Bearer abc": a server may repeat the key without the word before it.
        let of_headers = of_headers.flat_map(|header| {
            let key = header.value.rsplit(' ').next().unwrap_or_default();
            [header.value.clone(), key.to_owned()]
        });
        let mut words: Vec<String> = of_headers.chain(self.secrets.iter().cloned()).collect();
        words.retain(|word| !word.is_empty());
        words.sort_by_key(|word| std::cmp::Reverse(word.len()));
        words
    }
}

impl fmt::Debug for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Request")
            .field("method", &self.method)
            .field("url", &shown_url(&self.url))
            .field("headers", &self.headers)
            .field("has_body", &self.body.is_some())
            .finish_non_exhaustive()
    }
}

/// A reply with a status of success.
#[derive(Debug, Clone, PartialEq)]
pub struct Reply {
    /// 200 to 299.
    pub status: u16,
    /// The body; null when it is empty.
    pub body: Value,
}

/// A URL as it may be shown: without name, password, query and fragment.
pub fn shown_url(url: &str) -> String {
    let end = url.find(['?', '#']).unwrap_or(url.len());
    let url = url.get(..end).unwrap_or(url);
    let Some((scheme, rest)) = url.split_once("://") else { return url.to_owned() };
    let (host, path) = rest.find('/').map_or((rest, ""), |at| rest.split_at(at));
    let host = host.rsplit('@').next().unwrap_or(host);
    format!("{scheme}://{host}{path}")
}

/// A URL as it may be recorded: without name, password and fragment, and without the parts of its query
/// that hold a secret.
pub(super) fn url_without(url: &str, secrets: &[String]) -> String {
    let shown = redacted(&shown_url(url), secrets);
    let query = url.split('#').next().and_then(|url| Some(url.split_once('?')?.1));
    let parts = query.into_iter().flat_map(|query| query.split('&'));
    let plain: Vec<&str> = parts.filter(|part| redacted(part, secrets) == *part).collect();
    if plain.is_empty() { shown } else { format!("{shown}?{}", plain.join("&")) }
}

/// A text without its secret words.
pub(super) fn redacted(text: &str, secrets: &[String]) -> String {
    secrets.iter().fold(text.to_owned(), |text, secret| text.replace(secret, HIDDEN))
}
