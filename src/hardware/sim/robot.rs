//! The simulated gripper, and the world that it shares with the simulated camera.
//!
//! Only this file, its faults and `cameras/sim.rs` know the simulator: together they play the hardware.
//! The world outlives the actors that show it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use groundloop_sim::{CameraSpec, SceneSpec, World};
use tokio::sync::watch;

use super::config::SimConfig;
use super::faults::{
    ArmFaults, FaultSchedule, Occasion, Planned, Rendered, RobotParts, SensorFaults, SimArm, happen,
};
use super::witness::{Moment, Witness};
use crate::clock::{ClockKind, monotonic_ns};
use crate::files::{FileRef, Folder};
use crate::hardware::{FaultConfig, Robot, Sequencer};
use crate::messages::{Command, CommandKind, MAIN_CAMERA, RobotState, Status, StatusKind};
use crate::metrics::FaultRecord;
use crate::mismatch::Mismatch;
use crate::parts::PartError;
use crate::pddl::Step;
use crate::perception::Detection;
use crate::settings::TomlFile;

/// Control periods per second of the simulated robot.
const CONTROL_HZ: u64 = 120;
/// How long all frames may be lost in lockstep, simulated time: then none comes any more.
const BLIND_NS_MAX: u64 = 60_000_000_000;
/// What a simulated world is built from.
#[derive(Debug, Clone, Copy)]
pub struct SimSetup<'a> {
    /// `[sim]` of a run file.
    pub sim: &'a SimConfig,
    /// What the path of the scene starts from: the domain's folder.
    pub folder: &'a Folder,
    /// What disturbs the world.
    pub faults: &'a [FaultConfig],
    /// Which clock drives the world.
    pub clock: ClockKind,
    /// Frames per second.
    pub rate_hz: f64,
    /// Seed of everything random.
    pub seed: u64,
}

/// The simulated world as its actors share it.
#[derive(Clone)]
pub struct SimHardware {
    shared: Arc<Mutex<Hardware>>,
    /// How many frames may have been captured (lockstep).
    released: watch::Sender<u64>,
    /// Size, lens and pose of each camera that can be rendered.
    cameras: Arc<BTreeMap<String, CameraSpec>>,
    /// Frame period.
    pub frame_ns: u64,
    /// Which clock drives the world.
    pub clock: ClockKind,
    seed: u64,
    /// Whether a fault waits for frames or is done to them, and whether one is done to what is detected.
    disturbs: [bool; 2],
}

impl std::fmt::Debug for SimHardware {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SimHardware").field("seed", &self.seed).finish_non_exhaustive()
    }
}

/// Everything that must survive a restart of the actors.
struct Hardware {
    world: World,
    sequencer: Sequencer,
    faults: FaultSchedule,
    arm_faults: ArmFaults,
    sensor_faults: SensorFaults,
    /// The cameras, where a fault concerns frames; none otherwise.
    disturbed_cameras: Vec<String>,
    /// Whether frames have been lost for too long: no more is taken (lockstep).
    is_blind: bool,
    /// What came of the faults so far.
    records: Vec<FaultRecord>,
    /// What really was.
    witness: Witness,
    /// The command whose step is carried out, and the step.
    running: Option<(u64, Step)>,
    /// What the gripper held last.
    held: Option<String>,
    /// The frame that waits for an answer (lockstep).
    frame: u64,
    answered: Option<u64>,
    n_states: u64,
    n_statuses: u64,
    pending: Vec<Status>,
    /// Monotonic clock at simulated time zero (realtime).
    epoch_ns: Option<u64>,
    clock: ClockKind,
}

impl SimHardware {
    /// Builds a world.
    ///
    /// # Errors
    /// [`PartError`] naming the key, the scene file and the body.
    pub fn build(setup: &SimSetup<'_>) -> Result<Self, PartError> {
        let SimSetup { sim, folder, faults, clock, rate_hz, seed } = *setup;
        let bad = |key: &str, expected: &str, got: String| PartError::Inputs {
            reason: Mismatch::new(key, expected, got).to_string(),
        };
        let mut cameras = BTreeMap::new();
        for (name, mut camera) in sim.every_camera() {
            let key = SimConfig::key_of(&name);
            camera.check().map_err(|e| bad(&key, "a sound camera", e.to_string()))?;
            camera.light.seed = seed;
            cameras.insert(name, camera);
        }
        let scene = read_scene(&folder.file(&sim.scene))?;
        let world = World::new(&scene, &sim.world, seed)
            .map_err(|e| bad("sim.scene", "a sound scene", e.to_string()))?;
        let faults = FaultSchedule::new(faults, seed)
            .map_err(|e| bad("fault.action", "a fault that the simulator knows", e.to_string()))?;
        let of_detector = faults.sensing().any(|fault| fault.what.is_of_detector());
        let disturbs = [faults.concerns_frames(), of_detector];
        let mut hardware = Hardware {
            world,
            sequencer: Sequencer::default(),
            sensor_faults: SensorFaults::new(&faults),
            disturbed_cameras: cameras.keys().filter(|_| disturbs[0]).cloned().collect(),
            is_blind: false,
            faults,
            arm_faults: ArmFaults::default(),
            records: Vec::new(),
            witness: Witness::default(),
            running: None,
            held: None,
            frame: 0,
            answered: None,
            n_states: 0,
            n_statuses: 0,
            pending: Vec::new(),
            epoch_ns: None,
            clock,
        };
        // What is due at 0 has happened when the first frame is taken.
        hardware.let_faults_happen();
        let frame_ns = (1e9 / rate_hz) as u64;
        if clock == ClockKind::Lockstep {
            hardware.frame_is_due(frame_ns);
        }
        Ok(Self {
            shared: Arc::new(Mutex::new(hardware)),
            released: watch::Sender::new(0),
            cameras: Arc::new(cameras),
            frame_ns,
            clock,
            seed,
            disturbs,
        })
    }

    fn lock(&self) -> MutexGuard<'_, Hardware> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks at the world; returns its time with what `look` makes of it. In lockstep that is the
    /// time of the frame that waits for an answer; otherwise the monotonic clock.
    pub fn look<T>(&self, look: impl FnOnce(&World) -> T) -> (u64, T) {
        let hardware = self.lock();
        (hardware.run_time_ns(), look(&hardware.world))
    }

    /// Tells how many frames may have been captured (lockstep).
    pub fn released(&self) -> watch::Receiver<u64> {
        self.released.subscribe()
    }

    /// A camera by its name: size, lens and pose.
    pub fn camera(&self, name: &str) -> Option<&CameraSpec> {
        self.cameras.get(name)
    }

    /// Seed of the noise in one frame of a camera.
    pub fn frame_seed(&self, camera: &str, sequence: u64) -> u64 {
        let of_run = self.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(sequence);
        // FNV-1a over the name; nothing of it for the camera that every run has.
        let name = camera.bytes().filter(|_| camera != MAIN_CAMERA);
        name.fold(of_run, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    }

    /// What really is, and which bodies look alike, for scoring after the episode; nothing in the
    /// loop may ask.
    pub fn oracle(&self) -> (groundloop_sim::Truth, Vec<Vec<String>>) {
        let hardware = self.lock();
        (hardware.world.truth(), hardware.world.look_alikes())
    }

    /// A camera has taken a frame of the world as it is; `ids` says which body each pixel shows.
    pub(super) fn witness(&self, camera: &str, frame: u64, ids: &[u16]) {
        let hardware = &mut *self.lock();
        hardware.witness.see(camera, frame, &hardware.world, ids);
    }

    /// What really was, in order of the frames, and what the robot was told in answer to which frame; like
    /// the oracle for after the episode.
    pub(super) fn remembered(&self) -> (Vec<Moment>, Vec<(u64, Step)>) {
        let witness = &self.lock().witness;
        (witness.moments().cloned().collect(), witness.dispatches().cloned().collect())
    }

    /// The faults that have happened, and those that could not, in order.
    pub fn faults(&self) -> Vec<FaultRecord> {
        self.lock().records.clone()
    }

    /// What is done to a frame that a camera takes now. In lockstep that was decided when the frame
    /// became due.
    pub(super) fn planned(&self, camera: &str, sequence: u64) -> Vec<Planned> {
        if !self.disturbs[0] {
            return Vec::new();
        }
        let mut hardware = self.lock();
        if hardware.clock == ClockKind::Realtime {
            hardware.take_frame(&[camera.to_owned()], sequence);
        }
        hardware.sensor_faults.planned(camera, sequence)
    }

    /// Does to a frame what is planned for it.
    pub(super) fn disturb(&self, planned: &[Planned], mut rendered: Rendered<'_>) {
        if !self.disturbs[0] {
            return;
        }
        let seed = {
            let mut hardware = self.lock();
            let Hardware { world, sensor_faults, faults, .. } = &mut *hardware;
            sensor_faults.exchange(world, planned, &mut rendered);
            faults.seed()
        };
        for planned in planned {
            planned.spoil(seed, rendered.frame);
        }
    }

    /// Whether any fault is done to what detectors say.
    pub(super) fn disturbs_detections(&self) -> bool {
        self.disturbs[1]
    }

    /// Disturbs what a detector says of a frame.
    pub(super) fn disturb_detections(
        &self,
        camera: &str,
        sequence: u64,
        detections: &mut Vec<Detection>,
    ) {
        let mut hardware = self.lock();
        hardware.sensor_faults.disturb_detections(camera, sequence, detections);
        hardware.write_down(None);
    }

    /// The robot of this world.
    pub fn robot(&self) -> Box<dyn Robot> {
        Box::new(SimRobot(self.clone()))
    }
}

/// Reads a scene file.
///
/// # Errors
/// [`PartError::File`] when it cannot be read, [`PartError::Problems`]: every unknown key and wrong
/// value, with file and line.
pub fn read_scene(file: &FileRef) -> Result<SceneSpec, PartError> {
    Ok(TomlFile::parse(&file.to_string(), &file.text()?)?.read()?)
}

impl Hardware {
    fn run_time_ns(&self) -> u64 {
        match self.clock {
            ClockKind::Lockstep => self.world.time_ns(),
            ClockKind::Realtime => monotonic_ns(),
        }
    }

    fn say(&mut self, command_id: u64, kind: StatusKind) {
        let (sequence, capture_ns) = (self.n_statuses, self.run_time_ns());
        self.n_statuses += 1;
        self.pending.push(Status { sequence, capture_ns, command_id, kind });
    }

    fn obey(&mut self, command: &Command) {
        let arm = &mut SimArm { world: &mut self.world, faults: &mut self.arm_faults };
        let said = self.sequencer.accept(command.id, &command.kind, arm);
        if matches!(command.kind, CommandKind::Start(_)) && said == Some(StatusKind::Accepted) {
            self.running = command.step.clone().map(|step| (command.id, step));
            if let Some(step) = &command.step {
                self.witness.dispatched(command.frame_sequence, step);
                self.faults.note(Occasion::Started(step), self.world.time_ns());
            }
            let has_step = self.running.is_some();
            let Self { world, sequencer, .. } = self;
            self.arm_faults.moving(RobotParts { world, sequencer, has_step });
        }
        if let Some(kind) = said {
            self.say(command.id, kind);
        }
        self.write_down(None);
    }

    /// Keeps what has come of faults, with the first frame that can show it.
    fn write_down(&mut self, record: Option<FaultRecord>) {
        let frame = self.witness.next_frame();
        let waited = self.arm_faults.happened.drain(..);
        let records = waited.chain(self.sensor_faults.happened.drain(..)).chain(record);
        self.records.extend(records.map(|record| FaultRecord { frame, ..record }));
    }

    /// Lets the world go on until `time_ns`, one control period after the other.
    fn advance(&mut self, time_ns: u64) {
        let period_ns = 1_000_000_000 / CONTROL_HZ;
        while self.world.time_ns() < time_ns {
            let next_ns = (self.world.time_ns() + period_ns).min(time_ns);
            let before_ns = self.world.time_ns();
            self.world.advance_to(next_ns);
            self.look_what_is_held();
            self.let_faults_happen();
            let passed_ns = self.world.time_ns() - before_ns;
            self.arm_faults.pass(&mut self.world, passed_ns);
            let arm = &mut SimArm { world: &mut self.world, faults: &mut self.arm_faults };
            if let Some((id, kind)) = self.sequencer.tick(arm) {
                self.say(id, kind);
                if let Some((_, step)) = self.running.take_if(|(running, _)| *running == id) {
                    self.faults.note(Occasion::Ended(&step), self.world.time_ns());
                }
            }
            self.write_down(None);
            if self.world.time_ns() == before_ns {
                return; // less than one physics step is left
            }
        }
    }

    fn look_what_is_held(&mut self) {
        let held = self.world.held();
        if held == self.held.as_deref() {
            return;
        }
        if let Some(object) = held {
            self.faults.note(Occasion::Taken(object), self.world.time_ns());
        }
        self.held = held.map(str::to_owned);
    }

    fn let_faults_happen(&mut self) {
        let has_step = self.running.is_some();
        for due in self.faults.due(self.world.time_ns()) {
            let Self { world, sequencer, .. } = self;
            let robot = RobotParts { world, sequencer, has_step };
            let faults = (&mut self.arm_faults, &mut self.sensor_faults);
            let record = happen(due, self.faults.seed(), robot, faults);
            self.write_down(record);
        }
    }

    /// Decides what happens to a frame that these cameras take now.
    fn take_frame(&mut self, cameras: &[String], sequence: u64) {
        let now_ns = self.world.time_ns();
        for camera in cameras {
            self.faults.note(Occasion::Frame(camera), now_ns);
        }
        self.let_faults_happen();
        for camera in cameras {
            self.sensor_faults.take(camera, sequence, now_ns);
        }
        self.write_down(None);
    }

    /// The world stands as the next frame shall show it. A frame that any camera loses is shown by none:
    /// the world goes on to the next one, as if the loop had said to continue.
    fn frame_is_due(&mut self, frame_ns: u64) {
        if self.disturbed_cameras.is_empty() {
            return;
        }
        let cameras = std::mem::take(&mut self.disturbed_cameras);
        let until_ns = self.world.time_ns() + BLIND_NS_MAX;
        loop {
            let frame = self.frame;
            self.take_frame(&cameras, frame);
            let planned = |camera: &String| self.sensor_faults.planned(camera, frame);
            if !cameras.iter().flat_map(planned).any(|planned| planned.drops()) {
                break;
            }
            self.is_blind = self.world.time_ns() >= until_ns;
            if self.is_blind {
                tracing::warn!(target: "fault", "no frame for so long: no more is taken");
                break;
            }
            self.answered = Some(frame);
            self.frame += 1;
            self.advance(self.frame * frame_ns);
        }
        self.disturbed_cameras = cameras;
    }
}

/// The simulated gripper, as the robot actor hosts it.
struct SimRobot(SimHardware);

impl Robot for SimRobot {
    fn period(&self) -> Option<Duration> {
        match self.0.clock {
            ClockKind::Lockstep => None,
            ClockKind::Realtime => Some(Duration::from_nanos(1_000_000_000 / CONTROL_HZ)),
        }
    }

    fn accept(&mut self, command: &Command) {
        let frame_ns = self.0.frame_ns;
        let mut hardware = self.0.lock();
        if hardware.clock == ClockKind::Realtime {
            hardware.obey(command);
            return;
        }
        if command.frame_sequence != hardware.frame {
            // Answered before a restart. Who is told to stand still does so all the same; no time passes.
            if command.kind == CommandKind::Hold {
                hardware.obey(command);
            }
            return;
        }
        hardware.obey(command);
        hardware.answered = Some(hardware.frame);
        hardware.frame += 1;
        let until_ns = hardware.frame * frame_ns;
        hardware.advance(until_ns);
        hardware.frame_is_due(frame_ns);
    }

    fn refuse(&mut self, command_id: u64, reason: String) {
        self.0.lock().say(command_id, StatusKind::Failed(reason));
    }

    fn tick(&mut self) {
        let mut hardware = self.0.lock();
        let now_ns = monotonic_ns();
        let epoch_ns = *hardware.epoch_ns.get_or_insert(now_ns);
        hardware.advance(now_ns - epoch_ns);
    }

    fn state(&self) -> (u64, RobotState) {
        let hardware = self.0.lock();
        let gripper = hardware.world.gripper();
        let state = RobotState {
            capture_ns: hardware.run_time_ns(),
            position: gripper.position,
            yaw_rad: gripper.yaw_rad,
            opening_m: gripper.opening_m,
            holding: gripper.holding,
            command_id: hardware.sequencer.command_id(),
            phase: hardware.sequencer.phase(),
            answered: hardware.answered,
        };
        (hardware.n_states, state)
    }

    fn pending(&self) -> Vec<Status> {
        self.0.lock().pending.clone()
    }

    fn published(&mut self) {
        let frame = {
            let mut hardware = self.0.lock();
            hardware.pending.clear();
            hardware.n_states += 1;
            if hardware.is_blind {
                return;
            }
            hardware.frame
        };
        self.0.released.send_replace(frame + 1);
    }
}
