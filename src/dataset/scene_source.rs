//! What scenes are made of: a run file with its scene file, and the same with other values.

use nalgebra::Vector3;

use super::{Factor, FactorValue};
use crate::draws::Draws;
use crate::files::FileRef;
use crate::hardware::sim::{ChangedScene, SimConfig};
use crate::mismatch::Mismatch;
use crate::run::{ConfigError, DomainFolder, Layered, RunConfig};

/// The scenes of a run file.
#[derive(Debug, Clone)]
pub struct SceneSource {
    layered: Layered,
    /// The run file as it is.
    pub config: RunConfig,
    /// Its domain.
    pub folder: DomainFolder,
    sim: toml::Table,
}

/// A scene with the objects that were drawn, and the same objects as the scene file arranges them: goals
/// are taken from there, so that they may stack what a factor spreads.
#[derive(Debug)]
pub struct DrawnScene<'a> {
    /// The scene.
    pub start: ChangedScene<'a>,
    /// The same objects, and none of the factors of the scene file.
    pub as_written: ChangedScene<'a>,
}

/// How one scene is built and looked at.
#[derive(Debug, Clone)]
pub struct SceneSetting {
    /// The simulator: its camera, and what the world is made of.
    pub sim: SimConfig,
    /// The scene file.
    pub file: FileRef,
    /// What it says.
    as_written: toml::Table,
    /// The same with what is different.
    scene: toml::Table,
    /// How many of the bodies that can move there are; all without.
    n_objects: Option<usize>,
}

impl SceneSource {
    /// From a run file with a simulated camera.
    ///
    /// # Errors
    /// [`ConfigError`] naming file and key.
    pub fn new(layered: Layered) -> Result<Self, ConfigError> {
        let config = layered.run()?;
        let folder = config.domain_folder()?;
        let Some(sim) = config.sim.clone().filter(|_| config.camera.kind == "sim") else {
            let got = format!("\"{}\"", config.camera.kind);
            let at = format!("{}: camera.kind", config.origin);
            return Err(Mismatch::new(at, "\"sim\"", got).into());
        };
        Ok(Self { layered, config, folder, sim })
    }

    /// The setting with these values.
    ///
    /// # Errors
    /// [`ConfigError`] naming the factor, or the file and key.
    pub fn setting(&self, values: &[FactorValue]) -> Result<SceneSetting, ConfigError> {
        let mut table = self.sim.clone();
        for FactorValue { key, value } in values {
            if let Some(key) = key.strip_prefix("sim.") {
                put(&mut table, key, value.clone());
            }
        }
        let mut sim = SimConfig::read(Some(&table), &self.config.origin)?;
        let file = self.folder.files.file(&sim.scene);
        let mut scene: toml::Table = file.text()?.parse().map_err(|e: toml::de::Error| {
            ConfigError::Toml { path: file.to_string(), message: e.to_string() }
        })?;
        let as_written = scene.clone();
        let (mut view, mut n_objects) = (View::of(&sim), None);
        for FactorValue { key, value } in values {
            match (key.as_str(), key.strip_prefix("scene.")) {
                ("objects", _) => n_objects = Some(self.n_objects(&scene, value)?),
                (_, Some(key)) => put(&mut scene, key, value.clone()),
                ("light.intensity", _) => sim.camera.light.intensity = [number(key, value)?; 2],
                ("light.azimuth_deg", _) => sim.camera.light.azimuth_deg = [number(key, value)?; 2],
                ("light.elevation_deg", _) => {
                    sim.camera.light.elevation_deg = [number(key, value)?; 2];
                }
                ("view.distance_m", _) => view.distance_m = number(key, value)?,
                ("view.azimuth_deg", _) => view.azimuth_deg = number(key, value)?,
                ("view.elevation_deg", _) => view.elevation_deg = number(key, value)?,
                _ => {}
            }
        }
        if values.iter().any(|value| value.key.starts_with("view.")) {
            view.take(&mut sim);
        }
        Ok(SceneSetting { sim, file, as_written, scene, n_objects })
    }

    fn n_objects(&self, scene: &toml::Table, value: &toml::Value) -> Result<usize, ConfigError> {
        let n = movable(scene).len();
        let wanted = value.as_integer().and_then(|wanted| usize::try_from(wanted).ok());
        wanted.filter(|wanted| (1..=n).contains(wanted)).ok_or_else(|| {
            let of = &self.sim.get("scene").and_then(toml::Value::as_str).unwrap_or_default();
            let expected = format!("1 to {n}, the bodies of {of} that can move");
            Mismatch::new("--vary objects", expected, value).into()
        })
    }

    /// Tries the ends of every factor's range, so that a value that cannot be is told before anything is
    /// rendered.
    ///
    /// # Errors
    /// [`ConfigError`] naming the factor, or the file and key.
    pub fn check(&self, factors: &[Factor]) -> Result<(), ConfigError> {
        for (idx, factor) in factors.iter().enumerate() {
            if factors[..idx].iter().any(|other| other.key == factor.key) {
                return Err(Mismatch::new("--vary", "each factor once", &factor.key).into());
            }
            for FactorValue { key, value } in factor.extremes() {
                if key.starts_with("sim.") {
                    // The whole check of run files, with its messages.
                    let mut layered = self.layered.clone();
                    layered.layers.set(&format!("{key}={value}"))?;
                    layered.run()?;
                }
                let setting = self.setting(&[FactorValue { key: key.clone(), value }])?;
                let fault = |e: &dyn std::fmt::Display| {
                    Mismatch::new(format!("--vary {key}"), "values that can be", e)
                };
                setting.sim.camera.check().map_err(|e| fault(&e))?;
                ChangedScene::new(&setting.file, &setting.scene).map_err(|e| fault(&e))?;
            }
        }
        self.setting(&[]).map(|_| ())
    }
}

impl SceneSetting {
    /// How many bodies of the scene file can move.
    pub fn n_movable(&self) -> usize {
        movable(&self.scene).len()
    }

    /// The scene with as many objects as the setting has, of those in the file; which ones is drawn.
    ///
    /// # Errors
    /// [`ConfigError`] naming the scene file and what is wrong in it.
    pub fn drawn(&self, draws: &mut Draws) -> Result<DrawnScene<'_>, ConfigError> {
        let mut dropped = movable(&self.scene);
        draws.shuffle(&mut dropped);
        dropped.truncate(dropped.len() - self.n_objects.unwrap_or(dropped.len()));
        let scene = |table: &toml::Table| {
            let mut table = table.clone();
            table.iter_mut().for_each(|(_, value)| without(value, &dropped));
            ChangedScene::new(&self.file, &table)
        };
        Ok(DrawnScene { start: scene(&self.scene)?, as_written: scene(&self.as_written)? })
    }
}

/// A camera by where it stands about the point that it looks at.
struct View {
    distance_m: f64,
    /// To the right of the front, which is the side of negative y.
    azimuth_deg: f64,
    elevation_deg: f64,
}

impl View {
    fn of(sim: &SimConfig) -> Self {
        let away = sim.camera.position_m - sim.camera.look_at_m;
        Self {
            distance_m: away.norm(),
            azimuth_deg: away.x.atan2(-away.y).to_degrees(),
            elevation_deg: away.z.atan2(away.xy().norm()).to_degrees(),
        }
    }

    fn take(&self, sim: &mut SimConfig) {
        let (azimuth, elevation) = (self.azimuth_deg.to_radians(), self.elevation_deg.to_radians());
        let level = elevation.cos();
        let away = Vector3::new(level * azimuth.sin(), -level * azimuth.cos(), elevation.sin());
        sim.camera.position_m = sim.camera.look_at_m + away * self.distance_m;
    }
}

fn number(key: &str, value: &toml::Value) -> Result<f64, ConfigError> {
    let number = value.as_float().or_else(|| value.as_integer().map(|n| n as f64));
    number.ok_or_else(|| Mismatch::new(format!("--vary {key}"), "a number", value).into())
}

/// Sets a dotted key, with the tables above it where they are missing.
fn put(table: &mut toml::Table, key: &str, value: toml::Value) {
    match key.split_once('.') {
        None => drop(table.insert(key.to_owned(), value)),
        Some((first, rest)) => {
            let below = table.entry(first).or_insert_with(|| toml::Table::new().into());
            if !below.is_table() {
                *below = toml::Table::new().into();
            }
            if let toml::Value::Table(below) = below {
                put(below, rest, value);
            }
        }
    }
}

/// The names of the bodies that have no place of their own: those that can move.
fn movable(scene: &toml::Table) -> Vec<String> {
    let bodies = scene.get("bodies").and_then(toml::Value::as_array).into_iter().flatten();
    let movable = bodies.filter(|body| body.get("at_m").is_none());
    let names = movable.filter_map(|body| body.get("name")?.as_str());
    names.map(str::to_owned).collect()
}

/// Takes bodies out of a scene: their tables, and their names wherever a list has them.
fn without(value: &mut toml::Value, dropped: &[String]) {
    let is_dropped = |name: Option<&str>| dropped.iter().any(|d| name == Some(d));
    match value {
        toml::Value::Array(items) => {
            items.retain(|item| {
                let name = item.as_str().or_else(|| item.get("name")?.as_str());
                !is_dropped(name)
            });
            for item in items {
                without(item, dropped);
            }
        }
        toml::Value::Table(table) => table.iter_mut().for_each(|(_, v)| without(v, dropped)),
        toml::Value::String(_)
        | toml::Value::Integer(_)
        | toml::Value::Float(_)
        | toml::Value::Boolean(_)
        | toml::Value::Datetime(_) => {}
    }
}
