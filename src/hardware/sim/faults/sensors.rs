//! What is wrong with the cameras now, frame by frame.
//!
//! What is done to a frame is decided once, as it is taken, and kept by its number: a camera that is
//! restarted shows the same frame again, and the detector that gets it later is disturbed alike.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use groundloop_sim::World;

use super::detections::{self, Seen};
use super::draws::{Purpose, draws, frame_draws};
use super::schedule::Tag;
use super::sensing::{Disturbance, SensingFault};
use super::{FaultSchedule, picture, record};
use crate::geometry::CameraModel;
use crate::messages::{Frame, MAIN_CAMERA};
use crate::metrics::FaultRecord;
use crate::perception::Detection;

/// Frames for which it is kept what is done to them: a detector beside the loop is behind by fewer.
const PLANS_MAX: usize = 256;
/// Most records of a run; what happens more often is told and not written down.
const RECORDS_MAX: usize = 10_000;

/// What is wrong with the cameras of a world.
#[derive(Debug, Default)]
pub(in crate::hardware::sim) struct SensorFaults {
    seed: u64,
    /// What waits for a frame, and what lasts.
    active: Vec<Active>,
    plans: VecDeque<FramePlan>,
    /// The newest pictures of each camera that may be shown late, oldest first.
    kept: BTreeMap<String, VecDeque<Arc<Picture>>>,
    /// How far back they go, nanoseconds; `None` where none is shown late.
    keep_ns: Option<u64>,
    /// What frozen cameras show.
    frozen: Vec<(Tag, Arc<Picture>)>,
    /// Which occurrences of detectors' faults have been written down.
    written: Vec<Tag>,
    n_records: usize,
    /// What has happened, for whoever writes it down.
    pub(in crate::hardware::sim) happened: Vec<FaultRecord>,
}

/// A fault that waits for a frame, or lasts.
#[derive(Debug)]
struct Active {
    tag: Tag,
    fault: SensingFault,
    camera: String,
    /// Set by its first frame.
    until_ns: Option<u64>,
}

/// What is done to one frame, or to what is detected in it.
#[derive(Debug, Clone)]
pub(in crate::hardware::sim) struct Planned {
    tag: Tag,
    what: Disturbance,
}

#[derive(Debug)]
struct FramePlan {
    camera: String,
    sequence: u64,
    at_ns: u64,
    planned: Vec<Planned>,
    seen: Seen,
}

/// What a camera has shown.
#[derive(Debug)]
struct Picture {
    sequence: u64,
    capture_ns: u64,
    rgb: Vec<u8>,
    depth_m: Option<Vec<f32>>,
    model: Option<CameraModel>,
    seen: Seen,
}

/// A frame as it was rendered, with what each pixel shows.
pub(in crate::hardware::sim) struct Rendered<'a> {
    pub(in crate::hardware::sim) camera: &'a str,
    pub(in crate::hardware::sim) frame: &'a mut Frame,
    pub(in crate::hardware::sim) ids: &'a [u16],
}

impl SensorFaults {
    /// For the faults of a run.
    pub(in crate::hardware::sim) fn new(schedule: &FaultSchedule) -> Self {
        let keep_ns = schedule.sensing().filter_map(|fault| fault.what.late_ns()).max();
        Self { seed: schedule.seed(), keep_ns, ..Self::default() }
    }

    /// Lets a fault begin with the next frame of its camera. `waited_for` is the camera whose frame it has
    /// waited for.
    pub(super) fn begin(&mut self, tag: Tag, fault: SensingFault, waited_for: Option<String>) {
        let camera = fault.camera.clone().or(waited_for);
        let camera = camera.unwrap_or_else(|| MAIN_CAMERA.to_owned());
        self.active.push(Active { tag, fault, camera, until_ns: None });
    }

    /// Decides what is done to a frame that is taken now.
    pub(in crate::hardware::sim) fn take(&mut self, camera: &str, sequence: u64, now_ns: u64) {
        let of_this = |plan: &FramePlan| plan.camera == camera && plan.sequence == sequence;
        self.plans.retain(|plan| !of_this(plan)); // numbers begin anew after a restart in realtime
        let mut planned = Vec::new();
        for mut active in std::mem::take(&mut self.active) {
            if active.camera != camera {
                self.active.push(active);
                continue;
            }
            if active.until_ns.is_some_and(|until_ns| until_ns <= now_ns) {
                self.frozen.retain(|(tag, _)| *tag != active.tag);
                continue;
            }
            if active.until_ns.is_none() {
                self.first_frame(&active, now_ns);
            }
            planned.push(Planned { tag: active.tag.clone(), what: active.fault.what.clone() });
            active.until_ns = active.until_ns.or_else(|| active.end_ns(now_ns));
            self.active.extend(active.until_ns.is_some().then_some(active));
        }
        if planned.is_empty() {
            return;
        }
        if self.plans.len() == PLANS_MAX {
            self.plans.pop_front();
        }
        let camera = camera.to_owned();
        self.plans.push_back(FramePlan {
            camera,
            sequence,
            at_ns: now_ns,
            planned,
            seen: Seen::default(),
        });
    }

    /// Writes down that a fault begins; what is done to detections is known only later.
    fn first_frame(&mut self, active: &Active, now_ns: u64) {
        let Active { tag, fault, camera, .. } = active;
        if fault.what.is_of_detector() {
            return;
        }
        let has_none = matches!(fault.what, Disturbance::LateFrame { .. })
            && self.kept.get(camera).is_none_or(VecDeque::is_empty);
        let said = if has_none {
            Err(format!("fault: camera {camera} has shown no earlier picture"))
        } else {
            Ok(fault.what.told(camera, fault.for_s))
        };
        self.write(now_ns, tag, Vec::new(), said);
    }

    fn write(&mut self, at_ns: u64, tag: &Tag, objects: Vec<String>, said: Result<String, String>) {
        let record = record(at_ns, tag, objects, said);
        self.n_records += 1;
        if self.n_records <= RECORDS_MAX {
            self.happened.push(record);
        }
    }

    /// What is done to a frame.
    pub(in crate::hardware::sim) fn planned(&self, camera: &str, sequence: u64) -> Vec<Planned> {
        self.plan_idx(camera, sequence)
            .map(|idx| self.plans[idx].planned.clone())
            .unwrap_or_default()
    }

    fn plan_idx(&self, camera: &str, sequence: u64) -> Option<usize> {
        let of_this = |plan: &FramePlan| plan.camera == camera && plan.sequence == sequence;
        self.plans.iter().rposition(of_this)
    }

    /// Keeps what may be shown later, and shows what was kept.
    pub(in crate::hardware::sim) fn exchange(
        &mut self,
        world: &World,
        planned: &[Planned],
        rendered: &mut Rendered<'_>,
    ) {
        let is_asked = |planned: &Planned| {
            planned.what.is_of_detector() || matches!(planned.what, Disturbance::Freeze {})
        };
        if self.keep_ns.is_none() && !planned.iter().any(is_asked) {
            return;
        }
        let Rendered { camera, frame, ids } = rendered;
        let (camera, sequence) = (*camera, frame.sequence);
        let mut seen = Seen::of(world, [frame.width, frame.height], ids);
        self.keep(camera, frame, &seen);
        for Planned { tag, what } in planned {
            let late_ns = what.late_ns();
            let shown = if let Some(late_ns) = late_ns {
                self.picture_before(camera, frame, late_ns)
            } else {
                let freezes = matches!(what, Disturbance::Freeze {});
                freezes.then(|| self.freeze(tag, frame, &seen))
            };
            let Some(shown) = shown else { continue };
            shown.show(frame, late_ns.is_some());
            seen = shown.seen.clone();
        }
        if let Some(idx) = self.plan_idx(camera, sequence) {
            self.plans[idx].seen = seen;
        }
    }

    fn keep(&mut self, camera: &str, frame: &Frame, seen: &Seen) {
        let Some(keep_ns) = self.keep_ns else { return };
        let kept = self.kept.entry(camera.to_owned()).or_default();
        // A restarted camera takes the same frame again.
        kept.retain(|picture| picture.sequence != frame.sequence);
        kept.push_back(Arc::new(Picture::of(frame, seen)));
        let oldest_ns = frame.capture_ns.saturating_sub(keep_ns);
        while kept.get(1).is_some_and(|second| second.capture_ns <= oldest_ns) {
            kept.pop_front();
        }
    }

    /// The newest picture of at least that age, or the oldest there is.
    fn picture_before(&self, camera: &str, frame: &Frame, by_ns: u64) -> Option<Arc<Picture>> {
        let kept = self.kept.get(camera)?;
        let wanted_ns = frame.capture_ns.saturating_sub(by_ns);
        let is_old = |picture: &&Arc<Picture>| picture.capture_ns <= wanted_ns;
        kept.iter().rev().find(is_old).or_else(|| kept.front()).cloned()
    }

    fn freeze(&mut self, tag: &Tag, frame: &Frame, seen: &Seen) -> Arc<Picture> {
        if let Some((_, picture)) = self.frozen.iter().find(|(frozen, _)| frozen == tag) {
            return Arc::clone(picture);
        }
        let picture = Arc::new(Picture::of(frame, seen));
        self.frozen.push((tag.clone(), Arc::clone(&picture)));
        picture
    }

    /// Disturbs what a detector says of a frame.
    pub(in crate::hardware::sim) fn disturb_detections(
        &mut self,
        camera: &str,
        sequence: u64,
        detections: &mut Vec<Detection>,
    ) {
        let Some(idx) = self.plan_idx(camera, sequence) else { return };
        let FramePlan { at_ns, planned, seen, .. } = &self.plans[idx];
        let (at_ns, seen) = (*at_ns, seen.clone());
        for Planned { tag, what } in planned.clone() {
            if !what.is_of_detector() {
                continue;
            }
            let draws = draws(self.seed, (tag.fault, tag.occurrence), Purpose::Picture);
            let (objects, said) = detections::disturb(&what, detections, &seen, draws);
            if !self.written.contains(&tag) {
                self.write(at_ns, &tag, objects, said);
                self.written.push(tag);
            }
        }
    }
}

impl Active {
    /// When it ends, where it lasts longer than the frame that is taken now.
    fn end_ns(&self, now_ns: u64) -> Option<u64> {
        match (self.fault.for_s, &self.fault.what) {
            (Some(for_s), _) => Some(now_ns.saturating_add(super::nanoseconds(for_s))),
            (None, Disturbance::BumpCamera { .. }) => Some(u64::MAX),
            (None, _) => None,
        }
    }
}

impl Planned {
    /// Whether the frame is never published.
    pub(in crate::hardware::sim) fn drops(&self) -> bool {
        matches!(self.what, Disturbance::DropFrame {})
    }

    /// Whether it is published twice.
    pub(in crate::hardware::sim) fn repeats(&self) -> bool {
        matches!(self.what, Disturbance::RepeatFrame {})
    }

    /// How far the camera stands off its place: metres, and radians about the vertical.
    pub(in crate::hardware::sim) fn bump(&self) -> Option<([f64; 3], f64)> {
        let Disturbance::BumpCamera { by_m, by_rad } = self.what else { return None };
        Some((by_m, by_rad.unwrap_or(0.0)))
    }

    /// Does it to the pixels and the depth of a frame.
    pub(in crate::hardware::sim) fn spoil(&self, seed: u64, frame: &mut Frame) {
        let key = (self.tag.fault, self.tag.occurrence);
        let draws = draws(seed, key, Purpose::Picture);
        match self.what {
            Disturbance::Corrupt { share } => {
                picture::corrupt(frame, share, frame_draws(seed, key, frame.sequence));
            }
            Disturbance::Blur { px } => picture::blur(frame, px as usize),
            Disturbance::Exposure { factor } => picture::expose(frame, factor),
            Disturbance::Occluder { width } => picture::cover(frame, width, draws),
            Disturbance::DepthHoles { share } => picture::pierce(frame, share, draws),
            Disturbance::DropFrame {}
            | Disturbance::LateFrame { .. }
            | Disturbance::RepeatFrame {}
            | Disturbance::Freeze {}
            | Disturbance::BumpCamera { .. }
            | Disturbance::MissDetection { .. }
            | Disturbance::FalseDetection { .. }
            | Disturbance::MisplaceDetection { .. } => {}
        }
    }
}

impl Picture {
    fn of(frame: &Frame, seen: &Seen) -> Self {
        let Frame { sequence, capture_ns, rgb, depth_m, model, .. } = frame.clone();
        Self { sequence, capture_ns, rgb, depth_m, model, seen: seen.clone() }
    }

    /// Shows it in the place of a frame, perhaps with its own stamp and pose.
    fn show(&self, frame: &mut Frame, is_late: bool) {
        frame.rgb.clone_from(&self.rgb);
        frame.depth_m.clone_from(&self.depth_m);
        if is_late {
            (frame.capture_ns, frame.model) = (self.capture_ns, self.model);
        }
    }
}
