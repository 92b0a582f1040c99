//! A run file, as written. `configs/*.toml` describe every key.

use std::path::PathBuf;

use serde::Deserialize;

use super::ConfigError;
use crate::actors::{PanicConfig, SupervisorConfig};
use crate::clock::ClockKind;
use crate::executive::Limits;
use crate::hardware::{CAMERAS, EXTERNAL, FaultConfig, ROBOTS};
use crate::parts::PartChoice;
use crate::perception::tracking::{BeliefConfig, HullConfig};
use crate::planners::PlannerConfig;
use crate::skills::MotionConfig;

/// Everything an episode needs to know.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConfig {
    /// The file it was read from.
    #[serde(skip)]
    pub origin: PathBuf,
    /// Its text with all that was set over it, as TOML: what a process that joins the run is told.
    #[serde(skip)]
    pub resolved: String,
    /// Name of a folder below `domains/`, or the path of a domain folder.
    pub domain: String,
    /// Name of the run on the bus; without one, the file's name (and, where the simulator plays
    /// the hardware, the process id, so that runs do not meet).
    pub run: Option<String>,
    /// Seed of everything random.
    pub seed: u64,
    /// Which clock drives the loop.
    pub clock: ClockKind,
    /// Where the goal comes from.
    pub goal: GoalConfig,
    /// Where frames come from.
    pub camera: CameraConfig,
    /// How objects and facts are found.
    pub perception: PerceptionConfig,
    /// What acts.
    pub robot: RobotConfig,
    /// How plans are found.
    pub planner: PlannerConfig,
    /// Every bound of the loop.
    pub limits: Limits,
    /// How failed actors are restarted.
    pub supervisor: SupervisorConfig,
    /// The simulated world, for the parts of kind `sim`; read by them.
    pub sim: Option<toml::Table>,
    /// Disturbances of the simulated world.
    #[serde(default)]
    pub fault: Vec<FaultConfig>,
    /// Actors that are made to panic once, to exercise the supervisor.
    #[serde(default)]
    pub panic: Vec<PanicConfig>,
}

/// `[goal]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalConfig {
    /// A key of `goals::GOALS`.
    pub kind: String,
    /// The instruction, or the logical goal in PDDL.
    pub text: String,
    /// The source's own options.
    pub options: Option<toml::Table>,
}

/// `[camera]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraConfig {
    /// A key of `hardware::CAMERAS`.
    pub kind: String,
    /// The camera's own options.
    pub options: Option<toml::Table>,
    /// Frames per second.
    pub rate_hz: f64,
    /// How long a frame may be missing before the run ends with exit code 5, seconds of wall time.
    pub wait_s: f64,
}

/// `[perception]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerceptionConfig {
    /// A key of `detectors::DETECTORS`.
    pub detector: String,
    /// The detector's own options.
    pub options: Option<toml::Table>,
    /// Whether the detector works beside the loop instead of in it (realtime only): the loop goes
    /// on with the last scene, at that scene's age. Without the key, slow detectors do.
    pub beside: Option<bool>,
    /// A key of `grounders::GROUNDERS`.
    pub grounder: String,
    /// The grounder's own options.
    pub grounder_options: Option<toml::Table>,
    /// The labelled examples of this camera.
    pub exemplar: ExemplarConfig,
    /// When a change is believed.
    pub belief: BeliefConfig,
}

/// The labelled examples of one camera set-up.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExemplarConfig {
    /// A folder below the domain's `exemplar/`; all examples in it are pooled.
    pub folder: Option<String>,
    /// One image. `$data` stands for `--data`, `{n}` for `number`.
    pub image: Option<String>,
    /// Its boxes, JSON `{"name": [x1, y1, x2, y2]}`.
    pub boxes: Option<String>,
    /// Its state, a PDDL problem.
    pub state: Option<String>,
    /// What `{n}` stands for.
    pub number: Option<u32>,
}

impl ExemplarConfig {
    /// All labelled examples of a folder below the domain's `exemplar/`.
    pub fn in_folder(name: &str) -> Self {
        let folder = Some(name.to_owned());
        Self { folder, image: None, boxes: None, state: None, number: None }
    }
}

/// `[robot]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotConfig {
    /// A key of `hardware::ROBOTS`.
    pub kind: String,
    /// The robot's own options.
    pub options: Option<toml::Table>,
    /// How long a robot's state may be missing before the run ends with exit code 5, seconds of
    /// wall time.
    pub wait_s: f64,
    /// How it moves; not for `none`.
    pub motion: Option<MotionConfig>,
    /// Its shape in the picture; not for `none`.
    pub hull: Option<HullConfig>,
}

impl RunConfig {
    /// Checks what types cannot say.
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let value = |key: &str, expected: &str, got: String| {
            Err(ConfigError::Value { key: key.to_owned(), expected: expected.to_owned(), got })
        };
        if !(self.camera.rate_hz.is_finite() && self.camera.rate_hz > 0.0) {
            let got = self.camera.rate_hz.to_string();
            return value("camera.rate_hz", "a positive number", got);
        }
        if !(self.robot.wait_s.is_finite() && self.robot.wait_s > 0.0) {
            return value("robot.wait_s", "a positive number", self.robot.wait_s.to_string());
        }
        CAMERAS.find("camera.kind", &self.camera.kind)?;
        ROBOTS.find("robot.kind", &self.robot.kind)?;
        let [camera, robot] = [&self.camera.kind, &self.robot.kind];
        if robot == "sim" && camera != "sim" {
            let expected = "\"sim\" beside a robot of kind \"sim\"";
            return value("camera.kind", expected, camera.clone());
        }
        // Time stands still between frames only where camera and robot are of one world.
        if self.clock == ClockKind::Lockstep && camera != robot {
            let expected = "\"realtime\", unless camera and robot are of the same kind";
            return value("clock", expected, "lockstep".to_owned());
        }
        if self.clock == ClockKind::Lockstep && self.perception.beside == Some(true) {
            let got = "true in lockstep, where every frame waits for its answer".to_owned();
            return value("perception.beside", "false, or clock = \"realtime\"", got);
        }
        self.planner.check()?;
        for &pose in self.robot.motion.iter().flat_map(|motion| &motion.look_poses) {
            let reaches = self.robot.motion.as_ref().is_some_and(|motion| motion.reaches(pose));
            if !reaches {
                let expected = "positions within reach_x_m and reach_y_m, above table_z_m";
                return value("robot.motion.look_poses", expected, format!("{pose:?}"));
            }
        }
        for fault in &self.fault {
            if fault.at_s.is_some() == fault.during.is_some() {
                let got = if fault.at_s.is_some() { "both" } else { "neither" };
                return value("fault", "either at_s or during", got.to_owned());
            }
        }
        Ok(())
    }

    /// The detector that is chosen.
    pub fn detector_choice(&self) -> PartChoice {
        let PerceptionConfig { detector, options, .. } = &self.perception;
        PartChoice::new("perception.detector", detector)
            .with_options(options.as_ref(), &self.origin)
    }

    /// The grounder that is chosen.
    pub fn grounder_choice(&self) -> PartChoice {
        let PerceptionConfig { grounder, grounder_options, .. } = &self.perception;
        PartChoice::new("perception.grounder", grounder)
            .with_options(grounder_options.as_ref(), &self.origin)
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
        let stem = self.origin.file_stem().and_then(|s| s.to_str()).unwrap_or("run");
        if [&self.camera.kind, &self.robot.kind].iter().any(|kind| *kind == EXTERNAL) {
            return stem.to_owned();
        }
        format!("{stem}-{}", std::process::id())
    }
}
