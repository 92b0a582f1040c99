//! The only place that prints.

use std::io::{self, IsTerminal as _, Write as _};

use serde::Serialize;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::Layer as _;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt as _;

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
    let says_so = message.contains(": error:") || message.starts_with("error: ");
    let prefix = if says_so { "" } else { "error: " };
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
    // The bus tells at length of messages that were on their way when a process ended. Lost messages
    // that matter are noticed and told by their readers.
    let of_bus = if level >= LevelFilter::DEBUG { level } else { level.min(LevelFilter::ERROR) };
    let filter = Targets::new().with_default(level).with_target("iceoryx2_bb_loggers", of_bus);
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal())
        .without_time();
    let subscriber = tracing_subscriber::registry().with(lines.with_filter(filter));
    if tracing::subscriber::set_global_default(subscriber).is_err() {
        tracing::debug!("a log was started before");
    }
}
