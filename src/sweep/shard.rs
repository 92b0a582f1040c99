//! Which part of a sweep a process does, also as a cluster's scheduler tells it.

use std::fmt;

use thiserror::Error;

/// Variables in which schedulers of array jobs tell a task its number, each with the number of its first
/// task, or the variable that tells it: Slurm, Kubernetes (indexed jobs), `HyperQueue` (`--array 1-N`), PBS, Grid
/// Engine, LSF, AWS Batch.
const NUMBERED_BY: [(&str, First); 7] = [
    ("SLURM_ARRAY_TASK_ID", First::In("SLURM_ARRAY_TASK_MIN")),
    ("JOB_COMPLETION_INDEX", First::Is(0)),
    ("HQ_TASK_ID", First::Is(1)),
    ("PBS_ARRAY_INDEX", First::Is(1)),
    ("SGE_TASK_ID", First::In("SGE_TASK_FIRST")),
    ("LSB_JOBINDEX", First::Is(1)),
    ("AWS_BATCH_JOB_ARRAY_INDEX", First::Is(0)),
];
/// Variable in which Slurm tells how many tasks there are.
const COUNTED_BY: &str = "SLURM_ARRAY_TASK_COUNT";

#[derive(Debug, Clone, Copy)]
enum First {
    Is(u64),
    In(&'static str),
}

/// One of several parts of a sweep: every `count`th episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which one, from 1.
    number: u64,
    /// Of how many.
    count: u64,
}

/// What is said of a shard makes none.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("--shard: expected {expected}, got {got}")]
pub struct ShardError {
    expected: String,
    got: String,
}

impl Default for Shard {
    /// All of it.
    fn default() -> Self {
        Self { number: 1, count: 1 }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.number, self.count)
    }
}

impl Shard {
    /// Shard `number` of `count`; `None` unless `1 <= number <= count`.
    pub fn new(number: u64, count: u64) -> Option<Self> {
        (1..=count).contains(&number).then_some(Self { number, count })
    }

    /// Reads `I/N`, or `auto/N` and `auto`, which take what a scheduler tells. `variable` gives the
    /// environment's variables.
    ///
    /// # Errors
    /// [`ShardError`] with what can be said.
    pub fn parse(
        text: &str,
        variable: &dyn Fn(&str) -> Option<String>,
    ) -> Result<Self, ShardError> {
        let (number, count) = match text.split_once('/') {
            Some((number, count)) => (number, Some(count.to_owned())),
            None => (text, None),
        };
        let fault = |expected: &str, got: &str| ShardError {
            expected: expected.to_owned(),
            got: got.to_owned(),
        };
        let usage = "I/N with 1 <= I <= N, or auto/N";
        let is_auto = number == "auto";
        let count = count.or_else(|| variable(COUNTED_BY).filter(|_| is_auto));
        let count = count.ok_or_else(|| fault(usage, text))?;
        let count: u64 = count.parse().map_err(|_not| fault(usage, text))?;
        let number = if is_auto {
            told(variable).ok_or_else(|| fault(&none_told(), "none of them"))?
        } else {
            number.parse().map_err(|_not| fault(usage, text))?
        };
        Self::new(number, count).ok_or_else(|| fault(usage, &format!("{number}/{count}")))
    }

    /// The numbers of its episodes, of `n_episodes` in all.
    pub fn episodes(self, n_episodes: u64) -> impl Iterator<Item = u64> {
        (self.number - 1..n_episodes).step_by(usize::try_from(self.count).unwrap_or(usize::MAX))
    }

    /// Of how many it is one.
    pub fn count(self) -> u64 {
        self.count
    }

    /// The name of its file, without ending.
    pub fn stem(self) -> String {
        format!("shard-{}-of-{}", self.number, self.count)
    }

    /// The shard whose file has this name, without ending.
    pub fn of_stem(stem: &str) -> Option<Self> {
        let (number, count) = stem.strip_prefix("shard-")?.split_once("-of-")?;
        Self::new(number.parse().ok()?, count.parse().ok()?)
    }
}

/// The number from 1 that the first of the schedulers tells.
fn told(variable: &dyn Fn(&str) -> Option<String>) -> Option<u64> {
    NUMBERED_BY.iter().find_map(|(name, first)| {
        let number: u64 = variable(name)?.trim().parse().ok()?;
        let first = match first {
            First::Is(first) => *first,
            First::In(name) => {
                variable(name).and_then(|text| text.trim().parse().ok()).unwrap_or(1)
            }
        };
        (number + 1).checked_sub(first)
    })
}

fn none_told() -> String {
    let names: Vec<&str> = NUMBERED_BY.iter().map(|(name, _)| *name).collect();
    format!("a number in one of the variables {}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str, variables: &[(&str, &str)]) -> Result<Shard, ShardError> {
        Shard::parse(text, &|name| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn shards_part_the_episodes() {
        let mut all: Vec<u64> =
            (1..=3).flat_map(|number| Shard::new(number, 3).unwrap().episodes(10)).collect();
        all.sort_unstable();
        assert_eq!(all, (0..10).collect::<Vec<_>>());
        assert_eq!(parse("2/3", &[]).unwrap().episodes(10).collect::<Vec<_>>(), [1, 4, 7]);
        assert_eq!(parse("3/3", &[]).unwrap().episodes(1).count(), 0, "more shards than episodes");
    }

    #[test]
    fn schedulers_tell_the_number() {
        let slurm = [
            ("SLURM_ARRAY_TASK_ID", "4"),
            ("SLURM_ARRAY_TASK_MIN", "3"),
            ("SLURM_ARRAY_TASK_COUNT", "8"),
        ];
        assert_eq!(parse("auto", &slurm), Ok(Shard { number: 2, count: 8 }));
        let kubernetes = [("JOB_COMPLETION_INDEX", "0")];
        assert_eq!(parse("auto/5", &kubernetes), Ok(Shard { number: 1, count: 5 }));
        assert_eq!(parse("auto/5", &[("HQ_TASK_ID", "5")]), Ok(Shard { number: 5, count: 5 }));
    }

    #[test]
    fn what_is_no_shard_is_told() {
        for text in ["0/3", "4/3", "1", "a/b", "1/0", ""] {
            let error = parse(text, &[]).unwrap_err().to_string();
            assert!(error.contains("I/N") && error.starts_with("--shard"), "{text}: {error}");
        }
        let error = parse("auto/4", &[]).unwrap_err().to_string();
        assert!(error.contains("SLURM_ARRAY_TASK_ID"), "{error}");
        assert!(parse("auto/4", &[("HQ_TASK_ID", "5")]).is_err());
    }

    #[test]
    fn a_file_tells_its_shard() {
        let shard = Shard::new(2, 7).unwrap();
        assert_eq!(Shard::of_stem(&shard.stem()), Some(shard));
        assert_eq!(Shard::of_stem("shard-8-of-7"), None);
        assert_eq!(Shard::of_stem("episodes"), None);
    }
}
