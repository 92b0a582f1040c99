//! When the faults of a run file happen.

use super::draws::{Purpose, draws};
use super::{FaultAction, SensingFault};
use crate::hardware::{ANY, FaultConfig, is_drawn};
use crate::pddl::Step;

/// The faults of a run, and how often each has had its occasion.
#[derive(Debug, Clone, Default)]
pub(in crate::hardware::sim) struct FaultSchedule {
    entries: Vec<Entry>,
    seed: u64,
}

/// A fault that is due.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::hardware::sim) struct Due {
    pub(super) tag: Tag,
    pub(super) action: FaultAction,
    /// The camera that has taken the frame that it waited for.
    pub(super) camera: Option<String>,
}

/// Which occurrence of which fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::hardware::sim) struct Tag {
    /// Its place in the run file, from 0.
    pub(super) fault: usize,
    /// Counted from 1.
    pub(super) occurrence: u64,
    /// The kind of its action.
    pub(super) kind: String,
}

#[derive(Debug, Clone)]
struct Entry {
    /// Its place in the run file.
    fault: usize,
    action: FaultAction,
    kind: String,
    trigger: Trigger,
    /// At which occasion; at every one without it.
    nth: Option<u64>,
    after_ns: u64,
    probability: f64,
    n_occasions: u64,
    waiting: Vec<Waiting>,
}

/// What waits for its time.
#[derive(Debug, Clone)]
struct Waiting {
    at_ns: u64,
    occurrence: u64,
    camera: Option<String>,
}

#[derive(Debug, Clone)]
enum Trigger {
    /// Nothing more: it waits for its time from the start.
    Time,
    /// The start of a step that fits.
    During(String),
    /// The end of a step that fits.
    After(String),
    /// The gripper takes an object of this name.
    Holding(String),
    /// A camera of this name takes a frame.
    Frame(String),
}

/// What a trigger may wait for.
#[derive(Debug, Clone, Copy)]
pub(in crate::hardware::sim) enum Occasion<'a> {
    /// A step has started.
    Started(&'a Step),
    /// A step has ended.
    Ended(&'a Step),
    /// The gripper has taken an object.
    Taken(&'a str),
    /// A camera takes a frame.
    Frame(&'a str),
}

impl Occasion<'_> {
    fn camera(self) -> Option<String> {
        match self {
            Self::Frame(camera) => Some(camera.to_owned()),
            Self::Started(_) | Self::Ended(_) | Self::Taken(_) => None,
        }
    }
}

impl FaultSchedule {
    /// The schedule of a run file.
    pub(in crate::hardware::sim) fn new(
        faults: &[FaultConfig],
        seed: u64,
    ) -> Result<Self, toml::de::Error> {
        let entry = |(fault, config): (usize, &FaultConfig)| Entry::new(fault, config, seed);
        let entries = faults.iter().enumerate().filter(|(_, fault)| !fault.is_system()).map(entry);
        Ok(Self { entries: entries.collect::<Result<_, _>>()?, seed })
    }

    /// Takes note that something has happened that faults may wait for.
    pub(in crate::hardware::sim) fn note(&mut self, occasion: Occasion<'_>, now_ns: u64) {
        for entry in &mut self.entries {
            if !entry.trigger.fits(occasion) {
                continue;
            }
            entry.n_occasions += 1;
            let occurrence = entry.n_occasions;
            if entry.nth.is_none_or(|nth| nth == occurrence) {
                let (at_ns, camera) = (now_ns + entry.after_ns, occasion.camera());
                entry.decide(Waiting { at_ns, occurrence, camera }, self.seed);
            }
        }
    }

    /// Takes out what is due.
    pub(in crate::hardware::sim) fn due(&mut self, now_ns: u64) -> Vec<Due> {
        let mut due = Vec::new();
        for entry in &mut self.entries {
            let fault = entry.fault;
            for waiting in entry.waiting.extract_if(.., |waiting| waiting.at_ns <= now_ns) {
                let Waiting { occurrence, camera, .. } = waiting;
                let tag = Tag { fault, occurrence, kind: entry.kind.clone() };
                due.push(Due { tag, action: entry.action.clone(), camera });
            }
        }
        due
    }

    /// Whether any fault waits for frames, or is done to them.
    pub(in crate::hardware::sim) fn concerns_frames(&self) -> bool {
        let mut entries = self.entries.iter();
        entries.any(|entry| matches!(entry.trigger, Trigger::Frame(_)))
            || self.sensing().next().is_some()
    }

    /// The faults that are done to frames.
    pub(in crate::hardware::sim) fn sensing(&self) -> impl Iterator<Item = &SensingFault> {
        self.entries.iter().filter_map(|entry| match &entry.action {
            FaultAction::Sensing(fault) => Some(fault),
            FaultAction::World(_) | FaultAction::Acting(_) => None,
        })
    }

    /// The seed that everything is drawn from.
    pub(in crate::hardware::sim) fn seed(&self) -> u64 {
        self.seed
    }
}

impl Entry {
    fn new(fault: usize, config: &FaultConfig, seed: u64) -> Result<Self, toml::de::Error> {
        let nanoseconds = |seconds: f64| (seconds.max(0.0) * 1e9) as u64;
        let kind = config.action.get("kind").and_then(toml::Value::as_str).unwrap_or_default();
        let trigger = match (&config.during, &config.after, &config.holding, &config.frame) {
            (Some(pattern), ..) => Trigger::During(pattern.clone()),
            (None, Some(pattern), ..) => Trigger::After(pattern.clone()),
            (None, None, Some(object), _) => Trigger::Holding(object.clone()),
            (None, None, None, Some(camera)) => Trigger::Frame(camera.clone()),
            (None, None, None, None) => Trigger::Time,
        };
        let is_every = config.every == Some(true);
        let mut entry = Self {
            fault,
            action: FaultAction::read(&config.action)?,
            kind: kind.to_owned(),
            trigger,
            nth: (!is_every).then(|| u64::from(config.nth.unwrap_or(1))),
            after_ns: nanoseconds(config.after_s.unwrap_or(0.0)),
            probability: config.probability.unwrap_or(1.0),
            n_occasions: 0,
            waiting: Vec::new(),
        };
        if let Some(at_s) = config.at_s {
            let [low, high] = at_s.bounds_s();
            let at_s = draws(seed, (fault, 1), Purpose::Time).between(low, high);
            let waiting = Waiting { at_ns: nanoseconds(at_s), occurrence: 1, camera: None };
            entry.decide(waiting, seed);
        }
        Ok(entry)
    }

    /// Draws whether an occurrence happens.
    fn decide(&mut self, waiting: Waiting, seed: u64) {
        if is_drawn(seed, (self.fault, waiting.occurrence), self.probability) {
            self.waiting.push(waiting);
        }
    }
}

impl Trigger {
    fn fits(&self, occasion: Occasion<'_>) -> bool {
        match (self, occasion) {
            (Self::During(pattern), Occasion::Started(step))
            | (Self::After(pattern), Occasion::Ended(step)) => {
                [ANY, step.action.as_str()].contains(&pattern.as_str())
                    || *pattern == step.to_string()
            }
            (Self::Holding(name), Occasion::Taken(taken))
            | (Self::Frame(name), Occasion::Frame(taken)) => name == ANY || name == taken,
            (
                Self::Time | Self::During(_) | Self::After(_) | Self::Holding(_) | Self::Frame(_),
                _,
            ) => false,
        }
    }
}
