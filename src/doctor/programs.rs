//! Programs beside this one: those that the run file starts, and those that some things need.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::finding::Judgement;
use super::{Check, RunNeeds};

pub(super) const CHECK: Check = Check {
    name: "programs",
    look: |needs: Option<&RunNeeds>| {
        let named = needs.map(|needs| needs.programs.as_slice()).unwrap_or_default();
        let named = named.iter().map(|(key, program)| judge_named(key, program, find(program)));
        let python = find("python3");
        let packages = PACKAGES.map(|Package { name, what, how }| {
            let version = python.as_deref().and_then(|python| version_of(python, name));
            judge_package(name, what, how, version.as_deref())
        });
        let ffmpeg =
            judge_optional("ffmpeg", "camera pipe with videos and network cameras", find("ffmpeg"));
        named.chain([judge_python(python.as_deref())]).chain(packages).chain([ffmpeg]).collect()
    },
};

/// A Python package that something needs.
#[derive(Clone, Copy)]
struct Package {
    name: &'static str,
    what: &'static str,
    how: &'static str,
}

const PACKAGES: [Package; 3] = [
    Package {
        name: "iceoryx2",
        what: "cameras and robots in Python",
        how: "pip install iceoryx2==0.10.0",
    },
    Package { name: "numpy", what: "cameras in Python", how: "pip install numpy" },
    Package {
        name: "up-fast-downward",
        what: "planner.name = \"fast-downward\"",
        how: "pip install up-fast-downward",
    },
];

/// Where a program is: by its path, or in the folders of `PATH`.
fn find(program: &str) -> Option<PathBuf> {
    if program.contains('/') {
        return Some(PathBuf::from(program)).filter(|path| path.is_file());
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).map(|folder| folder.join(program)).find(|path| path.is_file())
}

/// The version of a package, without importing it.
fn version_of(python: &Path, package: &str) -> Option<String> {
    let code = format!("import importlib.metadata as m; print(m.version('{package}'))");
    let mut command = Command::new(python);
    command.args(["-c", &code]).stdin(Stdio::null()).stderr(Stdio::null());
    let ended = command.output().ok().filter(|ended| ended.status.success())?;
    let version = String::from_utf8_lossy(&ended.stdout).trim().to_owned();
    Some(version).filter(|version| !version.is_empty())
}

fn judge_named(key: &str, program: &str, found: Option<PathBuf>) -> Judgement {
    match found {
        Some(path) => Judgement::ok(format!("{}: the run starts it ({key})", path.display())),
        None => Judgement::fault(
            format!("{program} is not there, and the run starts it ({key})"),
            format!("install it, or write its path into {key}"),
        ),
    }
}

fn judge_optional(program: &str, what: &str, found: Option<PathBuf>) -> Judgement {
    match found {
        Some(path) => Judgement::ok(path.display().to_string()),
        None => Judgement::ok(format!("{program}: not there; only for {what}")),
    }
}

fn judge_python(found: Option<&Path>) -> Judgement {
    judge_optional(
        "python3",
        "cameras and robots in Python, and Fast Downward",
        found.map(Path::to_owned),
    )
}

fn judge_package(name: &str, what: &str, how: &str, version: Option<&str>) -> Judgement {
    match version {
        Some(version) => Judgement::ok(format!("{name} {version}: {what}")),
        None => Judgement::ok(format!("{name}: not there; only for {what} ({how})")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Health;

    #[test]
    fn what_the_run_starts_must_be_there_and_the_rest_may() {
        assert_eq!(judge_named("k", "ffmpeg", find("/no/such/ffmpeg")).health, Health::Fault);
        assert_eq!(judge_named("k", "sh", find("sh")).health, Health::Ok);
        let said = judge_optional("ffmpeg", "videos", None);
        assert_eq!(said, Judgement::ok("ffmpeg: not there; only for videos"));
        let said = judge_package("numpy", "cameras", "pip install numpy", None);
        assert_eq!(said, Judgement::ok("numpy: not there; only for cameras (pip install numpy)"));
    }
}
