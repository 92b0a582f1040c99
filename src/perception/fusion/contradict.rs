//! Where views contradict one another: a camera that looks through the place of an object, and
//! cameras that tell different labels of one body.

use nalgebra::Point3;

use super::associate::{Cluster, distance_m};
use super::view::{CameraView, Place, corners};
use crate::perception::{BoxEstimate, Detection};

/// A camera looks through a point when it measures something behind it by more than this, in metres.
const BEHIND_M: f64 = 0.02;
/// The share of an object that a camera must look through to deny it: an estimate's edges may be off.
const INNER_SHARE: f64 = 0.5;
/// Bodies in one place differ by less than this share of their edges: nearer than any two that touch.
const SAME_BODY_SHARE: f64 = 0.4;

/// Objects of one type in one place, with different labels: the first view's label counts, the other
/// detections are left out of `clusters`. Returns where they were, and what is said of them.
pub(super) fn conflicting_labels(
    views: &[CameraView<'_>],
    clusters: &mut Vec<Cluster>,
) -> Vec<(Place, String)> {
    let of = |(view, idx): Place| &views[view].detections[idx];
    let mut conflicts = Vec::new();
    clusters.sort_by(|a, b| a.members.cmp(&b.members));
    let mut at = 0;
    while at < clusters.len() {
        let first = clusters[at].members[0];
        let (same, rest): (Vec<Cluster>, Vec<Cluster>) =
            clusters.drain(at + 1..).partition(|other| {
                let (a, b) = (of(first), of(other.members[0]));
                let is_whole = |d: &Detection| d.measured.as_ref().is_some_and(shows_both_sides);
                a.type_name == b.type_name
                    && a.label != b.label
                    && is_whole(a)
                    && is_whole(b)
                    && distance_m(a, b, SAME_BODY_SHARE).is_some()
            });
        clusters.extend(rest);
        let (same, rest): (Vec<Cluster>, Vec<Cluster>) =
            same.into_iter().partition(|other| clusters[at].is_apart(other));
        clusters.extend(rest);
        if let Some(other) = same.first() {
            let place = other.members[0];
            let said = |place: Place| (&of(place).label, views[place.0].camera);
            let ((label, camera), (other, other_camera)) = (said(first), said(place));
            let reason = format!("seen as {label} by {camera} and as {other} by {other_camera}:");
            conflicts.push((first, reason));
        }
        at += 1;
    }
    conflicts
}

/// The view that looks through the place of an object that only other views, its `members`, show.
pub(super) fn sees_through(
    views: &[CameraView<'_>],
    members: &[Place],
    estimate: &BoxEstimate,
) -> Option<String> {
    if !shows_both_sides(estimate) {
        return None;
    }
    let is_member = |view: usize| members.iter().any(|place| place.0 == view);
    let mut views = views.iter().enumerate();
    let denies = views.find(|(view, seen)| !is_member(*view) && looks_through(seen, estimate))?;
    Some(format!("{} sees through the place of", denies.1.camera))
}

/// Whether the width of an object, and with it its place, is known. The table before it counts as
/// something nearer for a low camera: the lower edge says nothing.
fn shows_both_sides(estimate: &BoxEstimate) -> bool {
    !(estimate.cut.left || estimate.cut.right)
}

/// Whether a camera measures something behind every inner point of an estimate.
fn looks_through(view: &CameraView<'_>, estimate: &BoxEstimate) -> bool {
    let (Some(depth), Some(camera)) = (&view.frame.depth, view.frame.camera) else { return false };
    let is_free = |point: Point3<f64>| {
        let along = camera.world_from_camera.inverse_transform_point(&point).z;
        let Some(pixel) = camera.project(point) else { return false };
        let [column, row] = [pixel.x.round(), pixel.y.round()];
        let is_inside = column >= 0.0 && row >= 0.0;
        let measured = is_inside.then(|| depth.at(column as u32, row as u32)).flatten();
        measured.is_some_and(|measured| measured > along + BEHIND_M)
    };
    corners(estimate, INNER_SHARE).all(is_free)
}
