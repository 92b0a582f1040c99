//! A run file, as written. `configs/*.toml` describe every key.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    CameraConfig, ConfigError, DomainFolder, ExemplarConfig, OtherCameraConfig, ServeConfig,
};
use crate::actors::SupervisorConfig;
use crate::clock::ClockKind;
use crate::executive::{ExecutiveMode, Limits};
use crate::files::{FileRef, Folder};
#[cfg(feature = "sim")]
use crate::hardware::sim::{fault_mismatches, read_scene};
use crate::hardware::{EXTERNAL, FaultConfig, LoopShape, SystemFault};
use crate::http::Answers;
#[cfg(feature = "sim")]
use crate::messages::MAIN_CAMERA;
use crate::mismatch::{Mismatch, listed};
use crate::parts::PartChoice;
use crate::pddl::Name;
use crate::perception::tracking::{BeliefConfig, SelfFilterConfig};
use crate::planners::PlannerConfig;
use crate::settings::{LayerOrigin, Layers, SettingsProblem, near_hint};
use crate::skills::MotionConfig;
use crate::transport::run_name_fault;

/// A run file: everything that an episode needs to know. `configs/defaults.toml` is the reference of
/// every key.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunConfig {
    /// The file it was read from.
    #[serde(skip)]
    pub origin: FileRef,
    /// The file with all that it is laid over, as TOML: what a process that joins the run is told.
    #[serde(skip)]
    pub resolved: String,
    /// Where each value was written, for messages.
    #[serde(skip)]
    pub layers: Option<Arc<Layers>>,
    /// The file that this one is laid over: a path, which starts from this file's folder, or the
    /// name of a shipped file, such as "blocksworld".
    pub extends: Option<String>,
    /// The name of a domain, a folder of `domains/`, or the path of a domain folder.
    pub domain: String,
    /// Name of the run on the bus. Without the key the file's name; where the simulator plays the
    /// hardware with the process id behind it, so that runs do not meet.
    pub run: Option<String>,
    /// Seed of everything random: scene, light, noise.
    pub seed: u64,
    /// Which clock drives the loop.
    pub clock: ClockKind,
    /// Whether the loop is closed.
    pub executive: ExecutiveMode,
    /// Where the goal comes from.
    pub goal: GoalConfig,
    /// The services that goal source and detector ask.
    pub services: ServicesConfig,
    /// Where frames come from.
    pub camera: CameraConfig,
    /// Other cameras, by their names.
    #[serde(default)]
    pub cameras: BTreeMap<String, OtherCameraConfig>,
    /// How objects and facts are found.
    pub perception: PerceptionConfig,
    /// What acts.
    pub robot: RobotConfig,
    /// How plans are found.
    pub planner: PlannerConfig,
    /// Every bound of the loop. When one is met, the verdict names it.
    pub limits: Limits,
    /// How failed actors are restarted.
    pub supervisor: SupervisorConfig,
    /// The goals of `groundloop serve`.
    pub serve: ServeConfig,
    /// The simulated world, for a camera of kind "sim".
    #[cfg_attr(feature = "sim", schemars(with = "Option<crate::hardware::sim::SimConfig>"))]
    #[cfg_attr(
        not(feature = "sim"),
        schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")
    )]
    pub sim: Option<toml::Table>,
    /// What every `probability` of a `[[fault]]` is multiplied with, 0 to 1.
    pub fault_rate: f64,
    /// What goes wrong on purpose, in the simulated world, its robot, or among the actors.
    #[serde(default)]
    pub fault: Vec<FaultConfig>,
}

/// `[goal]`: what to reach, and who reads it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GoalConfig {
    /// What reads the goal.
    pub kind: String,
    /// The goal: a sentence, PDDL for the kind "logical", the path of a photograph for the kind
    /// "image".
    pub text: String,
    /// How often a source whose service is not there is asked again, each time with a later scene, before
    /// the run ends with exit code 5.
    pub retries_max: u32,
    /// The options of what reads the goal.
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    pub options: Option<toml::Table>,
}

/// `[services]`: what services have answered.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ServicesConfig {
    /// A folder of recorded answers: what was asked before is answered from there, what was not is
    /// asked and recorded. Without the key nothing is recorded.
    pub answers: Option<String>,
    /// Whether recorded answers are all there is: then no service is asked.
    pub offline: bool,
}

/// `[perception]`: detector, grounder, labelled examples, tracking.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PerceptionConfig {
    /// What finds the objects.
    pub detector: String,
    /// The options of the detector.
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    pub options: Option<toml::Table>,
    /// Whether each frame waits for the detector. Without the key "async" for slow detectors, else
    /// "sync".
    pub detector_mode: Option<DetectorMode>,
    /// What judges the facts.
    pub grounder: String,
    /// The options of the grounder.
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    pub grounder_options: Option<toml::Table>,
    /// The labelled examples of this camera: a folder, or one image with its boxes and state.
    pub exemplar: ExemplarConfig,
    /// When a change is believed.
    pub belief: BeliefConfig,
}

/// Whether frames wait for the detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DetectorMode {
    /// It works beside the loop, which goes on with the last scene at that scene's age; realtime only.
    Async,
    /// It works in the loop.
    Sync,
}

/// `[robot]`: where commands go, and how the arm moves.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotConfig {
    /// What acts.
    pub kind: String,
    /// The options of the robot.
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    pub options: Option<toml::Table>,
    /// How long a robot's state may be missing before the run ends with exit code 5, seconds of
    /// wall time.
    pub wait_s: f64,
    /// How long a robot that moves may go without a command before it holds by itself, milliseconds; realtime
    /// only. It is told to go on every 100 ms as long as somebody watches it.
    #[schemars(range(min = 300))]
    pub command_age_ms_max: u64,
    /// How the robot moves. Lengths in metres, in the world frame.
    pub motion: Option<MotionConfig>,
    /// A box around the tool that contains every part of the robot that the camera may see: what it
    /// hides keeps its last facts. Lengths in metres from the tool centre, along the world's axes.
    pub self_filter: Option<SelfFilterConfig>,
}

impl RunConfig {
    /// What types cannot say and is not so, each by its key.
    pub(super) fn mismatches(&self) -> Vec<Mismatch> {
        let mut found = Vec::new();
        if !(self.robot.wait_s.is_finite() && self.robot.wait_s > 0.0) {
            found.push(Mismatch::new("robot.wait_s", "a positive number", self.robot.wait_s));
        }
        if let Some(name) = &self.run
            && let Some(expected) = run_name_fault(name)
        {
            found.push(Mismatch::new("run", expected, format!("\"{name}\"")));
        }
        let [camera, robot] = [&self.camera.kind, &self.robot.kind];
        if [camera, robot].iter().any(|kind| *kind == "sim") && self.sim.is_none() {
            found.push(Mismatch::new(
                "sim",
                "a table, for a camera or robot of kind \"sim\"",
                "none",
            ));
        }
        if robot == "sim" && camera != "sim" {
            let expected = "\"sim\" beside a robot of kind \"sim\"";
            found.push(Mismatch::new("camera.kind", expected, format!("\"{camera}\"")));
        }
        // Time stands still between frames only where camera and robot are of one world.
        if self.clock == ClockKind::Lockstep && camera != robot {
            let expected = "\"realtime\", unless camera and robot are of the same kind";
            found.push(Mismatch::new("clock", expected, "\"lockstep\""));
        }
        let mode = self.perception.detector_mode;
        if self.clock == ClockKind::Lockstep && mode == Some(DetectorMode::Async) {
            let got = "\"async\" in lockstep, where every frame waits for its answer";
            let expected = "\"sync\", or clock = \"realtime\"";
            found.push(Mismatch::new("perception.detector_mode", expected, got));
        }
        if self.services.offline && self.services.answers.is_none() {
            let expected = "false, or a folder as services.answers";
            found.push(Mismatch::new("services.offline", expected, true));
        }
        found.extend(self.planner.check().err());
        found.extend(self.robot.mismatches());
        found.extend(self.perception.exemplar.mismatch("perception.exemplar"));
        found.extend(self.camera_mismatches());
        if ![camera, robot].iter().any(|kind| *kind == "sim") {
            if self.sim.is_some() {
                found.push(Mismatch::new("sim", "none, since nothing is simulated", "a table"));
            }
            let worldly = self.fault.iter().position(|fault| !fault.is_system());
            found.extend(worldly.map(|idx| {
                let expected = "message or sent as the trigger, since nothing is simulated";
                Mismatch::new(format!("fault[{idx}]"), expected, "another one")
            }));
        }
        if !(0.0..=1.0).contains(&self.fault_rate) {
            found.push(Mismatch::new("fault_rate", "a number from 0 to 1", self.fault_rate));
        }
        let cameras = self.used_cameras();
        let shape = self.loop_shape(&cameras);
        for (idx, fault) in self.fault.iter().enumerate() {
            let at = format!("fault[{idx}]");
            let wrong = fault.mismatch(&at);
            found.extend(wrong.or_else(|| SystemFault::mismatch(fault, &at, &shape)));
        }
        found
    }

    /// What decides which faults the loop can have.
    pub(super) fn loop_shape<'a>(&self, cameras: &'a [&'a str]) -> LoopShape<'a> {
        LoopShape { clock: self.clock, cameras }
    }

    /// Finds and reads the domain: beside the run file, in the working directory, or in the binary.
    /// One that was set on the command line is looked for in the working directory first.
    ///
    /// # Errors
    /// [`ConfigError`] naming the file and line.
    pub fn domain_folder(&self) -> Result<DomainFolder, ConfigError> {
        let written = self.layers.as_ref().and_then(|layers| layers.written("domain"));
        let is_set = written.is_some_and(|written| matches!(written.origin, LayerOrigin::Set(_)));
        let here = Folder::default();
        DomainFolder::find(&self.domain, if is_set { &here } else { &self.origin.folder })
    }

    /// Checks what names something of the domain or of the simulated scene: the steps that faults
    /// wait for, and the objects that they are done to.
    ///
    /// # Errors
    /// [`ConfigError::Problems`], each with file and line.
    pub fn check_domain(&self, folder: &DomainFolder) -> Result<(), ConfigError> {
        let actions = &folder.domain.actions;
        let unknown = |(idx, key, said): (usize, &str, &str)| {
            let words = said.trim_matches(['(', ')']).split_whitespace();
            let name = Name::new(words.clone().next().unwrap_or_default());
            let args = words.count().saturating_sub(1);
            let action = actions.iter().find(|action| action.name == name);
            if action.is_some_and(|action| args == 0 || args == action.params.len()) {
                return None;
            }
            let known: Vec<&str> = actions.iter().map(|action| action.name.as_str()).collect();
            let expected = format!(
                "an action of the domain {} ({}) or a step such as \"(stack a b arm)\"",
                folder.domain.name,
                known.join(", ")
            );
            let near = near_hint(name.as_str(), known);
            let at = format!("fault[{idx}].{key}");
            Some(self.located(Mismatch::new(at, expected, format!("\"{said}\"{near}"))))
        };
        let faults = self.fault.iter().enumerate();
        let waits = faults.flat_map(|(idx, fault)| fault.steps().map(move |(k, s)| (idx, k, s)));
        #[cfg_attr(not(feature = "sim"), expect(unused_mut, reason = "of the simulator"))]
        let mut problems: Vec<SettingsProblem> = waits.filter_map(unknown).collect();
        #[cfg(feature = "sim")]
        problems.extend(self.unknown_objects(folder)?);
        if problems.is_empty() { Ok(()) } else { Err(problems.into()) }
    }

    /// Objects of faults that are not in the simulated scene.
    #[cfg(feature = "sim")]
    fn unknown_objects(&self, folder: &DomainFolder) -> Result<Vec<SettingsProblem>, ConfigError> {
        if self.fault.is_empty() {
            return Ok(Vec::new());
        }
        let sim = self.sim()?;
        let scene = read_scene(&folder.files.file(&sim.scene))?;
        let cameras: Vec<&str> =
            std::iter::once(MAIN_CAMERA).chain(sim.cameras.keys().map(String::as_str)).collect();
        let found = fault_mismatches(&scene, &cameras, &self.fault).into_iter();
        Ok(found.map(|mismatch| self.located(mismatch)).collect())
    }

    /// The faults as likely as `fault_rate` makes them.
    pub fn faults_at_rate(&self) -> Vec<FaultConfig> {
        self.fault.iter().map(|fault| fault.clone().at_rate(self.fault_rate)).collect()
    }

    /// A mismatch with the place where its key was written.
    pub(crate) fn located(&self, mismatch: Mismatch) -> SettingsProblem {
        let file = self.origin.to_string();
        match &self.layers {
            Some(layers) => layers.located(mismatch, &file),
            None => SettingsProblem::of_file(&file, "", mismatch.to_string()),
        }
    }

    /// The detector that is chosen.
    pub fn detector_choice(&self) -> PartChoice {
        let PerceptionConfig { detector, options, .. } = &self.perception;
        PartChoice::new("perception.detector", detector)
            .with_options(options.as_ref(), self.origin.path())
            .with_answers(self.recorded_answers())
    }

    /// The recorded answers of services; the folder starts from that of the run file.
    pub(super) fn recorded_answers(&self) -> Option<Answers> {
        let folder = self.services.answers.as_ref()?;
        let path = self.origin.path();
        let beside = path.parent().map(|beside| beside.join(folder));
        Some(Answers::new(beside.unwrap_or_else(|| folder.into()), self.services.offline))
    }

    /// The grounder that is chosen.
    pub fn grounder_choice(&self) -> PartChoice {
        let PerceptionConfig { grounder, grounder_options, .. } = &self.perception;
        PartChoice::new("perception.grounder", grounder)
            .with_options(grounder_options.as_ref(), self.origin.path())
    }

    /// The simulated world.
    ///
    /// # Errors
    /// [`ConfigError`] naming the key.
    #[cfg(feature = "sim")]
    pub fn sim(&self) -> Result<crate::hardware::sim::SimConfig, ConfigError> {
        Ok(crate::hardware::sim::SimConfig::read(self.sim.as_ref(), &self.origin)?)
    }

    /// The name of the run on the bus.
    pub fn run_name(&self) -> String {
        if let Some(run) = &self.run {
            return run.clone();
        }
        let stem = self.origin.stem();
        if [&self.camera.kind, &self.robot.kind].iter().any(|kind| *kind == EXTERNAL) {
            return stem.to_owned();
        }
        format!("{stem}-{}", std::process::id())
    }
}

impl RobotConfig {
    fn mismatches(&self) -> Vec<Mismatch> {
        let mut found = Vec::new();
        let acts = self.kind != "none";
        if acts && self.motion.is_none() {
            found.push(Mismatch::new("robot.motion", "a table, for a robot that acts", "none"));
        }
        let tables = [
            ("robot.motion", self.motion.is_some()),
            ("robot.self_filter", self.self_filter.is_some()),
        ];
        for (table, _) in tables.into_iter().filter(|(_, is_there)| *is_there && !acts) {
            found.push(Mismatch::new(table, "none, for a robot of kind \"none\"", "a table"));
        }
        if let Some(motion) = &self.motion {
            for (idx, pose) in motion.view_poses.iter().enumerate() {
                if !motion.reaches(*pose) {
                    let expected = "a position within reach_x_m and reach_y_m, above table_z_m";
                    let at = format!("robot.motion.view_poses[{idx}]");
                    found.push(Mismatch::new(at, expected, listed(pose)));
                }
            }
        }
        found
    }
}
