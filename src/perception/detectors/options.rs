//! Reading a detector's own options and files.

use std::path::PathBuf;

use serde::de::DeserializeOwned;

use super::{DetectorError, DetectorSettings};

impl DetectorSettings<'_> {
    /// The options as the detector declares them; without a table, as if it were empty.
    pub(super) fn options<T: DeserializeOwned>(&self) -> Result<T, DetectorError> {
        let table = self.options.cloned().unwrap_or_default();
        let fault = |e: toml::de::Error| DetectorError::Options { message: e.message().to_owned() };
        table.try_into().map_err(fault)
    }

    /// A path of the options: relative ones start from the run file's folder.
    pub(super) fn path(&self, path: &str) -> PathBuf {
        self.folder.join(path)
    }

    /// A text file that an option names.
    pub(super) fn read(&self, path: &str) -> Result<String, DetectorError> {
        let path = self.path(path);
        std::fs::read_to_string(&path).map_err(|e| DetectorError::File {
            file: path.display().to_string(),
            message: e.to_string(),
        })
    }
}
