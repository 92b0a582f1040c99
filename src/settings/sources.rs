//! Where settings come from: texts laid end to end, so that one span tells text and place.

use std::fmt;
use std::ops::Range;

use crate::pddl::{SourcePosition, SourceText, Span};

/// What a setting was written in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LayerOrigin {
    /// `configs/defaults.toml`, as the binary carries it.
    Default,
    /// A file, as it is shown to people.
    File(String),
    /// One `--set`, as it was given.
    Set(String),
}

/// A setting's origin, with the line where it is a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The text.
    pub origin: LayerOrigin,
    /// Line, from 1.
    pub line: usize,
}

impl Written {
    /// One word for the origin.
    pub fn kind(&self) -> &'static str {
        match self.origin {
            LayerOrigin::Default => "default",
            LayerOrigin::File(_) => "file",
            LayerOrigin::Set(_) => "set",
        }
    }

    /// The file, and the line in it.
    pub fn in_file(&self) -> Option<(&str, usize)> {
        match &self.origin {
            LayerOrigin::File(name) => Some((name, self.line)),
            LayerOrigin::Default | LayerOrigin::Set(_) => None,
        }
    }
}

impl fmt::Display for Written {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.origin {
            LayerOrigin::Default => f.write_str("default"),
            LayerOrigin::File(name) => write!(f, "{name}:{}", self.line),
            LayerOrigin::Set(_) => f.write_str("--set"),
        }
    }
}

/// Every text that settings were read from, laid end to end: a byte range of the whole tells the text
/// and the place in it, as a compiler's source map does.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Sources(Vec<Source>);

#[derive(Debug, Clone, PartialEq, Eq)]
struct Source {
    start: usize,
    origin: LayerOrigin,
    text: SourceText,
}

impl Sources {
    /// Takes a text in and says where it starts.
    pub(super) fn add(&mut self, origin: LayerOrigin, text: &str) -> usize {
        // One byte lies between texts, so that the end of one is not the start of the next.
        let start = self.0.last().map_or(0, |last| last.start + last.text.text.len() + 1);
        let name = match &origin {
            LayerOrigin::Default => super::DEFAULTS_NAME.to_owned(),
            LayerOrigin::File(name) => name.clone(),
            LayerOrigin::Set(set) => format!("--set {set}"),
        };
        self.0.push(Source { start, origin, text: SourceText::new(name, text) });
        start
    }

    fn of(&self, span: &Range<usize>) -> Option<(&Source, Range<usize>)> {
        let source = self.0.iter().rev().find(|source| source.start <= span.start)?;
        let (start, end) = (span.start - source.start, span.end.saturating_sub(source.start));
        Some((source, start..end.max(start).min(source.text.text.len())))
    }

    /// The origin of a span.
    pub(crate) fn written(&self, span: &Range<usize>) -> Option<Written> {
        let (source, _) = self.of(span)?;
        let line = self.place(span).map_or(1, |place| place.line);
        Some(Written { origin: source.origin.clone(), line })
    }

    /// Whether a span lies in a `--set`.
    pub(super) fn is_set(&self, span: &Range<usize>) -> bool {
        self.of(span).is_some_and(|(source, _)| matches!(source.origin, LayerOrigin::Set(_)))
    }

    /// Whether a span lies in the defaults.
    pub(super) fn is_default(&self, span: &Range<usize>) -> bool {
        self.of(span).is_some_and(|(source, _)| source.origin == LayerOrigin::Default)
    }

    /// Line, column and text of a span.
    pub(super) fn place(&self, span: &Range<usize>) -> Option<SourcePosition> {
        let (source, local) = self.of(span)?;
        Some(SourcePosition::new(&source.text, Span { start: local.start, end: local.end }))
    }

    /// The text of a span.
    pub(super) fn text(&self, span: &Range<usize>) -> &str {
        self.of(span).and_then(|(source, local)| source.text.text.get(local)).unwrap_or_default()
    }
}
