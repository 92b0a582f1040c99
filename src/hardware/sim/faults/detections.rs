//! What is done to the boxes that a detector finds in a frame.

use std::sync::Arc;

use groundloop_sim::{Random, World};

use super::ANY;
use super::sensing::Disturbance;
use crate::geometry::{MaskRun, PixelBox};
use crate::perception::Detection;

/// Least overlap of the box of a detection with that of the object that it shows.
const SAME_IOU_MIN: f64 = 0.3;

/// What of each object a frame shows.
#[derive(Debug, Clone, Default)]
pub(super) struct Seen {
    /// Width and height of the frame, pixels.
    size: [u32; 2],
    /// The objects with pixels in it, each with its box.
    objects: Arc<Vec<(String, PixelBox)>>,
}

impl Seen {
    /// What the pixels of a frame show; `ids` as in [`groundloop_sim::Frame`].
    pub(super) fn of(world: &World, size: [u32; 2], ids: &[u16]) -> Self {
        let names: Vec<&str> = world.bodies().map(|body| body.spec.name.as_str()).collect();
        let mut boxes: Vec<Option<PixelBox>> = vec![None; names.len()];
        let columns = (size[0] as usize).max(1);
        for (pixel, id) in ids.iter().enumerate() {
            let Some(known) = usize::from(*id).checked_sub(1).and_then(|idx| boxes.get_mut(idx))
            else {
                continue;
            };
            let (x, y) = ((pixel % columns) as f64, (pixel / columns) as f64);
            let here = PixelBox::from([x, y, x + 1.0, y + 1.0]);
            *known = Some(known.map_or(here, |known| known.hull(&here)));
        }
        let objects = names.into_iter().zip(boxes);
        let objects = objects.filter_map(|(name, found)| Some((name.to_owned(), found?)));
        Self { size, objects: Arc::new(objects.collect()) }
    }

    /// The object that a detection shows.
    fn name_of(&self, detection: &Detection) -> Option<&str> {
        let overlap = |(_, object): &&(String, PixelBox)| object.iou(&detection.pixel_box);
        let best = self.objects.iter().max_by(|a, b| overlap(a).total_cmp(&overlap(b)))?;
        (overlap(&best) >= SAME_IOU_MIN).then_some(best.0.as_str())
    }
}

/// Disturbs the detections of a frame: whom it concerns, and what was done or why nothing was.
pub(super) fn disturb(
    what: &Disturbance,
    detections: &mut Vec<Detection>,
    seen: &Seen,
    mut draws: Random,
) -> (Vec<String>, Result<String, String>) {
    let wanted = what.object().unwrap_or(ANY);
    let Some(at) = chosen(wanted, detections, seen, &mut draws) else {
        let nothing = match wanted {
            ANY => "fault: the detector sees nothing".to_owned(),
            object => format!("fault: the detector does not see {object}"),
        };
        return (Vec::new(), Err(nothing));
    };
    let name = match seen.name_of(&detections[at]) {
        Some(name) => name.to_owned(),
        None => format!("{} {}", detections[at].label, detections[at].type_name),
    };
    if let Disturbance::FalseDetection { label } = what {
        return (Vec::new(), Ok(invent(detections, at, label.as_deref(), seen.size, &mut draws)));
    }
    if let Disturbance::MisplaceDetection { by_px, .. } = what {
        shift(&mut detections[at], *by_px, seen.size);
        let said = format!("the detector sees {name} off by ({}, {}) px", by_px[0], by_px[1]);
        return (vec![name], Ok(said));
    }
    detections.remove(at);
    let said = format!("the detector does not see {name}");
    (vec![name], Ok(said))
}

/// Adds a detection like another one, elsewhere; what it is, for people.
fn invent(
    detections: &mut Vec<Detection>,
    like: usize,
    label: Option<&str>,
    size: [u32; 2],
    draws: &mut Random,
) -> String {
    let mut detection = detections[like].clone();
    if let Some(label) = label {
        detection.label = label.into();
    }
    let by_px = elsewhere(&detection.pixel_box, size, draws);
    shift(&mut detection, by_px, size);
    let (x, y) = detection.pixel_box.centre();
    let (label, type_name) = (&detection.label, &detection.type_name);
    let said = format!("the detector sees a {label} {type_name} at ({x:.0}, {y:.0})");
    detections.push(detection);
    said
}

/// The place of the detection that is meant, or that is drawn.
fn chosen(
    wanted: &str,
    detections: &[Detection],
    seen: &Seen,
    draws: &mut Random,
) -> Option<usize> {
    let fits = |detection: &Detection| wanted == ANY || seen.name_of(detection) == Some(wanted);
    let mut places: Vec<usize> =
        (0..detections.len()).filter(|at| fits(&detections[*at])).collect();
    draws.shuffle(&mut places);
    places.first().copied()
}

/// The way to a place in the picture, whole pixels.
fn elsewhere(from: &PixelBox, [width, height]: [u32; 2], draws: &mut Random) -> [f64; 2] {
    let x = draws.between(0.0, (f64::from(width) - from.width()).max(0.0));
    let y = draws.between(0.0, (f64::from(height) - from.height()).max(0.0));
    [(x - from.x1).round(), (y - from.y1).round()]
}

/// Moves a detection with its pixels; what leaves the picture is cut off.
fn shift(detection: &mut Detection, [by_x, by_y]: [f64; 2], [width, height]: [u32; 2]) {
    let clip = |value: f64, by: f64, side: u32| (value + by).clamp(0.0, f64::from(side));
    let PixelBox { x1, y1, x2, y2 } = detection.pixel_box;
    let moved = PixelBox::from([
        clip(x1, by_x, width),
        clip(y1, by_y, height),
        clip(x2, by_x, width),
        clip(y2, by_y, height),
    ]);
    let moved_run = |run: &MaskRun| {
        let y = f64::from(run.y) + by_y.round();
        let [start, end] =
            [run.x_start, run.x_end].map(|x| clip(f64::from(x), by_x.round(), width));
        let is_inside = (0.0..f64::from(height)).contains(&y) && start < end;
        is_inside.then_some(MaskRun { y: y as u32, x_start: start as u32, x_end: end as u32 })
    };
    let mask = detection.mask.iter().filter_map(moved_run).collect();
    (detection.pixel_box, detection.mask) = (moved, mask);
}
