//! The services behind a topic: samples, wake-ups, and late joiners.

use iceoryx2::node::Node;
use iceoryx2::prelude::{EventId, ZeroCopySend};
use iceoryx2::service::ipc_threadsafe;

use super::TransportError;
use super::topics::Topic;
use super::wire::WireHeader;

/// The iceoryx2 variant whose ports may move between threads.
pub(super) type Service = ipc_threadsafe::Service;

/// What can be sent: plain records.
pub trait Record: ZeroCopySend + Copy + std::fmt::Debug + Send + Sync + 'static {}
impl<T: ZeroCopySend + Copy + std::fmt::Debug + Send + Sync + 'static> Record for T {}

/// Largest event id on any topic.
const EVENT_ID_MAX: usize = 15;
/// Readers of one topic (actors, recorders, viewers). Payload memory is reserved for as many, but
/// taken only as messages really wait.
const READERS_MAX: usize = 16;
/// Processes on one topic.
const NODES_MAX: usize = 32;
/// Samples that a reader may hold at a time.
const BORROWED_MAX: usize = 4;

type Samples<H, R> =
    iceoryx2::service::port_factory::publish_subscribe::PortFactory<Service, [R], H>;
type Events = iceoryx2::service::port_factory::event::PortFactory<Service>;

/// Messages of a topic.
pub(super) fn samples<H: WireHeader, R: Record>(
    node: &Node<Service>,
    service: &str,
    topic: &Topic,
) -> Result<Samples<H, R>, TransportError> {
    let fault = |e: &dyn std::fmt::Display| TransportError::open(topic.name, e);
    node.service_builder(&service.try_into().map_err(|e| fault(&e))?)
        .publish_subscribe::<[R]>()
        .user_header::<H>()
        .max_publishers(topic.writers_max)
        .max_subscribers(READERS_MAX)
        .max_nodes(NODES_MAX)
        .subscriber_max_buffer_size(topic.depth_max)
        .subscriber_max_borrowed_samples(BORROWED_MAX)
        .history_size(topic.history)
        .enable_safe_overflow(true)
        .open_or_create()
        .map_err(|e| fault(&e))
}

/// Wake-ups of a topic.
pub(super) fn events(
    node: &Node<Service>,
    service: &str,
    topic: &Topic,
) -> Result<Events, TransportError> {
    let fault = |e: &dyn std::fmt::Display| TransportError::open(topic.name, e);
    node.service_builder(&service.try_into().map_err(|e| fault(&e))?)
        .event()
        .max_notifiers(READERS_MAX + topic.writers_max)
        .max_listeners(READERS_MAX + topic.writers_max)
        .max_nodes(NODES_MAX)
        .event_id_max_value(EVENT_ID_MAX)
        .notifier_created_event(EventId::new(1))
        .notifier_dropped_event(EventId::new(2))
        .notifier_dead_event(EventId::new(3))
        .open_or_create()
        .map_err(|e| fault(&e))
}

/// Where readers announce themselves.
pub(super) fn late_joiners(service: &str) -> String {
    format!("{service}/late-joiners")
}
