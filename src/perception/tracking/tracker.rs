//! Names are identities: which detection is which known object.

use std::collections::BTreeSet;

use super::BeliefConfig;
use super::free_space::{Sight, sight};
use super::occlusion::is_covered;
use super::streak::{Pace, Streak};
use crate::geometry::{Aabb, PixelBox};
use crate::pddl::Name;
use crate::perception::model::{ObjectBox, Perception};
use crate::perception::{Detection, FrameView, name_detections, unused_name};

/// Weight of a new measurement of an object that rests.
const SMOOTHING: f64 = 0.3;
/// A measured middle further away than this has moved; nearer, it is smoothed. Metres.
const MOVED_M: f64 = 0.01;
/// Least overlap (intersection over union) by which a new detection goes on with the candidate of the last frame.
const SAME_IOU_MIN: f64 = 0.3;
/// Least share of an unseen object's place that other objects must fill to have taken it.
const REPLACED_SHARE_MIN: f64 = 0.5;

/// An object that is known by name.
#[derive(Debug, Clone)]
pub(super) struct Track {
    /// Who it is, and where it was seen last.
    pub(super) object: ObjectBox,
    label: Name,
    pub(super) score: f32,
    pub(super) seen_ns: u64,
    /// Whether this frame shows it whole.
    pub(super) is_in_sight: bool,
    /// For how long its place has been seen without it.
    absent: Option<Streak>,
    /// For how long it has been seen again, while it is gone.
    returning: Option<Streak>,
    /// What a phrase of the goal calls it, and for how long.
    phrase_votes: Option<(Name, Streak)>,
    /// What cameras do not agree on, in the frame that it was seen in last.
    pub(super) contradiction: Option<String>,
    /// Whether its name is a phrase of the goal: then it keeps it.
    is_phrase: bool,
}

/// Something that was seen, but not for long enough to be an object.
#[derive(Debug, Clone)]
struct Candidate {
    detection: Detection,
    seen: Streak,
}

/// All objects that have been seen in this episode.
#[derive(Debug, Clone, Default)]
pub(super) struct Tracker {
    pub(super) tracks: Vec<Track>,
    candidates: Vec<Candidate>,
}

/// An object that goes by the goal's phrase from now on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Renamed {
    pub(super) from: Name,
    pub(super) to: Name,
}

impl Tracker {
    /// Takes in one frame.
    pub(super) fn update(
        &mut self,
        detections: Vec<Detection>,
        occluders: &[PixelBox],
        (capture_ns, pace): (u64, Pace),
        (perception, config): (&Perception, &BeliefConfig),
    ) {
        let mut free: Vec<Option<Detection>> = detections.into_iter().map(Some).collect();
        let pairs = self.pairs(&free);
        let mut matched = vec![None; self.tracks.len()];
        for (_, track_idx, detection_idx) in pairs {
            if matched[track_idx].is_none() && free[detection_idx].is_some() {
                matched[track_idx] = free[detection_idx].take();
            }
        }
        for (track, detection) in self.tracks.iter_mut().zip(matched) {
            match detection {
                Some(detection)
                    if !track.is_hidden_by(&detection, occluders) && track.is_back(pace) =>
                {
                    track.see(detection, capture_ns, pace);
                }
                Some(_) => track.is_in_sight = false,
                None => (track.is_in_sight, track.returning) = (false, None),
            }
        }
        let born = free.into_iter().flatten();
        let born = born.filter(|d| d.is_whole_elsewhere || !is_covered(&d.pixel_box, occluders));
        self.propose(born.collect(), pace);
        self.promote((capture_ns, pace), perception, config);
    }

    /// Looks for objects that were not found at the places where they were seen last: a place that is
    /// empty, or that another object has taken, is not theirs any more. Fixtures, of which all are
    /// listed, stay where they are, and so does what is `held`: it has no place of its own.
    pub(super) fn look_for_unseen(
        &mut self,
        frames: &[FrameView<'_>],
        held: Option<&Name>,
        perception: &Perception,
        pace: Pace,
    ) {
        let is_fixture = |type_name: &Name| {
            perception.type_spec(type_name).is_some_and(|spec| !spec.naming.list.is_empty())
        };
        let seen: Vec<Aabb> = self.tracks.iter().filter_map(Track::volume_in_sight).collect();
        for track in &mut self.tracks {
            let place = track.object.volume.filter(|_| !track.is_in_sight);
            let place = place.filter(|_| held != Some(&track.object.name));
            let Some(place) = place.filter(|_| !is_fixture(&track.object.type_name)) else {
                track.absent = None;
                continue;
            };
            let is_replaced = || {
                let shares = seen.iter().map(|other| place.share_within(other));
                shares.sum::<f64>() >= REPLACED_SHARE_MIN
            };
            match sight(&place, frames) {
                Sight::Empty => track.miss(pace),
                Sight::Taken if is_replaced() => track.miss(pace),
                // By something: what is gone is back only once it is seen.
                Sight::Taken if track.is_gone(pace) => {}
                Sight::Taken => track.absent = None,
                // Nothing new is known of the place.
                Sight::Hidden => {}
            }
        }
    }

    /// Gives objects the names by which phrases of the goal have called them for long enough. Names are identities: an object is renamed at most once, and never to a
    /// name that is taken.
    pub(super) fn rename(&mut self, pace: Pace) -> Vec<Renamed> {
        let mut renamed = Vec::new();
        for idx in 0..self.tracks.len() {
            let track = &self.tracks[idx];
            let Some((to, streak)) = track.phrase_votes.clone() else { continue };
            let is_free = self.tracks.iter().all(|other| other.object.name != to);
            if track.is_phrase || !streak.is_confirmed(pace) || !is_free {
                continue;
            }
            let track = &mut self.tracks[idx];
            let from = std::mem::replace(&mut track.object.name, to.clone());
            track.is_phrase = true;
            renamed.push(Renamed { from, to });
        }
        self.tracks.sort_by(|a, b| a.object.name.cmp(&b.object.name));
        renamed
    }

    /// All possible matches of tracks with detections, best first.
    fn pairs(&self, detections: &[Option<Detection>]) -> Vec<(f64, usize, usize)> {
        let mut pairs = Vec::new();
        for (track_idx, track) in self.tracks.iter().enumerate() {
            for (detection_idx, detection) in detections.iter().enumerate() {
                let Some(detection) = detection else { continue };
                if detection.type_name == track.object.type_name && detection.label == track.label {
                    pairs.push((track.distance(detection), track_idx, detection_idx));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        pairs
    }

    /// Detections that fit no track become candidates, or confirm those of the last frame.
    fn propose(&mut self, born: Vec<Detection>, pace: Pace) {
        let mut before = std::mem::take(&mut self.candidates);
        for detection in born {
            let goes_on = before.iter().position(|c| {
                c.detection.type_name == detection.type_name
                    && c.detection.label == detection.label
                    && c.detection.pixel_box.iou(&detection.pixel_box) >= SAME_IOU_MIN
            });
            // Taken out, so that of two pieces of one only one goes on.
            let mut seen = goes_on.map(|at| before.swap_remove(at).seen);
            if let Some(seen) = &mut seen {
                seen.go_on(pace);
            }
            self.candidates.push(Candidate { detection, seen: seen.unwrap_or_default() });
        }
    }

    /// Candidates that were seen often enough become objects, with a name.
    fn promote(
        &mut self,
        (capture_ns, pace): (u64, Pace),
        perception: &Perception,
        config: &BeliefConfig,
    ) {
        let waits = self.waiting_types(perception, config, pace);
        let (ripe, unripe): (Vec<_>, Vec<_>) = std::mem::take(&mut self.candidates)
            .into_iter()
            .partition(|c| c.seen.is_confirmed(pace) && !waits.contains(&c.detection.type_name));
        self.candidates = unripe;
        let detections: Vec<Detection> = ripe.iter().map(|c| c.detection.clone()).collect();
        let names = name_detections(perception, &detections);
        for (Candidate { detection, .. }, name) in ripe.into_iter().zip(names) {
            let phrase = detection
                .phrase
                .clone()
                .filter(|p| self.tracks.iter().all(|t| t.object.name != *p));
            let (is_phrase, name) = (phrase.is_some(), phrase.unwrap_or(name));
            let name =
                unused_name(&name, &|name| self.tracks.iter().any(|t| t.object.name == *name));
            self.tracks.push(Track {
                object: detection.object(name),
                label: detection.label,
                score: detection.score,
                seen_ns: capture_ns,
                is_in_sight: true,
                absent: None,
                returning: None,
                phrase_votes: None,
                contradiction: detection.contradiction,
                is_phrase,
            });
        }
        self.tracks.sort_by(|a, b| a.object.name.cmp(&b.object.name));
    }

    /// Types whose names say their order, while not all of them are in sight: "left" has a meaning
    /// only beside "right". They wait for at most `hidden_s_max`.
    fn waiting_types(
        &self,
        perception: &Perception,
        config: &BeliefConfig,
        pace: Pace,
    ) -> BTreeSet<Name> {
        let waits = perception.types.iter().filter(|spec| {
            let of_type = self.candidates.iter().filter(|c| c.detection.type_name == spec.name);
            let ripe = of_type.clone().filter(|c| c.seen.is_confirmed(pace)).count();
            let known = self.tracks.iter().any(|t| t.object.type_name == spec.name);
            let waited_ns = of_type.map(|c| c.seen.ns()).max().unwrap_or(0);
            let patience = waited_ns < config.hidden_ns_max();
            !spec.naming.list.is_empty() && !known && ripe != spec.naming.list.len() && patience
        });
        waits.map(|spec| spec.name.clone()).collect()
    }
}

impl Track {
    /// Whether it has been seen to be where it was no more, and is seen nowhere else.
    pub(super) fn is_gone(&self, pace: Pace) -> bool {
        self.absent.is_some_and(|streak| streak.is_confirmed(pace))
    }

    /// Whether a detection shows it: what is gone comes back as what is new comes, once it has been seen for
    /// long enough.
    fn is_back(&mut self, pace: Pace) -> bool {
        if !self.is_gone(pace) {
            return true;
        }
        match &mut self.returning {
            Some(streak) => streak.go_on(pace),
            None => self.returning = Some(Streak::default()),
        }
        self.returning.is_some_and(|streak| streak.is_confirmed(pace))
    }

    /// For how long it has not been seen whole at the time of a frame, nanoseconds.
    pub(super) fn unseen_ns(&self, capture_ns: u64) -> u64 {
        if self.is_in_sight { 0 } else { capture_ns.saturating_sub(self.seen_ns) }
    }

    /// This frame shows its place without it.
    fn miss(&mut self, pace: Pace) {
        match &mut self.absent {
            Some(streak) => streak.go_on(pace),
            None => self.absent = Some(Streak::default()),
        }
    }

    /// Whether a detection may show it where it was seen last.
    pub(super) fn is_where(&self, detection: &Detection) -> bool {
        detection.type_name == self.object.type_name
            && detection.label == self.label
            && detection.pixel_box.iou(&self.object.pixel_box) >= SAME_IOU_MIN
    }

    fn volume_in_sight(&self) -> Option<Aabb> {
        self.object.volume.filter(|_| self.is_in_sight)
    }

    /// How unlike a detection is to this object: the distance of the middles and the difference
    /// of the sizes, in pixels.
    fn distance(&self, detection: &Detection) -> f64 {
        let (a, b) = (&self.object.pixel_box, &detection.pixel_box);
        let ((ax, ay), (bx, by)) = (a.centre(), b.centre());
        let size = (a.width() - b.width()).hypot(a.height() - b.height());
        (ax - bx).hypot(ay - by) + size
    }

    /// Whether a detection may show a part of the object only.
    fn is_hidden_by(&self, detection: &Detection, occluders: &[PixelBox]) -> bool {
        let (seen, known) = (&detection.pixel_box, &self.object.pixel_box);
        let in_place = seen.intersection(known).area() > 0.0;
        !detection.is_whole_elsewhere
            && (is_covered(seen, occluders) || (in_place && is_covered(known, occluders)))
    }

    fn see(&mut self, detection: Detection, capture_ns: u64, pace: Pace) {
        let known = self.object.volume;
        self.object = detection.object(self.object.name.clone());
        let measured = match (known, detection.measured) {
            (Some(known), Some(measured)) => measured.completed(&known),
            (None, Some(measured)) => Some(measured.volume),
            (_, None) => None,
        };
        self.object.volume = match (known, measured) {
            (Some(old), Some(new)) => Some(smooth(old, new)),
            (old, new) => new.or(old),
        };
        self.score = detection.score;
        self.seen_ns = capture_ns;
        (self.is_in_sight, self.absent, self.returning) = (true, None, None);
        self.contradiction = detection.contradiction;
        self.phrase_votes = detection.phrase.map(|phrase| match self.phrase_votes.take() {
            Some((before, mut streak)) if before == phrase => {
                streak.go_on(pace);
                (phrase, streak)
            }
            Some(_) | None => (phrase, Streak::default()),
        });
    }
}

/// Averages measurements of an object at rest; follows one that has moved.
fn smooth(old: Aabb, new: Aabb) -> Aabb {
    let moved = (old.centre - new.centre).norm() > MOVED_M;
    let grown = old.extent.iter().zip(new.extent).any(|(a, b)| (a - b).abs() > MOVED_M);
    if moved || grown {
        return new;
    }
    let mix = |a: f64, b: f64| a + SMOOTHING * (b - a);
    Aabb {
        centre: old.centre + (new.centre - old.centre) * SMOOTHING,
        extent: [
            mix(old.extent[0], new.extent[0]),
            mix(old.extent[1], new.extent[1]),
            mix(old.extent[2], new.extent[2]),
        ],
    }
}
