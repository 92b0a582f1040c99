//! Grounding over one factor after another: how many objects, from how high, how much is hidden, light, noise,
//! and how many labelled examples.
//!
//! The scenes are those of [`sim_grounding`](super::sim_grounding), seen by the run file's camera, with one thing
//! different. Labelled examples are always undisturbed; those for another elevation are seen from there.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use schemars::JsonSchema;
use serde::Serialize;

use super::sim_grounding::{Row, SetUp, Source, Used, examples, row};
use super::wilson_95;
use crate::dataset::{FactorValue, SceneSource};
use crate::draws::Draws;
use crate::hardware::sim::{Labeller, Look, exemplar_scenes};
use crate::run::ConfigError;

/// Metres of depth noise for each step of colour noise, as in the defaults of run files.
const DEPTH_M_PER_RGB: f64 = 0.0005;
/// Where the least share of an object that can be seen parts the scenes.
const VISIBLE_SHARES: [f64; 3] = [0.75, 0.5, 0.25];

/// What differs between the rows of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GroundingFactor {
    /// How many of the scene's objects are there.
    Objects,
    /// How high the camera stands, degrees above the table.
    Elevation,
    /// The share of the most hidden object that can be seen.
    Occlusion,
    /// The intensity of the light; 1 is usual.
    Light,
    /// Noise of each pixel: of colour, in steps of 1/255, and half a millimetre of depth for each.
    Noise,
    /// How many labelled examples there are.
    Exemplars,
}

impl GroundingFactor {
    /// Every factor with its name.
    pub const ALL: [(&'static str, Self); 6] = [
        ("objects", Self::Objects),
        ("elevation", Self::Elevation),
        ("occlusion", Self::Occlusion),
        ("light", Self::Light),
        ("noise", Self::Noise),
        ("exemplars", Self::Exemplars),
    ];

    /// Its name.
    pub fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, factor)| *factor == self).map_or("", |(name, _)| name)
    }
}

/// How well the facts were told at one level of one factor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FactorRow {
    /// What differs.
    pub factor: GroundingFactor,
    /// Its value.
    pub level: String,
    /// What was counted.
    #[serde(flatten)]
    pub row: Row,
    /// The share of the predicted facts that hold; 1 if none is predicted.
    pub precision: f64,
    /// The share of the facts that hold that are predicted; 1 if none holds.
    pub recall: f64,
    /// Wilson's 95 % interval of the share of exact states.
    pub exact_share_95: [f64; 2],
}

/// One or more rows that are measured together.
struct Cell {
    factor: GroundingFactor,
    levels: Vec<String>,
    values: Vec<FactorValue>,
    /// Whether the labelled examples are seen with these values, too.
    is_of_examples: bool,
    n_examples: usize,
}

impl Cell {
    /// The level that a look belongs to.
    fn level_of(&self, look: &Look) -> usize {
        if self.factor != GroundingFactor::Occlusion {
            return 0;
        }
        let hidden = if look.n_hidden > 0 { 0.0 } else { 1.0 };
        let least = look.visible_shares.iter().copied().fold(hidden, f64::min);
        VISIBLE_SHARES.iter().filter(|share| least < **share).count()
    }
}

/// How many cells of a table there are for these factors: `done` is called so often for each seed.
///
/// # Errors
/// [`ConfigError`] naming the scene file.
pub fn n_cells(source: &SceneSource, factors: &[GroundingFactor]) -> Result<usize, ConfigError> {
    Ok(cells(source, factors)?.len())
}

/// Measures one domain over each factor, on one scene for each seed from 1 and each level. `done` is called after
/// each scene; all processors work, and the rows are the same with any number.
///
/// # Errors
/// [`ConfigError`] naming the file.
pub fn measure_factors(
    source: &SceneSource,
    factors: &[GroundingFactor],
    seeds: u64,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<FactorRow>, ConfigError> {
    let cells = cells(source, factors)?;
    let next = AtomicUsize::new(0);
    let work = || -> Result<Vec<(usize, Vec<FactorRow>)>, ConfigError> {
        let mut measured = Vec::new();
        loop {
            let idx = next.fetch_add(1, Ordering::Relaxed);
            let Some(cell) = cells.get(idx) else { return Ok(measured) };
            measured.push((idx, measure_cell(source, cell, seeds, done)?));
        }
    };
    let n_threads = thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let results: Vec<_> = thread::scope(|scope| {
        let workers: Vec<_> = (0..n_threads).map(|_| scope.spawn(work)).collect();
        let joined = workers.into_iter().map(thread::ScopedJoinHandle::join);
        joined.map(|ended| ended.unwrap_or_else(|p| std::panic::resume_unwind(p))).collect()
    });
    let mut measured = Vec::new();
    for result in results {
        measured.extend(result?);
    }
    measured.sort_by_key(|(idx, _)| *idx);
    Ok(measured.into_iter().flat_map(|(_, rows)| rows).collect())
}

fn cells(source: &SceneSource, factors: &[GroundingFactor]) -> Result<Vec<Cell>, ConfigError> {
    let n_objects = source.setting(&[])?.n_movable();
    let n_examples = exemplar_scenes(&source.folder.files)?.len();
    let mut cells = Vec::new();
    for factor in factors {
        let cell = |level: String, values: &[(&str, f64)]| Cell {
            factor: *factor,
            levels: vec![level],
            values: values.iter().map(|(key, value)| real(key, *value)).collect(),
            is_of_examples: *factor == GroundingFactor::Elevation,
            n_examples,
        };
        let over = |key: &str, levels: &[f64]| -> Vec<Cell> {
            levels.iter().map(|level| cell(level.to_string(), &[(key, *level)])).collect()
        };
        cells.extend(match factor {
            GroundingFactor::Objects => {
                let step = (n_objects.saturating_sub(2) / 3).max(1);
                let levels = (2..=n_objects).step_by(step);
                levels
                    .map(|n| Cell { values: vec![whole("objects", n)], ..cell(n.to_string(), &[]) })
                    .collect()
            }
            GroundingFactor::Elevation => {
                over("view.elevation_deg", &[10.0, 20.0, 30.0, 45.0, 60.0])
            }
            GroundingFactor::Light => over("light.intensity", &[0.4, 0.7, 1.0, 1.5, 2.2]),
            GroundingFactor::Noise => {
                let noise = |level: &f64| {
                    let depth = ("sim.camera.noise.depth_sigma_m", level * DEPTH_M_PER_RGB);
                    cell(level.to_string(), &[("sim.camera.noise.rgb_sigma", *level), depth])
                };
                [0.0, 2.0, 5.0, 10.0, 20.0].iter().map(noise).collect()
            }
            GroundingFactor::Occlusion => {
                let [a, b, c] = VISIBLE_SHARES;
                let levels = [format!("{a} to 1"), format!("{b} to {a}"), format!("{c} to {b}")];
                let levels = levels.into_iter().chain([format!("below {c}")]).collect();
                vec![Cell { levels, ..cell(String::new(), &[]) }]
            }
            GroundingFactor::Exemplars => (1..=n_examples)
                .map(|n| Cell { n_examples: n, ..cell(n.to_string(), &[]) })
                .collect(),
        });
    }
    Ok(cells)
}

fn real(key: &str, value: f64) -> FactorValue {
    FactorValue { key: key.to_owned(), value: toml::Value::Float(value) }
}

fn whole(key: &str, value: usize) -> FactorValue {
    let value = toml::Value::Integer(i64::try_from(value).unwrap_or(i64::MAX));
    FactorValue { key: key.to_owned(), value }
}

fn measure_cell(
    source: &SceneSource,
    cell: &Cell,
    seeds: u64,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<FactorRow>, ConfigError> {
    let folder = &source.folder;
    let setting = source.setting(&cell.values)?;
    let shown = if cell.is_of_examples { setting.sim.clone() } else { source.setting(&[])?.sim };
    let mut labeller = Labeller::new(folder.scenes(), shown)?;
    let mut examples = examples(&mut labeller, folder, source.config.seed, None)?;
    examples.truncate(cell.n_examples);
    let mut setup = SetUp::new(folder, &examples)?;
    let kinds: Vec<(Source, Used)> = setup.combinations().collect();
    let level_rows = || kinds.iter().map(|(objects, used)| row(folder, "usual", *objects, *used));
    let mut levels: Vec<Vec<Row>> = cell.levels.iter().map(|_| level_rows().collect()).collect();
    for seed in 1..=seeds {
        let scene = setting.drawn(&mut Draws::of_key([seed, 0, 0, 0]))?;
        let look = labeller.look_at(&scene.start, &setting.sim, seed)?;
        setup.count(&look, &mut levels[cell.level_of(&look)])?;
        done();
    }
    let named = cell.levels.iter().zip(levels);
    let factor_row = |level: &String, row: Row| FactorRow {
        factor: cell.factor,
        level: level.clone(),
        precision: row.precision(),
        recall: row.recall(),
        exact_share_95: wilson_95(count(row.n_exact), count(row.n_scenes)),
        row,
    };
    Ok(named
        .flat_map(|(level, rows)| rows.into_iter().map(move |row| factor_row(level, row)))
        .collect())
}

fn count(n: u64) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}
