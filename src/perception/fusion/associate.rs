//! Which detections of different views show the same object: those of one type and label that are
//! in one place.

use super::view::{CameraView, Place};
use crate::geometry::Aabb;
use crate::perception::{BoxEstimate, Detection};

/// Middles of one object differ by less than this share of its edges: two objects in contact differ
/// by a whole edge, and an estimate of a visible half is off by a quarter.
pub(super) const SAME_SHARE: f64 = 0.6;

/// The detections of one object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Cluster {
    /// At most one for each view, in the order of the views.
    pub(super) members: Vec<Place>,
}

impl Cluster {
    /// Whether both may be of one object: no view sees it twice.
    pub(super) fn is_apart(&self, other: &Self) -> bool {
        self.members.iter().all(|(view, _)| other.members.iter().all(|(other, _)| view != other))
    }
}

/// Groups the detections of all views. What has no place in the world, and what the robot may hide a
/// part of in another view than the first, is in no group with others; the latter is left out.
pub(super) fn associate(views: &[CameraView<'_>]) -> Vec<Cluster> {
    let places: Vec<Place> = views
        .iter()
        .enumerate()
        .flat_map(|(view, seen)| {
            let is_used = move |d: &Detection| view == 0 || !seen.is_covered(d);
            let used = seen.detections.iter().enumerate().filter(move |(_, d)| is_used(d));
            used.map(move |(idx, _)| (view, idx))
        })
        .collect();
    let of = |(view, idx): Place| &views[view].detections[idx];
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, &a) in places.iter().enumerate() {
        for (j, &b) in places.iter().enumerate().skip(i + 1) {
            if a.0 != b.0
                && (&of(a).type_name, &of(a).label) == (&of(b).type_name, &of(b).label)
                && let Some(distance_m) = distance_m(of(a), of(b), SAME_SHARE)
            {
                pairs.push((distance_m, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut clusters: Vec<Cluster> =
        places.into_iter().map(|place| Cluster { members: vec![place] }).collect();
    let mut cluster_of: Vec<usize> = (0..clusters.len()).collect();
    for (_, i, j) in pairs {
        let (a, b) = (cluster_of[i].min(cluster_of[j]), cluster_of[i].max(cluster_of[j]));
        if a != b && clusters[a].is_apart(&clusters[b]) {
            let members = std::mem::take(&mut clusters[b].members);
            clusters[a].members.extend(members);
            cluster_of.iter_mut().filter(|of| **of == b).for_each(|of| *of = a);
        }
    }
    clusters.retain(|cluster| !cluster.members.is_empty());
    for cluster in &mut clusters {
        cluster.members.sort_unstable();
    }
    clusters
}

/// The distance of the middles of two detections, in metres, where it is less than a share of the
/// larger one's edges along each axis: as both are seen, or with the sides that are cut in one put
/// where the other's size says.
pub(super) fn distance_m(a: &Detection, b: &Detection, share: f64) -> Option<f64> {
    let (a, b) = (a.measured?, b.measured?);
    let whole = |own: &BoxEstimate, other: &Aabb| own.completed(other).unwrap_or(own.volume);
    let completed = (whole(&a, &b.volume), whole(&b, &a.volume));
    let near = [(a.volume, b.volume), completed].into_iter().filter_map(|(p, q)| {
        let offset = p.centre - q.centre;
        // Edges are along and across each camera's direction, which differ from view to view.
        let level =
            [p.extent[0], p.extent[1], q.extent[0], q.extent[1]].into_iter().fold(0.0, f64::max);
        let up = p.extent[2].max(q.extent[2]);
        let is_near = offset.x.abs() < share * level
            && offset.y.abs() < share * level
            && offset.z.abs() < share * up;
        is_near.then(|| offset.norm())
    });
    near.reduce(f64::min)
}
