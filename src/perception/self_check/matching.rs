//! Which detection is which labelled object.

use crate::geometry::{Mask, MaskRun, PixelBox};
use crate::pddl::Types;
use crate::perception::Detection;
use crate::perception::model::ObjectBox;

/// From this overlap on (intersection over union) two boxes are of one thing, as is usual.
pub(super) const IOU_SAME_MIN: f64 = 0.5;
/// A detection that overlaps a label by less has nothing to do with it.
const IOU_NEAR_MIN: f64 = 0.1;
/// A detection covers a label when so much of the label's box is inside.
const COVERED_MIN: f64 = 0.7;

/// Labelled objects and detections, by their places in the two lists.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Matched {
    /// Label, detection, whether their boxes agree.
    pairs: Vec<(usize, usize, bool)>,
    /// Label, the label that shares its detection, the detection.
    merged: Vec<(usize, usize, usize)>,
}

impl Matched {
    /// The detection of a label.
    pub(super) fn detection_of(&self, label: usize) -> Option<usize> {
        self.pairs.iter().find(|(at, ..)| *at == label).map(|(_, detection, _)| *detection)
    }

    /// Whether the boxes of a label and its detection agree.
    pub(super) fn fits(&self, label: usize) -> bool {
        self.pairs.iter().any(|(at, _, fits)| *at == label && *fits)
    }

    /// The label that one detection covers together with this one.
    pub(super) fn merged_with(&self, label: usize) -> Option<usize> {
        self.merged.iter().find(|(at, ..)| *at == label).map(|(_, other, _)| *other)
    }

    /// The detections that are no labelled object.
    pub(super) fn unlabelled(&self, n_detections: usize) -> impl Iterator<Item = usize> {
        (0..n_detections).filter(|detection| {
            self.pairs.iter().all(|(_, d, _)| d != detection)
                && self.merged.iter().all(|(.., d)| d != detection)
        })
    }
}

/// Matches by type and overlap, the greatest overlap first: boxes that agree, then labels that one
/// detection covers together, then boxes that overlap at all.
pub(super) fn matched(types: &Types, labels: &[ObjectBox], found: &[Detection]) -> Matched {
    let mut matched = Matched::default();
    let is_of = |label: &ObjectBox, detection: &Detection| {
        let (a, b) = (&label.type_name, &detection.type_name);
        types.is_a(a, b) || types.is_a(b, a)
    };
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (l, label) in labels.iter().enumerate() {
        let fitting = found.iter().enumerate().filter(|(_, d)| is_of(label, d));
        pairs.extend(fitting.map(|(d, f)| (overlap(label, f), l, d)));
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    take(&mut matched, pairs.iter().filter(|(iou, ..)| *iou >= IOU_SAME_MIN), true);
    for (l, label) in labels.iter().enumerate() {
        if matched.detection_of(l).is_some() {
            continue;
        }
        for (d, detection) in found.iter().enumerate().filter(|(_, d)| is_of(label, d)) {
            let covered = |at: &(usize, &ObjectBox)| {
                is_of(at.1, detection) && covers(&detection.pixel_box, &at.1.pixel_box)
            };
            let mut others = labels.iter().enumerate().filter(|(other, _)| *other != l);
            if covered(&(l, label))
                && let Some((other, _)) = others.find(covered)
            {
                matched.merged.push((l, other, d));
                break;
            }
        }
    }
    take(&mut matched, pairs.iter().filter(|(iou, ..)| *iou >= IOU_NEAR_MIN), false);
    matched
}

/// Takes pairs of which neither side is taken.
fn take<'p>(
    matched: &mut Matched,
    pairs: impl Iterator<Item = &'p (f64, usize, usize)>,
    fits: bool,
) {
    for (_, label, detection) in pairs {
        let is_taken = matched.pairs.iter().any(|(l, d, _)| l == label || d == detection)
            || matched.merged.iter().any(|(l, _, d)| l == label || d == detection);
        if !is_taken {
            matched.pairs.push((*label, *detection, fits));
        }
    }
}

/// How much two are in the same place (intersection over union): by their boxes, or by their pixels
/// where both tell them. Thin visible corners of a hidden object make a box, and few pixels.
fn overlap(label: &ObjectBox, detection: &Detection) -> f64 {
    let of_boxes = label.pixel_box.iou(&detection.pixel_box);
    let of_label = |mask: &&Mask| hull(mask).iou(&label.pixel_box) >= IOU_SAME_MIN;
    let mask = label.mask.as_ref().filter(|_| of_boxes > 0.0).filter(of_label);
    let Some(mask) = mask else { return of_boxes };
    let common: f64 = detection
        .mask
        .iter()
        .map(|run| {
            let from = mask.partition_point(|other| other.y < run.y);
            let in_row = mask[from..].iter().take_while(|other| other.y == run.y);
            let common = |other: &MaskRun| {
                other.x_end.min(run.x_end).saturating_sub(other.x_start.max(run.x_start))
            };
            in_row.map(|other| f64::from(common(other))).sum::<f64>()
        })
        .sum();
    let all = mask.area() + detection.mask_area() as f64 - common;
    of_boxes.max(if all > 0.0 { common / all } else { 0.0 })
}

/// The smallest box around pixels.
fn hull(mask: &Mask) -> PixelBox {
    let boxes = mask.iter().map(|run| {
        let [x1, x2, y] = [run.x_start, run.x_end, run.y].map(f64::from);
        PixelBox { x1, y1: y, x2, y2: y + 1.0 }
    });
    boxes.reduce(|a, b| a.hull(&b)).unwrap_or(PixelBox { x1: 0.0, y1: 0.0, x2: 0.0, y2: 0.0 })
}

/// Whether most of a label's box is inside a detection's.
fn covers(detection: &PixelBox, label: &PixelBox) -> bool {
    detection.intersection(label).area() >= COVERED_MIN * label.area()
}
