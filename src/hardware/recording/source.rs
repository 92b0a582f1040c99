//! A recording read from its beginning: frames of one topic, with the depth of another.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::io::MessageReader;
use mcap::sans_io::LinearReaderOptions;
use mcap::{Channel, Message};

use super::pictures::{PICTURES, Recorded, Shown, calibration, picture};
use crate::hardware::CameraError;
use crate::hardware::calibration::Calibration;
use crate::hardware::encodings::{Pixels, YuvColours};
use crate::mismatch::quoted;

/// Largest record and chunk, bytes: a length that is none asks for no more memory than that.
const RECORD_BYTES_MAX: usize = 1 << 29;
/// How far apart the stamps of colours and depth of one frame may be, nanoseconds: half a frame of a
/// camera of 30 frames a second.
const DEPTH_APART_NS_MAX: i128 = 16_000_000;
/// How many pictures may come before the calibration does.
const PICTURES_BEFORE_CALIBRATION_MAX: usize = 100;

/// Which topics are played.
#[derive(Debug, Clone)]
pub(super) struct Topics {
    pub(super) colour: String,
    pub(super) depth: Option<String>,
    pub(super) calibration: String,
    pub(super) yuv: YuvColours,
}

/// A frame as it was recorded.
#[derive(Debug, PartialEq)]
pub(super) struct RecordedFrame {
    /// When it was written down, nanoseconds of the recorder's clock.
    pub(super) log_ns: u64,
    pub(super) size: [u32; 2],
    pub(super) rgb: Vec<u8>,
    pub(super) depth_m: Option<Vec<f32>>,
}

/// What is known of a recording before it is played.
#[derive(Debug)]
pub(super) struct Glance {
    pub(super) size: [u32; 2],
    pub(super) calibration: Option<Calibration>,
}

/// A recording that is being read.
pub(super) struct Recording {
    path: PathBuf,
    topics: Topics,
    messages: MessageReader<BufReader<File>>,
    /// Colours that wait for their depth.
    waiting: Option<(u64, Shown)>,
    newest_depth: Option<Shown>,
    /// Messages of the topics that were no pictures, and why the last was not.
    pub(super) n_broken: u64,
}

/// What a message of the topics is.
enum Heard {
    Colour(u64, Shown),
    Depth(Shown),
    Calibration(Calibration),
    Other,
}

impl Recording {
    pub(super) fn open(path: &Path, topics: &Topics) -> Result<Self, CameraError> {
        let file = File::open(path).map_err(|error| CameraError::Recording {
            path: path.display().to_string(),
            reason: error.to_string(),
        })?;
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(RECORD_BYTES_MAX);
        Ok(Self {
            path: path.to_owned(),
            topics: topics.clone(),
            messages: MessageReader::new_with_options(BufReader::new(file), options),
            waiting: None,
            newest_depth: None,
            n_broken: 0,
        })
    }

    fn fault(&self, reason: impl std::fmt::Display) -> CameraError {
        let (path, reason) = (self.path.display().to_string(), reason.to_string());
        CameraError::Recording { path, reason }
    }

    /// The size of the frames and their calibration; the first picture has to be one.
    pub(super) fn glance(mut self) -> Result<Glance, CameraError> {
        let mut size = None;
        let mut n_pictures = 0;
        let mut there = BTreeSet::new();
        while let Some(message) = self.messages.next() {
            let message = message.map_err(|error| self.fault(error))?;
            there.extend(of_pictures(&message.channel));
            match self.heard(&message)? {
                Heard::Colour(_, shown) => {
                    size = size.or(Some(shown.size));
                    n_pictures += 1;
                }
                Heard::Calibration(calibration) if size.is_some() => {
                    let calibration = Some(calibration);
                    return Ok(Glance { size: size.unwrap_or_default(), calibration });
                }
                Heard::Calibration(_) | Heard::Depth(_) | Heard::Other => {}
            }
            if n_pictures > PICTURES_BEFORE_CALIBRATION_MAX {
                break;
            }
        }
        let Some(size) = size else {
            let there: Vec<String> = there.iter().map(|topic| quoted(topic)).collect();
            let (topic, there) = (quoted(&self.topics.colour), there.join(", "));
            let there = if there.is_empty() { "none".to_owned() } else { there };
            return Err(self
                .fault(format!("no picture on the topic {topic}; topics with pictures: {there}")));
        };
        Ok(Glance { size, calibration: None })
    }

    /// The next frame; `None` at the end. Messages that are no pictures are told and passed over.
    pub(super) fn next(&mut self) -> Result<Option<RecordedFrame>, CameraError> {
        while let Some(message) = self.messages.next() {
            let message = message.map_err(|error| self.fault(error))?;
            let heard = match self.heard(&message) {
                Ok(heard) => heard,
                Err(error) => {
                    self.n_broken += 1;
                    tracing::warn!(%error, n_broken = self.n_broken, "picture skipped");
                    continue;
                }
            };
            let frame = match heard {
                Heard::Colour(log_ns, shown) => self.colour(log_ns, shown),
                Heard::Depth(shown) => self.depth(shown),
                Heard::Calibration(_) | Heard::Other => None,
            };
            if frame.is_some() {
                return Ok(frame);
            }
        }
        Ok(self.waiting.take().and_then(|(log_ns, shown)| frame(log_ns, shown, None)))
    }

    fn heard(&self, message: &Message<'_>) -> Result<Heard, CameraError> {
        let Topics { colour, depth, calibration: info, yuv } = &self.topics;
        let topic = message.channel.topic.as_str();
        let is_depth = depth.as_deref() == Some(topic);
        if topic != colour && !is_depth && topic != info {
            return Ok(Heard::Other);
        }
        let Channel { schema, message_encoding, .. } = &*message.channel;
        let recorded = Recorded {
            schema: schema.as_ref().map_or("none", |schema| schema.name.as_str()),
            encoding: message_encoding,
            data: &message.data,
        };
        let wrong = |reason: String| self.fault(format!("topic {}: {reason}", quoted(topic)));
        if topic == info {
            let is_rectified = is_rectified(colour);
            let read = calibration(recorded, is_rectified).map_err(wrong)?;
            return Ok(Heard::Calibration(read));
        }
        let shown = picture(recorded, *yuv).map_err(wrong)?;
        match (&shown.pixels, is_depth) {
            (Pixels::Rgb(_), false) => Ok(Heard::Colour(message.log_time, shown)),
            (Pixels::DepthM(_), true) => Ok(Heard::Depth(shown)),
            (Pixels::DepthM(_), false) => Err(wrong(
                "expected colours, got depth: say it as camera.options.depth_topic".into(),
            )),
            (Pixels::Rgb(_), true) => Err(wrong("expected depth, got colours".into())),
        }
    }

    /// Colours go at once with the depth that is there, or wait for it; those that waited in vain go
    /// without.
    fn colour(&mut self, log_ns: u64, shown: Shown) -> Option<RecordedFrame> {
        if self.topics.depth.is_none() {
            return frame(log_ns, shown, None);
        }
        let before = self.waiting.take();
        let fits = self.newest_depth.as_ref().is_some_and(|depth| is_one(depth, &shown));
        if before.is_none() && fits {
            return frame(log_ns, shown, self.newest_depth.take());
        }
        self.waiting = Some((log_ns, shown));
        before.and_then(|(log_ns, shown)| frame(log_ns, shown, None))
    }

    fn depth(&mut self, depth: Shown) -> Option<RecordedFrame> {
        let waited = self.waiting.take_if(|(_, shown)| is_one(&depth, shown));
        let Some((log_ns, shown)) = waited else {
            self.newest_depth = Some(depth);
            return None;
        };
        frame(log_ns, shown, Some(depth))
    }
}

/// Whether colours and depth are of one moment and one size.
fn is_one(depth: &Shown, colour: &Shown) -> bool {
    depth.size == colour.size && (depth.stamp_ns - colour.stamp_ns).abs() <= DEPTH_APART_NS_MAX
}

fn frame(log_ns: u64, colour: Shown, depth: Option<Shown>) -> Option<RecordedFrame> {
    let Pixels::Rgb(rgb) = colour.pixels else { return None };
    let depth_m = depth.and_then(|depth| match depth.pixels {
        Pixels::DepthM(depth_m) => Some(depth_m),
        Pixels::Rgb(_) => None,
    });
    Some(RecordedFrame { log_ns, size: colour.size, rgb, depth_m })
}

/// The topic of a channel, where it has pictures.
fn of_pictures(channel: &Arc<Channel<'_>>) -> Option<String> {
    let name = &channel.schema.as_ref()?.name;
    PICTURES.contains(&name.as_str()).then(|| channel.topic.clone())
}

/// The topic with what is known of the camera of a topic of pictures, by the rule of ROS: its neighbour.
pub(super) fn info_topic(colour: &str) -> String {
    let plain = ["/compressed", "/compressedDepth"].iter().find_map(|end| colour.strip_suffix(end));
    let plain = plain.unwrap_or(colour);
    match plain.rsplit_once('/') {
        Some((within, _)) => format!("{within}/camera_info"),
        None => "camera_info".to_owned(),
    }
}

/// Whether a topic has pictures that are rectified, by the rule of ROS.
fn is_rectified(colour: &str) -> bool {
    colour.split('/').any(|part| part.starts_with("image_rect"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_and_rectified_pictures_are_known_by_their_names() {
        for (colour, info) in [
            ("/camera/color/image_raw", "/camera/color/camera_info"),
            ("/camera/color/image_raw/compressed", "/camera/color/camera_info"),
            ("/depth/image_rect/compressedDepth", "/depth/camera_info"),
            ("image", "camera_info"),
        ] {
            assert_eq!(info_topic(colour), info);
        }
        assert!(is_rectified("/camera/image_rect_color") && !is_rectified("/rect/image_raw"));
    }
}
