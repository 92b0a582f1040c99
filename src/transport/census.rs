//! Who is on the bus of this user, and what dead processes have left behind.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeState, NodeView as _};
use iceoryx2::prelude::CallbackProgression;
use iceoryx2::service::Service as _;
use rustix::process::getuid;

use super::patience::within;
use super::place::{SHARED_MEMORY, default_prefix, default_root};
use super::services::Service;
use super::{Bus, BusConfig, TransportError};

/// How long the bus is looked through.
const LOOK_MAX: Duration = Duration::from_secs(10);
/// What is younger may be in the making.
const YOUNG: Duration = Duration::from_secs(2);
/// Objects of every version of groundloop begin with this.
const ANY_PREFIX: &str = "groundloop_";
/// The one object of 16 bytes that a bus keeps for good.
const KEPT: &str = ".global_mgmt";

/// A process on the bus.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct BusProcess {
    /// Its number.
    pub pid: u32,
    /// Its program.
    pub program: String,
}

/// What a dead process has left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leftover {
    /// The file.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
}

/// The bus of this user.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BusCensus {
    /// The processes of each run, by its name.
    pub runs: BTreeMap<String, BTreeSet<BusProcess>>,
    /// Nodes of processes that have died.
    pub n_dead_nodes: usize,
    /// Processes that are on the bus and cannot be seen from here: they live in another container. What is theirs
    /// cannot be told from what is left behind.
    pub n_unseen: usize,
    /// Files that nobody uses.
    pub leftovers: Vec<Leftover>,
}

impl BusCensus {
    /// Looks through the bus.
    ///
    /// # Errors
    /// [`TransportError::Open`] when it cannot be looked through.
    pub fn take() -> Result<Self, TransportError> {
        let root = default_root();
        let what = root.display().to_string();
        let fault = |reason: String| TransportError::Open { what: what.clone(), reason };
        if !root.is_dir() {
            let leftovers = unused_objects(&used_objects());
            return Ok(Self { leftovers, ..Self::default() });
        }
        let mut config = Config::default();
        let root_text = root.to_str().ok_or_else(|| fault("the path is not UTF-8".to_owned()))?;
        let root_path = root_text.try_into();
        config.global.set_root_path(&root_path.map_err(|e| fault(super::reason(&e)))?);
        let prefix = default_prefix();
        config.global.prefix = prefix.as_str().try_into().map_err(|e| fault(super::reason(&e)))?;
        let looked = within(LOOK_MAX, move || looked_through(&config));
        let (mut census, used) = looked
            .unwrap_or_else(|| Err(format!("no answer for {} s", LOOK_MAX.as_secs())))
            .map_err(fault)?;
        if census.n_unseen == 0 {
            census.leftovers = unused_objects(&used_objects());
            census.leftovers.extend(unused_services(&root.join("services"), &prefix, &used));
        }
        Ok(census)
    }

    /// Bytes of all that is left.
    pub fn leftover_bytes(&self) -> u64 {
        self.leftovers.iter().map(|leftover| leftover.bytes).sum()
    }

    /// Removes what dead processes have left.
    ///
    /// # Errors
    /// [`TransportError::Open`] when the bus cannot be joined.
    pub fn clean_up() -> Result<(), TransportError> {
        // Whoever joins clears dead nodes.
        drop(Bus::open(&BusConfig::for_run("doctor"))?);
        for Leftover { path, .. } in Self::take()?.leftovers {
            if let Err(error) = fs::remove_file(&path) {
                tracing::warn!(%error, path = %path.display(), "left by a dead process");
            }
        }
        Ok(())
    }
}

/// Runs and nodes, and the hashes of all services that somebody uses.
fn looked_through(config: &Config) -> Result<(BusCensus, BTreeSet<String>), String> {
    let mut census = BusCensus::default();
    let mut used = BTreeSet::new();
    let listed = Node::<Service>::list(config, |state| {
        match state {
            NodeState::Alive(node) => {
                let pid = node.details().as_ref().map(|details| details.process_id().value());
                let is_seen = pid.is_some_and(|pid| Path::new(&format!("/proc/{pid}")).is_dir());
                census.n_unseen += usize::from(!is_seen);
            }
            NodeState::Dead(_) | NodeState::Undefined(_) => census.n_dead_nodes += 1,
            NodeState::Inaccessible(_) => census.n_unseen += 1,
        }
        CallbackProgression::Continue
    });
    listed.map_err(|error| super::reason(&error))?;
    let listed = Service::list(config, |service| {
        let details = &service.static_details;
        let nodes = service.dynamic_details.iter().flat_map(|details| &details.nodes);
        let alive = nodes.filter_map(|node| match node {
            NodeState::Alive(node) => Some(node.details()),
            NodeState::Dead(_) | NodeState::Inaccessible(_) | NodeState::Undefined(_) => None,
        });
        for details_of_node in alive {
            used.insert(details.service_hash().to_string());
            let (Some(node), Some(run)) = (details_of_node, run_of(details.name().as_str())) else {
                continue;
            };
            let pid = u32::try_from(node.process_id().value()).unwrap_or_default();
            let program = node.executable().to_string();
            census.runs.entry(run.to_owned()).or_default().insert(BusProcess { pid, program });
        }
        CallbackProgression::Continue
    });
    listed.map_err(|error| super::reason(&error))?;
    Ok((census, used))
}

/// The run that a service belongs to.
fn run_of(service: &str) -> Option<&str> {
    service.strip_prefix("groundloop/")?.split_once('/').map(|(run, _)| run)
}

/// The objects of shared memory that the processes of this user have mapped.
fn used_objects() -> BTreeSet<String> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let maps = processes.filter_map(|entry| fs::read_to_string(entry.path().join("maps")).ok());
    maps.flat_map(|maps| mapped_objects(&maps)).collect()
}

/// The objects of shared memory in a text as of `/proc/PID/maps`.
fn mapped_objects(maps: &str) -> BTreeSet<String> {
    let names = maps.lines().filter_map(|line| line.rsplit_once("/dev/shm/").map(|(_, name)| name));
    names.map(|name| name.trim_end_matches(" (deleted)").to_owned()).collect()
}

/// Objects of shared memory that are this user's and that nobody has mapped.
fn unused_objects(used: &BTreeSet<String>) -> Vec<Leftover> {
    let is_unused =
        |name: &str| name.starts_with(ANY_PREFIX) && !name.ends_with(KEPT) && !used.contains(name);
    old_files(Path::new(SHARED_MEMORY), is_unused)
}

/// Descriptions of services that no live node uses.
fn unused_services(folder: &Path, prefix: &str, used: &BTreeSet<String>) -> Vec<Leftover> {
    let hash = |name: &str| {
        let name = name.strip_prefix(prefix)?;
        name.strip_suffix(".service").map(str::to_owned)
    };
    old_files(folder, |name| hash(name).is_some_and(|hash| !used.contains(&hash)))
}

/// Files of this user that are of a kind and not in the making.
fn old_files(folder: &Path, is_wanted: impl Fn(&str) -> bool) -> Vec<Leftover> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<Leftover> = entries
        .filter(|entry| is_wanted(&entry.file_name().to_string_lossy()))
        .filter_map(|entry| {
            let info = entry.metadata().ok()?;
            let age = info.modified().ok()?.elapsed().unwrap_or_default();
            let is_ours = info.is_file() && info.uid() == getuid().as_raw() && age > YOUNG;
            is_ours.then(|| Leftover { path: entry.path(), bytes: info.len() })
        })
        .collect();
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_mapped_is_used() {
        let maps = "\
7f00-7f01 rw-s 00000000 00:1b 12     /dev/shm/groundloop_0_a__0.data
7f01-7f02 rw-s 00000000 00:1b 13     /dev/shm/groundloop_0_b.dynamic (deleted)
7f02-7f03 r--p 00000000 00:1b 14     /usr/lib/libc.so
7f03-7f04 rw-p 00000000 00:00 0
";
        let expect = ["groundloop_0_a__0.data", "groundloop_0_b.dynamic"];
        assert!(mapped_objects(maps).iter().eq(expect.iter()));
    }

    #[test]
    fn services_are_of_runs() {
        assert_eq!(run_of("groundloop/kitchen/camera/main/rgb"), Some("kitchen"));
        assert_eq!(run_of("somebody/else"), None);
    }

    #[test]
    fn what_is_young_or_used_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let old = std::time::UNIX_EPOCH;
        for (name, is_old) in [("p_a.service", true), ("p_b.service", true), ("p_c.service", false)]
        {
            let file = fs::File::create(folder.path().join(name)).unwrap();
            if is_old {
                file.set_modified(old).unwrap();
            }
        }
        let used = ["b".to_owned()].into_iter().collect();
        let left = unused_services(folder.path(), "p_", &used);
        let expect = Leftover { path: folder.path().join("p_a.service"), bytes: 0 };
        assert_eq!(left, [expect]);
    }
}
