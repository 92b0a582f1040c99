//! The only place that prints.

use std::io::{self, IsTerminal as _, Write as _};

use serde::Serialize;
use tracing::level_filters::LevelFilter;

use super::Failure;

/// Writes one line to standard output. A closed pipe ends the output, not the program.
pub(super) fn line(text: &str) {
    let mut out = io::stdout().lock();
    drop(writeln!(out, "{text}").and_then(|()| out.flush()));
}

/// Writes one line to standard error.
pub(super) fn note(text: &str) {
    let mut err = io::stderr().lock();
    drop(writeln!(err, "{text}"));
}

/// Writes an error to standard error.
pub(super) fn error(message: &str) {
    let prefix = if message.contains(": error:") { "" } else { "error: " };
    note(&format!("{prefix}{}", message.trim_end()));
}

/// Writes one JSON object to standard output.
pub(super) fn json(value: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string(value).map_err(Failure::internal)?;
    line(&text);
    Ok(())
}

/// Whether standard output is a terminal.
pub(super) fn is_terminal() -> bool {
    io::stdout().is_terminal()
}

/// Starts the log on standard error.
pub(super) fn start_log(level: &str) {
    let level: LevelFilter = level.parse().unwrap_or(LevelFilter::WARN);
    let subscriber = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal())
        .without_time()
        .finish();
    if tracing::subscriber::set_global_default(subscriber).is_err() {
        tracing::debug!("a log was started before");
    }
}
