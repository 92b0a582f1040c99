//! Raw video from any program: ffmpeg, or one of your own.

mod jpeg_stream;
mod program;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::calibration::{Known, Viewpoint};
use super::encodings::{Encoding, PixelLayout, Pixels, YuvColours, decode};
use super::{Camera, CameraError, CameraPort, NextFrame, OpenCamera};
use crate::clock::monotonic_ns;
use crate::messages::Frame;
use crate::parts::{Part, PartContext, PartError, options_of};
use program::{Picture, Program};

/// Pictures in a row that may be broken before the camera fails.
const BROKEN_MAX: u32 = 30;

/// `[camera.options]` of the kind "pipe".
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Options {
    /// The program with its arguments. It writes one picture after another to its standard output, at the
    /// rate at which they are to be looked at.
    command: Vec<String>,
    /// Width and height of a picture in pixels.
    size: [u32; 2],
    /// What the bytes of a picture are.
    encoding: Encoding,
    /// Bytes from one row of a picture to the next; without it rows follow one another without a gap.
    stride: Option<u32>,
    /// What Y, U and V are, where the encoding has them.
    yuv: YuvColours,
    /// The encoding of a depth picture of the same size that follows each picture, its rows without a gap.
    /// Without it there is no depth.
    depth: Option<Encoding>,
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
    name: "pipe",
    help: "raw video that a program writes to its standard output, such as ffmpeg",
    options: options_of::<Options>(),
    build,
};

fn build(context: &PartContext<'_, CameraPort>) -> Result<Box<CameraPort>, PartError> {
    let options: Options = context.options()?;
    let Options { size, encoding, stride, yuv, .. } = options;
    if options.command.first().is_none_or(String::is_empty) {
        return Err(context.bad_option("command", "a program and its arguments", "nothing"));
    }
    let colour = PixelLayout { encoding, size, stride, yuv };
    if encoding.is_depth() {
        let expected = "an encoding of colours; depth follows as camera.options.depth";
        return Err(context.bad_option("encoding", expected, "one of depth"));
    }
    colour.bytes().map_err(|error| {
        let reason = format!("camera.options.{error}");
        PartError::Options { file: context.choice.file.clone(), message: reason }
    })?;
    let depth = options.depth.map(|encoding| PixelLayout { encoding, stride: None, ..colour });
    if depth.is_some_and(|depth| !depth.encoding.is_depth()) {
        let expected = "an encoding of depth, such as \"16UC1\" or \"32FC1\"";
        return Err(context.bad_option("depth", expected, "one of colours"));
    }
    let known = Known {
        intrinsics: options.intrinsics.as_deref(),
        intrinsics_px: options.intrinsics_px,
        pose: options.pose,
    };
    let model = Viewpoint::read(context, known)?.model(size)?;
    let [width, height] = size;
    let frame = Frame { width, height, model, ..Frame::default() };
    let command = options.command;
    let open: OpenCamera = Arc::new(move || {
        Ok(Box::new(PipeCamera::start(&command, (colour, depth), frame.clone())?))
    });
    Ok(Box::new(CameraPort { open: Some(open), image_size: Some(size), ..CameraPort::default() }))
}

/// Shows what a program writes.
struct PipeCamera {
    program: Program,
    colour: PixelLayout,
    depth: Option<PixelLayout>,
    frame: Frame,
    n_read: u64,
    /// Pictures in a row that were none.
    n_broken: u32,
}

impl Camera for PipeCamera {
    fn next(&mut self) -> NextFrame<'_> {
        Box::pin(async {
            while self.read().await? {
                if self.n_broken == 0 {
                    return Ok(Some(&self.frame));
                }
            }
            Ok(None)
        })
    }
}

impl PipeCamera {
    /// Starts the program; `frame` has what all frames share.
    fn start(
        command: &[String],
        (colour, depth): (PixelLayout, Option<PixelLayout>),
        frame: Frame,
    ) -> Result<Self, CameraError> {
        let program = Program::start(command)?;
        Ok(Self { program, colour, depth, frame, n_read: 0, n_broken: 0 })
    }

    /// Reads the next picture, with its depth, into the frame; whether there was one.
    async fn read(&mut self) -> Result<bool, CameraError> {
        let pixels = match self.program.picture(&self.colour).await? {
            Picture::End => return Ok(false),
            Picture::Whole(bytes) => decode(&self.colour, bytes),
        };
        let capture_ns = monotonic_ns();
        let depth = match &self.depth {
            None => None,
            Some(layout) => match self.program.picture(layout).await? {
                Picture::End => {
                    return Err(self.program.failure("a picture came without its depth"));
                }
                Picture::Whole(bytes) => Some(decode(layout, bytes)),
            },
        };
        match (pixels, depth.transpose()) {
            (Ok(Pixels::Rgb(rgb)), Ok(depth)) => {
                let depth_m = depth.and_then(|depth| match depth {
                    Pixels::DepthM(depth_m) => Some(depth_m),
                    Pixels::Rgb(_) => None,
                });
                let sequence = self.n_read;
                self.n_read += 1;
                self.n_broken = 0;
                let Frame { width, height, model, .. } = self.frame;
                self.frame = Frame { sequence, capture_ns, width, height, rgb, depth_m, model };
            }
            (Err(error), _) | (_, Err(error)) => self.broken(&error.to_string())?,
            (Ok(Pixels::DepthM(_)), _) => self.broken("expected colours, got depth")?,
        }
        Ok(true)
    }

    /// Passes over a picture that is none, as a cable that is loose makes them.
    fn broken(&mut self, reason: &str) -> Result<(), CameraError> {
        self.n_broken += 1;
        tracing::warn!(reason, "picture skipped");
        if self.n_broken >= BROKEN_MAX {
            let said = format!("{BROKEN_MAX} pictures in a row are broken, the last: {reason}");
            return Err(self.program.failure(&said));
        }
        Ok(())
    }
}
