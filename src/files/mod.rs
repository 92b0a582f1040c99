//! Files on disk and files that the binary carries, read in one way.
//!
//! `domains/` and `configs/` are embedded, so that what the project ships works from any directory.
//! What reads a domain folder or a run file goes through [`Folder`] and [`FileRef`], whose names say in
//! messages which of the two it is: `domains/hanoi/domain.pddl (embedded)`.

mod shipped;

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};

use thiserror::Error;

use shipped::{embedded, embedded_below, embedded_folders_below};
pub use shipped::{shipped_domains, shipped_names, shipped_sweeps};

/// A file cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{file}: {reason}")]
pub struct FileError {
    /// Path or name of the file that could not be read.
    pub file: String,
    /// The system's reason.
    pub reason: String,
}

/// A folder. The default is the working directory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Folder {
    /// On disk; the empty path is the working directory.
    Disk(PathBuf),
    /// In the binary: a path such as `domains/hanoi`.
    Embedded(String),
}

/// A file in a folder.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FileRef {
    /// Where the file is looked for, on disk or built in.
    pub folder: Folder,
    /// Its name there.
    pub name: String,
}

impl Default for Folder {
    fn default() -> Self {
        Self::Disk(PathBuf::new())
    }
}

impl Folder {
    /// A folder below this one.
    #[must_use]
    pub fn below(&self, path: &str) -> Self {
        match self {
            Self::Disk(folder) => Self::Disk(folder.join(path)),
            Self::Embedded(folder) => Self::Embedded(joined(folder, path)),
        }
    }

    /// A file in this folder, or below it.
    pub fn file(&self, name: &str) -> FileRef {
        FileRef { folder: self.clone(), name: name.to_owned() }
    }

    /// Where it is on disk, if it is there.
    pub fn on_disk(&self) -> Option<&Path> {
        match self {
            Self::Disk(path) => Some(path),
            Self::Embedded(_) => None,
        }
    }

    /// What relative paths start from that are said in this folder's files: the folder, or the
    /// working directory for what is embedded.
    pub fn base(&self) -> &Path {
        self.on_disk().unwrap_or(Path::new(""))
    }

    /// Names of the files in this folder that end with `ending`, in order.
    ///
    /// # Errors
    /// [`FileError`] when there is no such folder.
    pub fn names(&self, ending: &str) -> Result<Vec<String>, FileError> {
        let fault = |reason: String| FileError { file: self.to_string(), reason };
        let mut names: Vec<String> = match self {
            Self::Disk(path) => {
                let entries = std::fs::read_dir(path).map_err(|e| fault(e.to_string()))?;
                let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
                let names = files.filter(|path| path.is_file());
                names.filter_map(|path| Some(path.file_name()?.to_str()?.to_owned())).collect()
            }
            Self::Embedded(path) => {
                let names = embedded_below(path);
                if names.is_empty() {
                    return Err(fault("no such folder".to_owned()));
                }
                names
            }
        };
        names.retain(|name| name.ends_with(ending));
        names.sort_unstable();
        Ok(names)
    }

    /// Names of the folders in this folder, in order; none where there is no such folder.
    pub fn folder_names(&self) -> Vec<String> {
        let names: BTreeSet<String> = match self {
            Self::Disk(path) => {
                let entries = std::fs::read_dir(path).into_iter().flatten();
                let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
                let folders = paths.filter(|path| path.is_dir());
                folders.filter_map(|path| Some(path.file_name()?.to_str()?.to_owned())).collect()
            }
            Self::Embedded(path) => embedded_folders_below(path),
        };
        names.into_iter().collect()
    }
}

impl FileRef {
    /// A file on disk.
    pub fn disk(path: &Path) -> Self {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Self { folder: Folder::Disk(folder), name }
    }

    /// The same file with its name free of folders.
    #[must_use]
    pub fn normal(&self) -> Self {
        match (&self.folder, self.name.rsplit_once('/')) {
            (Folder::Disk(folder), _) => Self::disk(&folder.join(&self.name)),
            (Folder::Embedded(_), Some((below, name))) => {
                Self { folder: self.folder.below(below), name: name.to_owned() }
            }
            (Folder::Embedded(_), None) => self.clone(),
        }
    }

    /// A path for what wants one: where the file is on disk, or a name in the working directory that
    /// says that it is embedded.
    pub fn path(&self) -> PathBuf {
        match &self.folder {
            Folder::Disk(folder) => folder.join(&self.name),
            Folder::Embedded(_) => PathBuf::from(format!("{} (embedded)", self.name)),
        }
    }

    /// Its name without folder and ending.
    pub fn stem(&self) -> &str {
        let name = self.name.rsplit_once('/').map_or(self.name.as_str(), |(_, name)| name);
        name.split_once('.').map_or(name, |(stem, _)| stem)
    }

    /// The file beside it that has another ending.
    #[must_use]
    pub fn with_ending(&self, ending: &str) -> Self {
        let start = self.name.len() - self.name.rsplit('/').next().unwrap_or_default().len();
        let stem_end = self.name[start..].find('.').map_or(self.name.len(), |at| start + at);
        Self { folder: self.folder.clone(), name: format!("{}.{ending}", &self.name[..stem_end]) }
    }

    /// Whether it is there.
    pub fn exists(&self) -> bool {
        match &self.folder {
            Folder::Disk(folder) => folder.join(&self.name).is_file(),
            Folder::Embedded(folder) => embedded(&joined(folder, &self.name)).is_some(),
        }
    }

    /// All of it.
    ///
    /// # Errors
    /// [`FileError`] when it is not there or cannot be read.
    pub fn bytes(&self) -> Result<Vec<u8>, FileError> {
        let fault = |reason: String| FileError { file: self.to_string(), reason };
        match &self.folder {
            Folder::Disk(folder) => {
                std::fs::read(folder.join(&self.name)).map_err(|e| fault(e.to_string()))
            }
            Folder::Embedded(folder) => embedded(&joined(folder, &self.name))
                .map(std::borrow::Cow::into_owned)
                .ok_or_else(|| fault("no such file".to_owned())),
        }
    }

    /// All of it, as text.
    ///
    /// # Errors
    /// [`FileError`] when it is not there, cannot be read, or is no UTF-8.
    pub fn text(&self) -> Result<String, FileError> {
        let fault = |reason: String| FileError { file: self.to_string(), reason };
        String::from_utf8(self.bytes()?).map_err(|error| {
            let (at, bytes) = (error.utf8_error().valid_up_to(), error.as_bytes());
            let before = String::from_utf8_lossy(&bytes[..at]);
            let line = before.matches('\n').count() + 1;
            let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
            fault(format!("line {line}, column {column}: expected UTF-8, got 0x{:02x}", bytes[at]))
        })
    }
}

fn joined(folder: &str, path: &str) -> String {
    if folder.is_empty() { path.to_owned() } else { format!("{folder}/{path}") }
}

impl fmt::Display for Folder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Disk(path) => write!(f, "{}", path.display()),
            Self::Embedded(path) => write!(f, "{path} (embedded)"),
        }
    }
}

impl fmt::Display for FileRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.folder {
            Folder::Disk(folder) => write!(f, "{}", folder.join(&self.name).display()),
            Folder::Embedded(folder) => write!(f, "{} (embedded)", joined(folder, &self.name)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_from_endings() {
        let file = FileRef::disk(Path::new("a.b/tower.masks.json"));
        assert_eq!((file.stem(), file.to_string().as_str()), ("tower", "a.b/tower.masks.json"));
        assert_eq!(file.with_ending("pddl").to_string(), "a.b/tower.pddl");
        let nested = Folder::Embedded("domains/hanoi".to_owned()).file("scenes/four.toml");
        assert_eq!(nested.stem(), "four");
        assert_eq!(nested.with_ending("x").to_string(), "domains/hanoi/scenes/four.x (embedded)");
    }

    #[test]
    fn the_binary_carries_what_the_folders_hold() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for path in ["domains/hanoi", "domains/blocksworld/exemplar/sim_640x480", "configs"] {
            let (disk, embedded) =
                (Folder::Disk(root.join(path)), Folder::Embedded(path.to_owned()));
            let names = disk.names("").unwrap();
            assert_eq!(names, embedded.names("").unwrap(), "{path}");
            assert_eq!(disk.folder_names(), embedded.folder_names(), "{path}");
            for name in names {
                assert_eq!(disk.file(&name).bytes(), embedded.file(&name).bytes(), "{name}");
            }
        }
    }

    #[test]
    fn what_is_not_there_is_named() {
        let folder = Folder::Embedded("domains/kitchen".to_owned());
        let error = folder.names("toml").unwrap_err().to_string();
        assert_eq!(error, "domains/kitchen (embedded): no such folder");
        let error = folder.file("domain.pddl").text().unwrap_err().to_string();
        assert_eq!(error, "domains/kitchen/domain.pddl (embedded): no such file");
        let error = Folder::Disk("no/such".into()).names("toml").unwrap_err().to_string();
        assert!(error.starts_with("no/such: "), "{error}");
    }
}
