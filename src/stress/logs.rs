//! Interval logs in the form of `HdrHistogram`, one file for each case, size, workload and rate.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Duration;

use hdrhistogram::Histogram;
use hdrhistogram::serialization::V2DeflateSerializer;
use hdrhistogram::serialization::interval_log::{
    IntervalLogWriterBuilder, IntervalLogWriterError, Tag,
};

use super::measure::{AllSamples, Key, Samples, Timing};
use crate::run::ConfigError;

/// Largest time that is told apart, nanoseconds (a quarter of an hour).
const NS_MAX: u64 = 900_000_000_000;

/// What is logged of a plan.
type Value = fn(&Timing) -> u64;

/// All samples of a stress test, to be written.
#[derive(Debug)]
pub struct Logs(pub(super) AllSamples);

/// Writes the logs into a folder; returns how many files.
///
/// Every rung has two tags: `<rung>.cpu`, thread-CPU nanoseconds, and `<rung>.wall`.
///
/// # Errors
/// [`ConfigError::File`] naming the file.
pub fn write_logs(logs: &Logs, folder: &Path) -> Result<usize, ConfigError> {
    let fault = |path: &Path, reason: String| ConfigError::File {
        path: path.display().to_string(),
        reason,
    };
    fs::create_dir_all(folder).map_err(|e| fault(folder, e.to_string()))?;
    let mut files: BTreeMap<String, Vec<(&Key, &Samples)>> = BTreeMap::new();
    for (key, samples) in &logs.0 {
        files.entry(file_name(key)).or_default().push((key, samples));
    }
    for (name, entries) in &files {
        let path = folder.join(name);
        let bytes = log(entries).map_err(|reason| fault(&path, reason))?;
        fs::write(&path, bytes).map_err(|e| fault(&path, e.to_string()))?;
    }
    Ok(files.len())
}

fn file_name(key: &Key) -> String {
    let Key { case, size, problem, feed, rate, .. } = key;
    let size = problem.clone().unwrap_or_else(|| size.to_string());
    let name = format!("{case}-{size}-{}-{rate}", feed.name());
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    format!("{}.hlog", name.chars().map(plain).collect::<String>())
}

fn log(entries: &[(&Key, &Samples)]) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let mut serializer = V2DeflateSerializer::new();
    let mut log = IntervalLogWriterBuilder::new()
        .add_comment("groundloop stress: nanoseconds")
        .begin_log_with(&mut bytes, &mut serializer)
        .map_err(|e| e.to_string())?;
    for (key, samples) in entries {
        for (kind, value) in [("cpu", Timing::cpu_ns as Value), ("wall", |timing| timing.wall_ns)] {
            let mut histogram =
                Histogram::<u64>::new_with_bounds(1, NS_MAX, 3).map_err(|e| e.to_string())?;
            samples.all().for_each(|timing| histogram.saturating_record(value(timing).max(1)));
            let tag = format!("{}.{kind}", key.rung);
            let tag = Tag::new(&tag).ok_or_else(|| format!("\"{tag}\" is no tag"))?;
            let span = Duration::from_nanos(samples.all().map(|t| t.wall_ns).sum());
            log.write_histogram(&histogram, Duration::ZERO, span, Some(tag)).map_err(
                |e| match e {
                    IntervalLogWriterError::SerializeError(error) => error.to_string(),
                    IntervalLogWriterError::IoError(error) => error.to_string(),
                },
            )?;
        }
    }
    Ok(bytes)
}
