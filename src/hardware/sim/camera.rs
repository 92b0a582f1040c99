//! The simulated camera: renders the world that `robots/sim.rs` moves.

use std::time::Duration;

use groundloop_sim::{CameraSpec, Renderer};
use tokio::sync::watch;
use tokio::time::{Interval, MissedTickBehavior};

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
        Some(Self { hardware, name, camera, renderer, buffer, frame, released, ticks, next })
    }

    fn capture(&mut self) -> Result<(), CameraError> {
        let sequence = self.next;
        self.next += 1;
        let seed = self.hardware.frame_seed(&self.name, sequence);
        let (renderer, buffer, camera) = (&mut self.renderer, &mut self.buffer, &self.camera);
        let (capture_ns, (model, rendered)) = self.hardware.look(|world| {
            let here = camera.with_gripper_at(world.gripper().position);
            (model_of(&here), renderer.render_into(world, &here, seed, buffer))
        });
        self.frame.model = Some(model);
        rendered.map_err(|e| CameraError::Render { reason: e.to_string() })?;
        self.hardware.witness(&self.name, sequence, &buffer.ids);
        // The buffers change places, so that no frame needs new memory.
        std::mem::swap(&mut self.frame.rgb, &mut buffer.rgb);
        std::mem::swap(self.frame.depth_m.get_or_insert_default(), &mut buffer.depth_m);
        (self.frame.sequence, self.frame.capture_ns) = (sequence, capture_ns);
        Ok(())
    }
}

impl Camera for SimCamera {
    fn next(&mut self) -> NextFrame<'_> {
        Box::pin(async {
            if let Some(ticks) = &mut self.ticks {
                ticks.tick().await;
            } else {
                let next = self.next;
                if self.released.wait_for(|released| *released > next).await.is_err() {
                    return Ok(None); // the world is gone
                }
            }
            tokio::task::block_in_place(|| self.capture())?;
            Ok(Some(&self.frame))
        })
    }
}
