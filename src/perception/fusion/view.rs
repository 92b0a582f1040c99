//! What one camera sees, and where an object is in its image.

use nalgebra::Point3;

use crate::geometry::{Aabb, CameraModel, PixelBox};
use crate::perception::{BoxEstimate, Detection, FrameView};

/// What one camera sees of the scene at one time.
#[derive(Debug, Clone)]
pub struct CameraView<'a> {
    /// The camera's name.
    pub camera: &'a str,
    /// Its depth, and its lens and pose: without them nothing in it has a place.
    pub frame: FrameView<'a>,
    /// What it sees, with places in the world.
    pub detections: Vec<Detection>,
    /// Where the robot, or what it holds, may hide something, in its image.
    pub occluders: Vec<PixelBox>,
}

impl CameraView<'_> {
    /// Whether the robot may hide a part of a detection.
    pub(super) fn is_covered(&self, detection: &Detection) -> bool {
        self.occluders.iter().any(|o| o.intersection(&detection.pixel_box).area() > 0.0)
    }
}

/// A detection with its view: both by their indices.
pub(super) type Place = (usize, usize);

/// The corners of an estimate, shrunk about its middle, in the world.
pub(super) fn corners(
    estimate: &BoxEstimate,
    share: f64,
) -> impl Iterator<Item = Point3<f64>> + use<> {
    let (volume, heading) = (estimate.volume, estimate.heading);
    let centre = heading.view_from_world(volume.centre);
    let shrunk = Aabb { centre, extent: volume.extent.map(|edge| share * edge) };
    shrunk.corners().map(move |corner| heading.world_from_view(corner))
}

/// The box of an estimate in a camera's image; `None` when a part of it is behind the camera.
pub(super) fn in_image(estimate: &BoxEstimate, camera: &CameraModel) -> Option<PixelBox> {
    camera.bounds(corners(estimate, 1.0)).filter(PixelBox::is_valid)
}
