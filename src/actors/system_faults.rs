//! What goes wrong among the actors and their messages, as `[[fault]]` of a run file says.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::clock::ClockKind;
use crate::hardware::{FaultConfig, LoopShape, SystemFault, is_drawn};
use crate::messages::{Command, CommandKind};
use crate::metrics::FaultRecord;
use crate::transport::convert::{command_to_wire, device_header};
use crate::transport::topics::ROBOT_COMMAND;
use crate::transport::wire::{CommandRecord, DeviceHeader};
use crate::transport::{Bus, Delivery, Outgoing, Publisher, SendHook, TransportError};

/// What an actor has to do about a message besides what it always does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Handling {
    /// Nothing.
    Usual,
    /// The planner is out of time.
    DeadlineMissed,
    /// The goal source is not there.
    SourceDown,
}

/// Lets faults happen to actors and messages. Cheap to clone; without faults it does nothing.
#[derive(Debug, Clone, Default)]
pub struct SystemFaults(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    seed: u64,
    state: Mutex<State>,
    lockstep: Option<FrameAnswers>,
}

#[derive(Debug, Default)]
struct State {
    entries: Vec<Entry>,
    records: Vec<FaultRecord>,
    time: RunTime,
}

#[derive(Debug)]
struct Entry {
    /// Its place in the run file.
    fault: usize,
    trigger: Occasion,
    action: SystemFault,
    kind: String,
    /// At which occasion; at every one without it.
    nth: Option<u64>,
    probability: f64,
    n_occasions: u64,
}

/// What a fault waits for.
#[derive(Debug, PartialEq, Eq)]
enum Occasion {
    /// A message of this actor.
    Message(String),
    /// A message on this topic.
    Sent(String),
}

/// Run time as the stamps of messages tell it.
#[derive(Debug, Default)]
struct RunTime {
    first_ns: Option<u64>,
    newest_ns: u64,
}

/// Answers the frame of a message that is lost on its way to a command, so that a world in lockstep goes on.
#[derive(Debug)]
struct FrameAnswers {
    commands: Publisher<DeviceHeader, CommandRecord>,
    /// Topics whose messages the frame waits for.
    waited: Vec<String>,
    /// The newest frame.
    frame: AtomicU64,
    /// The number of the newest command of the executor.
    command: AtomicU64,
}

impl SystemFaults {
    /// The faults of a run file that concern actors and messages; `bus` is undisturbed.
    ///
    /// # Errors
    /// [`TransportError`] when the topic of commands does not open.
    pub fn open(
        (faults, seed): (&[FaultConfig], u64),
        shape: &LoopShape<'_>,
        bus: &Bus,
    ) -> Result<Self, TransportError> {
        let entries: Vec<Entry> = faults.iter().enumerate().filter_map(Entry::new).collect();
        let is_waited = |entry: &Entry| match &entry.trigger {
            Occasion::Sent(topic) if shape.waits_for(topic) => Some(topic.clone()),
            Occasion::Sent(_) | Occasion::Message(_) => None,
        };
        let waited: Vec<String> = entries.iter().filter_map(is_waited).collect();
        let is_lockstep = shape.clock == ClockKind::Lockstep;
        let lockstep = if is_lockstep && !waited.is_empty() {
            let (frame, command) = Default::default();
            Some(FrameAnswers { commands: bus.publisher(&ROBOT_COMMAND)?, waited, frame, command })
        } else {
            None
        };
        let first_ns = is_lockstep.then_some(0);
        let time = RunTime { first_ns, newest_ns: 0 };
        let state = Mutex::new(State { entries, records: Vec::new(), time });
        Ok(Self(Arc::new(Inner { seed, state, lockstep })))
    }

    /// Counts one message of an actor, and lets happen what the run file says: it stands still, or panics.
    ///
    /// # Panics
    /// When the run file says so.
    #[expect(clippy::panic, reason = "a fault that the run file asks for")]
    pub(super) async fn message(&self, actor: &str) -> Handling {
        let occasion = Occasion::Message(actor.to_owned());
        let happening = self.lock().happening(&occasion, self.0.seed);
        let mut handling = Handling::Usual;
        for Happening { occurrence, action, tag } in happening {
            let said = match &action {
                SystemFault::Panic {} => format!("{actor} panics at message {occurrence}"),
                SystemFault::Stall { for_s } => {
                    format!("{actor} stands still for {for_s} s at message {occurrence}")
                }
                SystemFault::DeadlineMissed {} => {
                    format!("the deadline passes at message {occurrence} of the planner")
                }
                SystemFault::SourceDown {} => {
                    format!("the goal source is not there at message {occurrence}")
                }
                // Only beside `sent`.
                SystemFault::Lose {} | SystemFault::Duplicate {} | SystemFault::Delay { .. } => {
                    continue;
                }
            };
            self.lock().record(tag, None, Ok(said.clone()));
            match action {
                SystemFault::Stall { for_s } => {
                    tokio::time::sleep(Duration::from_secs_f64(for_s)).await;
                }
                SystemFault::DeadlineMissed {} => handling = Handling::DeadlineMissed,
                SystemFault::SourceDown {} => handling = Handling::SourceDown,
                SystemFault::Panic {} => panic!("{said}, as the run file says"),
                SystemFault::Lose {} | SystemFault::Duplicate {} | SystemFault::Delay { .. } => {}
            }
        }
        handling
    }

    /// What has happened so far.
    pub fn records(&self) -> Vec<FaultRecord> {
        self.lock().records.clone()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SendHook for SystemFaults {
    fn delivery(&self, message: Outgoing) -> Delivery {
        let Outgoing { topic, sequence, capture_ns } = message;
        let occasion = Occasion::Sent(topic.to_owned());
        let delivery = {
            let mut state = self.lock();
            state.time.pass(capture_ns);
            let happening = state.happening(&occasion, self.0.seed);
            let mut delivery = Delivery::Sent;
            for Happening { occurrence, action, tag } in happening {
                let (this, said) = match action {
                    SystemFault::Lose {} => (Delivery::Lost, "is lost".to_owned()),
                    SystemFault::Duplicate {} => (Delivery::Twice, "is sent twice".to_owned()),
                    SystemFault::Delay { messages } => {
                        let messages = messages.unwrap_or(std::num::NonZeroU32::MIN);
                        (Delivery::Late(messages), format!("waits for {messages} later ones"))
                    }
                    // Only beside `message`.
                    SystemFault::Panic {}
                    | SystemFault::Stall { .. }
                    | SystemFault::DeadlineMissed {}
                    | SystemFault::SourceDown {} => continue,
                };
                let said = format!("message {occurrence} on {topic} {said}");
                let is_free = delivery == Delivery::Sent;
                let said =
                    if is_free { Ok(said) } else { Err(format!("{said}: another fault has it")) };
                state.record(tag, Some(capture_ns), said);
                if is_free {
                    delivery = this;
                }
            }
            delivery
        };
        if let Some(lockstep) = &self.0.lockstep {
            lockstep.note(topic, sequence);
            if matches!(delivery, Delivery::Lost | Delivery::Late(_)) {
                lockstep.go_on(topic);
            }
        }
        delivery
    }
}

/// A fault that happens.
struct Happening {
    /// Counted from 1.
    occurrence: u64,
    action: SystemFault,
    /// Its place in the run file, and its kind.
    tag: (usize, String),
}

impl State {
    /// Counts an occasion; the faults that happen with it.
    fn happening(&mut self, occasion: &Occasion, seed: u64) -> Vec<Happening> {
        let mut happening = Vec::new();
        for entry in self.entries.iter_mut().filter(|entry| entry.trigger == *occasion) {
            entry.n_occasions += 1;
            let (fault, occurrence) = (entry.fault, entry.n_occasions);
            let is_it = entry.nth.is_none_or(|nth| nth == occurrence);
            if is_it && is_drawn(seed, (fault, occurrence), entry.probability) {
                let (action, tag) = (entry.action.clone(), (fault, entry.kind.clone()));
                happening.push(Happening { occurrence, action, tag });
            }
        }
        happening
    }

    /// Tells of an occurrence, and writes it down.
    fn record(
        &mut self,
        (fault, kind): (usize, String),
        at: Option<u64>,
        said: Result<String, String>,
    ) {
        match &said {
            Ok(done) => tracing::info!(target: "fault", "{done}"),
            Err(error) => tracing::info!(target: "fault", %error, "not applied"),
        }
        let (at_ns, happened) = (self.time.of(at), said.is_ok());
        let said = said.unwrap_or_else(|error| error);
        let told = FaultRecord { at_ns, fault, kind, happened, said, ..FaultRecord::default() };
        self.records.push(told);
    }
}

impl RunTime {
    /// A message with this stamp goes out; 0 is none.
    fn pass(&mut self, capture_ns: u64) {
        if capture_ns > 0 {
            self.first_ns.get_or_insert(capture_ns);
            self.newest_ns = self.newest_ns.max(capture_ns);
        }
    }

    /// Nanoseconds since the start at a stamp, or at the newest one.
    fn of(&self, capture_ns: Option<u64>) -> u64 {
        let now_ns = capture_ns.filter(|ns| *ns > 0).unwrap_or(self.newest_ns);
        now_ns.saturating_sub(self.first_ns.unwrap_or(now_ns))
    }
}

impl Entry {
    /// `None` for what concerns the simulated world, and for what cannot be read: that was refused before.
    fn new((fault, config): (usize, &FaultConfig)) -> Option<Self> {
        let trigger = match (&config.message, &config.sent) {
            (Some(actor), _) => Occasion::Message(actor.clone()),
            (None, Some(topic)) => Occasion::Sent(topic.clone()),
            (None, None) => return None,
        };
        let is_every = config.every == Some(true);
        Some(Self {
            fault,
            trigger,
            action: SystemFault::read(&config.action).ok()?,
            kind: config.action.get("kind")?.as_str()?.to_owned(),
            nth: (!is_every).then(|| u64::from(config.nth.unwrap_or(1))),
            probability: config.probability.unwrap_or(1.0),
            n_occasions: 0,
        })
    }
}

impl FrameAnswers {
    /// Keeps the numbers of the newest frame and of the newest command.
    fn note(&self, topic: &str, sequence: u64) {
        if topic.starts_with("camera/") {
            self.frame.store(sequence, Ordering::Relaxed);
        } else if topic == ROBOT_COMMAND.name {
            self.command.store(sequence, Ordering::Relaxed);
        }
    }

    /// The frame of a lost message is answered: the robot carries on, and the next frame is due.
    fn go_on(&self, topic: &str) {
        if !self.waited.iter().any(|waited| waited == topic) {
            return;
        }
        let frame_sequence = self.frame.load(Ordering::Relaxed);
        let kind = CommandKind::Continue;
        let command = Command { id: 0, frame_sequence, capture_ns: 0, kind, step: None };
        let header = device_header(self.command.load(Ordering::Relaxed), 0);
        let sent = command_to_wire(&command)
            .map_err(|e| e.to_string())
            .and_then(|record| self.commands.publish(header, &[record]).map_err(|e| e.to_string()));
        if let Err(error) = sent {
            tracing::warn!(error, "the frame of a lost message is not answered");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::BusConfig;

    const SHAPE: LoopShape<'_> = LoopShape { clock: ClockKind::Realtime, cameras: &["main"] };

    /// Faults of a loop in realtime, which needs no bus of its own.
    fn faults(text: &str, seed: u64) -> SystemFaults {
        let table: toml::Table = text.parse().unwrap();
        let faults: Vec<FaultConfig> = table["fault"].clone().try_into().unwrap();
        let root = tempfile::tempdir().unwrap();
        let prefix = root.path().file_name().unwrap().to_str().unwrap().replace('.', "");
        let path = Some(root.path().to_owned());
        let bus = Bus::open(&BusConfig { root: path, prefix, run: "faults".to_owned() }).unwrap();
        SystemFaults::open((&faults, seed), &SHAPE, &bus).unwrap()
    }

    fn send(faults: &SystemFaults, topic: &'static str, sequence: u64) -> Delivery {
        faults.delivery(Outgoing { topic, sequence, capture_ns: 1000 + sequence })
    }

    #[test]
    fn messages_of_a_topic_are_counted_and_the_first_fault_has_them() {
        let text = "[[fault]]\nsent = 'plan'\nnth = 2\naction = { kind = 'lose' }\n\
                    [[fault]]\nat_s = 1\naction = { kind = 'drop' }\n\
                    [[fault]]\nsent = 'plan'\nevery = true\naction = { kind = 'duplicate' }\n\
                    [[fault]]\nsent = 'scene'\naction = { kind = 'delay', messages = 3 }\n";
        let faults = faults(text, 1);
        let three = std::num::NonZeroU32::new(3).unwrap();
        assert_eq!(send(&faults, "scene", 0), Delivery::Late(three));
        let plans = [1, 2, 3].map(|sequence| send(&faults, "plan", sequence));
        assert_eq!(plans, [Delivery::Twice, Delivery::Lost, Delivery::Twice]);
        assert_eq!(send(&faults, "scene", 1), Delivery::Sent);
        let told = faults.records().into_iter().map(|r| (r.at_ns, r.fault, r.happened, r.said));
        let told: Vec<_> = told.collect();
        assert_eq!(told.len(), 5, "{told:?}");
        assert_eq!(told[0], (0, 3, true, "message 1 on scene waits for 3 later ones".to_owned()));
        assert_eq!(told[2], (2, 0, true, "message 2 on plan is lost".to_owned()));
        let refused = "message 2 on plan is sent twice: another fault has it".to_owned();
        assert_eq!(told[3], (2, 2, false, refused));
    }

    #[tokio::test]
    async fn an_actor_is_told_what_to_do_about_its_message() {
        let text = "[[fault]]\nmessage = 'planner'\nnth = 2\naction = { kind = 'deadline_missed' }\n\
                    [[fault]]\nmessage = 'goal_parser'\naction = { kind = 'source_down' }\n";
        let faults = faults(text, 1);
        let mut handled = Vec::new();
        for actor in ["planner", "planner", "planner", "goal_parser", "camera"] {
            handled.push(faults.message(actor).await);
        }
        use Handling::{DeadlineMissed, SourceDown, Usual};
        assert_eq!(handled, [Usual, DeadlineMissed, Usual, SourceDown, Usual]);
        assert_eq!(faults.records().len(), 2);
    }

    #[test]
    fn the_seed_draws_which_messages_are_lost() {
        let text = "[[fault]]\nsent = 'plan'\nevery = true\nprobability = 0.4\naction = { kind = 'lose' }\n";
        let lost = |seed| {
            let faults = faults(text, seed);
            (0..200).map(|n| send(&faults, "plan", n) == Delivery::Lost).collect::<Vec<bool>>()
        };
        let n_lost = lost(1).iter().filter(|is_lost| **is_lost).count();
        assert!((50..110).contains(&n_lost), "{n_lost}");
        assert_eq!(lost(1), lost(1));
        assert_ne!(lost(1), lost(2));
    }
}
