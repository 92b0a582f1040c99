//! The frames of all cameras, put together: one of each, of the same moment.
//!
//! In lockstep those of one number belong together, and all are waited for. In realtime the newest
//! frame of `main` goes with what the others showed last, where that was captured within
//! `camera.skew_ms_max`: the loop waits for no other camera, once each has shown something.

use std::fmt::{Display, Formatter};
use std::future::poll_fn;
use std::pin::Pin;
use std::task::Poll;
use std::time::Duration;

use tokio::time::Instant;

use super::fitted::{FittedFrame, scale_of};
use super::{CameraArgs, Rejection};
use crate::actors::patience::was_stopped;
use crate::clock::{ClockKind, StampFault, Stamps, monotonic_ns};
use crate::geometry::CameraModel;
use crate::messages::FrameFault;
use crate::perception::{DepthView, FrameView, ImageView};
use crate::transport::convert::{RgbFrame, depth_from_wire};
use crate::transport::topics::CameraTopics;
use crate::transport::wire::FrameHeader;
use crate::transport::{
    Bus, Depth, Drops, Received, Subscriber, Told, TopicSilence, TransportError,
};

/// What is read of one camera.
struct Feed {
    args: CameraArgs,
    topics: CameraTopics,
    rgb: Subscriber<FrameHeader, u8>,
    depth: Subscriber<FrameHeader, u8>,
    /// Its newest frame that can be worked on, and the depth that came last.
    frame: Option<FittedFrame>,
    newest_depth: Option<Received<FrameHeader, u8>>,
    stamps: Stamps,
    /// When its last frame came, and what the topic's reader had missed by then.
    seen: Instant,
    seen_with: Drops,
    /// Time between that frame and the one before.
    gap: Duration,
    /// What is wrong with its depth, so that the same is not told each time.
    told: Told,
    /// Whether people have been told that the loop goes on without it.
    is_late: bool,
}

/// The cameras of a run.
pub(super) struct Cameras {
    /// That of `[camera]` first.
    feeds: Vec<Feed>,
    /// How far apart frames of one moment may be captured; `None` in lockstep: of one number.
    skew: Option<Duration>,
}

/// What the cameras show at one moment: the frame of `main`, and of the others what belongs to it.
pub(super) struct Moment {
    pub(super) frame: FittedFrame,
    /// Which feeds belong to it, by their places.
    used: Vec<usize>,
}

/// One camera's part of a moment, with depth in memory of its own.
#[derive(Debug, Clone)]
pub(super) struct Shot<'a> {
    /// Place among the cameras.
    pub(super) camera_idx: usize,
    /// Number of its frame.
    pub(super) sequence: u64,
    pub(super) size: [usize; 2],
    pub(super) rgb: &'a [u8],
    pub(super) depth_m: Option<&'a [f32]>,
    pub(super) model: Option<&'a CameraModel>,
}

impl<'a> Shot<'a> {
    /// Its image alone.
    pub(super) fn image(&self) -> Result<ImageView<'a>, Rejection> {
        let [width, height] = self.size;
        ImageView::new(width, height, self.rgb).map_err(|e| Rejection::unusable(&e))
    }

    /// What perception looks at.
    pub(super) fn view(&self) -> Result<FrameView<'a>, Rejection> {
        let [width, height] = self.size;
        let depth = self.depth_m.and_then(|depth_m| DepthView::new(width, height, depth_m).ok());
        Ok(FrameView { image: Some(self.image()?), depth, camera: self.model })
    }
}

impl Cameras {
    /// Opens the topics of all cameras.
    pub(super) fn open(
        bus: &Bus,
        cameras: &[CameraArgs],
        skew: Option<Duration>,
    ) -> Result<Self, TransportError> {
        let clock = if skew.is_some() { ClockKind::Realtime } else { ClockKind::Lockstep };
        let feeds = cameras.iter().map(|args| {
            let topics = CameraTopics::of(&args.name);
            Ok(Feed {
                args: args.clone(),
                topics,
                rgb: bus.subscriber(&topics.rgb, Depth::newest())?,
                depth: bus.subscriber(&topics.depth, Depth::newest())?,
                frame: None,
                newest_depth: None,
                stamps: Stamps::new(clock),
                seen: Instant::now(),
                seen_with: Drops::default(),
                gap: Duration::ZERO,
                told: Told::default(),
                is_late: false,
            })
        });
        Ok(Self { feeds: feeds.collect::<Result<_, TransportError>>()?, skew })
    }

    /// Waits until there is a frame of every camera that belongs to the newest of `main`. `refused` hears why
    /// a frame cannot be worked on.
    ///
    /// Cancel-safe: what has come stays.
    pub(super) async fn next(
        &mut self,
        mut refused: impl FnMut(&Refusal),
    ) -> Result<Moment, TransportError> {
        let is_one = self.feeds.len() == 1;
        loop {
            for feed in &mut self.feeds {
                feed.take(is_one, &mut refused)?;
            }
            if let Some(moment) = self.moment() {
                return Ok(moment);
            }
            let waits = self.feeds.iter().map(|feed| feed.rgb.wait()).collect();
            first_of(waits).await?;
        }
    }

    /// The moment of the newest frame of `main`, when all that belongs to it is here.
    fn moment(&mut self) -> Option<Moment> {
        let skew = self.skew;
        let (main, others) = self.feeds.split_first_mut()?;
        let header = *main.frame.as_ref()?.header();
        let mut used = vec![0];
        for (idx, feed) in (1..).zip(others) {
            let other = feed.frame.as_ref()?.header();
            match skew {
                None if other.sequence != header.sequence => return None,
                None => used.push(idx),
                Some(skew) => {
                    let apart_ns = u128::from(other.capture_ns.abs_diff(header.capture_ns));
                    let is_late = apart_ns > skew.as_nanos();
                    feed.tell(is_late);
                    used.extend((!is_late).then_some(idx));
                }
            }
        }
        let frame = main.frame.take()?;
        Some(Moment { frame, used })
    }

    /// The place of the camera that keeps the next moment waiting, where there is one: it has shown
    /// nothing, or not the frame of the others' number.
    pub(super) fn awaited(&self) -> usize {
        let Some(frame) = &self.feeds[0].frame else { return 0 };
        let is_here = |feed: &Feed| match (&feed.frame, self.skew) {
            (Some(other), None) => other.header().sequence == frame.header().sequence,
            (other, _) => other.is_some(),
        };
        self.feeds.iter().position(|feed| !is_here(feed)).unwrap_or(0)
    }

    /// The place of a camera beside `main` that has shown nothing for so long, in realtime.
    pub(super) fn lost(&mut self, wait: Duration) -> Option<usize> {
        self.skew?;
        // After a pause of all cameras nobody is lost: this process, or all of them, stood still.
        if was_stopped(self.feeds[0].gap, wait).is_some() {
            self.wait_anew();
        }
        (1..self.feeds.len()).find(|&idx| self.feeds[idx].seen.elapsed() > wait)
    }

    /// The topics of a camera.
    pub(super) fn topics(&self, idx: usize) -> CameraTopics {
        self.feeds[idx].topics
    }

    /// Why a camera has shown nothing since its last frame.
    pub(super) fn silence(
        &mut self,
        bus: &Bus,
        idx: usize,
    ) -> Result<TopicSilence, TransportError> {
        let Feed { topics, rgb, seen_with, .. } = &mut self.feeds[idx];
        bus.silence(&topics.rgb, rgb, *seen_with)
    }

    /// While the loop is paused, no camera counts as lost.
    pub(super) fn wait_anew(&mut self) {
        self.feeds.iter_mut().for_each(|feed| feed.seen = Instant::now());
    }

    /// Frames of `main` that were overtaken.
    pub(super) fn missed(&self) -> u64 {
        self.feeds.first().map_or(0, |feed| feed.rgb.drops().missed)
    }

    /// Reads the depth of each frame of a moment into `depths`, one for each camera.
    ///
    /// With several cameras each needs depth: without it nothing that it sees has a place.
    pub(super) fn read_depth(
        &mut self,
        moment: &Moment,
        depths: &mut Vec<Vec<f32>>,
    ) -> Result<Vec<bool>, Rejection> {
        depths.resize_with(self.feeds.len(), Vec::new);
        let mut has_depth = vec![false; self.feeds.len()];
        let is_one = self.feeds.len() == 1;
        for &idx in &moment.used {
            let feed = &mut self.feeds[idx];
            if let Some(newer) = feed.depth.drain_newest().map_err(|e| Rejection::unusable(&e))? {
                feed.newest_depth = Some(newer);
            }
            let frame = if idx == 0 { Some(&moment.frame) } else { feed.frame.as_ref() };
            let Some(frame) = frame else { continue };
            let sequence = frame.header().sequence;
            let read = read_depth(feed.newest_depth.as_ref(), frame, &mut depths[idx]);
            has_depth[idx] = read == Ok(true);
            if let Err(reason) = read
                && let Some(nth) = feed.told.count(&reason)
            {
                tracing::warn!(topic = feed.topics.depth.name, reason, nth, "depth refused");
            }
            if !has_depth[idx] && !is_one {
                let topic = feed.topics.depth.name;
                let reason = format!(
                    "frame {sequence} has no depth on {topic}: with several cameras each needs depth"
                );
                return Err(Rejection { reason, is_missing: false });
            }
        }
        Ok(has_depth)
    }

    /// What the cameras show at a moment, `main` first.
    pub(super) fn shots<'a>(
        &'a self,
        moment: &'a Moment,
        depths: &'a [Vec<f32>],
        has_depth: &[bool],
    ) -> Vec<Shot<'a>> {
        let shot = |&idx: &usize| {
            let own = self.feeds[idx].frame.as_ref();
            let frame = if idx == 0 { &moment.frame } else { own? };
            Some(Shot {
                camera_idx: idx,
                sequence: frame.header().sequence,
                size: frame.size().map(|side| side as usize),
                rgb: frame.rgb(),
                depth_m: has_depth[idx].then_some(depths[idx].as_slice()),
                model: frame.model(),
            })
        };
        moment.used.iter().filter_map(shot).collect()
    }
}

/// Waits for the first of several.
async fn first_of<T>(waits: Vec<impl Future<Output = T>>) -> T {
    let mut waits: Vec<Pin<Box<_>>> = waits.into_iter().map(Box::pin).collect();
    poll_fn(|context| {
        let mut polled = waits.iter_mut().map(|wait| wait.as_mut().poll(context));
        polled.find(Poll::is_ready).unwrap_or(Poll::Pending)
    })
    .await
}

impl Feed {
    /// Takes the newest frame that can be worked on.
    fn take(
        &mut self,
        is_one: bool,
        refused: &mut impl FnMut(&Refusal),
    ) -> Result<(), TransportError> {
        let name = (!is_one).then_some(self.args.name.as_str());
        let size = self.args.image_size;
        let stamps = &mut self.stamps;
        let newest = self.rgb.drain_newest_of(|message| {
            let FrameHeader { sequence, capture_ns, .. } = *message.header();
            check(name.is_some(), size, message)
                .and_then(|frame| {
                    let stamp = stamps.take_once(sequence, capture_ns, monotonic_ns());
                    stamp.map(|()| frame).map_err(Refusal::from)
                })
                .map_err(|refusal| refusal.of(name))
                .inspect_err(&mut *refused)
        })?;
        if let Some(newest) = newest {
            self.frame = Some(FittedFrame::new(newest, size));
            self.gap = self.seen.elapsed();
            (self.seen, self.seen_with) = (Instant::now(), self.rgb.drops());
        }
        Ok(())
    }

    /// Tells people, once each time, that the loop goes on without this camera, or with it again.
    fn tell(&mut self, is_late: bool) {
        if is_late == self.is_late {
            return;
        }
        self.is_late = is_late;
        let (topic, camera) = (self.topics.rgb.name, &self.args.name);
        if is_late {
            tracing::warn!(
                topic,
                "no frame of this moment (camera.skew_ms_max): going on without {camera}"
            );
        } else {
            tracing::warn!(topic, "frames again: going on with {camera}");
        }
    }
}

/// Why a frame cannot be worked on.
#[derive(Debug, Clone)]
pub(super) struct Refusal {
    pub(super) fault: FrameFault,
    pub(super) reason: String,
}

impl Refusal {
    fn new(fault: FrameFault, reason: impl Into<String>) -> Self {
        Self { fault, reason: reason.into() }
    }

    /// The same with the camera, where there are several.
    fn of(self, camera: Option<&str>) -> Self {
        let Some(name) = camera else { return self };
        Self { reason: format!("camera {name}: {}", self.reason), ..self }
    }
}

impl From<StampFault> for Refusal {
    fn from(StampFault { kind, reason }: StampFault) -> Self {
        Self { fault: kind, reason }
    }
}

impl Display for Refusal {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.reason)
    }
}

/// A frame that can be worked on, once it has the `wanted` size; why not, otherwise. Where there are
/// several cameras, each needs a pose.
fn check(
    needs_model: bool,
    wanted: [u32; 2],
    message: Received<FrameHeader, u8>,
) -> Result<RgbFrame, Refusal> {
    let malformed = |reason: String| Refusal::new(FrameFault::Malformed, reason);
    let frame = RgbFrame::read(message).map_err(|error| malformed(error.to_string()))?;
    scale_of(frame.size(), wanted).map_err(|reason| Refusal::new(FrameFault::OtherSize, reason))?;
    if needs_model && frame.model().is_none() {
        let reason = "the frame has no intrinsics or no pose: with several cameras each needs both";
        return Err(malformed(reason.to_owned()));
    }
    Ok(frame)
}

/// Reads the depth of a frame into `depth_m`; whether there is any.
///
/// # Errors
/// Why what there is cannot be used.
fn read_depth(
    depth: Option<&Received<FrameHeader, u8>>,
    frame: &FittedFrame,
    depth_m: &mut Vec<f32>,
) -> Result<bool, String> {
    let sequence = frame.header().sequence;
    let Some(depth) = depth.filter(|d| d.header().sequence == sequence) else { return Ok(false) };
    let read = depth_from_wire(depth.header(), depth.records(), depth_m);
    read.map_err(|error| error.to_string())?;
    frame.fit_depth(depth_m);
    Ok(true)
}
