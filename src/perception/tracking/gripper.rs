//! What the gripper holds: a gripper feels that it holds something, the tracks say what.

use nalgebra::{Point3, Vector3};

use super::tracker::Track;
use crate::messages::RobotState;
use crate::pddl::Name;
use crate::perception::GripperContent;

/// Follows the gripper from one robot state to the next.
///
/// What is taken is the object that was last at the tool: the one whose volume is nearest to the
/// tool centre, within `reach_m`; `None` of the candidates is nearer than that for an object that
/// nobody has seen.
pub(super) fn follow(
    gripper: &GripperContent,
    robot: &RobotState,
    tracks: &[Track],
    reach_m: f64,
) -> GripperContent {
    match (robot.holding, gripper) {
        (false, _) => GripperContent::Empty,
        (true, GripperContent::Holds(name)) => GripperContent::Holds(name.clone()),
        (true, GripperContent::Empty | GripperContent::HoldsSomething) => {
            let distances = tracks.iter().filter_map(|track| {
                let distance = distance_m(track, robot.position)?;
                (distance <= reach_m).then_some((distance, &track.object.name))
            });
            let nearest: Option<(f64, &Name)> =
                distances.min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(b.1)));
            nearest.map_or(GripperContent::HoldsSomething, |(_, name)| {
                GripperContent::Holds(name.clone())
            })
        }
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
