//! What a check has found.

use schemars::JsonSchema;
use serde::Serialize;

/// How well it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Health {
    /// As it should be.
    Ok,
    /// A run may work, and may not.
    Warning,
    /// No run will work.
    Fault,
}

impl Health {
    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warning => "warning",
            Self::Fault => "fault",
        }
    }
}

/// One finding about the machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct DoctorFinding {
    /// The check.
    pub check: String,
    /// How well it is.
    pub health: Health,
    /// What was measured, in words.
    pub measured: String,
    /// What to change; `null` where nothing is.
    pub remedy: Option<String>,
}

/// What a check says: a finding without its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Judgement {
    pub(super) health: Health,
    pub(super) measured: String,
    pub(super) remedy: Option<String>,
}

impl Judgement {
    pub(super) fn ok(measured: impl Into<String>) -> Self {
        Self { health: Health::Ok, measured: measured.into(), remedy: None }
    }

    pub(super) fn warning(measured: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (measured, remedy) = (measured.into(), Some(remedy.into()));
        Self { health: Health::Warning, measured, remedy }
    }

    pub(super) fn fault(measured: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { health: Health::Fault, ..Self::warning(measured, remedy) }
    }
}

impl DoctorFinding {
    pub(super) fn of(check: &str, Judgement { health, measured, remedy }: Judgement) -> Self {
        Self { check: check.to_owned(), health, measured, remedy }
    }

    /// A run file that cannot be used.
    pub fn of_run_file(file: &str, reason: &str) -> Self {
        let measured = format!("{file} cannot be run: {reason}");
        let remedy = "put it right: what the run needs is not known before".to_owned();
        Self::of("run file", Judgement::fault(measured, remedy))
    }
}

/// A number of bytes for people.
pub(super) fn in_words(bytes: u64) -> String {
    const UNITS: [(u64, &str); 3] = [(1 << 30, "GB"), (1 << 20, "MB"), (1 << 10, "kB")];
    match UNITS.iter().find(|(unit, _)| bytes >= *unit) {
        Some((unit, name)) if bytes >= 10 * unit => format!("{} {name}", bytes / unit),
        Some((unit, name)) => format!("{:.1} {name}", bytes as f64 / *unit as f64),
        None => format!("{bytes} bytes"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_told_in_their_unit() {
        let said = [0, 183, 3959, 64 << 20, 24 << 30].map(in_words);
        assert_eq!(said, ["0 bytes", "183 bytes", "3.9 kB", "64 MB", "24 GB"]);
    }
}
