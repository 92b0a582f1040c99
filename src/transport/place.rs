//! Where shared memory lives, and whether a run can live there: names, what a killed process has left
//! half made, open files, room.

use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::Access;
use rustix::process::{Resource, Rlimit, getrlimit, getuid, setrlimit};

/// Where the system keeps shared memory; its objects lie here whatever the bus's root is.
pub(super) const SHARED_MEMORY: &str = "/dev/shm";
/// `f_type` of a memory file system (Linux, `statfs(2)`).
const TMPFS_MAGIC: rustix::fs::FsWord = 0x0102_1994;
/// Longest name of a run, in bytes.
pub const RUN_NAME_BYTES_MAX: usize = 64;
/// Open files that a run needs: each topic has a socket and some files of shared memory.
const OPEN_FILES_MIN: u64 = 512;
/// A file that is still empty after so long will never be finished: whoever made it was killed between
/// making and sizing it, which takes microseconds.
const UNFINISHED_AGE: Duration = Duration::from_secs(1);
/// Shared memory that a run needs besides frames, in bytes: 12 MB were measured.
const ROOM_BYTES_MIN: u64 = 16 << 20;
/// What a bus or one of its ports needs besides messages, in bytes: 300 kB for each pair of writer and
/// reader were measured.
const OPEN_BYTES_MIN: u64 = 1 << 20;
/// Frames of one stream that are written before the first is used again: of the slots for all
/// possible readers only those that are used take memory.
const FRAMES_HELD: u64 = 4;

/// Why a name cannot be that of a run; nothing for one that can.
pub fn run_name_fault(name: &str) -> Option<String> {
    let may_stand = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let is_good = !name.is_empty()
        && name.len() <= RUN_NAME_BYTES_MAX
        && !name.starts_with('.')
        && name.chars().all(may_stand);
    (!is_good).then(|| {
        format!("1 to {RUN_NAME_BYTES_MAX} letters a-z, digits, '-', '_' or '.', no '.' in front")
    })
}

/// Directory of the bookkeeping of a user: of users that share a machine each has an own one.
pub(super) fn default_root() -> PathBuf {
    let name = format!("groundloop-{}", getuid().as_raw());
    if is_tmpfs(Path::new(SHARED_MEMORY)) {
        Path::new(SHARED_MEMORY).join(name)
    } else {
        std::env::temp_dir().join(name)
    }
}

/// Prefix of all shared memory of a user.
pub(super) fn default_prefix() -> String {
    format!("groundloop_{}_", getuid().as_raw())
}

fn is_tmpfs(path: &Path) -> bool {
    rustix::fs::statfs(path).is_ok_and(|info| info.f_type == TMPFS_MAGIC)
}

/// Makes ready for a node: as many open files as a run needs, and nothing half made in the way, for
/// which iceoryx2 0.10 would wait without an end.
pub(super) fn make_ready(prefix: &str) -> Result<(), String> {
    allow_open_files()?;
    remove_unfinished(Path::new(SHARED_MEMORY), prefix);
    Ok(())
}

/// Raises the soft limit of open files to what a run needs, where the hard one allows it.
fn allow_open_files() -> Result<(), String> {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if current.is_none_or(|current| current >= OPEN_FILES_MIN) {
        return Ok(());
    }
    if maximum.is_some_and(|maximum| maximum < OPEN_FILES_MIN) {
        let maximum = maximum.unwrap_or_default();
        return Err(format!(
            "this process may open {maximum} files, and a run needs {OPEN_FILES_MIN}: raise `ulimit -n`"
        ));
    }
    setrlimit(Resource::Nofile, Rlimit { current: Some(OPEN_FILES_MIN), maximum })
        .map_err(|error| format!("{OPEN_FILES_MIN} open files: {error}: raise `ulimit -n`"))
}

/// Removes empty files of killed processes; waits for those that are too young to be told from what
/// is being made, one second at most.
fn remove_unfinished(folder: &Path, prefix: &str) {
    for path in unfinished(folder, prefix) {
        let age = || fs::metadata(&path).ok()?.modified().ok()?.elapsed().ok();
        if let Some(left) = age().and_then(|age| UNFINISHED_AGE.checked_sub(age)) {
            std::thread::sleep(left);
        }
        let is_empty = fs::metadata(&path).is_ok_and(|info| info.len() == 0);
        if is_empty && let Err(error) = fs::remove_file(&path) {
            tracing::warn!(%error, path = %path.display(), "left by a killed process");
        }
    }
}

fn unfinished(folder: &Path, prefix: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let ours = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix));
    ours.filter(|entry| entry.metadata().is_ok_and(|info| info.is_file() && info.len() == 0))
        .map(|entry| entry.path())
        .collect()
}

/// Shared memory that a run lacks: what it needs, and what is free, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingRoom {
    /// What the run needs.
    pub needed_bytes: u64,
    /// What is free.
    pub free_bytes: u64,
}

/// Whether there is room for frames of these sizes, in bytes; nothing where there is.
pub fn missing_room(frame_bytes: impl Iterator<Item = u64>) -> Option<MissingRoom> {
    let free_bytes = free_bytes()?;
    let needed_bytes = room_for(frame_bytes);
    (needed_bytes > free_bytes).then_some(MissingRoom { needed_bytes, free_bytes })
}

/// Whether there is room for a bus or a port; nothing where there is. iceoryx2 writes what it needs without a
/// look at the room, and where there is none its process is killed without a word.
pub(super) fn missing_room_to_open() -> Option<MissingRoom> {
    let (needed_bytes, free_bytes) = (OPEN_BYTES_MIN, free_bytes()?);
    (needed_bytes > free_bytes).then_some(MissingRoom { needed_bytes, free_bytes })
}

/// What is free in shared memory, in bytes; nothing where the system does not say.
pub(super) fn free_bytes() -> Option<u64> {
    let info = rustix::fs::statvfs(SHARED_MEMORY).ok()?;
    Some(info.f_bavail.saturating_mul(info.f_frsize))
}

/// Shared memory that a run needs with frames of these sizes, in bytes.
pub fn room_for(frame_bytes: impl Iterator<Item = u64>) -> u64 {
    ROOM_BYTES_MIN.saturating_add(frame_bytes.sum::<u64>().saturating_mul(FRAMES_HELD))
}

/// Shared memory as the system has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SharedMemory {
    /// Where it is.
    pub path: &'static str,
    /// Whether it is a memory file system.
    pub is_memory: bool,
    /// Whether this process may make files there.
    pub is_writable: bool,
    /// Its size; nothing where the system does not say.
    pub total_bytes: Option<u64>,
    /// What is free of it.
    pub free_bytes: Option<u64>,
}

impl SharedMemory {
    /// Looks.
    pub fn look() -> Self {
        let info = rustix::fs::statvfs(SHARED_MEMORY).ok();
        let total_bytes = info.map(|info| info.f_blocks.saturating_mul(info.f_frsize));
        Self {
            path: SHARED_MEMORY,
            is_memory: is_tmpfs(Path::new(SHARED_MEMORY)),
            is_writable: is_writable(Path::new(SHARED_MEMORY)),
            total_bytes,
            free_bytes: free_bytes(),
        }
    }
}

fn is_writable(path: &Path) -> bool {
    rustix::fs::access(path, Access::WRITE_OK | Access::EXEC_OK).is_ok()
}

/// The folder of the bookkeeping, and those of other users.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RootFolder {
    /// Where it is.
    pub path: PathBuf,
    /// Who looks.
    pub user: u32,
    /// Whose it is; nothing where it is not there yet.
    pub owner: Option<u32>,
    /// Whether this process may make files there; where it is not there yet, whether it can be made.
    pub is_writable: bool,
    /// The users that have folders of their own beside it.
    pub others: Vec<String>,
}

impl RootFolder {
    /// Looks.
    pub fn look() -> Self {
        let (path, user) = (default_root(), getuid().as_raw());
        let owner = fs::metadata(&path).ok().map(|info| info.uid());
        let beside = path.parent().unwrap_or(&path);
        let is_writable = is_writable(if owner.is_some() { &path } else { beside });
        let entries = fs::read_dir(beside).into_iter().flatten().flatten();
        let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
        let others = names.filter_map(|name| name.strip_prefix("groundloop-").map(str::to_owned));
        let mut others: Vec<String> = others.filter(|other| *other != user.to_string()).collect();
        others.sort();
        Self { path, user, owner, is_writable, others }
    }
}

/// How many files this process may open; nothing for a limit that there is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpenFilesLimit {
    /// Now.
    pub soft: Option<u64>,
    /// What it may be raised to.
    pub hard: Option<u64>,
    /// What a run needs.
    pub needed: u64,
}

impl OpenFilesLimit {
    /// Looks.
    pub fn look() -> Self {
        let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
        Self { soft: current, hard: maximum, needed: OPEN_FILES_MIN }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_runs_are_plain() {
        for good in ["blocksworld-17", "a", "cell_2.left"] {
            assert_eq!(run_name_fault(good), None, "{good}");
        }
        for bad in ["", "a/../b", "héllo", "two words", ".hidden", &"x".repeat(65)] {
            assert!(run_name_fault(bad).is_some(), "{bad}");
        }
    }

    /// Killed between making and sizing a file, a process leaves an empty one.
    #[test]
    fn what_was_left_empty_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::write(&path, text).unwrap();
            path
        };
        let left = file("gl_a.dynamic", "");
        let kept = [file("gl_b.dynamic", "x"), file("other_c.dynamic", "")];
        remove_unfinished(folder.path(), "gl_");
        assert!(!left.exists());
        assert!(kept.iter().all(|path| path.exists()));
    }

    #[test]
    fn a_large_camera_needs_more_room() {
        let twelve_megapixels = 12_000_000 * 7;
        assert!(room_for([twelve_megapixels].into_iter()) > 300 << 20);
        assert_eq!(room_for(std::iter::empty()), ROOM_BYTES_MIN);
    }
}
