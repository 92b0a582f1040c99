//! What came of all disturbed pictures, counted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{TRANSFORMS, Tried, Worth};
use crate::eval::interval::wilson_95;

/// Output of `groundloop eval robustness --json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "groundloop eval robustness --json")]
pub struct RobustnessReport {
    /// The detector.
    pub detector: String,
    /// The grounder.
    pub grounder: String,
    /// Where the disturbances' seeds begin.
    pub seed: u64,
    /// One row for each set of pictures and disturbance.
    pub rows: Vec<RobustnessRow>,
    /// What is wrong or unknown in each picture that is not right; empty without `--details`.
    pub faults: Vec<RobustnessFault>,
}

/// One set of pictures under one disturbance. Objects count as facts do: a missed or an invented
/// object makes a state wrong.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobustnessRow {
    /// The pictures: a domain's photographs or rendered scenes.
    pub pictures: String,
    /// The disturbance.
    pub transform: String,
    /// Whether it hides parts of objects: then unknown is as good as right.
    pub hides: bool,
    /// States that are exactly right.
    pub right: u32,
    /// States without a wrong word, in which some facts are unknown.
    pub unknown: u32,
    /// Wrong states that an anomaly or an unknown fact warns of.
    pub doubted: u32,
    /// Wrong states that nothing warns of.
    pub silent: u32,
    /// Wilson's 95 % interval of the share of right states (Wilson, 1927).
    pub right_share_95: [f64; 2],
}

/// What is wrong with one state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobustnessFault {
    /// Which picture, read by which example.
    pub case: String,
    /// The disturbance.
    pub transform: String,
    /// What the state is worth.
    pub worth: Worth,
    /// What is wrong, missing or unknown.
    pub faults: Vec<String>,
    /// What warned.
    pub anomalies: Vec<String>,
}

impl RobustnessRow {
    /// The disturbance, with a word where it hides parts of objects.
    pub fn label(&self) -> String {
        if self.hides { format!("{} (hides)", self.transform) } else { self.transform.clone() }
    }

    /// How many states were read.
    pub fn n(&self) -> u32 {
        self.right + self.unknown + self.doubted + self.silent
    }

    fn count(&mut self, worth: Worth) {
        let counter = match worth {
            Worth::Right => &mut self.right,
            Worth::Unknown => &mut self.unknown,
            Worth::Doubted => &mut self.doubted,
            Worth::Silent => &mut self.silent,
        };
        *counter += 1;
        self.right_share_95 = wilson_95(self.right, self.n());
    }
}

impl RobustnessReport {
    /// A report of nothing yet.
    pub fn new(detector: &str, grounder: &str, seed: u64) -> Self {
        let (detector, grounder) = (detector.to_owned(), grounder.to_owned());
        Self { detector, grounder, seed, rows: Vec::new(), faults: Vec::new() }
    }

    /// Counts one picture; with `details` says what is wrong with it.
    pub fn add(&mut self, pictures: &str, tried: &Tried<'_>, details: bool) {
        let (transform, worth) = (tried.transform.name, tried.judgement.worth);
        let is_it =
            |row: &&mut RobustnessRow| row.pictures == pictures && row.transform == transform;
        if let Some(row) = self.rows.iter_mut().find(is_it) {
            row.count(worth);
        } else {
            let mut row = empty(pictures, transform, tried.transform.hides);
            row.count(worth);
            self.rows.push(row);
        }
        if details && worth != Worth::Right {
            let anomalies = tried.read.state.grounding.anomalies.iter();
            self.faults.push(RobustnessFault {
                case: tried.case.to_owned(),
                transform: transform.to_owned(),
                worth,
                faults: tried.judgement.faults.clone(),
                anomalies: anomalies.map(ToString::to_string).collect(),
            });
        }
    }

    /// The sets of pictures, in the order of their first picture.
    pub fn sets(&self) -> Vec<&str> {
        let mut sets: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !sets.contains(&row.pictures.as_str()) {
                sets.push(&row.pictures);
            }
        }
        sets
    }

    /// The row of a set under a disturbance.
    pub fn row(&self, pictures: &str, transform: &str) -> Option<&RobustnessRow> {
        self.rows.iter().find(|row| row.pictures == pictures && row.transform == transform)
    }

    /// The sum over all disturbances of one set.
    pub fn total(&self, pictures: &str) -> RobustnessRow {
        let mut total = empty(pictures, "all", false);
        for row in self.rows.iter().filter(|row| row.pictures == pictures) {
            total.right += row.right;
            total.unknown += row.unknown;
            total.doubted += row.doubted;
            total.silent += row.silent;
        }
        total.right_share_95 = wilson_95(total.right, total.n());
        total
    }

    /// The disturbances that were tried, in the order of [`TRANSFORMS`].
    pub fn transforms(&self) -> impl Iterator<Item = &'static str> {
        let names = TRANSFORMS.iter().map(|transform| transform.name);
        names.filter(|name| self.rows.iter().any(|row| row.transform == *name))
    }
}

fn empty(pictures: &str, transform: &str, hides: bool) -> RobustnessRow {
    let (right, unknown, doubted, silent) = Default::default();
    let (pictures, transform) = (pictures.to_owned(), transform.to_owned());
    RobustnessRow {
        pictures,
        transform,
        hides,
        right,
        unknown,
        doubted,
        silent,
        right_share_95: [0.0, 1.0],
    }
}
