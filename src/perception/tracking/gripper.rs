//! What the gripper holds: a gripper feels that it holds something, the tracks say what.

use nalgebra::{Point3, Vector3};

use super::tracker::Track;
use crate::geometry::Aabb;
use crate::messages::RobotState;
use crate::pddl::Name;
use crate::perception::GripperContent;

/// What may have been taken.
#[derive(Debug, Clone, Copy)]
pub(super) struct Taking<'a> {
    /// All known objects.
    pub(super) tracks: &'a [Track],
    /// What the running step takes or carries.
    pub(super) expected: Option<&'a Track>,
    /// Whether this frame shows that where it was.
    pub(super) is_in_place: bool,
    /// How near to the tool an object must be, in metres.
    pub(super) reach_m: f64,
}

/// The object in the gripper.
pub(super) fn held(gripper: &GripperContent) -> Option<&Name> {
    match gripper {
        GripperContent::Holds(name) => Some(name),
        GripperContent::Empty | GripperContent::HoldsSomething => None,
    }
}

/// Follows the gripper from one robot state to the next.
pub(super) fn follow(
    gripper: &GripperContent,
    robot: &RobotState,
    taking: Taking<'_>,
) -> GripperContent {
    match (robot.holding, gripper) {
        (false, _) => GripperContent::Empty,
        (true, GripperContent::Holds(name)) => GripperContent::Holds(name.clone()),
        (true, GripperContent::Empty | GripperContent::HoldsSomething) => {
            let taken = taking.taken(robot.position);
            taken.map_or(GripperContent::HoldsSomething, |name| GripperContent::Holds(name.clone()))
        }
    }
}

impl<'a> Taking<'a> {
    /// What the running step takes, if it is at the tool, though something else may be as near: a peg. Or if it
    /// has left its place: at few frames per second the tool has gone far by the time that anything is known of
    /// the grasp. Else the object whose volume is
    /// nearest to the tool centre, within reach; none of them for an object that nobody has seen.
    fn taken(&self, tool: Point3<f64>) -> Option<&'a Name> {
        let near = |track: &Track| distance_m(track, tool).filter(|d| *d <= self.reach_m);
        let distances =
            self.tracks.iter().filter_map(|track| Some((near(track)?, &track.object.name)));
        let nearest: Option<(f64, &Name)> =
            distances.min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(b.1)));
        let expected = self
            .expected
            .filter(|track| near(track).is_some() || (nearest.is_none() && !self.is_in_place));
        expected.map(|track| &track.object.name).or(nearest.map(|(_, name)| name))
    }
}

/// Where what is held is: it goes with the tool, which is somewhere within it.
pub(super) fn carry(volume: &mut Aabb, tool: Point3<f64>) {
    for axis in 0..3 {
        let half = volume.extent[axis] / 2.0;
        let offset = volume.centre[axis] - tool[axis];
        volume.centre[axis] = tool[axis] + offset.clamp(-half, half);
    }
}

/// Distance of a point from a track's volume; zero inside. Ties inside go to the nearer middle by
/// adding a small share of its distance.
fn distance_m(track: &Track, point: Point3<f64>) -> Option<f64> {
    let volume = track.object.volume?;
    let offset = point - volume.centre;
    let outside = Vector3::new(
        (offset.x.abs() - volume.extent[0] / 2.0).max(0.0),
        (offset.y.abs() - volume.extent[1] / 2.0).max(0.0),
        (offset.z.abs() - volume.extent[2] / 2.0).max(0.0),
    );
    Some(outside.norm() + 0.01 * offset.norm())
}
