//! All views as one list of detections.

use std::cmp::{Ordering, Reverse};

use super::associate::{Cluster, associate};
use super::contradict::{conflicting_labels, sees_through};
use super::view::{CameraView, Place, in_image};
use crate::perception::Detection;

/// The objects that several cameras see, as one list of detections in the image of the first.
///
/// An object that one camera sees only is kept; one that the robot hides from `main` and another
/// camera sees whole is marked so. What `main` sees stands first, in its order, then the rest by
/// type, label and place. Without other cameras nothing changes.
///
/// Views that see through the place of an object, or that tell different labels of one body, leave
/// a [`Detection::contradiction`].
pub fn fuse(main: CameraView<'_>, mut others: Vec<CameraView<'_>>) -> Vec<Detection> {
    if others.is_empty() {
        return main.detections;
    }
    others.sort_by(|a, b| a.camera.cmp(b.camera));
    let views: Vec<CameraView<'_>> = std::iter::once(main).chain(others).collect();
    let mut clusters = associate(&views);
    let conflicts = conflicting_labels(&views, &mut clusters);
    let mut fused: Vec<Fused> =
        clusters.iter().filter_map(|cluster| Fused::of(&views, cluster)).collect();
    for fused in &mut fused {
        let said = conflicts.iter().find(|(place, _)| fused.members.contains(place));
        fused.detection.contradiction = said.map(|(_, reason)| reason.clone());
        if fused.detection.contradiction.is_none() {
            fused.detection.contradiction = fused
                .detection
                .measured
                .and_then(|measured| sees_through(&views, &fused.members, &measured));
        }
    }
    fused.sort_by(Fused::order);
    fused.into_iter().map(|fused| fused.detection).collect()
}

/// An object as all views together show it.
struct Fused {
    /// Its detections, at most one for each view.
    members: Vec<Place>,
    detection: Detection,
}

impl Fused {
    /// `None` for what `main` does not see and what cannot be in its image: behind it, or without a
    /// place in the world.
    fn of(views: &[CameraView<'_>], cluster: &Cluster) -> Option<Self> {
        let of = |&(view, idx): &Place| &views[view].detections[idx];
        let members = cluster.members.clone();
        let is_free = |place: &&Place| !views[place.0].is_covered(of(place));
        let free: Vec<&Place> = members.iter().filter(is_free).collect();
        let elsewhere = free.iter().any(|place| place.0 != 0);
        let own = members.iter().find(|place| place.0 == 0);
        let own_free = own.filter(|own| free.contains(own));
        if !elsewhere {
            return Some(Self { detection: of(own?).clone(), members });
        }
        let best = free.into_iter().filter(|place| of(place).measured.is_some());
        let best = of(best.min_by_key(|place| rank(of(place), place.0))?);
        let measured = best.measured;
        let mut detection = if let Some(own) = own_free {
            of(own).clone()
        } else {
            let pixel_box = in_image(&measured?, views[0].frame.camera?)?;
            Detection { pixel_box, mask: Vec::new(), ..best.clone() }
        };
        let phrases = members.iter().find_map(|place| of(place).phrase.clone());
        let scores = members.iter().map(|place| of(place).score);
        detection.score = scores.fold(detection.score, f32::max);
        detection.phrase = detection.phrase.take().or(phrases);
        detection.measured = measured;
        detection.is_whole_elsewhere = true;
        Some(Self { members, detection })
    }

    /// What `main` sees in its order, then the rest by what they are and where.
    fn order(&self, other: &Self) -> Ordering {
        let own = |fused: &Self| {
            let own = fused.members.iter().find(|place| place.0 == 0);
            own.map_or(usize::MAX, |place| place.1)
        };
        let (a, b) = (&self.detection, &other.detection);
        let place = |d: &Detection| d.measured.map(|m| m.volume.centre.coords).unwrap_or_default();
        let (p, q) = (place(a), place(b));
        own(self)
            .cmp(&own(other))
            .then_with(|| (&a.type_name, &a.label).cmp(&(&b.type_name, &b.label)))
            .then(p.x.total_cmp(&q.x))
            .then(p.y.total_cmp(&q.y))
            .then(p.z.total_cmp(&q.z))
    }
}

/// Which of several estimates of one object counts, the best first: few cut sides, then many
/// pixels, then the order of the views.
fn rank(detection: &Detection, view: usize) -> (u8, Reverse<usize>, usize) {
    let cut = detection.measured.map(|m| m.cut).unwrap_or_default();
    let n_cut = u8::from(cut.left) + u8::from(cut.right) + u8::from(cut.bottom);
    let area = if detection.mask.is_empty() {
        detection.pixel_box.area() as usize
    } else {
        detection.mask_area()
    };
    (n_cut, Reverse(area), view)
}
