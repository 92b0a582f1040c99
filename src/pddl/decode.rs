//! Bytes of a PDDL file to text.

use super::error::{ErrorKind, PddlError, SourcePosition, SourceText, Span};

/// A byte order mark of UTF-16, and how two bytes make a unit after it.
type ByteOrder = ([u8; 2], fn([u8; 2]) -> u16);

const UTF_16: [ByteOrder; 2] =
    [([0xff, 0xfe], u16::from_le_bytes), ([0xfe, 0xff], u16::from_be_bytes)];
/// How many bytes that are no UTF-8 are shown in a message.
const SHOWN_BYTES_MAX: usize = 4;

impl SourceText {
    /// Reads the bytes of a PDDL file: UTF-8, or UTF-16 with a byte order mark.
    ///
    /// Comments may be in any encoding; what is no UTF-8 in them is replaced.
    ///
    /// # Errors
    /// Bytes outside comments that are no UTF-8, with line and column.
    pub fn decode(name: impl Into<String>, bytes: Vec<u8>) -> Result<Self, PddlError> {
        let name = name.into();
        if let Some((_, unit)) = UTF_16.iter().find(|(mark, _)| bytes.starts_with(mark)) {
            let pairs =
                bytes[2..].chunks(2).map(|pair| unit([pair[0], *pair.get(1).unwrap_or(&0)]));
            let text = String::from_utf16_lossy(&pairs.collect::<Vec<_>>());
            return Ok(Self { name, text });
        }
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Self { name, text }),
            Err(error) => lossy_comments(name, &error.into_bytes()),
        }
    }
}

/// Replaces what is no UTF-8, which may stand in comments only.
fn lossy_comments(name: String, bytes: &[u8]) -> Result<SourceText, PddlError> {
    let (mut text, mut is_comment, mut wrong) = (String::new(), false, None);
    for chunk in bytes.utf8_chunks() {
        for c in chunk.valid().chars() {
            is_comment = c == ';' || is_comment && !matches!(c, '\n' | '\r');
        }
        text.push_str(chunk.valid());
        if chunk.invalid().is_empty() {
            continue;
        }
        if !is_comment && wrong.is_none() {
            wrong = Some((text.len(), chunk.invalid()));
        }
        text.push(char::REPLACEMENT_CHARACTER);
    }
    let source = SourceText { name, text };
    let Some((start, bytes)) = wrong else { return Ok(source) };
    let shown: Vec<String> =
        bytes.iter().take(SHOWN_BYTES_MAX).map(|byte| format!("0x{byte:02x}")).collect();
    let span = Span { start, end: start + char::REPLACEMENT_CHARACTER.len_utf8() };
    Err(PddlError {
        kind: ErrorKind::Syntax,
        place: Box::new(SourcePosition::new(&source, span)),
        message: format!("expected UTF-8, got {}", shown.join(" ")),
        context: String::new(),
        help: Some("save the file as UTF-8; only comments may hold other bytes".to_owned()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bytes: &[u8]) -> Result<String, String> {
        match SourceText::decode("t", bytes.to_vec()) {
            Ok(source) => Ok(source.text),
            Err(error) => Err(error.to_string()),
        }
    }

    #[test]
    fn foreign_bytes_are_fine_in_comments_and_located_elsewhere() {
        assert_eq!(decoded(b"; M\xfcller\n(a)").unwrap(), "; M\u{fffd}ller\n(a)");
        assert_eq!(
            decoded(b"; M\xfcller\r(a\r\n \xfcb)").unwrap_err(),
            "t:3:2: error: expected UTF-8, got 0xfc"
        );
        assert_eq!(decoded("(größe)".as_bytes()).unwrap(), "(größe)");
    }

    #[test]
    fn a_byte_order_mark_tells_utf_16() {
        assert_eq!(decoded(b"\xff\xfe(\0a\0)\0").unwrap(), "(a)");
        assert_eq!(decoded(b"\xfe\xff\0(\0a\0)").unwrap(), "(a)");
        assert_eq!(decoded(b"\xff\xfe(").unwrap(), "(");
    }
}
