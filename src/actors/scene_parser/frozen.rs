//! A camera that sends the same picture again and again, under new numbers and stamps.
//!
//! That alone is no fault: a simulated scene without noise looks the same while nothing moves. While the
//! robot's tool moves in view it is one.

use std::hash::{DefaultHasher, Hasher as _};

use nalgebra::Point3;

use super::frames::Shot;
use super::{CameraArgs, Rejection};
use crate::messages::RobotState;

/// So many frames after the first are the same before it is said: more than a driver repeats whose camera
/// is slower than it.
const SAME_FRAMES_MIN: u32 = 10;
/// So far has the tool moved in view meanwhile, metres: much more than a state can be off by.
const TOOL_MOVED_M: f64 = 0.05;

/// Every so many rows of a picture one is looked at: a hash of all takes a quarter of a millisecond of
/// each frame of 640x480.
const ROW_STEP: usize = 8;

/// What one camera has shown last.
#[derive(Debug, Clone, Default)]
pub(super) struct Stillness {
    picture: u64,
    /// Frames that were the same since.
    n_same: u32,
    /// Where the tool was in view with the first of them.
    tool: Option<Point3<f64>>,
    /// How far from there it has been in view since, metres.
    moved_m: f64,
}

impl Stillness {
    /// Takes in a frame, by the hash of its picture, and where the tool is that it must show.
    fn take(&mut self, picture: u64, tool: Option<Point3<f64>>) -> Result<(), String> {
        if picture != self.picture || self.tool.is_none() {
            *self = Self { picture, n_same: 0, tool, moved_m: 0.0 };
            return Ok(());
        }
        self.n_same = self.n_same.saturating_add(1);
        let moved_m = self.tool.zip(tool).map_or(0.0, |(was, is)| (is - was).norm());
        self.moved_m = self.moved_m.max(moved_m);
        if self.n_same < SAME_FRAMES_MIN || self.moved_m < TOOL_MOVED_M {
            return Ok(());
        }
        Err(format!(
            "its last {} pictures are the same, though the robot's tool has moved {:.2} m in view: the \
             camera is frozen, or robot/state or the camera's pose is wrong",
            self.n_same + 1,
            self.moved_m
        ))
    }
}

/// Refuses what frozen cameras show. A camera that does not say where it is, and one without a robot, is
/// believed.
pub(super) fn check_frozen(
    stillness: &mut Vec<Stillness>,
    (cameras, shots): (&[CameraArgs], &[Shot<'_>]),
    robot: Option<&RobotState>,
) -> Result<(), Rejection> {
    let Some(robot) = robot else { return Ok(()) };
    for shot in shots {
        let Some(model) = shot.model else { continue };
        let size = shot.size.map(|side| side as f64);
        let pixel = model.project(robot.position);
        let is_in_view =
            pixel.is_some_and(|p| (0.0..size[0]).contains(&p.x) && (0.0..size[1]).contains(&p.y));
        let tool = is_in_view.then_some(robot.position);
        if stillness.len() <= shot.camera_idx {
            stillness.resize_with(shot.camera_idx + 1, Stillness::default);
        }
        let taken = stillness[shot.camera_idx].take(fingerprint(shot.rgb, shot.size[0]), tool);
        let name = &cameras[shot.camera_idx].name;
        taken.map_err(|reason| Rejection::unusable(&format!("camera {name}: {reason}")))?;
    }
    Ok(())
}

/// A number that is another one for a picture which differs in one of the rows that are looked at. A tool that
/// moves by `TOOL_MOVED_M` in view covers others of them, and noise is everywhere.
fn fingerprint(rgb: &[u8], width: usize) -> u64 {
    let mut hasher = DefaultHasher::new();
    rgb.chunks((3 * width).max(1)).step_by(ROW_STEP).for_each(|row| hasher.write(row));
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_that_differ_where_a_tool_may_be_have_other_fingerprints() {
        let (width, row) = (4, 3 * 4);
        let picture = vec![7; row * 2 * ROW_STEP];
        let mut moved = picture.clone();
        moved[row..][..row * ROW_STEP].fill(8);
        assert_eq!(fingerprint(&picture, width), fingerprint(&picture.clone(), width));
        assert_ne!(fingerprint(&picture, width), fingerprint(&moved, width));
        assert_eq!(fingerprint(&[], 0), fingerprint(&[], 0), "an empty picture is one, too");
    }

    /// Takes pictures with the tool at these places along x; whether the last one is refused.
    fn is_refused(frames: impl IntoIterator<Item = (u64, Option<f64>)>) -> bool {
        let mut stillness = Stillness::default();
        let mut last = Ok(());
        for (picture, x) in frames {
            last = stillness.take(picture, x.map(|x| Point3::new(x, 0.0, 0.2)));
        }
        last.is_err()
    }

    #[test]
    fn a_picture_that_stays_while_the_tool_moves_is_refused() {
        assert!(is_refused((0..11).map(|n| (7, Some(0.01 * f64::from(n))))));
        let too_few = (0..10).map(|n| (7, Some(0.1 * f64::from(n))));
        assert!(!is_refused(too_few), "a slow camera behind a quick driver");
        let back = (0..20).map(|n| (7, Some(if n == 5 { 0.1 } else { 0.0 })));
        assert!(is_refused(back), "it is back where it was, and was elsewhere meanwhile");
    }

    #[test]
    fn what_may_look_the_same_is_believed() {
        assert!(!is_refused((0..99).map(|n| (7, Some(0.0001 * f64::from(n))))), "it hardly moves");
        assert!(!is_refused((0..99).map(|_| (7, None))), "out of view");
        assert!(!is_refused((0..99).map(|n| (n, Some(0.01 * n as f64)))), "the pictures differ");
        let seen_again = (0..99).map(|n| (7, (n > 50).then_some(0.1)));
        assert!(!is_refused(seen_again), "it comes into view and stands there");
    }
}
