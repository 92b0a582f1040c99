//! Which episodes a sweep has: a pure function of its spec.

use super::spec::{Sampling, SweepFactor, SweepSpec};
use crate::draws::Draws;

/// The run file's key that is no key of it: which run file it is.
const RUN: &str = "run";

/// One factor at one of its levels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// The factor.
    pub factor: String,
    /// Its level, as tables show it.
    pub level: String,
}

/// Everything that one episode of a sweep is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EpisodePlan {
    /// Its number, from 0.
    pub index: u64,
    /// Its point, from 0; episodes of one point differ in their seeds only.
    pub point: u64,
    /// Its seed.
    pub seed: u64,
    /// The run file, or the name of a shipped one.
    pub run: String,
    /// `key=value`, as after `--set`, in order.
    pub sets: Vec<String>,
    /// Each factor's level, in the order of the spec.
    pub settings: Vec<Setting>,
}

impl EpisodePlan {
    /// The command that runs it again.
    pub fn command(&self) -> String {
        let sets = self.sets.iter().map(|set| format!(" --set {}", shell_word(set)));
        let sets: String = sets.collect();
        format!("groundloop run {} --seed {}{sets}", shell_word(&self.run), self.seed)
    }
}

/// All episodes of a sweep.
#[derive(Debug, Clone)]
pub struct SweepDesign {
    spec: SweepSpec,
    /// Of a Latin hypercube, where in its range each factor is for each sample, in [0, 1).
    places: Vec<Vec<f64>>,
}

impl SweepDesign {
    /// The design of a spec.
    pub fn new(spec: SweepSpec) -> Self {
        let n = match spec.sampling {
            Sampling::Grid => 0,
            Sampling::LatinHypercube => spec.samples,
        };
        let factors = 0..spec.factor.len() as u64;
        let places = factors.map(|factor| places(spec.seed, factor, n)).collect();
        Self { spec, places }
    }

    /// What the sweep file says.
    pub fn spec(&self) -> &SweepSpec {
        &self.spec
    }

    /// How many episodes there are.
    pub fn len(&self) -> u64 {
        self.spec.n_episodes()
    }

    /// Whether there are none, which no sweep file can say.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One episode; `None` beyond the last.
    pub fn episode(&self, index: u64) -> Option<EpisodePlan> {
        if index >= self.len() {
            return None;
        }
        let spec = &self.spec;
        let (point, seed) = match spec.sampling {
            Sampling::Grid => (index / spec.repeats, spec.seed.wrapping_add(index % spec.repeats)),
            Sampling::LatinHypercube => (index, spec.seed.wrapping_add(index)),
        };
        let mut plan = EpisodePlan {
            index,
            point,
            seed,
            run: spec.run.clone(),
            sets: settings(&spec.set),
            settings: Vec::new(),
        };
        let mut rest = point;
        for (i, factor) in spec.factor.iter().enumerate() {
            let level = match spec.sampling {
                Sampling::Grid => {
                    let n = factor.n_levels();
                    let level = rest % n;
                    rest /= n;
                    factor.level(level)
                }
                Sampling::LatinHypercube => factor.at(*self.places.get(i)?.get(index as usize)?),
            };
            plan.take(factor, level);
        }
        Some(plan)
    }
}

/// What a factor is set to.
enum Chosen<'a> {
    Value(toml::Value),
    Level(&'a super::Level),
}

impl SweepFactor {
    /// One of its levels in a grid.
    fn level(&self, idx: u64) -> Chosen<'_> {
        let last = self.n_levels().saturating_sub(1).max(1);
        match self.range {
            Some(_) => self.in_range(idx as f64 / last as f64),
            None => self.listed(idx as usize),
        }
    }

    /// What it is at a place in [0, 1).
    fn at(&self, place: f64) -> Chosen<'_> {
        match self.range {
            Some(_) => self.in_range(place),
            None => self.listed((place * self.n_levels() as f64) as usize),
        }
    }

    fn in_range(&self, share: f64) -> Chosen<'_> {
        let [low, high] = self.range.unwrap_or_default();
        let value = low + share * (high - low);
        Chosen::Value(if self.whole {
            toml::Value::Integer(value.round() as i64)
        } else {
            toml::Value::Float(value)
        })
    }

    fn listed(&self, idx: usize) -> Chosen<'_> {
        let last = self.levels.len().saturating_sub(1);
        match self.values.get(idx) {
            Some(value) => Chosen::Value(value.clone()),
            None => Chosen::Level(&self.levels[idx.min(last)]),
        }
    }
}

impl EpisodePlan {
    fn take(&mut self, factor: &SweepFactor, chosen: Chosen<'_>) {
        let level = match chosen {
            Chosen::Value(value) => {
                let shown = shown(&value);
                if factor.key == RUN {
                    self.run.clone_from(&shown);
                } else {
                    self.sets.push(format!("{}={value}", factor.key));
                }
                shown
            }
            Chosen::Level(level) => {
                self.run = level.run.clone().unwrap_or_else(|| self.run.clone());
                self.sets.extend(settings(&level.set));
                level.name.clone()
            }
        };
        self.settings.push(Setting { factor: factor.title().to_owned(), level });
    }
}

/// A value as tables show it: a text without quotes.
fn shown(value: &toml::Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// The leaves of a table as `key=value`.
fn settings(table: &toml::Table) -> Vec<String> {
    let of = |(key, value): (&String, &toml::Value)| match value.as_table() {
        Some(below) => settings(below).iter().map(|set| format!("{key}.{set}")).collect(),
        None => vec![format!("{key}={value}")],
    };
    table.iter().flat_map(of).collect()
}

/// Where each of `n` samples is for one factor: in every nth part of the range there is one, in a drawn order
/// and at a drawn place of the part.
fn places(seed: u64, factor: u64, n: u64) -> Vec<f64> {
    let mut draws = Draws::stream(seed, factor);
    let mut parts: Vec<u64> = (0..n).collect();
    draws.shuffle(&mut parts);
    parts.into_iter().map(|part| (part as f64 + draws.unit()) / n as f64).collect()
}

/// A word for a POSIX shell.
pub(super) fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn design(text: &str) -> SweepDesign {
        SweepDesign::new(SweepSpec::parse("sweep.toml", text).unwrap())
    }

    fn all(design: &SweepDesign) -> Vec<EpisodePlan> {
        (0..design.len()).map(|index| design.episode(index).unwrap()).collect()
    }

    const GRID: &str = r#"
        run = "blocksworld"
        seed = 7
        repeats = 3
        set = { camera.rate_hz = 5.0, goal.text = "red on blue" }
        [[factor]]
        key = "fault_rate"
        values = [0.0, 0.5]
        [[factor]]
        name = "world"
        levels = [{ name = "blocks" }, { name = "disks", run = "hanoi", set = { sim.scene = "x.toml" } }]
        [[factor]]
        key = "sim.camera.noise"
        range = [0.0, 20.0]
        steps = 3
        whole = true
    "#;

    #[test]
    fn a_grid_has_every_combination_with_the_same_seeds() {
        let design = design(GRID);
        let episodes = all(&design);
        assert_eq!(episodes.len(), 2 * 2 * 3 * 3);
        let levels = |e: &EpisodePlan| {
            e.settings.iter().map(|s| s.level.clone()).collect::<Vec<_>>().join(" ")
        };
        let points: BTreeSet<String> = episodes.iter().map(levels).collect();
        assert_eq!(points.len(), 12, "{points:?}");
        assert!(points.contains("0.5 disks 10"), "{points:?}");
        assert!(episodes.chunks(3).all(|e| e.iter().map(|e| e.seed).eq(7..10)));
        assert!(episodes.iter().all(|e| e.point == e.index / 3));
    }

    #[test]
    fn an_episode_is_a_command() {
        let design = design(GRID);
        let of_disks = all(&design).into_iter().find(|e| e.run == "hanoi").unwrap();
        assert_eq!(
            of_disks.command(),
            "groundloop run hanoi --seed 7 --set camera.rate_hz=5.0 --set 'goal.text=\"red on blue\"' \
             --set fault_rate=0.0 --set 'sim.scene=\"x.toml\"' --set sim.camera.noise=0"
        );
        assert_eq!(shell_word("it's"), r"'it'\''s'");
    }

    const HYPERCUBE: &str = r#"
        run = "blocksworld"
        sampling = "latin_hypercube"
        samples = 40
        [[factor]]
        key = "fault_rate"
        range = [0.0, 1.0]
        [[factor]]
        key = "executive"
        values = ["closed_loop", "open_loop"]
    "#;

    #[test]
    fn a_hypercube_takes_each_part_of_a_range_once() {
        let episodes = all(&design(HYPERCUBE));
        let parts: BTreeSet<u64> = episodes
            .iter()
            .map(|e| (e.settings[0].level.parse::<f64>().unwrap() * 40.0) as u64)
            .collect();
        assert_eq!(parts.len(), 40);
        let open = episodes.iter().filter(|e| e.settings[1].level == "open_loop").count();
        assert_eq!(open, 20);
        let seeds: BTreeSet<u64> = episodes.iter().map(|e| e.seed).collect();
        assert_eq!(seeds.len(), 40);
        let again = all(&design(HYPERCUBE));
        assert_eq!(again, episodes);
    }

    #[test]
    fn a_wrong_spec_is_told_by_its_key() {
        let told = |text: &str| SweepSpec::parse("s.toml", text).unwrap_err().render();
        let both = told("run = \"a\"\n[[factor]]\nkey = \"x\"\nvalues = [1]\nrange = [0.0, 1.0]");
        assert!(both.contains("s.toml:2") && both.contains("got values and range"), "{both}");
        let unknown = told("run = \"a\"\nrepeat = 3");
        assert!(unknown.contains("repeats"), "{unknown}");
        let none = told("run = \"a\"\nsampling = \"latin_hypercube\"");
        assert!(none.contains("samples") && none.contains("got 0"), "{none}");
        let many = told("run = \"a\"\nrepeats = 2000000");
        assert!(many.contains("1 to 1000000 episodes"), "{many}");
        let twice = "[[factor]]\nkey = \"x\"\nvalues = [1]\n";
        let twice = told(&format!("run = \"a\"\n{twice}{twice}"));
        assert!(twice.contains("x twice"), "{twice}");
    }
}
