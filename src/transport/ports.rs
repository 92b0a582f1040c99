//! Publisher and Subscriber: one topic as a service pair (samples and wake-ups), in tokio.
//!
//! A reader sleeps on the listener's file descriptor. The order is: wait, clear readiness, drain
//! wake-ups, drain samples; any other order loses wake-ups. Late-joiner handshake: a reader that has
//! just opened says so on a second event service, and the writer then hands it what the topic keeps;
//! without that a slow topic (goal, plan) would stay silent until its next message.

use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Weak};

use iceoryx2::node::Node;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher as SamplePublisher;
use iceoryx2::port::subscriber::Subscriber as SampleSubscriber;
use iceoryx2::port::update_connections::UpdateConnections as _;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, EventId};
use iceoryx2::sample::Sample;
use iceoryx2::sample_mut_uninit::SampleMutUninit;
use tokio::task::JoinHandle;

use super::TransportError;
use super::outbox::{Outbox, SendHook};
use super::reason::reason;
use super::reserve::{LackingRoom, Reserve};
use super::services::{Record, Service, events, late_joiners, samples};
use super::told::Told;
use super::topics::Topic;
use super::wakeups::Wakeups;
use super::wire::{SCHEMA, WireHeader};
use crate::clock::monotonic_ns;

/// Event id of "a sample was sent". Ids 1 to 3 are iceoryx2's life-cycle events.
const SENT: EventId = EventId::new(4);
/// Event id of "I have just opened this topic for reading".
const JOINED: EventId = EventId::new(5);
/// Messages that a reader of the newest one has waiting: that one, and the one it overtakes.
const NEWEST_DEPTH: usize = 2;

/// How much a reader lets pile up, and whether it minds what is overtaken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Depth {
    waiting: usize,
    is_complete: bool,
}

impl Depth {
    /// Only the newest message counts; what it overtakes is counted, not queued.
    pub const fn newest() -> Self {
        Self { waiting: NEWEST_DEPTH, is_complete: false }
    }

    /// Every message counts, and so many may wait; they have the numbers of another stream, such as decisions
    /// those of the commands that they are about, and gaps say nothing.
    pub const fn numbered_elsewhere(waiting: usize) -> Self {
        Self { waiting, is_complete: false }
    }

    /// Every message counts, and so many may wait (at most the topic's `depth_max`); a gap is an
    /// error in the log.
    pub const fn all(waiting: usize) -> Self {
        Self { waiting, is_complete: true }
    }
}

/// The writing end of a topic.
pub struct Publisher<H: WireHeader, R: Record> {
    samples: Arc<SamplePublisher<Service, [R], H>>,
    notifier: Arc<Notifier<Service>>,
    handshakes: JoinHandle<()>,
    n_sent: AtomicU64,
    topic: &'static str,
    reserve: Reserve,
    /// What becomes of messages on purpose; without it each is sent.
    outbox: Option<Outbox<H, R>>,
}

impl<H: WireHeader, R: Record> std::fmt::Debug for Publisher<H, R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Publisher").field("topic", &self.topic).finish_non_exhaustive()
    }
}

impl<H: WireHeader, R: Record> Drop for Publisher<H, R> {
    fn drop(&mut self) {
        self.handshakes.abort();
    }
}

impl<H: WireHeader, R: Record> Publisher<H, R> {
    pub(super) fn open(
        node: &Node<Service>,
        service: &str,
        topic: &Topic,
        disturbance: Option<Arc<dyn SendHook>>,
    ) -> Result<Self, TransportError> {
        let fault = |e: &dyn std::fmt::Display| TransportError::open(topic.name, e);
        let publisher = samples::<H, R>(node, service, topic)?
            .publisher_builder()
            .initial_max_slice_len(topic.initial_len)
            .allocation_strategy(AllocationStrategy::PowerOfTwo)
            .max_loaned_samples(2)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|e| fault(&e))?;
        let notifier = events(node, service, topic)?
            .notifier_builder()
            .default_event_id(SENT)
            .create()
            .map_err(|e| fault(&e))?;
        let joins = events(node, &late_joiners(service), topic)?
            .listener_builder()
            .create()
            .map_err(|e| fault(&e))?;
        let joins = Wakeups::new(joins, topic)?;
        let (publisher, notifier) = (Arc::new(publisher), Arc::new(notifier));
        let (weak_publisher, weak_notifier) =
            (Arc::downgrade(&publisher), Arc::downgrade(&notifier));
        let handshakes = tokio::spawn(serve_late_joiners(joins, weak_publisher, weak_notifier));
        // A reader that opened before this writer has announced itself already.
        connect(&publisher, &notifier, topic.name);
        let writer = Self {
            samples: publisher,
            notifier,
            handshakes,
            n_sent: AtomicU64::new(0),
            topic: topic.name,
            reserve: Reserve::default(),
            outbox: disturbance.map(Outbox::new),
        };
        // What is taken now is there when nothing else is.
        drop(writer.loan(topic.initial_len)?);
        Ok(writer)
    }

    /// Sends one message: stamps the header and copies the records into shared memory.
    ///
    /// # Errors
    /// [`TransportError::Send`] when shared memory is exhausted or corrupted.
    pub fn publish(&self, mut header: H, records: &[R]) -> Result<(), TransportError> {
        header.stamp(monotonic_ns(), self.n_sent.fetch_add(1, Ordering::Relaxed));
        match &self.outbox {
            Some(outbox) => outbox.pass(self.topic, header, records, |h, r| self.send(h, r)),
            None => self.send(header, records),
        }
    }

    fn send(&self, header: H, records: &[R]) -> Result<(), TransportError> {
        let fault = |e: &dyn std::fmt::Display| TransportError::Send {
            topic: self.topic,
            reason: reason(e),
        };
        let mut sample = self.loan(records.len())?.write_from_slice(records);
        *sample.user_header_mut() = header;
        sample.send().map_err(|e| fault(&e))?;
        self.notifier.notify().map_err(|e| fault(&e))?;
        Ok(())
    }

    /// Room for a message of so many records, which may be written.
    fn loan(&self, len: usize) -> Result<Loaned<H, R>, TransportError> {
        let full = |LackingRoom { needed_bytes, free_bytes }| TransportError::Full {
            topic: self.topic,
            needed_bytes,
            free_bytes,
        };
        self.reserve.before(len.saturating_mul(size_of::<R>())).map_err(full)?;
        let mut sample = self
            .samples
            .loan_slice_uninit(len)
            .map_err(|e| TransportError::Send { topic: self.topic, reason: reason(&e) })?;
        let payload = sample.payload_mut().as_mut_ptr_range();
        let addresses = payload.start.expose_provenance()..payload.end.expose_provenance();
        self.reserve.take(&addresses).map_err(full)?;
        Ok(sample)
    }
}

/// A message that is not written yet.
type Loaned<H, R> = SampleMutUninit<Service, [MaybeUninit<R>], H>;

/// Hands late joiners what the topic keeps, whenever one announces itself.
async fn serve_late_joiners<H: WireHeader, R: Record>(
    joins: Wakeups,
    publisher: Weak<SamplePublisher<Service, [R], H>>,
    notifier: Weak<Notifier<Service>>,
) {
    while joins.wait().await.is_ok() {
        let (Some(publisher), Some(notifier)) = (publisher.upgrade(), notifier.upgrade()) else {
            return;
        };
        connect(&publisher, &notifier, joins.topic);
    }
}

fn connect<H: WireHeader, R: Record>(
    publisher: &SamplePublisher<Service, [R], H>,
    notifier: &Notifier<Service>,
    topic: &'static str,
) {
    if let Err(error) = publisher.update_connections() {
        tracing::warn!(topic, error = reason(&error), "a late joiner could not be connected");
    }
    if let Err(error) = notifier.notify() {
        tracing::warn!(topic, error = reason(&error), "a late joiner could not be woken");
    }
}

/// One received message; a view into shared memory, valid after the writer has gone.
#[derive(Debug)]
pub struct Received<H: WireHeader, R: Record>(Sample<Service, [R], H>);

impl<H: WireHeader, R: Record> Received<H, R> {
    /// The header, not checked yet.
    pub fn header(&self) -> &H {
        self.0.user_header()
    }

    /// The records, not checked yet.
    pub fn records(&self) -> &[R] {
        self.0.payload()
    }
}

/// What is said of a message of another schema.
fn other_version(schema: u32) -> String {
    format!(
        "a message of schema {schema}, and this program reads schema {SCHEMA}: run one version of groundloop"
    )
}

/// What a reader has missed so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Drops {
    /// Messages overtaken by newer ones, or lost.
    pub missed: u64,
    /// Messages that came behind a later one of their writer, or a second time: they are dropped.
    pub late: u64,
    /// Messages of another schema version.
    pub foreign: u64,
    /// The version of the last of those.
    pub foreign_schema: Option<u32>,
}

/// What came last.
#[derive(Debug, Clone, Copy)]
struct Last {
    writer: u128,
    sequence: u64,
    send_ns: u64,
}

impl Last {
    /// Whether it was sent before a message of the same writer, or is that message.
    fn is_behind(&self, last: &Self) -> bool {
        self.writer == last.writer && (self.send_ns, self.sequence) <= (last.send_ns, last.sequence)
    }
}

/// The reading end of a topic. It never goes back: what its writer sent before what has come already
/// is no news.
pub struct Subscriber<H: WireHeader, R: Record> {
    samples: SampleSubscriber<Service, [R], H>,
    wakeups: Wakeups,
    /// Has announced this reader. It stays, so that the service is there for writers who open it only.
    _joined: Notifier<Service>,
    last: Option<Last>,
    drops: Drops,
    /// What was refused, so that the same is not told each time.
    told: Told,
    is_complete: bool,
}

impl<H: WireHeader, R: Record> std::fmt::Debug for Subscriber<H, R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Subscriber")
            .field("topic", &self.wakeups.topic)
            .field("drops", &self.drops)
            .finish_non_exhaustive()
    }
}

impl<H: WireHeader, R: Record> Subscriber<H, R> {
    pub(super) fn open(
        node: &Node<Service>,
        service: &str,
        topic: &Topic,
        depth: Depth,
    ) -> Result<Self, TransportError> {
        let fault = |e: &dyn std::fmt::Display| TransportError::open(topic.name, e);
        let Depth { waiting, is_complete } = depth;
        if waiting > topic.depth_max {
            let (topic, depth_max) = (topic.name, topic.depth_max);
            return Err(TransportError::Depth { topic, waiting, depth_max });
        }
        // The listener comes first: a sample sent between the two has a wake-up waiting.
        let listener =
            events(node, service, topic)?.listener_builder().create().map_err(|e| fault(&e))?;
        let subscriber = samples::<H, R>(node, service, topic)?
            .subscriber_builder()
            .buffer_size(waiting)
            .create()
            .map_err(|e| fault(&e))?;
        let joined = events(node, &late_joiners(service), topic)?
            .notifier_builder()
            .default_event_id(JOINED)
            .create()
            .map_err(|e| fault(&e))?;
        joined.notify().map_err(|e| fault(&e))?;
        let wakeups = Wakeups::new(listener, topic)?;
        Ok(Self {
            samples: subscriber,
            wakeups,
            _joined: joined,
            last: None,
            drops: Drops::default(),
            told: Told::default(),
            is_complete,
        })
    }

    /// Waits for a message and returns the newest one, counting what it overtook.
    ///
    /// Cancel-safe: dropping the future loses no message.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub async fn newest(&mut self) -> Result<Received<H, R>, TransportError> {
        loop {
            if let Some(received) = self.drain_newest()? {
                return Ok(received);
            }
            self.wakeups.wait().await?;
        }
    }

    /// Waits for messages and returns the newest one that `read` accepts. What it refuses is told
    /// and dropped: a foreign message must not hide one that counts.
    ///
    /// Cancel-safe: dropping the future loses no message.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub async fn newest_of<T, E: std::fmt::Display>(
        &mut self,
        mut read: impl FnMut(Received<H, R>) -> Result<T, E>,
    ) -> Result<T, TransportError> {
        loop {
            if let Some(value) = self.drain_newest_of(&mut read)? {
                return Ok(value);
            }
            self.wakeups.wait().await?;
        }
    }

    /// The newest message that is here already and that `read` accepts, if any; what it refuses
    /// is told and dropped.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub fn drain_newest_of<T, E: std::fmt::Display>(
        &mut self,
        mut read: impl FnMut(Received<H, R>) -> Result<T, E>,
    ) -> Result<Option<T>, TransportError> {
        let mut newest = None;
        while let Some(received) = self.poll_next()? {
            match read(received) {
                Ok(value) => newest = Some(value),
                Err(error) => self.refuse(&error),
            }
        }
        Ok(newest)
    }

    /// Tells of a message that cannot be used; of many that are alike, how many there are.
    fn refuse(&mut self, error: &dyn std::fmt::Display) {
        if let Some(nth) = self.told.count(&error.to_string()) {
            tracing::warn!(topic = self.wakeups.topic, %error, nth, "refused");
        }
    }

    /// Waits for the next message, oldest first. Cancel-safe.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub async fn next(&mut self) -> Result<Received<H, R>, TransportError> {
        loop {
            if let Some(received) = self.poll_next()? {
                return Ok(received);
            }
            self.wakeups.wait().await?;
        }
    }

    /// Waits until something may have come. Cancel-safe.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub async fn wait(&self) -> Result<(), TransportError> {
        self.wakeups.wait().await
    }

    /// The newest message that is here already, if any.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub fn drain_newest(&mut self) -> Result<Option<Received<H, R>>, TransportError> {
        let mut newest = None;
        while let Some(received) = self.poll_next()? {
            newest = Some(received);
        }
        Ok(newest)
    }

    /// The oldest message that is here already, if any.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    pub fn poll_next(&mut self) -> Result<Option<Received<H, R>>, TransportError> {
        while let Some(sample) = self.samples.receive().map_err(|e| self.wakeups.fault(&e))? {
            let writer = sample.header().publisher_id().value();
            let header = sample.user_header();
            if header.schema() != SCHEMA {
                let got = header.schema();
                (self.drops.foreign, self.drops.foreign_schema) =
                    (self.drops.foreign + 1, Some(got));
                if let Some(nth) = self.told.count("schema") {
                    let topic = self.wakeups.topic;
                    tracing::warn!(topic, nth, "refused: {}", other_version(got));
                }
                continue;
            }
            let now = Last { writer, sequence: header.sequence(), send_ns: header.send_ns() };
            if self.last.is_some_and(|last| now.is_behind(&last)) {
                self.drops.late += 1;
                tracing::debug!(topic = self.wakeups.topic, sequence = now.sequence, "late");
                continue;
            }
            self.count_gap(now);
            return Ok(Some(Received(sample)));
        }
        Ok(None)
    }

    /// Drops what is here already; how many messages that nobody was woken for.
    pub(super) fn drain_unwoken(&mut self) -> Result<u64, TransportError> {
        let mut is_woken = false;
        self.wakeups.drain(|| is_woken = true)?;
        let before = self.drops;
        let mut n = 0;
        while self.poll_next()?.is_some() {
            n += 1;
        }
        n += self.drops.late - before.late + self.drops.foreign - before.foreign;
        Ok(if is_woken { 0 } else { n })
    }

    /// Name of the topic.
    pub fn topic(&self) -> &'static str {
        self.wakeups.topic
    }

    /// What has been missed so far.
    pub fn drops(&self) -> Drops {
        self.drops
    }

    fn count_gap(&mut self, now: Last) {
        if let Some(last) = self.last
            && last.writer == now.writer
            && let missed @ 1.. = now.sequence.saturating_sub(last.sequence).saturating_sub(1)
        {
            // Numbers are the writer's, and foreign writers may leap.
            self.drops.missed = self.drops.missed.saturating_add(missed);
            if self.is_complete {
                tracing::error!(topic = self.wakeups.topic, missed, "messages were lost");
            }
        }
        self.last = Some(now);
    }
}
