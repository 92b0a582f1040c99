//! Answers kept in files, found by what was asked, so that a replay needs no server.

use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest as _, Sha256};

use crate::http::chat::ChatResponse;

/// A folder of answers.
#[derive(Debug, Clone)]
pub(super) struct Cache {
    folder: PathBuf,
}

/// One file.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    /// The request, the model's name among it.
    request: Value,
    answer: String,
    is_cut: bool,
}

impl Cache {
    pub(super) fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// The answer to a request that was asked before. An entry that is damaged is as good as none.
    pub(super) fn get(&self, request: &Value) -> Option<ChatResponse> {
        let path = self.path(request);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
            Err(error) => {
                tracing::warn!(%error, path = %path.display(), "a kept answer cannot be read");
                return None;
            }
        };
        match serde_json::from_str::<Entry>(&text) {
            Ok(entry) if entry.request == *request => {
                Some(ChatResponse { text: entry.answer, is_cut: entry.is_cut })
            }
            Ok(_) => {
                tracing::warn!(path = %path.display(), "a kept answer is for another request");
                None
            }
            Err(error) => {
                tracing::warn!(%error, path = %path.display(), "a kept answer is damaged");
                None
            }
        }
    }

    /// Keeps an answer. Without room for it the next time asks again, which is only said.
    pub(super) fn put(&self, request: &Value, answer: &ChatResponse) {
        let entry =
            Entry { request: request.clone(), answer: answer.text.clone(), is_cut: answer.is_cut };
        let path = self.path(request);
        if let Err(error) = self.write(&path, &entry) {
            tracing::warn!(%error, path = %path.display(), "an answer cannot be kept");
        }
    }

    /// Writes beside the place and renames, so that nobody ever reads half an entry.
    fn write(&self, path: &Path, entry: &Entry) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let text = serde_json::to_string_pretty(entry)?;
        let beside = path.with_extension(format!("{}.part", std::process::id()));
        fs::write(&beside, text)?;
        fs::rename(&beside, path)
    }

    fn path(&self, request: &Value) -> PathBuf {
        let digest = Sha256::digest(request.to_string().as_bytes());
        self.folder.join(format!("{digest:x}.json"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn answers_are_found_by_content_and_damaged_ones_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path().join("answers"));
        let request = json!({"model": "m", "messages": ["a"]});
        let answer = ChatResponse { text: "(a)".to_owned(), is_cut: false };
        assert_eq!(cache.get(&request), None);
        cache.put(&request, &answer);
        assert_eq!(cache.get(&request), Some(answer.clone()));
        assert_eq!(cache.get(&json!({"model": "n", "messages": ["a"]})), None);
        let files: Vec<_> = fs::read_dir(&cache.folder).unwrap().flatten().collect();
        assert_eq!(files.len(), 1, "{files:?}");
        let text = fs::read_to_string(cache.path(&request)).unwrap();
        for damaged in [&text[..text.len() / 2], "", "[]", &text.replace("\"a\"", "\"b\"")] {
            fs::write(cache.path(&request), damaged).unwrap();
            assert_eq!(cache.get(&request), None, "{damaged}");
        }
        cache.put(&request, &answer);
        assert_eq!(cache.get(&request), Some(answer));
    }
}
