//! Cameras: frames out. A camera in another process needs no adapter here: it publishes the topic.

use std::pin::Pin;

use thiserror::Error;

use crate::messages::Frame;

/// The next frame, lent until the one after it; `None` when there will be no more.
pub type NextFrame<'a> =
    Pin<Box<dyn Future<Output = Result<Option<&'a Frame>, CameraError>> + Send + 'a>>;

/// A camera, hosted by the camera actor.
pub trait Camera: Send {
    /// Waits until the next frame is due, and captures it.
    fn next(&mut self) -> NextFrame<'_>;
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
    /// A simulated camera cannot render.
    #[error("the simulated camera cannot render: {reason}")]
    Render {
        /// Why.
        reason: String,
    },
}
