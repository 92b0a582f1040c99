//! Photographs from a folder, each shown for a while.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use image::RgbImage;
use schemars::JsonSchema;
use serde::Deserialize;
use tokio::time::{Interval, MissedTickBehavior};

use super::calibration::{Known, Viewpoint};
use super::file::read_rgb;
use super::{Camera, CameraError, CameraPort, NextFrame, OpenCamera};
use crate::clock::monotonic_ns;
use crate::geometry::CameraModel;
use crate::messages::Frame;
use crate::parts::{Part, PartContext, PartError, options_of};

/// Shows each image of a list `repeat` times, again and again.
#[derive(Debug)]
pub struct ImageCamera {
    frames: Vec<Frame>,
    repeat: u64,
    ticks: Interval,
    sequence: u64,
}

/// `[camera.options]` of the kind "images".
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Options {
    /// A folder of images, which are shown in the order of their names, or one image.
    path: String,
    /// Frames that each image is shown for.
    #[schemars(range(min = 1))]
    repeat: u64,
    /// A calibration: `camera_info` of ROS, or `FileStorage` of `OpenCV`, in YAML.
    intrinsics: Option<String>,
    /// Focal lengths and principal point fx, fy, cx, cy at the size of the frames, instead of a calibration.
    intrinsics_px: Option<[f64; 4]>,
    /// Where the camera stands in the world: x, y, z in metres, and the quaternion x, y, z, w that turns
    /// camera axes (x right, y down, z forward) to world axes.
    pose: Option<[f64; 7]>,
}

/// The entry of the table of cameras.
pub(super) const CAMERA: Part<CameraPort> = Part {
    name: "images",
    help: "image files, each shown for a while, again and again",
    options: options_of::<Options>(),
    build,
};

fn build(context: &PartContext<'_, CameraPort>) -> Result<Box<CameraPort>, PartError> {
    let Options { path, repeat, intrinsics, intrinsics_px, pose } = context.options()?;
    let (path, rate_hz) = (context.path(&path), context.inputs.rate_hz);
    let fault = |reason: String| PartError::Inputs { reason };
    let images = find_images(&path).map_err(|e| fault(e.to_string()))?;
    let first = images.first().map(|first| read(first).map_err(|e| fault(e.to_string())));
    let image_size = first.transpose()?.map(|image| [image.width(), image.height()]);
    let known = Known { intrinsics: intrinsics.as_deref(), intrinsics_px, pose };
    let viewpoint = Viewpoint::read(context, known)?;
    let model = image_size.map(|size| viewpoint.model(size)).transpose()?.flatten();
    let open: OpenCamera =
        Arc::new(move || Ok(Box::new(ImageCamera::open(&path, rate_hz, repeat, model)?)));
    Ok(Box::new(CameraPort { open: Some(open), image_size, ..CameraPort::default() }))
}

/// Endings of files that count as images.
const ENDINGS: [&str; 3] = ["jpg", "jpeg", "png"];

/// The images of a folder in order of their names, or the one image that `path` names.
///
/// # Errors
/// [`CameraError::Image`] naming the folder when there is none.
pub fn find_images(path: &Path) -> Result<Vec<PathBuf>, CameraError> {
    if path.is_file() {
        return Ok(vec![path.to_owned()]);
    }
    let fault = |reason: String| CameraError::Image { path: path.display().to_string(), reason };
    let entries = std::fs::read_dir(path).map_err(|e| fault(e.to_string()))?;
    let is_image = |path: &PathBuf| {
        let ending = path.extension().and_then(|e| e.to_str()).map(str::to_lowercase);
        ending.is_some_and(|e| ENDINGS.contains(&e.as_str()))
    };
    let mut images: Vec<PathBuf> =
        entries.filter_map(|e| Some(e.ok()?.path())).filter(is_image).collect();
    images.sort();
    if images.is_empty() {
        return Err(fault(format!("no image ({}) here", ENDINGS.join(", "))));
    }
    Ok(images)
}

/// An image; the error names its path.
fn read(path: &Path) -> Result<RgbImage, CameraError> {
    read_rgb(path)
        .map_err(|e| CameraError::Image { path: path.display().to_string(), reason: e.to_string() })
}

impl ImageCamera {
    /// A camera that shows the images at `path` (see [`find_images`]) at `rate_hz`, each for
    /// `repeat` frames; `model` is where they were taken from, where that is known.
    ///
    /// # Errors
    /// [`CameraError::Image`] naming the file that is not an image.
    pub fn open(
        path: &Path,
        rate_hz: f64,
        repeat: u64,
        model: Option<CameraModel>,
    ) -> Result<Self, CameraError> {
        let images = find_images(path)?;
        let frames = images.iter().map(|path| read(path).map(|image| still(image, model)));
        let frames = frames.collect::<Result<_, CameraError>>()?;
        let mut ticks = tokio::time::interval(Duration::from_secs_f64(1.0 / rate_hz));
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        Ok(Self { frames, repeat: repeat.max(1), ticks, sequence: 0 })
    }
}

/// An image as a frame.
fn still(image: RgbImage, model: Option<CameraModel>) -> Frame {
    let (width, height) = image.dimensions();
    Frame { width, height, rgb: image.into_raw(), model, ..Frame::default() }
}

impl Camera for ImageCamera {
    fn next(&mut self) -> NextFrame<'_> {
        Box::pin(async {
            self.ticks.tick().await;
            let sequence = self.sequence;
            self.sequence += 1;
            let frame_idx = (sequence / self.repeat) as usize % self.frames.len().max(1);
            let Some(frame) = self.frames.get_mut(frame_idx) else { return Ok(None) };
            (frame.sequence, frame.capture_ns) = (sequence, monotonic_ns());
            Ok(Some(&*frame))
        })
    }
}
