//! Whether a state that was read is right, doubtful or wrong; objects count as facts do.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::logic::Truth;
use crate::pddl::{Atom, Name};
use crate::perception::model::{ObjectBox, Perception};
use crate::perception::{GroundedImage, missing_fixtures};
use crate::scene::Place;

/// A detection that overlaps its true box by less stands for something else.
const IOU_FOUND_MIN: f64 = 0.3;

/// An object may be hidden behind what covers at least this share of its box.
const HIDDEN_MIN: f64 = 0.3;

/// What a state that was read is worth, best first.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Worth {
    /// Every object and every observed fact is right.
    Right,
    /// Nothing that is said is wrong, and some facts or objects are said to be unknown.
    Unknown,
    /// An object or a fact is wrong or missing; an anomaly or an unknown fact warns of it.
    Doubted,
    /// An object or a fact is wrong or missing, and nothing warns.
    Silent,
}

/// A state with what is wrong with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StateJudgement {
    /// What it is worth.
    pub worth: Worth,
    /// What is wrong, missing or unknown, in words; empty where it is right.
    pub faults: Vec<String>,
}

/// Compares what was read with what is there. `facts` are the true observed facts.
pub fn judge(
    read: &GroundedImage,
    objects: &[ObjectBox],
    facts: &BTreeSet<Atom>,
    perception: &Perception,
) -> StateJudgement {
    let observed = |name: &Name| perception.observed_predicates().any(|p| p == name);
    let same = matched(&read.named.boxes, objects);
    let mut faults: Vec<String> = Vec::new();
    for detection in read.named.boxes.iter().filter(|d| !same.contains_key(&d.name)) {
        faults.push(format!("{} is not there", detection.name));
    }
    let found: BTreeSet<&Name> = same.values().copied().collect();
    let mut unknown = Vec::new();
    for object in objects.iter().filter(|o| !found.contains(&o.name)) {
        if is_told(object, read, perception) {
            unknown.push(format!("{} may be hidden", object.name));
        } else {
            faults.push(format!("{} is not found", object.name));
        }
    }
    let mut said = BTreeSet::new();
    for judged in read.state.grounding.judged.iter().filter(|j| observed(&j.atom.predicate)) {
        let named = |name: &Name| same.get(name).map(|object| (*object).clone());
        let args: Option<Vec<Name>> = judged.atom.args.iter().map(named).collect();
        let Some(args) = args else { continue }; // told above
        let atom = Atom { predicate: judged.atom.predicate.clone(), args };
        match judged.truth {
            Truth::Unknown => unknown.push(format!("{atom} is unknown")),
            Truth::True if !facts.contains(&atom) => faults.push(format!("{atom} is wrong")),
            Truth::True | Truth::False => {}
        }
        if judged.truth != Truth::False {
            said.insert(atom);
        }
    }
    for atom in facts.iter().filter(|atom| !said.contains(*atom)) {
        if atom.args.iter().all(|name| found.contains(name)) {
            faults.push(format!("{atom} is missing"));
        }
    }
    let warned = !unknown.is_empty() || !read.state.grounding.anomalies.is_empty();
    let worth = match (faults.is_empty(), unknown.is_empty(), warned) {
        (true, true, _) => Worth::Right,
        (true, false, _) => Worth::Unknown,
        (false, _, true) => Worth::Doubted,
        (false, _, false) => Worth::Silent,
    };
    faults.extend(unknown);
    StateJudgement { worth, faults }
}

/// Whether the reading says that an object like this may be missing: a place that may hide one is
/// where it is, or there should be more of its type.
fn is_told(object: &ObjectBox, read: &GroundedImage, perception: &Perception) -> bool {
    let hides = |place: &Place| {
        let common = place.pixel_box().intersection(&object.pixel_box).area();
        place.may_hide && common >= HIDDEN_MIN * object.pixel_box.area()
    };
    let mut places = read.state.grounding.anomalies.iter().filter_map(|a| a.place);
    let mut missing = missing_fixtures(perception, &read.named.boxes);
    places.any(|place| hides(&place)) || missing.any(|(spec, _)| spec.name == object.type_name)
}

/// Detected names to true ones: each true box with the detection of its type that overlaps it most.
fn matched<'a>(detected: &[ObjectBox], objects: &'a [ObjectBox]) -> BTreeMap<Name, &'a Name> {
    let mut same: BTreeMap<Name, &Name> = BTreeMap::new();
    for object in objects {
        let iou = |d: &&ObjectBox| d.pixel_box.iou(&object.pixel_box);
        let free = detected.iter().filter(|d| {
            d.type_name == object.type_name
                && !same.contains_key(&d.name)
                && iou(d) >= IOU_FOUND_MIN
        });
        if let Some(best) = free.max_by(|a, b| iou(a).total_cmp(&iou(b))) {
            same.insert(best.name.clone(), &object.name);
        }
    }
    same
}
