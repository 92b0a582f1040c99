//! Errors and warnings that point at the text they are about.

use std::fmt;

/// The text of one file, with the name to show in messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceText {
    /// Path or other name, as shown in messages.
    pub name: String,
    /// The whole text.
    pub text: String,
}

impl SourceText {
    /// A named text.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into() }
    }
}

/// A range of bytes of a source text; the end is exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Span {
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

/// What kind of mistake a text has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ErrorKind {
    /// The text is not a well-formed PDDL form.
    Syntax,
    /// The text is well formed, but its names, types or values do not fit together.
    Semantics,
    /// The text is PDDL that is not understood here.
    Unsupported {
        /// The feature, for example "durative actions".
        feature: String,
    },
}

/// A position in a source text, with enough of the text to show it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourcePosition {
    /// Name of the source.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Bytes concerned.
    pub span: Span,
    /// The whole line, for the caret below it.
    line_text: String,
}

/// Why a PDDL text was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: error: {message}")]
pub struct PddlError {
    /// The class of mistake, for callers that tell them apart.
    pub kind: ErrorKind,
    /// Line, column and text, for the caret.
    pub place: Box<SourcePosition>,
    /// What was expected and what was found.
    pub message: String,
    /// The enclosing form, for example "in action stack, precondition"; empty at the top.
    pub context: String,
    /// How to put it right, when that is known.
    pub help: Option<String>,
}

/// Something odd that does not keep a text from being used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// Bytes concerned.
    pub span: Span,
    /// What is accepted though it is likely a mistake.
    pub message: String,
}

/// A tree read from text, with what was odd about the text.
#[derive(Debug, Clone, PartialEq)]
pub struct Parsed<T> {
    /// What was read.
    pub value: T,
    /// In the order of the text.
    pub warnings: Vec<Warning>,
}

/// Longest part of a source line shown in a message, in characters.
const SHOWN_LINE_CHARS_MAX: usize = 120;
/// What ends a line, alone or together.
const LINE_ENDS: [char; 2] = ['\n', '\r'];
/// How a tab is shown.
const TAB: &str = "    ";

impl SourcePosition {
    /// Finds the line and column of `span` in `source`; a span outside the text is clamped to it.
    pub fn new(source: &SourceText, span: Span) -> Self {
        let text = &source.text;
        let start = floor_char_boundary(text, span.start);
        let end = floor_char_boundary(text, span.end).max(start);
        let line_start = text[..start].rfind(LINE_ENDS).map_or(0, |i| i + 1);
        let line_end = text[start..].find(LINE_ENDS).map_or(text.len(), |i| start + i);
        // `\r\n` ends one line, not two.
        let before = &text[..line_start];
        let n_ends = before.matches(LINE_ENDS).count() - before.matches("\r\n").count();
        Self {
            file: source.name.clone(),
            line: n_ends + 1,
            column: text[line_start..start].chars().count() + 1,
            span: Span { start, end },
            line_text: text[line_start..line_end].to_owned(),
        }
    }

    /// The line with its number and, below it, carets under the span's part of it.
    pub(crate) fn shown(&self) -> String {
        let (line, carets) = self.excerpt();
        let number = self.line.to_string();
        let gutter = " ".repeat(number.len());
        format!("{gutter} |\n{number} | {line}\n{gutter} | {carets}\n")
    }

    /// The line and, below it, carets under the span's part of it.
    fn excerpt(&self) -> (String, String) {
        let before = self.column - 1;
        let marked_chars = self.marked_chars();
        // A window around the mark, so that a file without line breaks does not flood the screen.
        let first = (before + 1).saturating_sub(SHOWN_LINE_CHARS_MAX / 2);
        let (mut shown, mut carets) = (String::new(), String::new());
        if first > 0 {
            shown.push_str("... ");
            carets.push_str("    ");
        }
        let chars = self.line_text.chars().skip(first).take(SHOWN_LINE_CHARS_MAX);
        for (idx, c) in chars.enumerate().map(|(i, c)| (i + first, c)) {
            let as_shown = match c {
                '\t' => TAB.to_owned(),
                c if c.is_control() => "?".to_owned(),
                c => c.to_string(),
            };
            if idx < before + marked_chars {
                let mark = if idx < before { ' ' } else { '^' };
                carets.extend(as_shown.chars().map(|_| mark));
            }
            shown.push_str(&as_shown);
        }
        if !carets.contains('^') {
            carets.push('^');
        }
        (shown, carets)
    }

    /// How many characters of the line the span covers, at least one.
    fn marked_chars(&self) -> usize {
        let bytes = self.span.end - self.span.start;
        let tail_start = self
            .line_text
            .char_indices()
            .nth(self.column - 1)
            .map_or(self.line_text.len(), |c| c.0);
        let tail = &self.line_text[tail_start..];
        tail.char_indices().take_while(|(i, _)| *i < bytes).count().max(1)
    }
}

impl fmt::Display for SourcePosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

impl PddlError {
    /// The message with the source line, the text concerned underlined, and its context.
    pub fn render(&self) -> String {
        let gutter = " ".repeat(self.place.line.to_string().len());
        let context = match self.context.as_str() {
            "" => String::new(),
            context => format!("{gutter}--> {context}\n"),
        };
        let help = match &self.help {
            None => String::new(),
            Some(help) => format!("{gutter} = help: {help}\n"),
        };
        format!("{self}\n{context}{}{help}", self.place.shown())
    }
}

/// The largest character boundary of `text` that is not beyond `idx`.
fn floor_char_boundary(text: &str, idx: usize) -> usize {
    let mut idx = idx.min(text.len());
    while !text.is_char_boundary(idx) {
        idx -= 1;
    }
    idx
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rendered(text: &str, marked: &str) -> String {
        let start = text.find(marked).unwrap();
        let source = SourceText::new("a.pddl", text);
        PddlError {
            kind: ErrorKind::Syntax,
            place: Box::new(SourcePosition::new(
                &source,
                Span { start, end: start + marked.len() },
            )),
            message: "no".to_owned(),
            context: "in action a".to_owned(),
            help: Some("write b".to_owned()),
        }
        .render()
    }

    #[test]
    fn underlines_after_tabs_and_multibyte_characters() {
        assert_eq!(
            rendered("x\n\té (größe y)\n", "größe"),
            "a.pddl:2:5: error: no\n --> in action a\n  |\n2 |     é (größe y)\n  |        ^^^^^\n  = help: write b\n"
        );
    }

    #[test]
    fn every_line_ending_counts_once() {
        let line = |text: &str| {
            let start = text.find('x').unwrap();
            let place =
                SourcePosition::new(&SourceText::new("a", text), Span { start, end: start });
            (place.line, place.column, place.line_text)
        };
        for text in ["a\nb\n x", "a\r\nb\r\n x", "a\rb\r x", "a\r\rb x"] {
            let expected = if text.contains("b x") { (3, 3, "b x") } else { (3, 2, " x") };
            assert_eq!(line(text), (expected.0, expected.1, expected.2.to_owned()), "{text:?}");
        }
    }

    #[test]
    fn a_span_over_several_lines_is_marked_to_the_end_of_the_first() {
        assert!(rendered("ab (c\nd)", "(c\nd)").contains("1 | ab (c\n  |    ^^\n"));
    }

    #[test]
    fn a_long_line_is_cut_to_a_window() {
        let text = format!("{}wrong{}", "x ".repeat(5000), " y".repeat(5000));
        let shown = rendered(&text, "wrong");
        assert!(shown.lines().all(|l| l.len() < 200), "{shown}");
        assert!(shown.contains("^^^^^\n"));
    }

    #[test]
    fn a_span_outside_the_text_is_clamped() {
        let source = SourceText::new("a", "é");
        assert_eq!(SourcePosition::new(&source, Span { start: 1, end: 99 }).column, 1);
        assert_eq!(SourcePosition::new(&source, Span { start: 50, end: 99 }).column, 2);
    }
}
