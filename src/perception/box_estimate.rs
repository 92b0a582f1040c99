//! The box of an object in the world, as far as one image shows it.

use nalgebra::{Point3, Vector3};

use crate::geometry::{Aabb, CameraModel};

/// What depth says of a detected object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxEstimate {
    /// The volume of what is visible of it.
    pub volume: Aabb,
    /// Sides on which something nearer, or the image's edge, hides how far it reaches.
    pub cut: TruncatedSides,
    /// Which way the camera looks.
    pub(super) heading: Heading,
}

/// The horizontal direction in which a camera looks; volumes are measured along and across it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Heading(pub(super) [f64; 2]);

impl Heading {
    /// Of a camera that is not turned about its own axis and looks level or down, even straight
    /// down: then "along" is up in the image.
    pub(super) fn of(camera: &CameraModel) -> Self {
        let ahead = camera.world_from_camera * Vector3::new(0.0, -1.0, 1.0);
        let length = ahead.xy().norm();
        // Only a camera that looks up has none: it measures as one that looks along y.
        if length > 0.0 { Self([ahead.x / length, ahead.y / length]) } else { Self([0.0, 1.0]) }
    }

    /// From the world to a frame with x to the right of the camera, y ahead, and the same z.
    pub(super) fn view_from_world(self, p: Point3<f64>) -> Point3<f64> {
        let Self([x, y]) = self;
        Point3::new(y * p.x - x * p.y, x * p.x + y * p.y, p.z)
    }

    /// And back.
    pub(super) fn world_from_view(self, p: Point3<f64>) -> Point3<f64> {
        let Self([x, y]) = self;
        Point3::new(y * p.x + x * p.y, y * p.y - x * p.x, p.z)
    }
}

/// Sides of a visible volume that are not the object's own, as the camera sees them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TruncatedSides {
    /// The edge at the smallest column.
    pub left: bool,
    /// The edge at the largest column.
    pub right: bool,
    /// The lower one.
    pub bottom: bool,
}

impl BoxEstimate {
    /// Puts the sides that are cut where the usual size of such objects says.
    pub fn complete_cut_sides(&mut self, extent: [f64; 3]) {
        if self.cut != TruncatedSides::default()
            && let Some(whole) = self.completed(&Aabb { extent, ..self.volume })
        {
            self.volume = whole;
        }
    }

    /// The whole object, given how large it is known to be: a side that is cut is put where the
    /// opposite side says. `None` when left and right are cut, and nothing says where it is.
    pub fn completed(&self, known: &Aabb) -> Option<Aabb> {
        let Self { volume, cut, heading } = self;
        let volume = Aabb { centre: heading.view_from_world(volume.centre), ..*volume };
        let ([x_low, x_high], [_, z_high]) = (volume.span(0), volume.span(2));
        let [width, depth, height] = known.extent;
        let (x_low, x_high) = match (cut.left, cut.right) {
            (true, true) => return None,
            (true, false) => (x_high - width, x_high),
            (false, true) => (x_low, x_low + width),
            (false, false) => (x_low, x_high),
        };
        let is_cut = cut.left || cut.right;
        let extent_y = if is_cut { depth } else { volume.extent[1] };
        let extent_z = if cut.bottom { height } else { volume.extent[2] };
        let front = volume.span(1)[0];
        let centre = Point3::new(
            f64::midpoint(x_low, x_high),
            front + extent_y / 2.0,
            z_high - extent_z / 2.0,
        );
        Some(Aabb {
            centre: heading.world_from_view(centre),
            extent: [x_high - x_low, extent_y, extent_z],
        })
    }
}
