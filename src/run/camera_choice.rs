//! Which cameras a run file chooses, beside that of `[camera]` those of `[cameras.NAME]`.

use super::scaled_examples::Examples;
use super::{ConfigError, ExemplarConfig, RunConfig};
use crate::clock::ClockKind;
use crate::messages::MAIN_CAMERA;
use crate::mismatch::{Mismatch, listed};
use crate::parts::PartChoice;
use crate::perception::ImageRegion;
use crate::settings::near_hint;

/// Another camera of a run, with what its detector learns from.
#[derive(Debug, Clone)]
pub(super) struct OtherCamera {
    pub(super) name: String,
    pub(super) examples: Examples,
}

/// The region of these edges; `at` is where they are written.
pub(crate) fn region_at(at: &str, edges: [f64; 4]) -> Result<ImageRegion, Mismatch> {
    ImageRegion::new(edges).map_err(|expected| Mismatch::new(at, expected, listed(edges)))
}

/// Longest name of a camera: part of the name of a topic.
const NAME_BYTES_MAX: usize = 64;

impl RunConfig {
    /// The names of all cameras beside that of `[camera]`, without those that are not used.
    pub(super) fn other_cameras(&self) -> impl Iterator<Item = &String> {
        let used = self.cameras.iter().filter(|(_, camera)| !camera.is_unused());
        used.map(|(name, _)| name)
    }

    /// The cameras that are looked through, that of `[camera]` first.
    pub(super) fn used_cameras(&self) -> Vec<&str> {
        std::iter::once(MAIN_CAMERA).chain(self.other_cameras().map(String::as_str)).collect()
    }

    /// Every camera by its name, that of `[camera]` first.
    pub fn camera_names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(MAIN_CAMERA).chain(self.cameras.keys().map(String::as_str))
    }

    /// A camera as it is chosen, by its name.
    pub(super) fn camera_choice(&self, name: &str) -> PartChoice {
        let choice = |key: &str, kind: &str, options| {
            PartChoice::new(key, kind).with_options(options, self.origin.path())
        };
        match self.cameras.get(name) {
            Some(camera) => {
                let kind = camera.kind.as_ref().unwrap_or(&self.camera.kind);
                choice(&format!("cameras.{name}.kind"), kind, camera.options.as_ref())
            }
            None => choice("camera.kind", &self.camera.kind, self.camera.options.as_ref()),
        }
    }

    /// The part of a camera's image in which objects can be.
    ///
    /// # Errors
    /// [`ConfigError::Mismatch`] with the key.
    pub(super) fn region_of(&self, name: &str) -> Result<Option<ImageRegion>, ConfigError> {
        let (key, edges) = match self.cameras.get(name) {
            Some(camera) => (format!("cameras.{name}.region"), camera.region),
            None => ("camera.region".to_owned(), self.camera.region),
        };
        Ok(edges.map(|edges| region_at(&key, edges)).transpose()?)
    }

    /// The key that says how large the images of a camera are.
    pub(super) fn image_size_key(&self, name: &str) -> String {
        match (self.camera_choice(name).name == "sim", name) {
            (true, MAIN_CAMERA) => "sim.camera".to_owned(),
            (true, other) => format!("sim.cameras.{other}"),
            (false, MAIN_CAMERA) => "camera.options".to_owned(),
            (false, other) => format!("cameras.{other}.options"),
        }
    }

    /// The labelled examples of another camera.
    pub(super) fn exemplar_of(&self, name: &str) -> &ExemplarConfig {
        let own = self.cameras.get(name).and_then(|camera| camera.exemplar.as_ref());
        own.unwrap_or(&self.perception.exemplar)
    }

    /// What is not so in `[cameras]`, and in `[sim.cameras]` beside it.
    pub(super) fn camera_mismatches(&self) -> Vec<Mismatch> {
        let mut found = Vec::new();
        let simulated = self.sim.as_ref().and_then(|sim| sim.get("cameras")?.as_table());
        let is_placed = |name: &str| simulated.is_some_and(|table| table.contains_key(name));
        for (name, camera) in &self.cameras {
            let key = format!("cameras.{name}");
            let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            let is_name = (1..=NAME_BYTES_MAX).contains(&name.len()) && name.chars().all(is_plain);
            if !is_name || name == MAIN_CAMERA {
                let expected = format!(
                    "a name of letters, digits, _ and - other than \"{MAIN_CAMERA}\", which is that of \
                     [camera], at most {NAME_BYTES_MAX} characters"
                );
                found.push(Mismatch::new(key.clone(), expected, format!("\"{name}\"")));
            }
            let kind = camera.kind.as_ref().unwrap_or(&self.camera.kind);
            if camera.is_unused() {
                continue;
            }
            if kind == "sim" && !is_placed(name) {
                let expected =
                    "a table with position_m and look_at_m, for a camera of kind \"sim\"";
                found.push(Mismatch::new(format!("sim.cameras.{name}"), expected, "none"));
            }
            if self.clock == ClockKind::Lockstep && *kind != self.robot.kind {
                let expected = "the kind of camera and robot, or clock = \"realtime\"";
                let got = format!("\"{kind}\"");
                found.push(Mismatch::new(format!("{key}.kind"), expected, got));
            }
            found.extend(
                camera.region.and_then(|edges| region_at(&format!("{key}.region"), edges).err()),
            );
            let exemplar = camera.exemplar.as_ref();
            let key = format!("{key}.exemplar");
            found.extend(exemplar.and_then(|exemplar| exemplar.mismatch(&key)));
        }
        for (name, _) in simulated.into_iter().flatten() {
            if !self.cameras.contains_key(name) {
                let known: Vec<&str> = self.cameras.keys().map(String::as_str).collect();
                let near = near_hint(name, known);
                let expected = format!("a table [cameras.{name}] beside it");
                let got = format!("none{near}");
                found.push(Mismatch::new(format!("sim.cameras.{name}"), expected, got));
            }
        }
        found.extend(self.camera.region.and_then(|edges| region_at("camera.region", edges).err()));
        let skew_ms_max = self.camera.skew_ms_max;
        if !(skew_ms_max.is_finite() && skew_ms_max >= 0.0) {
            let expected = "a number, 0 or more";
            found.push(Mismatch::new("camera.skew_ms_max", expected, skew_ms_max));
        }
        found
    }

    /// The camera that `name` says.
    ///
    /// # Errors
    /// [`ConfigError::Mismatch`] with the cameras that there are.
    pub fn check_camera(&self, flag: &str, name: &str) -> Result<(), ConfigError> {
        if self.camera_names().any(|known| known == name) {
            return Ok(());
        }
        let known: Vec<&str> = self.camera_names().collect();
        let expected = format!("a camera of the run file ({})", known.join(", "));
        let near = near_hint(name, known);
        Err(Mismatch::new(flag, expected, format!("\"{name}\"{near}")).into())
    }
}
