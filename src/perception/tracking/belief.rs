//! The one belief: which facts planner and executor rely on, and which anomalies count.
//!
//! A changed fact counts once the frames that show its objects have said so for `confirm_s`, or at
//! once when a step that has just ended predicts it. While a step runs, what it is about to change and whatever
//! is said of the object that it carries keep their values. An anomaly counts as long as it has been
//! there in each frame of the last `confirm_s`.

use std::collections::{BTreeMap, BTreeSet};

use super::streak::{Pace, Streak};
use crate::logic::Truth;
use crate::messages::Effects;
use crate::pddl::{Atom, Name};
use crate::perception::grounders::Basis;
use crate::scene::{Anomaly, Origin};

/// What is believed of one observed atom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Entry {
    pub(super) confirmed: Truth,
    pub(super) raw: Truth,
    pub(super) origin: Origin,
    pub(super) confidence: f32,
    candidate: Truth,
    agreeing: Option<Streak>,
}

/// What one frame says of an atom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reading {
    pub(super) truth: Truth,
    pub(super) basis: Basis,
    pub(super) confidence: f32,
}

impl Reading {
    fn origin(self) -> Origin {
        match self.basis {
            Basis::Observed => Origin::Observed,
            Basis::Constrained => Origin::Constrained,
        }
    }
}

/// Places that overlap by at least this share are one.
const SAME_PLACE_IOU_MIN: f64 = 0.5;

/// Beliefs about all observed atoms that were ever judged.
#[derive(Debug, Clone, Default)]
pub(super) struct Belief {
    pub(super) entries: BTreeMap<Atom, Entry>,
    /// For how long each anomaly has been there.
    anomalies: BTreeMap<Anomaly, Streak>,
}

/// What holds facts back in this frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Latched {
    /// Atoms that the running step is about to change.
    pub(super) atoms: BTreeSet<Atom>,
    /// The object that it carries.
    pub(super) carried: Option<Name>,
    /// The object in the gripper: nothing comes to be true of it and one that is lost.
    pub(super) held: Option<Name>,
}

impl Latched {
    pub(super) fn holds_back(&self, atom: &Atom) -> bool {
        self.atoms.contains(atom)
            || self.carried.as_ref().is_some_and(|carried| atom.args.contains(carried))
    }
}

impl Latched {
    fn is_of_held(&self, atom: &Atom) -> bool {
        self.held.as_ref().is_some_and(|held| atom.args.contains(held))
    }
}

impl Belief {
    /// Takes in one frame: the judged atoms, what is latched, which objects are lost from sight for
    /// good, and what a step that has just ended predicts.
    ///
    /// Returns how many facts are seen otherwise than believed and are not confirmed yet.
    pub(super) fn update(
        &mut self,
        readings: &BTreeMap<Atom, Reading>,
        latched: &Latched,
        lost: &BTreeSet<Name>,
        predicted: Option<&Effects>,
        pace: Pace,
    ) -> u32 {
        for atom in readings.keys() {
            self.entries.entry(atom.clone()).or_insert(Entry {
                confirmed: Truth::Unknown,
                raw: Truth::Unknown,
                origin: Origin::Observed,
                confidence: 0.0,
                candidate: Truth::Unknown,
                agreeing: None,
            });
        }
        let mut unsettled = 0;
        for (atom, entry) in &mut self.entries {
            let reading = readings.get(atom);
            let expected = predicted.and_then(|effects| effects.truth(atom));
            entry.read(reading, pace);
            if latched.holds_back(atom) {
                continue;
            }
            match (reading, expected) {
                (Some(reading), Some(expected)) if reading.truth == expected => {
                    entry.believe(expected, reading.origin());
                }
                (None, Some(expected)) => entry.believe(expected, Origin::Predicted),
                (Some(reading), _) => {
                    if entry.agreeing.is_some_and(|streak| streak.is_confirmed(pace)) {
                        entry.believe(entry.candidate, reading.origin());
                    }
                    unsettled += u32::from(entry.confirmed != entry.candidate);
                }
                (None, None)
                    if atom.args.iter().any(|arg| lost.contains(arg))
                        && !(entry.confirmed.is_false() && latched.is_of_held(atom)) =>
                {
                    entry.believe(Truth::Unknown, Origin::Remembered);
                }
                (None, None) => {
                    if matches!(entry.origin, Origin::Observed | Origin::Constrained) {
                        entry.origin = Origin::Remembered;
                    }
                }
            }
        }
        unsettled
    }

    /// Takes in what one frame cannot explain; returns what counts.
    pub(super) fn anomaly(&mut self, anomalies: Vec<Anomaly>, pace: Pace) -> Vec<Anomaly> {
        let before = std::mem::take(&mut self.anomalies);
        for mut anomaly in anomalies {
            // A place is the same where it moves a little: it keeps its first edges.
            let is_same = |known: &&Anomaly| {
                let places = known.place.zip(anomaly.place);
                known.objects == anomaly.objects
                    && known.reason == anomaly.reason
                    && places.is_some_and(|(a, b)| {
                        a.may_hide == b.may_hide
                            && a.pixel_box().iou(&b.pixel_box()) >= SAME_PLACE_IOU_MIN
                    })
            };
            if let Some(known) = before.keys().find(is_same) {
                anomaly.place = known.place;
            }
            let mut streak = before.get(&anomaly).copied();
            if let Some(streak) = &mut streak {
                streak.go_on(pace);
            }
            self.anomalies.insert(anomaly, streak.unwrap_or_default());
        }
        let confirmed = self.anomalies.iter().filter(|(_, streak)| streak.is_confirmed(pace));
        confirmed.map(|(anomaly, _)| anomaly.clone()).collect()
    }
}

impl Belief {
    /// Atoms that are believed because a step that has ended should have made them so, and nobody has seen
    /// it yet.
    pub(super) fn predicted(&self) -> impl Iterator<Item = &Atom> {
        let predicted = self.entries.iter().filter(|(_, e)| e.origin == Origin::Predicted);
        predicted.map(|(atom, _)| atom)
    }

    /// What holds of an object that was taken without being asked for need not hold any more.
    pub(super) fn doubt_relations(&mut self, taken: &Name) {
        let of_it = self.entries.iter_mut().filter(|(atom, _)| atom.args.contains(taken));
        for (_, entry) in of_it.filter(|(_, entry)| entry.confirmed.is_true()) {
            entry.believe(Truth::Unknown, Origin::Remembered);
        }
    }

    /// Everything that is believed of one object is believed of it under its new name.
    pub(super) fn rename(&mut self, from: &Name, to: &Name) {
        let renamed = |mut atom: Atom| {
            atom.args.iter_mut().filter(|arg| *arg == from).for_each(|arg| arg.clone_from(to));
            atom
        };
        let entries = std::mem::take(&mut self.entries);
        self.entries = entries.into_iter().map(|(atom, entry)| (renamed(atom), entry)).collect();
    }
}

impl Entry {
    /// Counts how long the frames have said the same.
    fn read(&mut self, reading: Option<&Reading>, pace: Pace) {
        let Some(reading) = reading else {
            // A frame that does not show it says nothing against what the last ones said.
            self.raw = Truth::Unknown;
            return;
        };
        match &mut self.agreeing {
            Some(streak) if self.candidate == reading.truth => streak.go_on(pace),
            _ => self.agreeing = Some(Streak::default()),
        }
        self.raw = reading.truth;
        self.candidate = reading.truth;
        self.confidence = reading.confidence;
    }

    fn believe(&mut self, truth: Truth, origin: Origin) {
        self.confirmed = truth;
        self.origin = origin;
    }
}
