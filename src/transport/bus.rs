//! The bus: one iceoryx2 node per process and run, in a name space of its own.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::prelude::{NodeName, SignalHandlingMode};
use iceoryx2::service::port_factory::PortFactory as _;

use super::TransportError;
use super::outbox::SendHook;
use super::patience::within;
use super::place::{
    MissingRoom, default_prefix, default_root, make_ready, missing_room_to_open, run_name_fault,
};
use super::ports::{Depth, Publisher, Subscriber};
use super::reason::reason;
use super::services::{Record, Service, samples};
use super::topics::Topic;
use super::wire::WireHeader;

/// Which shared-memory world to join. All processes of one run need the same values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BusConfig {
    /// Directory of iceoryx2's bookkeeping; `None` = `/dev/shm/groundloop-UID` of this user where
    /// that is a memory file system, else the same in the system's directory for temporary files.
    pub root: Option<PathBuf>,
    /// Prefix of every shared-memory object.
    pub prefix: String,
    /// Name of the run: the middle part of every service name.
    pub run: String,
}

impl BusConfig {
    /// The usual place, for the run of that name.
    pub fn for_run(run: impl Into<String>) -> Self {
        Self { root: None, prefix: default_prefix(), run: run.into() }
    }
}

/// How long joining the bus may take.
const OPEN_MAX: Duration = Duration::from_secs(10);

fn has_room_to_open(topic: &'static str) -> Result<(), TransportError> {
    let Some(MissingRoom { needed_bytes, free_bytes }) = missing_room_to_open() else {
        return Ok(());
    };
    Err(TransportError::Full { topic, needed_bytes, free_bytes })
}

/// iceoryx2 waits without an end for what another process has begun.
fn unanswered(prefix: &str) -> String {
    format!(
        "no answer for {} s: a process of this user stands still while it starts, or was killed then; end it, or \
         remove /dev/shm/{prefix}* once no run is on (groundloop doctor --clean)",
        OPEN_MAX.as_secs()
    )
}

/// A node on the bus. Cheap to clone; the last clone closes it.
#[derive(Debug, Clone)]
pub struct Bus {
    node: Arc<Node<Service>>,
    /// One port is opened at a time: where one thread creates a service and another opens it at
    /// the same moment, iceoryx2 0.10 panics ("already registered").
    opening: Arc<Mutex<()>>,
    run: Arc<str>,
    disturbance: Option<Arc<dyn SendHook>>,
}

impl Bus {
    /// Joins the bus and clears what dead processes left behind.
    ///
    /// Blocks for as long as iceoryx2 needs to create its files: well below a second, and ten seconds at most.
    ///
    /// # Errors
    /// [`TransportError::Open`] when the place cannot be used; it names the place.
    /// [`TransportError::Full`] when shared memory is full.
    /// [`TransportError::Name`] for a run with a name that cannot be one.
    pub fn open(config: &BusConfig) -> Result<Self, TransportError> {
        let root = config.root.clone().unwrap_or_else(default_root);
        let fault =
            |reason: String| TransportError::Open { what: root.display().to_string(), reason };
        if let Some(expected) = run_name_fault(&config.run) {
            return Err(TransportError::Name { run: config.run.clone(), expected });
        }
        has_room_to_open("the bus")?;
        make_ready(&config.prefix).map_err(fault)?;
        let mut settings = Config::default();
        let root_text = root.to_str().ok_or_else(|| fault("the path is not UTF-8".to_owned()))?;
        settings.global.set_root_path(&root_text.try_into().map_err(|e| fault(reason(&e)))?);
        settings.global.prefix =
            config.prefix.as_str().try_into().map_err(|e| fault(reason(&e)))?;
        let name = NodeName::new("groundloop").map_err(|e| fault(reason(&e)))?;
        let create = move || {
            let node = NodeBuilder::new()
                .config(&settings)
                .name(&name)
                .signal_handling_mode(SignalHandlingMode::Disabled)
                .create::<Service>()
                .map_err(|e| reason(&e))?;
            node.try_cleanup_dead_nodes();
            Ok(node)
        };
        let node = within(OPEN_MAX, create)
            .unwrap_or_else(|| Err(unanswered(&config.prefix)))
            .map_err(fault)?;
        let (node, opening) = (Arc::new(node), Arc::default());
        Ok(Self { node, opening, run: config.run.as_str().into(), disturbance: None })
    }

    /// The same bus for writers whose messages are lost, doubled or late, as `disturbance` says.
    #[must_use]
    pub fn disturbed(&self, disturbance: Arc<dyn SendHook>) -> Self {
        Self { disturbance: Some(disturbance), ..self.clone() }
    }

    /// Opens a topic for writing.
    ///
    /// # Errors
    /// [`TransportError::Open`] naming the topic.
    pub fn publisher<H: WireHeader, R: Record>(
        &self,
        topic: &Topic,
    ) -> Result<Publisher<H, R>, TransportError> {
        let _one_at_a_time = self.opening(topic)?;
        Publisher::open(&self.node, &self.service_name(topic), topic, self.disturbance.clone())
    }

    /// Opens a topic for reading; what the topic keeps for late joiners arrives first.
    ///
    /// # Errors
    /// [`TransportError::Open`] naming the topic, [`TransportError::Depth`] when it does not allow
    /// as many messages to wait.
    pub fn subscriber<H: WireHeader, R: Record>(
        &self,
        topic: &Topic,
        depth: Depth,
    ) -> Result<Subscriber<H, R>, TransportError> {
        let _one_at_a_time = self.opening(topic)?;
        Subscriber::open(&self.node, &self.service_name(topic), topic, depth)
    }

    /// How many write and read a topic, in all processes that live.
    ///
    /// # Errors
    /// [`TransportError::Open`] naming the topic.
    pub fn uses<H: WireHeader, R: Record>(
        &self,
        topic: &Topic,
    ) -> Result<[usize; 2], TransportError> {
        let _one_at_a_time = self.opening(topic)?;
        let service = samples::<H, R>(&self.node, &self.service_name(topic), topic)?;
        let counts = service.dynamic_config();
        Ok([counts.number_of_publishers(), counts.number_of_subscribers()])
    }

    /// Refuses what another process does already: two writers of a topic would be mixed.
    ///
    /// # Errors
    /// [`TransportError::Taken`] when somebody writes the topic, [`TransportError::Open`].
    pub fn refuse_second<H: WireHeader, R: Record>(
        &self,
        topic: &Topic,
    ) -> Result<(), TransportError> {
        let [writers, _] = self.uses::<H, R>(topic)?;
        let taken = || TransportError::Taken { topic: topic.name, run: self.run.to_string() };
        if writers == 0 { Ok(()) } else { Err(taken()) }
    }

    /// Name of the run.
    pub fn run(&self) -> &str {
        &self.run
    }

    /// The run and where it lies: all its processes need the same.
    pub(super) fn place(&self) -> String {
        let config = &self.node.config().global;
        format!("run \"{}\" in {} (prefix {})", self.run, config.root_path(), config.prefix)
    }

    /// Removes what dead processes left behind and tells their readers.
    pub fn clean_up_dead_nodes(&self) {
        self.node.try_cleanup_dead_nodes();
    }

    /// The node itself.
    pub(super) fn node(&self) -> &Node<Service> {
        &self.node
    }

    fn opening(&self, topic: &Topic) -> Result<MutexGuard<'_, ()>, TransportError> {
        has_room_to_open(topic.name)?;
        Ok(self.opening.lock().unwrap_or_else(PoisonError::into_inner))
    }

    pub(super) fn service_name(&self, topic: &Topic) -> String {
        format!("groundloop/{}/{}", self.run, topic.name)
    }
}
