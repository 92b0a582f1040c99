//! From a run file to actors that are ready to start.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::camera_choice::OtherCamera;
use super::ready_detectors::ReadyDetectors;
use super::scaled_examples::{Examples, scaled_examples, size_of};
use super::{
    ConfigError, DetectorMode, DomainFolder, GoalConfig, HardwarePorts, PlannerSetup, RunConfig,
    StillImageParts, environment, in_data, new_run_id,
};
use crate::actors::{
    ActorSpec, Checkpoint, CommandLine, Fatal, Monitor, goal_parser, scene_parser, skill_executor,
};
use crate::clock::ClockKind;
use crate::executive::ExecutiveConfig;
use crate::goals::{GOALS, GoalInputs, GoalSource};
use crate::hardware::{CameraPort, RobotPort};
use crate::logic::Facts;
use crate::messages::{MAIN_CAMERA, Submission};
use crate::mismatch::Mismatch;
use crate::parts::{PartChoice, PartContext};
use crate::perception::detectors::Detector;
use crate::perception::grounders::Grounder;
use crate::perception::model::Exemplar;
use crate::perception::tracking::ParserConfig;
use crate::skills::SkillMap;
use crate::transport::convert::WireContext;
use crate::transport::{Bus, MissingRoom, missing_room};

/// Bytes of a pixel: red, green, blue and depth.
const PIXEL_BYTES: u64 = 7;

/// A run file with everything that it names, read and checked.
#[derive(Debug, Clone)]
pub struct PreparedRun {
    /// The run file.
    pub config: RunConfig,
    /// Its domain.
    pub folder: Arc<DomainFolder>,
    examples: Examples,
    others: Vec<OtherCamera>,
    skills: SkillMap,
    /// Made once: it may have looked at an image or hold a connection.
    goal: Arc<dyn GoalSource>,
    ready: ReadyDetectors,
    data: Option<PathBuf>,
}

/// What the actors of one episode share besides the bus.
pub(super) struct Shared {
    pub(super) context: Arc<WireContext>,
    pub(super) monitor: Monitor,
    pub(super) commands: Arc<CommandLine>,
    pub(super) before: Option<Before>,
    /// The memory of the scene parser.
    pub(super) parser: Checkpoint<scene_parser::SceneParserMemory>,
}

/// Where an episode goes on that is not the first one of its robot.
#[derive(Debug, Clone, Copy)]
pub(super) struct Before {
    /// The motion that was commanded last.
    pub(super) command_id: u64,
    /// The frame that was answered last; none where there was none.
    pub(super) frame_sequence: Option<u64>,
    /// When the episode begins, monotonic clock: requests of before were meant for others.
    pub(super) since_ns: u64,
}

impl PreparedRun {
    /// Reads everything that a run file names; `data` is what `$data` stands for.
    ///
    /// # Errors
    /// [`ConfigError`] naming file and line or key.
    pub fn read(config: RunConfig, data: Option<&Path>) -> Result<Self, ConfigError> {
        let folder = config.domain_folder()?;
        config.check_domain(&folder)?;
        let examples = config.perception.exemplar.read(&folder, data)?;
        let skills = folder.skills.clone().unwrap_or_else(SkillMap::empty);
        let others = config.other_cameras().map(|name| {
            let examples = config.exemplar_of(name).read(&folder, data)?;
            Ok(OtherCamera { name: name.clone(), examples: Arc::new(examples) })
        });
        let others = others.collect::<Result<Vec<_>, ConfigError>>()?;
        let (folder, examples) = (Arc::new(folder), Arc::new(examples));
        let origin = format!("{}: goal.text", config.origin);
        let goal = goal_source(&config, &folder, &examples, (&origin, data))?.into();
        let ready = ReadyDetectors::default();
        let data = data.map(Path::to_owned);
        let mut prepared = Self { config, folder, examples, others, skills, goal, ready, data };
        // Whatever may fail fails here, before anything starts.
        let hardware = prepared.hardware()?;
        prepared.scale_examples(&hardware)?;
        let grounder = prepared.grounder()?;
        prepared.planner().replanner(prepared.reference_states())?;
        prepared.check_robot(&hardware.robot)?;
        prepared.make_detectors(&*grounder)?;
        #[cfg(feature = "sim")]
        prepared.config.warn_of_scene(&prepared.folder)?;
        Ok(prepared)
    }

    /// The same with another goal.
    ///
    /// # Errors
    /// [`ConfigError`]: nothing reads goals of its kind, or what reads it cannot be made.
    pub(super) fn with_goal(&self, task: &Submission) -> Result<Self, ConfigError> {
        let mut config = self.config.clone();
        config.goal.text.clone_from(&task.text);
        if let Some(kind) = task.kind.as_ref().filter(|kind| **kind != config.goal.kind) {
            // Options are those of the run file's kind.
            (config.goal.kind, config.goal.options) = (kind.clone(), None);
        }
        let (origin, data) = (format!("goal {}", task.id), self.data.as_deref());
        let goal = goal_source(&config, &self.folder, &self.examples, (&origin, data))?.into();
        Ok(Self { config, goal, ..self.clone() })
    }

    /// What both ends of the topics of another episode agree on.
    pub(super) fn new_context(&self) -> Arc<WireContext> {
        let (hash, domain) = (self.folder.hash, self.folder.domain.clone());
        Arc::new(WireContext::new(new_run_id(), hash, domain))
    }

    /// Makes the detectors that have been taken anew, so that the next episode starts at once.
    pub(super) fn make_ready(&self) -> Result<(), ConfigError> {
        let main = (MAIN_CAMERA, &self.examples);
        let others = self.others.iter().map(|other| (other.name.as_str(), &other.examples));
        for (camera, examples) in std::iter::once(main).chain(others) {
            if !self.ready.has(camera) {
                self.ready.put(camera, self.detector(camera, examples)?);
            }
        }
        Ok(())
    }

    /// Makes the detector of every camera for the first episode, and warns of examples that it does
    /// not read as they are labelled.
    fn make_detectors(&self, grounder: &dyn Grounder) -> Result<(), ConfigError> {
        let mut detector = self.detector(MAIN_CAMERA, &self.examples)?;
        let parts = self.config.taught_parts(&mut *detector, grounder);
        self.folder.warn_of_examples(MAIN_CAMERA, parts, &self.examples);
        self.ready.put(MAIN_CAMERA, detector);
        for OtherCamera { name, examples } in &self.others {
            let mut detector = self.detector(name, examples)?;
            if self.config.has_own_examples(name) {
                let choice = self.config.grounder_choice();
                let grounder = self.folder.silent_grounder(&choice, examples)?;
                let parts = self.config.taught_parts(&mut *detector, &*grounder);
                self.folder.warn_of_examples(name, parts, examples);
            }
            self.ready.put(name, detector);
        }
        Ok(())
    }

    /// The detector that was made for a camera, or a new one after the first episode.
    fn ready_detector(
        &self,
        camera: &str,
        examples: &[(image::RgbImage, Exemplar)],
    ) -> Result<Box<dyn Detector>, ConfigError> {
        self.ready.take(camera).map_or_else(|| self.detector(camera, examples), Ok)
    }

    /// Width and height that frames must have.
    pub fn image_size(&self) -> [u32; 2] {
        size_of(&self.examples)
    }

    /// A detector that labelled examples of one camera have taught.
    fn detector(
        &self,
        camera: &str,
        examples: &[(image::RgbImage, Exemplar)],
    ) -> Result<Box<dyn Detector>, ConfigError> {
        let (region, choice) = (self.config.region_of(camera)?, self.config.detector_choice());
        self.folder.detector_within(region, &choice, examples)
    }

    /// What makes the detector of one camera: the first one is made here, before anything starts, so
    /// that no frame waits for its tables.
    fn make_detector(
        &self,
        camera: &str,
        first: Box<dyn Detector>,
        examples: &Examples,
    ) -> scene_parser::MakeDetector {
        let first = Mutex::new(Some(first));
        let (this, camera) = (self.clone(), camera.to_owned());
        let examples = Arc::clone(examples);
        Arc::new(move || {
            let first = first.lock().unwrap_or_else(PoisonError::into_inner).take();
            first.map_or_else(|| this.detector(&camera, &examples).map_err(|e| e.to_string()), Ok)
        })
    }

    fn grounder(&self) -> Result<Box<dyn Grounder>, ConfigError> {
        self.folder.grounder(&self.config.grounder_choice(), &self.examples)
    }

    fn planner(&self) -> PlannerSetup<'_> {
        PlannerSetup {
            domain: &self.folder.domain,
            config: &self.config.planner,
            origin: &self.config.origin,
            clock: self.config.clock,
        }
    }

    /// The states of the labelled examples.
    fn reference_states(&self) -> impl Iterator<Item = Facts> {
        self.examples.iter().map(|(_, example)| Facts::new(example.init.clone()))
    }

    /// The name of each camera, and the bytes of its frames with depth.
    pub fn frame_bytes(&self) -> Vec<(String, u64)> {
        let others = self.others.iter().map(|other| (other.name.clone(), size_of(&other.examples)));
        let cameras = std::iter::once((MAIN_CAMERA.to_owned(), self.image_size())).chain(others);
        let bytes = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height) * PIXEL_BYTES;
        cameras.map(|(name, size)| (name, bytes(size))).collect()
    }

    /// Refuses to start where shared memory is too small: what does not fit ends the process without a
    /// word when it is written.
    pub(super) fn check_room(&self) -> Result<(), Fatal> {
        let bytes = self.frame_bytes().into_iter().map(|(_, bytes)| bytes);
        let Some(MissingRoom { needed_bytes, free_bytes }) = missing_room(bytes) else {
            return Ok(());
        };
        let (needed, free) = (needed_bytes.div_ceil(1 << 20), free_bytes >> 20);
        Err(Fatal::Full {
            message: format!(
                "shared memory: the run needs {needed} MB in /dev/shm, where {free} MB are free: remove what lies \
                 there, raise --shm-size of the container to {needed}m, or use smaller frames"
            ),
        })
    }

    /// The actors that every run has.
    pub(super) fn core_actors(
        &self,
        bus: &Bus,
        shared: &Shared,
        hardware: &HardwarePorts,
    ) -> Result<Vec<ActorSpec>, ConfigError> {
        Ok(vec![
            self.scene_parser(bus, shared, hardware)?,
            self.goal_parser(bus, shared),
            self.planner().actor(
                (bus, &shared.context),
                shared.monitor.clone(),
                self.reference_states(),
            )?,
            self.skill_executor(bus, shared, &hardware.robot),
        ])
    }

    fn scene_parser(
        &self,
        bus: &Bus,
        shared: &Shared,
        hardware: &HardwarePorts,
    ) -> Result<ActorSpec, ConfigError> {
        let grounder = self.grounder()?;
        let is_slow = grounder.is_slow();
        let config = ParserConfig {
            domain: self.folder.domain.clone(),
            perception: self.folder.perception.clone(),
            rules: self.folder.rules.clone(),
            skills: self.skills.clone(),
            grounder,
            belief: self.config.perception.belief.clone(),
            self_filter: self.config.robot.self_filter.clone(),
        };
        let first = self.ready_detector(MAIN_CAMERA, &self.examples)?;
        let perception = &self.config.perception;
        let beside = match perception.detector_mode {
            Some(mode) => mode == DetectorMode::Async,
            None => is_slow || first.is_slow(),
        };
        let others = self.others.iter().zip(&hardware.others).map(|(other, (_, port))| {
            let first = self.ready_detector(&other.name, &other.examples)?;
            Ok(scene_parser::CameraArgs {
                name: other.name.clone(),
                detector: self.make_detector(&other.name, first, &other.examples),
                image_size: size_of(&other.examples),
                disturb: port.disturb.clone(),
            })
        });
        let main = scene_parser::CameraArgs {
            name: MAIN_CAMERA.to_owned(),
            detector: self.make_detector(MAIN_CAMERA, first, &self.examples),
            image_size: self.image_size(),
            disturb: hardware.camera.disturb.clone(),
        };
        let cameras = std::iter::once(Ok(main)).chain(others);
        let skew = Duration::from_secs_f64(self.config.camera.skew_ms_max / 1000.0);
        let args = Arc::new(scene_parser::SceneParserArgs {
            bus: bus.clone(),
            context: Arc::clone(&shared.context),
            config: Arc::new(config),
            cameras: cameras.collect::<Result<_, ConfigError>>()?,
            skew: (self.config.clock == ClockKind::Realtime).then_some(skew),
            detector_name: perception.detector.clone(),
            beside: beside && self.config.clock == ClockKind::Realtime,
            awaits_robot: hardware.robot.acts && self.config.clock == ClockKind::Lockstep,
            wait: Duration::from_secs_f64(self.config.camera.wait_s),
            checkpoint: shared.parser.clone(),
            monitor: shared.monitor.clone(),
        });
        Ok(ActorSpec::new("scene_parser", move || scene_parser::serve(Arc::clone(&args))))
    }

    fn goal_parser(&self, bus: &Bus, shared: &Shared) -> ActorSpec {
        let args = Arc::new(goal_parser::GoalParserArgs {
            bus: bus.clone(),
            context: Arc::clone(&shared.context),
            source: Arc::clone(&self.goal),
            perception: self.folder.perception.clone(),
            retries_max: self.config.goal.retries_max,
            checkpoint: Checkpoint::default(),
            monitor: shared.monitor.clone(),
        });
        ActorSpec::new("goal_parser", move || goal_parser::serve(Arc::clone(&args)))
    }

    fn skill_executor(&self, bus: &Bus, shared: &Shared, robot: &RobotPort) -> ActorSpec {
        let motion = self.config.robot.motion.clone().filter(|_| robot.acts);
        let config = ExecutiveConfig {
            domain: self.folder.domain.clone(),
            skills: self.skills.clone(),
            motion,
            limits: self.config.limits.clone(),
            mode: self.config.executive,
        };
        let memory = shared.before.map(|Before { command_id, since_ns, .. }| {
            skill_executor::SkillExecutorMemory::after(command_id, since_ns)
        });
        let args = Arc::new(skill_executor::SkillExecutorArgs {
            bus: bus.clone(),
            context: Arc::clone(&shared.context),
            config: Arc::new(config),
            clock: self.config.clock,
            commands: Arc::clone(&shared.commands),
            frame_s: 1.0 / self.config.camera.rate_hz,
            robot_wait: Duration::from_secs_f64(self.config.robot.wait_s),
            checkpoint: Checkpoint::new(memory.unwrap_or_default()),
            monitor: shared.monitor.clone(),
        });
        ActorSpec::new("skill_executor", move || skill_executor::serve(Arc::clone(&args)))
    }

    /// Camera and robot of one episode: a simulated world starts anew.
    pub(super) fn hardware(&self) -> Result<HardwarePorts, ConfigError> {
        HardwarePorts::build(&self.config, &self.folder)
    }

    /// Scales the labelled examples to the frames of their cameras, where those have another size that
    /// is known.
    fn scale_examples(&mut self, hardware: &HardwarePorts) -> Result<(), ConfigError> {
        let config = &self.config;
        let fit = |name: &str, examples: &mut Examples, port: &CameraPort| {
            let Some(size) = port.image_size else { return Ok(()) };
            *examples = scaled_examples(examples, size)
                .map_err(|other| other.mismatch(&config.image_size_key(name)))?;
            Ok::<_, ConfigError>(())
        };
        fit(MAIN_CAMERA, &mut self.examples, &hardware.camera)?;
        for (other, (name, port)) in self.others.iter_mut().zip(&hardware.others) {
            fit(name, &mut other.examples, port)?;
        }
        Ok(())
    }

    /// Refuses robots that cannot serve this run.
    fn check_robot(&self, robot: &RobotPort) -> Result<(), ConfigError> {
        if robot.acts && self.config.robot.motion.is_none() {
            return Err(
                Mismatch::new("robot.motion", "a table, for a robot that acts", "none").into()
            );
        }
        if robot.acts && self.folder.skills.is_none() {
            return Err(ConfigError::File {
                path: self.folder.files.file("skills.toml").to_string(),
                reason: "a robot needs this file".to_owned(),
            });
        }
        Ok(())
    }
}

/// Where the goal comes from.
fn goal_source(
    config: &RunConfig,
    folder: &Arc<DomainFolder>,
    examples: &Examples,
    (origin, data): (&str, Option<&Path>),
) -> Result<Box<dyn GoalSource>, ConfigError> {
    let parts = StillImageParts {
        folder: Arc::clone(folder),
        examples: Arc::clone(examples),
        detector: config.detector_choice(),
        grounder: config.grounder_choice(),
        region: config.region_of(MAIN_CAMERA)?,
    };
    let GoalConfig { kind, text, options, .. } = &config.goal;
    let choice = PartChoice::new("goal.kind", kind)
        .with_options(options.as_ref(), config.origin.path())
        .with_answers(config.recorded_answers());
    let text = in_data("goal.text", text, data)?;
    let inputs = GoalInputs {
        origin,
        text: &text.to_string_lossy(),
        language: folder.language.as_ref(),
        perception: Some(&folder.perception),
        read_image: Some(parts.into_read_image()),
    };
    Ok(GOALS.build(&PartContext { choice: &choice, inputs, environment })?)
}
