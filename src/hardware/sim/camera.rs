//! The simulated camera: renders the world that `robots/sim.rs` moves.

use std::time::Duration;

use groundloop_sim::{CameraSpec, Renderer};
use nalgebra::{Rotation3, Vector3};
use tokio::sync::watch;
use tokio::time::{Interval, MissedTickBehavior};

use super::faults::{Planned, Rendered};
use super::robot::SimHardware;
use crate::clock::ClockKind;
use crate::geometry::{CameraModel, Intrinsics};
use crate::hardware::{Camera, CameraError, NextFrame};
use crate::messages::Frame;

/// Renders one frame for every answer (lockstep), or at its rate (realtime).
pub struct SimCamera {
    hardware: SimHardware,
    /// Its name in the run file.
    name: String,
    camera: CameraSpec,
    renderer: Renderer,
    buffer: groundloop_sim::Frame,
    frame: Frame,
    released: watch::Receiver<u64>,
    ticks: Option<Interval>,
    next: u64,
    is_shown_again: bool,
}

impl std::fmt::Debug for SimCamera {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SimCamera").field("next", &self.next).finish_non_exhaustive()
    }
}

/// Pose and intrinsics of a simulated camera.
pub fn model_of(camera: &CameraSpec) -> CameraModel {
    let k = camera.intrinsics();
    CameraModel {
        intrinsics: Intrinsics { fx: k.fx, fy: k.fy, cx: k.cx, cy: k.cy },
        world_from_camera: camera.world_from_camera(),
    }
}

impl SimCamera {
    /// A camera of a simulated world by its name; `None` where it has none of that name. Must be
    /// called inside a tokio runtime.
    pub fn new(hardware: SimHardware, name: &str) -> Option<Self> {
        let camera = hardware.camera(name)?.clone();
        let ticks = (hardware.clock == ClockKind::Realtime).then(|| {
            let mut ticks = tokio::time::interval(Duration::from_nanos(hardware.frame_ns));
            ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
            ticks
        });
        let released = hardware.released();
        // The frame that waits for an answer is shown (again, after a restart).
        let next = released.borrow().saturating_sub(1);
        let (renderer, buffer) = (Renderer::new(), groundloop_sim::Frame::default());
        let frame = Frame {
            sequence: 0,
            capture_ns: 0,
            width: camera.width,
            height: camera.height,
            rgb: Vec::new(),
            depth_m: Some(Vec::new()),
            model: Some(model_of(&camera)),
        };
        let name = name.to_owned();
        let is_shown_again = false;
        Some(Self {
            hardware,
            name,
            camera,
            renderer,
            buffer,
            frame,
            released,
            ticks,
            next,
            is_shown_again,
        })
    }

    /// Waits until a frame is due; false when none will be any more.
    async fn is_due(&mut self) -> bool {
        let Some(ticks) = &mut self.ticks else {
            let next = self.next;
            let Ok(released) = self.released.wait_for(|released| *released > next).await else {
                return false;
            };
            // Only the newest waits for an answer: those before it are lost.
            self.next = *released - 1;
            return true;
        };
        ticks.tick().await;
        true
    }

    /// Captures the next frame; whether it is to be shown.
    fn capture(&mut self) -> Result<bool, CameraError> {
        let sequence = self.next;
        self.next += 1;
        let planned = self.hardware.planned(&self.name, sequence);
        if planned.iter().any(Planned::drops) {
            return Ok(false);
        }
        let seed = self.hardware.frame_seed(&self.name, sequence);
        let (renderer, buffer, camera) = (&mut self.renderer, &mut self.buffer, &self.camera);
        let (capture_ns, (model, rendered)) = self.hardware.look(|world| {
            let here = camera.with_gripper_at(world.gripper().position);
            let bumps = planned.iter().filter_map(Planned::bump);
            let really = bumps.fold(None, |_, bump| Some(bumped(&here, bump)));
            let really = really.as_ref().unwrap_or(&here);
            (model_of(&here), renderer.render_into(world, really, seed, buffer))
        });
        self.frame.model = Some(model);
        rendered.map_err(|e| CameraError::Render { reason: e.to_string() })?;
        self.hardware.witness(&self.name, sequence, &buffer.ids);
        // The buffers change places, so that no frame needs new memory.
        std::mem::swap(&mut self.frame.rgb, &mut buffer.rgb);
        std::mem::swap(self.frame.depth_m.get_or_insert_default(), &mut buffer.depth_m);
        (self.frame.sequence, self.frame.capture_ns) = (sequence, capture_ns);
        let rendered =
            Rendered { camera: &self.name, frame: &mut self.frame, ids: &self.buffer.ids };
        self.hardware.disturb(&planned, rendered);
        self.is_shown_again = planned.iter().any(Planned::repeats);
        Ok(true)
    }
}

/// A camera that stands off its place, and is turned about the vertical.
fn bumped(camera: &CameraSpec, ([x, y, z], by_rad): ([f64; 3], f64)) -> CameraSpec {
    let position_m = camera.position_m + Vector3::new(x, y, z);
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), by_rad);
    let look_at_m = position_m + turn * (camera.look_at_m - camera.position_m);
    CameraSpec { position_m, look_at_m, ..camera.clone() }
}

impl Camera for SimCamera {
    fn next(&mut self) -> NextFrame<'_> {
        Box::pin(async {
            if std::mem::take(&mut self.is_shown_again) {
                return Ok(Some(&self.frame));
            }
            while self.is_due().await {
                if tokio::task::block_in_place(|| self.capture())? {
                    return Ok(Some(&self.frame));
                }
            }
            Ok(None) // the world is gone
        })
    }
}
