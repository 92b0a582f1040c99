//! Recorded answers: a folder of what services have answered, found by what they were asked, so that
//! the same question needs no server a second time.
//!
//! Each question is one file, `<key>.json`, with the question and the answer. The key is the SHA-256 of
//! the question: method, address, body. Secrets are no part of either: they are left out of addresses
//! and bodies and hidden in answers. An image stands in the question by its name, which tells its
//! pixels by their hash; the image itself is not stored.

use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

use super::request::{redacted, url_without};
use super::{Method, Request, WebError, shown_url};

/// A folder of recorded answers, and whether services are asked for the ones that are not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answers {
    folder: PathBuf,
    is_offline: bool,
}

/// One file.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Recorded {
    /// The name of the file, without its ending.
    key: String,
    /// What was asked; for people.
    question: Value,
    /// The body of the reply.
    answer: Value,
}

impl Answers {
    /// The answers in a folder, which need not be there yet. Offline, what is not there is an error;
    /// else it is asked for and kept.
    pub fn new(folder: impl Into<PathBuf>, is_offline: bool) -> Self {
        Self { folder: folder.into(), is_offline }
    }

    /// The answer to a request: the recorded one, else what `ask` gets, which is recorded. What `ask`
    /// gets must be worth keeping: an error is not kept.
    ///
    /// # Errors
    /// What `ask` says; [`WebError::NotRecorded`] when it may not be asked.
    pub fn answer<E: From<WebError>>(
        &self,
        request: &Request,
        ask: impl FnOnce() -> Result<Value, E>,
    ) -> Result<Value, E> {
        let question = question_of(request);
        let key = format!("{:x}", Sha256::digest(question.to_string().as_bytes()));
        let path = self.folder.join(format!("{key}.json"));
        if let Some(answer) = recorded(&path, &key) {
            tracing::debug!(key, "a recorded answer");
            return Ok(answer);
        }
        if self.is_offline {
            let (url, folder) = (shown_url(&request.url), self.folder.display().to_string());
            return Err(WebError::NotRecorded { url, key, folder }.into());
        }
        let mut answer = ask()?;
        let secrets = request.hidden_words();
        each_text(&mut answer, &mut |text| *text = redacted(text, &secrets));
        let recorded = Recorded { key, question, answer };
        if let Err(error) = self.write(&path, &recorded) {
            tracing::warn!(%error, path = %path.display(), "an answer cannot be recorded");
        }
        Ok(as_read(recorded.answer))
    }

    /// Writes beside the place and renames, so that nobody ever reads half an answer.
    fn write(&self, path: &Path, recorded: &Recorded) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let text = serde_json::to_string_pretty(recorded)?;
        let beside = path.with_extension(format!("{}.part", std::process::id()));
        fs::write(&beside, text)?;
        fs::rename(&beside, path)
    }
}

/// The answer in a file. A file that is damaged is as good as none.
fn recorded(path: &Path, key: &str) -> Option<Value> {
    let unusable = |reason: &dyn std::fmt::Display| {
        tracing::warn!(%reason, path = %path.display(), "a recorded answer is not used");
    };
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
        Err(error) => {
            unusable(&error);
            return None;
        }
    };
    match serde_json::from_str::<Recorded>(&text) {
        Ok(recorded) if recorded.key == key => Some(recorded.answer),
        Ok(recorded) => {
            unusable(&format!("key: expected {key}, got {}", recorded.key));
            None
        }
        Err(error) => {
            unusable(&error);
            None
        }
    }
}

/// An answer as it will be read back: digits that reading does not keep make no difference between
/// the first time and the next.
fn as_read(answer: Value) -> Value {
    serde_json::from_str(&answer.to_string()).unwrap_or(answer)
}

/// What is asked, with nothing in it that is secret, large or by chance.
fn question_of(request: &Request) -> Value {
    let secrets = request.hidden_words();
    let mut body = request.body.clone().unwrap_or_default();
    without(&mut body, &secrets);
    each_text(&mut body, &mut |text| {
        for image in &request.images {
            *text = text.replace(&image.text, &image.name);
        }
        *text = redacted(text, &secrets);
    });
    body.sort_all_objects();
    let method = match request.method {
        Method::Get => "GET",
        Method::Post => "POST",
    };
    json!({ "method": method, "url": url_without(&request.url, &secrets), "body": body })
}

/// Takes the fields out that are secret as a whole: a question is the same with and without its key.
fn without(value: &mut Value, secrets: &[String]) {
    match value {
        Value::Object(fields) => {
            let is_secret = |value: &Value| {
                value.as_str().is_some_and(|text| secrets.iter().any(|secret| secret == text))
            };
            fields.retain(|_, value| !is_secret(value));
            fields.values_mut().for_each(|value| without(value, secrets));
        }
        Value::Array(items) => items.iter_mut().for_each(|value| without(value, secrets)),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

/// Does something to every text in a value.
fn each_text(value: &mut Value, change: &mut dyn FnMut(&mut String)) {
    match value {
        Value::String(text) => change(text),
        Value::Array(items) => items.iter_mut().for_each(|item| each_text(item, change)),
        Value::Object(fields) => fields.values_mut().for_each(|field| each_text(field, change)),
        Value::Null | Value::Bool(_) | Value::Number(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http::{Header, SentImage};

    /// A request with a key in every place where one may be.
    fn request(key: Option<&str>, image: &str, name: &str) -> Request {
        let address = "http://me:word@host:1/a?model=m";
        let mut body = json!({"image": format!("data:image/png;base64,{image}"), "n": 0.25});
        let images = vec![SentImage { text: image.to_owned(), name: name.to_owned() }];
        let Some(key) = key else { return Request { images, ..Request::post(address, body) } };
        body["api_key"] = Value::from(key);
        body["said"] = Value::from(format!("for {key}"));
        let request = Request::post(&format!("{address}&key={key}#part"), body);
        let request = Request { images, secrets: vec![key.to_owned()], ..request };
        request.with(Header::secret("Authorization", &format!("Bearer {key}")))
    }

    fn never() -> Result<Value, WebError> {
        panic!("asked although there is an answer")
    }

    fn files(folder: &Path) -> Vec<PathBuf> {
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
    }

    #[test]
    fn an_answer_is_asked_for_once_and_nothing_secret_or_large_is_stored() {
        let folder = tempfile::tempdir().unwrap();
        let answers = Answers::new(folder.path().join("answers"), false);
        let pixels = "AbCd".repeat(1000);
        let asked = request(Some("sesame"), &pixels, "png of 2 x 2 pixels, sha256 12ab");
        let answer = json!({"boxes": [0.1, 0.912_345_678_901_234_5], "echo": "key sesame"});
        let hidden = json!({"boxes": [0.1, 0.912_345_678_901_234_5], "echo": "key [hidden]"});
        let first = answers.answer(&asked, || Ok::<_, WebError>(answer)).unwrap();
        assert_eq!(first.to_string(), as_read(hidden).to_string());
        assert_eq!(answers.answer(&asked, never).unwrap().to_string(), first.to_string());
        let files = files(&folder.path().join("answers"));
        assert_eq!(files.len(), 1, "{files:?}");
        let text = fs::read_to_string(&files[0]).unwrap();
        assert!(!text.contains("sesame") && !text.contains("AbCd") && !text.contains("word"));
        assert!(text.contains("12ab") && text.contains("http://host:1/a?model=m\""), "{text}");
    }

    #[test]
    fn a_question_is_the_same_without_its_key_and_another_with_another_image() {
        let asked = |key, name| {
            let mut request = request(key, "AbCd", name);
            if let Some(body) = &mut request.body {
                body.as_object_mut().unwrap().remove("said");
            }
            question_of(&request).to_string()
        };
        assert_eq!(asked(Some("sesame"), "x"), asked(None, "x"));
        assert_ne!(asked(None, "x"), asked(None, "y"));
        let [post, get] = [Request::post("http://h/", Value::Null), Request::get("http://h/")];
        assert_ne!(question_of(&post), question_of(&get));
    }

    #[test]
    fn offline_nothing_is_asked_and_damaged_files_are_as_good_as_none() {
        let folder = tempfile::tempdir().unwrap();
        let asked = request(None, "AbCd", "x");
        let offline = Answers::new(folder.path(), true);
        let missed = |offline: &Answers| match offline.answer(&asked, never) {
            Err(error @ WebError::NotRecorded { .. }) => {
                assert!(error.is_absent());
                error.to_string()
            }
            other => panic!("{other:?}"),
        };
        let said = missed(&offline);
        assert!(said.starts_with("http://host:1/a: "), "{said}");
        let online = Answers::new(folder.path(), false);
        let failed = online.answer(&asked, || Err(WebError::Client { reason: "no".to_owned() }));
        assert!(failed.is_err() && files(folder.path()).is_empty(), "an error is not kept");
        let good = || Ok::<_, WebError>(json!([1]));
        online.answer(&asked, good).unwrap();
        assert_eq!(offline.answer(&asked, never).unwrap(), json!([1]));
        let path = files(folder.path()).remove(0);
        assert!(said.contains(path.file_stem().unwrap().to_str().unwrap()), "{said}");
        let text = fs::read_to_string(&path).unwrap();
        for damaged in [&text[..text.len() / 2], "", "[]", &text.replace("key\": \"", "key\": \"0")]
        {
            fs::write(&path, damaged).unwrap();
            missed(&offline);
        }
        online.answer(&asked, good).unwrap();
        assert_eq!(offline.answer(&asked, never).unwrap(), json!([1]));
    }
}
