//! The flags of verbs that ask services.

use std::path::{Path, PathBuf};

use crate::http::Answers;

/// Where answers of services are recorded.
#[derive(Debug, clap::Args)]
pub(super) struct ServiceArgs {
    /// Records what services answer in this folder, and takes from there what was asked before.
    #[arg(long, value_name = "DIR")]
    answers: Option<PathBuf>,
    /// Asks no service: an answer that is not recorded is missing (exit code 5).
    #[arg(long, requires = "answers")]
    offline: bool,
}

impl ServiceArgs {
    /// The recorded answers.
    pub(super) fn answers(&self) -> Option<Answers> {
        self.answers.as_ref().map(|folder| Answers::new(folder, self.offline))
    }

    /// The same as keys of a run file, whose paths start from its folder.
    pub(super) fn sets(&self) -> Vec<String> {
        let Some(folder) = &self.answers else { return Vec::new() };
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.clone());
        let folder = toml::Value::String(Path::new(&folder).display().to_string());
        let offline = self.offline.then(|| "services.offline=true".to_owned());
        std::iter::once(format!("services.answers={folder}")).chain(offline).collect()
    }
}
