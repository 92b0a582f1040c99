//! Looking at any topic of a run from outside, whatever travels on it.

use iceoryx2::prelude::CallbackProgression;
use iceoryx2::service::Service as _;
use iceoryx2::service::static_config::messaging_pattern::MessagingPattern;

use super::convert::{command_from_wire, robot_state_from_wire, status_from_wire};
use super::services::{Record, Service};
use super::topics::{CameraTopics, TOPICS, Topic};
use super::wire::{
    CommandRecord, ControlRecord, DecisionRecord, DeviceHeader, DispatchRecord, FrameHeader,
    HealthRecord, OutcomeRecord, RobotStateRecord, SceneRecord, StatusRecord, StepRecord,
    StreamHeader, TaskHeader, WireHeader,
};
use super::{Bus, Depth, Drops, Subscriber, TransportError};
use crate::messages::{CommandKind, StatusKind};

/// One message, as a viewer that knows nothing of the run sees it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TappedMessage {
    /// Its number.
    pub sequence: u64,
    /// When it was sent, monotonic nanoseconds.
    pub send_ns: u64,
    /// Bytes of its payload.
    pub n_bytes: usize,
    /// What it says, in a line.
    pub text: String,
}

/// A reader of one topic.
pub trait Tap {
    /// Every message that has come.
    ///
    /// # Errors
    /// [`TransportError::Receive`].
    fn poll(&mut self) -> Result<Vec<TappedMessage>, TransportError>;

    /// What it has missed.
    fn drops(&self) -> Drops;

    /// How many write and read the topic, this reader included.
    ///
    /// # Errors
    /// [`TransportError::Open`].
    fn uses(&self) -> Result<[usize; 2], TransportError>;
}

struct Reader<H: WireHeader, R: Record> {
    bus: Bus,
    topic: Topic,
    subscriber: Subscriber<H, R>,
    show: fn(&H, &[R]) -> String,
}

impl<H: WireHeader, R: Record> Tap for Reader<H, R> {
    fn poll(&mut self) -> Result<Vec<TappedMessage>, TransportError> {
        let mut messages = Vec::new();
        while let Some(message) = self.subscriber.poll_next()? {
            let (header, records) = (message.header(), message.records());
            messages.push(TappedMessage {
                sequence: header.sequence(),
                send_ns: header.send_ns(),
                n_bytes: size_of_val(records),
                text: (self.show)(header, records),
            });
        }
        Ok(messages)
    }

    fn drops(&self) -> Drops {
        self.subscriber.drops()
    }

    fn uses(&self) -> Result<[usize; 2], TransportError> {
        self.bus.uses::<H, R>(&self.topic)
    }
}

type Open = fn(&Bus, &Topic) -> Result<Box<dyn Tap>, TransportError>;

/// How each topic is read.
const READERS: [(&str, Open); 16] = [
    ("robot/state", |bus, topic| tap(bus, topic, show_state)),
    ("robot/command", |bus, topic| tap(bus, topic, show_command)),
    ("robot/status", |bus, topic| tap(bus, topic, show_status)),
    ("goal", |bus, topic| tap::<TaskHeader, u8>(bus, topic, |_, text| show_text(text))),
    ("scene", |bus, topic| tap::<TaskHeader, SceneRecord>(bus, topic, show_cycle)),
    ("plan", |bus, topic| tap::<TaskHeader, StepRecord>(bus, topic, show_cycle)),
    ("dispatch", |bus, topic| tap::<StreamHeader, DispatchRecord>(bus, topic, show_stream)),
    ("outcome", |bus, topic| tap::<TaskHeader, OutcomeRecord>(bus, topic, show_cycle)),
    ("decision", |bus, topic| tap::<StreamHeader, DecisionRecord>(bus, topic, show_stream)),
    ("event", |bus, topic| tap::<StreamHeader, u8>(bus, topic, |_, text| show_text(text))),
    ("verdict", |bus, topic| tap::<StreamHeader, u8>(bus, topic, |_, text| show_text(text))),
    ("control", |bus, topic| tap::<DeviceHeader, ControlRecord>(bus, topic, show_control)),
    ("health", |bus, topic| tap::<StreamHeader, HealthRecord>(bus, topic, show_stream)),
    ("run", |bus, topic| tap::<DeviceHeader, u8>(bus, topic, |_, text| show_text(text))),
    ("task", |bus, topic| tap::<DeviceHeader, u8>(bus, topic, |_, text| show_text(text))),
    ("task/status", |bus, topic| tap::<DeviceHeader, u8>(bus, topic, |_, text| show_text(text))),
];

fn tap<H: WireHeader, R: Record>(
    bus: &Bus,
    topic: &Topic,
    show: fn(&H, &[R]) -> String,
) -> Result<Box<dyn Tap>, TransportError> {
    let subscriber = bus.subscriber(topic, Depth::all(topic.depth_max))?;
    Ok(Box::new(Reader { bus: bus.clone(), topic: *topic, subscriber, show }))
}

impl Bus {
    /// The names of the run's topics that somebody has opened, in the order of the table; cameras first.
    ///
    /// # Errors
    /// [`TransportError::Open`] when the bus cannot be looked through.
    pub fn topics(&self) -> Result<Vec<String>, TransportError> {
        let before = format!("groundloop/{}/", self.run());
        let mut names = Vec::new();
        Service::list(self.node().config(), |service| {
            let details = &service.static_details;
            let name = details.name().as_str().strip_prefix(&before);
            if matches!(details.messaging_pattern(), MessagingPattern::PublishSubscribe(_)) {
                names.extend(name.map(str::to_owned));
            }
            CallbackProgression::Continue
        })
        .map_err(|error| TransportError::open("list", &error))?;
        let place = |name: &String| {
            let known = TOPICS.iter().position(|topic| topic.name == name);
            (known.filter(|_| !name.starts_with("camera/")), name.clone())
        };
        names.sort_by_key(place);
        Ok(names)
    }

    /// Opens a topic of the run to look at it; `None` for a name that no topic has. The topic must be there:
    /// it would be made.
    ///
    /// # Errors
    /// [`TransportError::Open`] naming the topic.
    pub fn tap(&self, name: &str) -> Result<Option<Box<dyn Tap>>, TransportError> {
        if let Some((id, what)) = name.strip_prefix("camera/").and_then(|rest| rest.split_once('/'))
        {
            let topics = CameraTopics::of(id);
            let topic = match what {
                "rgb" => topics.rgb,
                "depth" => topics.depth,
                _ => return Ok(None),
            };
            return tap(self, &topic, show_frame).map(Some);
        }
        let topic = TOPICS.iter().find(|topic| topic.name == name);
        let reader = READERS.iter().find(|(known, _)| *known == name);
        topic.zip(reader).map(|(topic, (_, open))| open(self, topic)).transpose()
    }
}

fn show_frame(header: &FrameHeader, pixels: &[u8]) -> String {
    let FrameHeader { width, height, encoding, has_intrinsics, has_pose, .. } = header;
    let known = |is: u32, what: &str| if is == 1 { format!(", {what}") } else { String::new() };
    format!(
        "{width}x{height}, encoding {encoding}, {} bytes{}{}",
        pixels.len(),
        known(*has_intrinsics, "intrinsics"),
        known(*has_pose, "pose")
    )
}

fn show_state(header: &DeviceHeader, records: &[RobotStateRecord]) -> String {
    let state = match robot_state_from_wire(header, records) {
        Ok(state) => state,
        Err(error) => return format!("refused: {error}"),
    };
    let held = if state.holding { "holding" } else { "empty" };
    let [x, y, z] = [state.position.x, state.position.y, state.position.z];
    let running = match state.command_id {
        Some(id) => format!("command {id}, point {}", state.phase),
        None => "idle".to_owned(),
    };
    let (yaw_rad, opening_m) = (state.yaw_rad, state.opening_m);
    format!(
        "at ({x:.3}, {y:.3}, {z:.3}) m, {yaw_rad:.2} rad, jaws {opening_m:.3} m, {held}, {running}"
    )
}

fn show_command(header: &DeviceHeader, records: &[CommandRecord]) -> String {
    let command = match command_from_wire(header, records) {
        Ok(command) => command,
        Err(error) => return format!("refused: {error}"),
    };
    let step = command.step.map(|step| format!(" for {step}")).unwrap_or_default();
    let told = match command.kind {
        CommandKind::Continue => "continue".to_owned(),
        CommandKind::Start(motion) => format!("start, {} points", motion.waypoints.len()),
        CommandKind::Cancel => "cancel".to_owned(),
        CommandKind::Hold => "hold".to_owned(),
    };
    format!("{}: {told}{step}, answers frame {}", command.id, command.frame_sequence)
}

fn show_status(header: &DeviceHeader, records: &[StatusRecord]) -> String {
    match status_from_wire(header, records) {
        Ok(status) => {
            let told = match status.kind {
                StatusKind::Accepted => "accepted".to_owned(),
                StatusKind::Done => "done".to_owned(),
                StatusKind::Cancelled => "cancelled".to_owned(),
                StatusKind::Failed(reason) => format!("failed: {reason}"),
            };
            format!("{}: {told}", status.command_id)
        }
        Err(error) => format!("refused: {error}"),
    }
}

fn show_text(text: &[u8]) -> String {
    String::from_utf8_lossy(text).replace('\n', " ")
}

fn show_cycle<R>(header: &TaskHeader, records: &[R]) -> String {
    format!("cycle {}, frame {}, {} records", header.cycle, header.frame_sequence, records.len())
}

fn show_stream<R>(header: &StreamHeader, records: &[R]) -> String {
    format!("cycle {}, frame {}, {} records", header.cycle, header.frame_sequence, records.len())
}

fn show_control(_header: &DeviceHeader, records: &[ControlRecord]) -> String {
    let words = ["stop", "pause", "resume", "step"];
    let word = |r: &ControlRecord| words.get(r.request as usize).copied().unwrap_or("unknown");
    records.iter().map(word).collect::<Vec<_>>().join(", ")
}
