//! The files of a sweep: each shard's own, and what they make together.
//!
//! A shard in the making appends a line for each episode to `shard-I-of-N.part`; when it is done, `.jsonl`
//! files appear at once under their names, in the order of the episodes. What a killed shard has written is
//! taken up again, but for a last line without an end.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

use super::record::{SweepLine, SweepRecord, SweepTiming};
use super::shard::Shard;

/// What the sweep file said, word for word.
const SPEC: &str = "sweep.toml";
/// All records, in order.
const EPISODES: &str = "episodes.jsonl";
/// What they cost.
const TIMINGS: &str = "timings.jsonl";
/// Most numbers of missing episodes that a message lists.
const LISTED_MAX: usize = 5;

/// A file of a sweep cannot be used.
#[derive(Debug, Error)]
pub enum StoreError {
    /// Reading or writing failed.
    #[error("{path}: {error}")]
    Io {
        /// The file.
        path: String,
        /// The system's reason.
        error: io::Error,
    },
    /// A line is not what it should be.
    #[error("{path}:{line}: expected an episode of a sweep: {reason}")]
    Line {
        /// The file.
        path: String,
        /// Its line, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// The folder is of another sweep.
    #[error(
        "{path}: the folder is of another sweep than {spec}; choose another folder, or remove it"
    )]
    OtherSpec {
        /// What the folder's sweep says.
        path: String,
        /// The sweep file.
        spec: String,
    },
    /// Somebody else is at it.
    #[error("{path}: another process is running this shard")]
    Busy {
        /// The shard's file.
        path: String,
    },
    /// Not all episodes are there.
    #[error(
        "{folder}: {missing} of {expected} episodes are missing ({first}); run their shards with \
         `groundloop sweep run`, which takes up what is there"
    )]
    Missing {
        /// The sweep's folder.
        folder: String,
        /// How many there are not.
        missing: u64,
        /// How many there should be.
        expected: u64,
        /// The first ones' numbers.
        first: String,
    },
}

fn io_error(path: &Path) -> impl FnOnce(io::Error) -> StoreError {
    let path = path.display().to_string();
    move |error| StoreError::Io { path, error }
}

/// The folder of a sweep.
#[derive(Debug, Clone)]
pub struct SweepFolder(PathBuf);

impl SweepFolder {
    /// A folder that holds a sweep already.
    pub fn at(path: &Path) -> Self {
        Self(path.to_owned())
    }

    /// A folder for a sweep, made when it is not there. `spec` is the text of its file, and `name` that file's.
    ///
    /// # Errors
    /// [`StoreError`] when it cannot be written, or is of another sweep.
    pub fn open(path: &Path, (name, spec): (&str, &str)) -> Result<Self, StoreError> {
        std::fs::create_dir_all(path).map_err(io_error(path))?;
        let folder = Self(path.to_owned());
        let file = folder.0.join(SPEC);
        // Several shards may come at once: each writes the same.
        if !file.exists() {
            folder.write(SPEC, spec.as_bytes())?;
        }
        if folder.spec()? == spec {
            return Ok(folder);
        }
        Err(StoreError::OtherSpec { path: file.display().to_string(), spec: name.to_owned() })
    }

    /// What the sweep file said.
    ///
    /// # Errors
    /// [`StoreError`] when it cannot be read.
    pub fn spec(&self) -> Result<String, StoreError> {
        let path = self.spec_path();
        std::fs::read_to_string(&path).map_err(io_error(&path))
    }

    /// Where that stands.
    pub fn spec_path(&self) -> PathBuf {
        self.0.join(SPEC)
    }

    /// A file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Writes a file whole or not at all.
    ///
    /// # Errors
    /// [`StoreError`] when that fails.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        let path = self.0.join(name);
        let part = self.0.join(format!(".{name}.{}", std::process::id()));
        let write = || {
            let mut file = File::create(&part)?;
            file.write_all(bytes)?;
            file.sync_all()?;
            std::fs::rename(&part, &path)
        };
        write().map_err(io_error(&path))
    }

    /// Opens a shard to work on; `None` when it is done.
    ///
    /// # Errors
    /// [`StoreError`] when its file cannot be read or written, or another process is at it.
    pub fn shard(&self, shard: Shard) -> Result<Option<ShardFile>, StoreError> {
        if self.0.join(records_name(shard)).exists() {
            return Ok(None);
        }
        let path = self.0.join(format!("{}.part", shard.stem()));
        let open = OpenOptions::new().create(true).read(true).append(true).open(&path);
        let file = open.map_err(io_error(&path))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(StoreError::Busy { path: path.display().to_string() });
            }
            Err(TryLockError::Error(error)) => return Err(io_error(&path)(error)),
        }
        let (lines, whole_bytes) = whole_lines(&path)?;
        file.set_len(whole_bytes).map_err(io_error(&path))?;
        Ok(Some(ShardFile { folder: self.clone(), shard, path, file, lines }))
    }

    /// The records of all shards that are done, with what they cost, in order; they need not be all.
    ///
    /// # Errors
    /// [`StoreError`] when a file cannot be read.
    pub fn records(&self) -> Result<(Vec<SweepRecord>, Vec<SweepTiming>), StoreError> {
        let merged = self.0.join(EPISODES);
        if merged.exists() {
            return Ok((json_lines(&merged)?, json_lines(&self.0.join(TIMINGS))?));
        }
        let entries = std::fs::read_dir(&self.0).map_err(io_error(&self.0))?;
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let shards = names.filter_map(|name| Shard::of_stem(name.strip_suffix(".jsonl")?));
        let (mut records, mut timings) = (Vec::new(), Vec::new());
        for shard in shards {
            records.extend(json_lines::<SweepRecord>(&self.0.join(records_name(shard)))?);
            timings.extend(json_lines::<SweepTiming>(&self.0.join(timings_name(shard)))?);
        }
        records.sort_by_key(|record| record.index);
        records.dedup_by_key(|record| record.index);
        timings.sort_by_key(|timing| timing.index);
        timings.dedup_by_key(|timing| timing.index);
        Ok((records, timings))
    }

    /// The records of all episodes.
    ///
    /// # Errors
    /// [`StoreError::Missing`] when there are fewer than `expected`.
    pub fn complete(
        &self,
        expected: u64,
    ) -> Result<(Vec<SweepRecord>, Vec<SweepTiming>), StoreError> {
        let (records, timings) = self.records()?;
        let mut there = records.iter().map(|record| record.index).peekable();
        let missing = (0..expected).filter(|index| there.next_if_eq(index).is_none());
        let missing: Vec<u64> = missing.collect();
        if missing.is_empty() {
            return Ok((records, timings));
        }
        let first: Vec<String> = missing.iter().take(LISTED_MAX).map(ToString::to_string).collect();
        let more = if missing.len() > LISTED_MAX { ", …" } else { "" };
        Err(StoreError::Missing {
            folder: self.0.display().to_string(),
            missing: missing.len() as u64,
            expected,
            first: first.join(", ") + more,
        })
    }

    /// Writes all records, in order, into one file.
    ///
    /// # Errors
    /// [`StoreError`] when there are fewer than `expected`, or the file cannot be written.
    pub fn merge(&self, expected: u64) -> Result<PathBuf, StoreError> {
        let (records, timings) = self.complete(expected)?;
        // The records last: their file says that all is there.
        self.write(TIMINGS, &lines_of(&timings))?;
        self.write(EPISODES, &lines_of(&records))?;
        Ok(self.0.join(EPISODES))
    }
}

fn records_name(shard: Shard) -> String {
    format!("{}.jsonl", shard.stem())
}

fn timings_name(shard: Shard) -> String {
    format!("{}.timing.jsonl", shard.stem())
}

/// A shard in the making; nobody else works on it as long as this lives.
#[derive(Debug)]
pub struct ShardFile {
    folder: SweepFolder,
    shard: Shard,
    path: PathBuf,
    file: File,
    lines: Vec<SweepLine>,
}

impl ShardFile {
    /// What is there, from an earlier try or this one.
    pub fn lines(&self) -> &[SweepLine] {
        &self.lines
    }

    /// Keeps one episode.
    ///
    /// # Errors
    /// [`StoreError`] when it cannot be written.
    pub fn keep(&mut self, line: SweepLine) -> Result<(), StoreError> {
        let text = lines_of(std::slice::from_ref(&line));
        self.file.write_all(&text).map_err(io_error(&self.path))?;
        self.lines.push(line);
        Ok(())
    }

    /// All its episodes are there: the shard's files appear.
    ///
    /// # Errors
    /// [`StoreError`] when they cannot be written.
    pub fn finish(mut self) -> Result<(), StoreError> {
        self.lines.sort_by_key(|line| line.record.index);
        let records: Vec<&SweepRecord> = self.lines.iter().map(|line| &line.record).collect();
        let timings: Vec<SweepTiming> = self.lines.iter().filter_map(|line| line.timing).collect();
        self.folder.write(&timings_name(self.shard), &lines_of(&timings))?;
        self.folder.write(&records_name(self.shard), &lines_of(&records))?;
        std::fs::remove_file(&self.path).map_err(io_error(&self.path))
    }
}

fn lines_of<T: Serialize>(values: &[T]) -> Vec<u8> {
    let mut text = Vec::new();
    for value in values {
        // What has only texts, numbers and names as keys can always be written.
        text.extend(serde_json::to_vec(value).unwrap_or_default());
        text.push(b'\n');
    }
    text
}

fn json_lines<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, StoreError> {
    let text = std::fs::read_to_string(path).map_err(io_error(path))?;
    let parse = |(n, line): (usize, &str)| {
        serde_json::from_str(line).map_err(|error| StoreError::Line {
            path: path.display().to_string(),
            line: n + 1,
            reason: error.to_string(),
        })
    };
    text.lines().enumerate().map(parse).collect()
}

/// The lines of a file up to the first that is not whole, and how many bytes they are.
fn whole_lines(path: &Path) -> Result<(Vec<SweepLine>, u64), StoreError> {
    let file = File::open(path).map_err(io_error(path))?;
    let (mut lines, mut n_bytes) = (Vec::new(), 0);
    let mut reader = BufReader::new(file);
    let mut line = Vec::new();
    loop {
        line.clear();
        let n = reader.read_until(b'\n', &mut line).map_err(io_error(path))?;
        let is_whole = line.last() == Some(&b'\n');
        match serde_json::from_slice(&line) {
            Ok(parsed) if is_whole => lines.push(parsed),
            Ok(_) | Err(_) => return Ok((lines, n_bytes)),
        }
        n_bytes += n as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{SweepDesign, SweepSpec};

    const TEXT: &str = "run = \"blocksworld\"\nrepeats = 5";

    fn line(index: u64) -> SweepLine {
        let design = SweepDesign::new(SweepSpec::parse("s.toml", TEXT).unwrap());
        SweepLine::new(&design.episode(index).unwrap(), Err("not run"))
    }

    fn folder() -> (tempfile::TempDir, SweepFolder) {
        let temp = tempfile::tempdir().unwrap();
        let folder = SweepFolder::open(&temp.path().join("out"), ("s.toml", TEXT)).unwrap();
        (temp, folder)
    }

    fn shard(number: u64, count: u64) -> Shard {
        Shard::new(number, count).unwrap()
    }

    #[test]
    fn shards_make_the_same_file_as_one_in_any_order() {
        let merged = |shards: &[(u64, u64, Vec<u64>)]| {
            let (_temp, folder) = folder();
            for (number, count, episodes) in shards {
                let mut file = folder.shard(shard(*number, *count)).unwrap().unwrap();
                for index in episodes {
                    file.keep(line(*index)).unwrap();
                }
                file.finish().unwrap();
            }
            std::fs::read_to_string(folder.merge(5).unwrap()).unwrap()
        };
        let one = merged(&[(1, 1, vec![3, 0, 1, 4, 2])]);
        let two = merged(&[(2, 2, vec![3, 1]), (1, 2, vec![0, 4, 2])]);
        assert_eq!(one, two);
        assert_eq!(one.lines().count(), 5);
    }

    #[test]
    fn a_killed_shard_goes_on_where_it_was() {
        let (_temp, folder) = folder();
        let mut file = folder.shard(shard(1, 1)).unwrap().unwrap();
        file.keep(line(0)).unwrap();
        file.keep(line(1)).unwrap();
        drop(file);
        let path = folder.path("shard-1-of-1.part");
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 20]).unwrap();
        let mut file = folder.shard(shard(1, 1)).unwrap().unwrap();
        assert_eq!(file.lines(), [line(0)], "the second line had no end");
        file.keep(line(1)).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }

    #[test]
    fn what_is_missing_done_busy_or_another_sweep_is_told() {
        let (temp, folder) = folder();
        let mut file = folder.shard(shard(1, 2)).unwrap().unwrap();
        let busy = folder.shard(shard(1, 2)).unwrap_err().to_string();
        assert!(busy.contains("another process"), "{busy}");
        for index in [0, 2, 4] {
            file.keep(line(index)).unwrap();
        }
        file.finish().unwrap();
        assert!(folder.shard(shard(1, 2)).unwrap().is_none(), "it is done");
        let missing = folder.merge(5).unwrap_err().to_string();
        assert!(missing.contains("2 of 5 episodes are missing (1, 3)"), "{missing}");
        let path = temp.path().join("out");
        let other = SweepFolder::open(&path, ("t.toml", "run = \"hanoi\"")).unwrap_err();
        assert!(other.to_string().contains("another sweep than t.toml"), "{other}");
    }
}
