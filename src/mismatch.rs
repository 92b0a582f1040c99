//! The one way to say that a value is not what may stand there.

use std::fmt::Display;

use thiserror::Error;

/// A value that is not what may stand there.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{at}: expected {expected}, got {got}")]
pub struct Mismatch {
    /// Where: a key, a field, or a file and what is in it.
    pub at: String,
    /// What may stand there.
    pub expected: String,
    /// What does.
    pub got: String,
}

/// A text from outside in quotes, with control characters escaped: it may go to a terminal.
pub fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        if c.is_control() {
            quoted.extend(c.escape_default());
        } else {
            quoted.push(c);
        }
    }
    quoted + "\""
}

/// Values in brackets: `[0, 0.5, NaN]`.
pub fn listed<T: Display>(values: impl IntoIterator<Item = T>) -> String {
    let texts: Vec<String> = values.into_iter().map(|value| value.to_string()).collect();
    format!("[{}]", texts.join(", "))
}

impl Mismatch {
    /// A mismatch from anything that can be written.
    pub fn new(at: impl Display, expected: impl Display, got: impl Display) -> Self {
        Self { at: at.to_string(), expected: expected.to_string(), got: got.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_texts_are_shown_and_cannot_steer_a_terminal() {
        assert_eq!(quoted("left tray"), "\"left tray\"");
        assert_eq!(quoted("größe\u{1b}[2J\n"), "\"größe\\u{1b}[2J\\n\"");
        assert_eq!(listed([0.5, f64::NAN]), "[0.5, NaN]");
        assert_eq!(listed([0_u8; 0]), "[]");
    }
}
