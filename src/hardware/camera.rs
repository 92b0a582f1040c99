//! Cameras: frames out. A camera in another process needs no adapter here: it is of the kind
//! `external` and publishes the topic.

use std::pin::Pin;
use std::sync::Arc;

use thiserror::Error;

use super::{HardwareInputs, TrueHistory};
use crate::messages::Frame;
use crate::parts::Role;
use crate::perception::Detection;

/// The next frame, lent until the one after it; `None` when there will be no more.
pub type NextFrame<'a> =
    Pin<Box<dyn Future<Output = Result<Option<&'a Frame>, CameraError>> + Send + 'a>>;

/// A camera, hosted by the camera actor.
pub trait Camera: Send {
    /// Waits until the next frame is due, and captures it.
    fn next(&mut self) -> NextFrame<'_>;
}

/// Opens a camera, for each start of its actor. Called inside a tokio runtime.
pub type OpenCamera = Arc<dyn Fn() -> Result<Box<dyn Camera>, CameraError> + Send + Sync>;

/// A camera as a run file chooses it.
#[derive(Clone, Default)]
#[expect(missing_debug_implementations, reason = "holds closures")]
pub struct CameraPort {
    /// Opens it in this process; without it, another process publishes the frames.
    pub open: Option<OpenCamera>,
    /// Width and height of its frames, where they are known beforehand.
    pub image_size: Option<[u32; 2]>,
    /// What really was, where the camera sees a simulated world: for judging an episode that has
    /// ended.
    pub history: Option<Arc<dyn Fn() -> TrueHistory + Send + Sync>>,
    /// What disturbs the detector that looks at its frames, where the run file says so.
    pub disturb: Option<DisturbDetections>,
}

/// Changes what a detector says of the frame of a number.
pub type DisturbDetections = Arc<dyn Fn(u64, &mut Vec<Detection>) + Send + Sync>;

impl Role for CameraPort {
    type Inputs<'a> = HardwareInputs<'a>;
    const NAME: &'static str = "camera";
    const KEY: &'static str = "camera.kind";
    const OPTIONS: &'static str = "camera.options";
}

/// A camera cannot give frames.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CameraError {
    /// An image file is not usable.
    #[error("{path}: {reason}")]
    Image {
        /// The file.
        path: String,
        /// Why.
        reason: String,
    },
    /// A program that gives pictures has failed.
    #[error("the program {name}: {reason}")]
    Program {
        /// The program.
        name: String,
        /// Why, and what it said last.
        reason: String,
    },
    /// A recording cannot be played.
    #[error("{path}: {reason}")]
    Recording {
        /// The file.
        path: String,
        /// Why.
        reason: String,
    },
    /// A simulated camera cannot render.
    #[error("the simulated camera cannot render: {reason}")]
    Render {
        /// Why.
        reason: String,
    },
}
