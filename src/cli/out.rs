//! The only place that prints.

use std::io::{self, Write as _};
use std::sync::OnceLock;

use comfy_table::Table;
use console::Term;
use serde::Serialize;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::Layer as _;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt as _;

use super::{Failure, table};

/// Why standard output does not take what is written, once it does not.
static LOST: OnceLock<String> = OnceLock::new();

/// Writes one line to standard output. A closed pipe ends the output, not the program; what is lost
/// otherwise, such as on a full disk, makes the program fail in the end.
pub(super) fn line(text: &str) {
    let mut out = io::stdout().lock();
    if let Err(error) = writeln!(out, "{text}").and_then(|()| out.flush())
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| error.to_string());
    }
}

/// Why something that was written to standard output is lost, if it is.
pub(super) fn lost() -> Option<Failure> {
    LOST.get().map(|reason| Failure::internal(format!("standard output: {reason}")))
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

/// Columns that text is laid out for where there is no terminal.
const COLUMNS_PIPED: usize = 100;

/// Where text for people goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stream {
    /// Standard output.
    Output,
    /// Standard error: standard output is for one JSON object.
    Error,
}

impl Stream {
    /// Where text goes beside a JSON object, or without one.
    pub(super) fn beside(json: bool) -> Self {
        if json { Self::Error } else { Self::Output }
    }

    /// Writes one line.
    pub(super) fn line(self, text: &str) {
        match self {
            Self::Output => line(text),
            Self::Error => note(text),
        }
    }

    /// Writes a table: as wide as the terminal, or as it is where there is no terminal.
    pub(super) fn table(self, table: Table) {
        self.line(&table::text(table, self.terminal_columns()));
    }

    /// The terminal's columns now; a fixed number where there is no terminal.
    pub(super) fn columns(self) -> usize {
        self.terminal_columns().unwrap_or(COLUMNS_PIPED)
    }

    fn terminal_columns(self) -> Option<usize> {
        let terminal = match self {
            Self::Output => Term::stdout(),
            Self::Error => Term::stderr(),
        };
        terminal.size_checked().map(|(_, columns)| columns.into())
    }

    /// Whether to use colours: on a terminal, unless `NO_COLOR` or `CLICOLOR=0` says otherwise.
    pub(super) fn has_colours(self) -> bool {
        match self {
            Self::Output => console::colors_enabled(),
            Self::Error => console::colors_enabled_stderr(),
        }
    }
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
        .with_ansi(Stream::Error.has_colours())
        .without_time();
    let subscriber = tracing_subscriber::registry().with(lines.with_filter(filter));
    if tracing::subscriber::set_global_default(subscriber).is_err() {
        tracing::debug!("a log was started before");
    }
}
