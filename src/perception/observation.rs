//! What one camera shows, and the objects that are judged in it.

use super::model::ObjectBox;
use super::{DepthView, ImageView, Unexplained};
use crate::geometry::CameraModel;

/// What one camera shows at one time. Everything is optional: boxes may come from elsewhere, and
/// few cameras measure depth.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameView<'a> {
    /// The colours.
    pub image: Option<ImageView<'a>>,
    /// The depth, as large as the image.
    pub depth: Option<DepthView<'a>>,
    /// Intrinsics and pose of the camera.
    pub camera: Option<&'a CameraModel>,
}

/// What a grounder judges: named objects in the frame that shows them.
#[derive(Debug, Clone, Copy)]
pub struct Observation<'a> {
    /// What the camera shows.
    pub frame: FrameView<'a>,
    /// The objects, each name once. One that is out of sight for the moment stands where it was
    /// last seen.
    pub objects: &'a [ObjectBox],
    /// What is no object and may hide one.
    pub unexplained: &'a [Unexplained],
}

impl<'a> Observation<'a> {
    /// Objects of which nothing but their boxes is at hand.
    pub fn of_boxes(objects: &'a [ObjectBox]) -> Self {
        Self { frame: FrameView::default(), objects, unexplained: &[] }
    }
}
