//! Names and texts in fixed-size fields: UTF-8, padded with zero bytes.

use super::WireError;
use crate::mismatch::quoted;
use crate::pddl::Name;
use crate::transport::wire::{NAME_BYTES_MAX, NameText};

/// Writes a name.
pub(super) fn name_to_wire(name: &Name) -> Result<NameText, WireError> {
    let bytes = name.as_str().as_bytes();
    if bytes.len() > NAME_BYTES_MAX {
        let expected = format!("at most {NAME_BYTES_MAX} bytes");
        return Err(WireError::new("name", expected, name));
    }
    let mut text = NameText::default();
    for (to, from) in text.bytes.iter_mut().zip(bytes) {
        *to = *from;
    }
    Ok(text)
}

/// Reads a name: no white space, parentheses, or control characters; not empty.
pub(super) fn name_from_wire(field: &'static str, text: &NameText) -> Result<Name, WireError> {
    let name = text_from_wire(field, &text.bytes)?;
    if !is_pddl_name(name) {
        return Err(WireError::new(field, "a PDDL name", quoted(name)));
    }
    Ok(Name::new(name))
}

/// Whether a text can be a name in PDDL.
pub(super) fn is_pddl_name(name: &str) -> bool {
    let is_plain =
        |c: char| !c.is_whitespace() && !c.is_control() && !matches!(c, '(' | ')' | ';' | '?');
    !name.is_empty() && name.chars().all(is_plain)
}

/// Writes a text, cutting it at a character's border where it is too long.
pub(super) fn text_to_wire<const N: usize>(text: &str) -> [u8; N] {
    let mut end = text.len().min(N);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let mut bytes = [0; N];
    for (to, from) in bytes.iter_mut().zip(text.as_bytes().iter().take(end)) {
        *to = *from;
    }
    bytes
}

/// Reads a text up to its padding.
pub(super) fn text_from_wire<'a>(
    field: &'static str,
    bytes: &'a [u8],
) -> Result<&'a str, WireError> {
    let end = bytes.iter().position(|&b| b == 0).unwrap_or(bytes.len());
    let used = bytes.get(..end).unwrap_or_default();
    std::str::from_utf8(used).map_err(|e| WireError::new(field, "UTF-8", e))
}
