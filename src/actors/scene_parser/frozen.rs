//! A camera that sends the same picture again and again, under new numbers and stamps.
//!
//! That alone is no fault: a simulated scene without noise looks the same while nothing moves. While the
//! robot's tool moves in view it is one.

use nalgebra::Point3;

use super::frames::Shot;
use super::{CameraArgs, Rejection};
use crate::messages::RobotState;

/// So many frames after the first are the same before it is said: more than a driver repeats whose camera
/// is slower than it.
const SAME_FRAMES_MIN: u32 = 10;
/// So far has the tool moved in view meanwhile, metres: much more than a state can be off by.
const TOOL_MOVED_M: f64 = 0.05;

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
        let taken = stillness[shot.camera_idx].take(fingerprint(shot.rgb), tool);
        let name = &cameras[shot.camera_idx].name;
        taken.map_err(|reason| Rejection::unusable(&format!("camera {name}: {reason}")))?;
    }
    Ok(())
}

/// A number that is another one for a picture which differs anywhere, as good as always. Words are mixed as
/// in `FxHash`, in lanes of their own: a sound hash of a megabyte takes as long as to detect what it shows.
fn fingerprint(picture: &[u8]) -> u64 {
    const FACTOR: u64 = 0x517c_c1b7_2722_0a95;
    let mix = |sum: u64, word: u64| (sum.rotate_left(5) ^ word).wrapping_mul(FACTOR);
    let (blocks, rest) = picture.as_chunks::<32>();
    let mut lanes = [0; 4];
    for block in blocks {
        let (words, _) = block.as_chunks::<8>();
        lanes.iter_mut().zip(words).for_each(|(lane, word)| {
            *lane = mix(*lane, u64::from_ne_bytes(*word));
        });
    }
    let ends = lanes.into_iter().chain(rest.iter().map(|byte| u64::from(*byte)));
    ends.fold(picture.len() as u64, mix)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_that_differs_in_one_byte_has_another_fingerprint() {
        let picture: Vec<u8> = (0..100_u8).collect();
        let mut seen: Vec<u64> = (0..picture.len())
            .map(|at| {
                let mut other = picture.clone();
                other[at] ^= 1;
                fingerprint(&other)
            })
            .chain([fingerprint(&picture), fingerprint(&picture[..99]), fingerprint(&[])])
            .collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), picture.len() + 3);
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
