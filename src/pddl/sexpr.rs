//! Spanned s-expressions: the only layer that looks at characters.

use super::error::{ErrorKind, PddlError, SourcePosition, SourceText, Span};

/// Deepest nesting of parentheses; it bounds every recursion over a tree made from text.
pub const NESTING_MAX: usize = 200;
/// Largest text that is read, in bytes.
pub const SOURCE_BYTES_MAX: usize = 16 * 1024 * 1024;

/// A word or a parenthesised list, with its place in the text.
#[derive(Debug, Clone)]
pub(super) struct Node<'s> {
    /// Where it stands; for a list including its parentheses.
    pub(super) span: Span,
    /// What it is.
    pub(super) kind: NodeKind<'s>,
}

/// What a [`Node`] is.
#[derive(Debug, Clone)]
pub(super) enum NodeKind<'s> {
    /// A run of characters without space and parenthesis, as written.
    Word(&'s str),
    /// What stands between two parentheses.
    List(Vec<Node<'s>>),
}

impl<'s> Node<'s> {
    /// The word, unless this is a list.
    pub(super) fn word(&self) -> Option<&'s str> {
        match self.kind {
            NodeKind::Word(word) => Some(word),
            NodeKind::List(_) => None,
        }
    }

    /// The members of the list, unless this is a word.
    pub(super) fn list(&self) -> Option<&[Self]> {
        match &self.kind {
            NodeKind::Word(_) => None,
            NodeKind::List(members) => Some(members),
        }
    }

    /// Whether this is the given word, ignoring case.
    pub(super) fn is(&self, word: &str) -> bool {
        self.word().is_some_and(|w| w.eq_ignore_ascii_case(word))
    }

    /// The first word of a list, lower-cased.
    pub(super) fn head(&self) -> Option<String> {
        self.list()?.first()?.word().map(str::to_lowercase)
    }

    /// How the node is named in a message.
    pub(super) fn describe(&self) -> String {
        match &self.kind {
            NodeKind::Word(word) => quote(word),
            NodeKind::List(members) => match members.first().map(|m| &m.kind) {
                None => "`()`".to_owned(),
                Some(NodeKind::Word(word)) => format!("a list that begins with {}", quote(word)),
                Some(NodeKind::List(_)) => "a list that begins with a list".to_owned(),
            },
        }
    }
}

/// A word between back quotes, short and without control characters.
pub(super) fn quote(word: &str) -> String {
    const SHOWN_CHARS_MAX: usize = 40;
    let mut shown: String =
        word.chars().take(SHOWN_CHARS_MAX).flat_map(char::escape_debug).collect();
    if word.chars().nth(SHOWN_CHARS_MAX).is_some() {
        shown.push_str("...");
    }
    format!("`{shown}`")
}

/// Reads the top-level forms of a text.
///
/// # Errors
/// [`ErrorKind::Syntax`] for parentheses that do not match, nesting deeper than [`NESTING_MAX`]
/// or a text longer than [`SOURCE_BYTES_MAX`].
pub(super) fn read(source: &SourceText) -> Result<Vec<Node<'_>>, PddlError> {
    let error = |span: Span, message: String| PddlError {
        kind: ErrorKind::Syntax,
        place: Box::new(SourcePosition::new(source, span)),
        message,
        context: String::new(),
        help: None,
    };
    if source.text.len() > SOURCE_BYTES_MAX {
        let (expected, got) = (SOURCE_BYTES_MAX, source.text.len());
        let message = format!("expected a text of at most {expected} bytes, got {got}");
        return Err(error(Span { start: 0, end: 0 }, message));
    }
    // Each open list with the place of its parenthesis; the bottom entry is the file itself.
    let mut open: Vec<(usize, Vec<Node<'_>>)> = Vec::new();
    let mut top = Vec::new();
    let tokens = Tokens { text: &source.text, at: 0 };
    for (span, text) in tokens {
        let node = match text {
            "(" if open.len() == NESTING_MAX => {
                let message = format!("expected at most {NESTING_MAX} nested parentheses");
                return Err(error(span, message));
            }
            "(" => {
                open.push((span.start, Vec::new()));
                continue;
            }
            ")" => {
                let Some((start, members)) = open.pop() else {
                    let message = "expected the end of the file, got `)` without its `(`";
                    return Err(error(span, message.to_owned()));
                };
                Node { span: Span { start, end: span.end }, kind: NodeKind::List(members) }
            }
            word => {
                if let Some((at, got, help)) = no_pddl(word) {
                    let start = span.start + at;
                    let span = Span { start, end: start + 1 };
                    let message = format!("expected PDDL, got {got}");
                    return Err(PddlError { help: Some(help.to_owned()), ..error(span, message) });
                }
                Node { span, kind: NodeKind::Word(word) }
            }
        };
        open.last_mut().map_or(&mut top, |(_, members)| members).push(node);
    }
    match open.last() {
        None => Ok(top),
        Some((start, _)) => {
            let span = Span { start: *start, end: start + 1 };
            let message = "expected `)` before the end of the file: this `(` is never closed";
            Err(error(span, message.to_owned()))
        }
    }
}

/// What no word of PDDL holds: where it begins, how it is called, and what to do about it.
fn no_pddl(word: &str) -> Option<(usize, &'static str, &'static str)> {
    const NONE: [(&str, &str, &str); 2] = [
        (
            "```",
            "a Markdown fence",
            "give the PDDL alone, without the fences and the text around it",
        ),
        (",", "a comma", "names are separated by spaces: leave out the comma"),
    ];
    NONE.iter().find_map(|&(what, got, help)| Some((word.find(what)?, got, help)))
}

/// Splits a text into parentheses and words; `;` starts a comment that ends with the line.
struct Tokens<'s> {
    text: &'s str,
    at: usize,
}

impl<'s> Iterator for Tokens<'s> {
    type Item = (Span, &'s str);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let rest = &self.text[self.at..];
            let first = rest.chars().next()?;
            let len = match first {
                // A byte order mark is no part of a name.
                c if c.is_whitespace() || c == '\u{feff}' => {
                    self.at += c.len_utf8();
                    continue;
                }
                ';' => {
                    self.at += rest.find(['\n', '\r']).unwrap_or(rest.len());
                    continue;
                }
                '(' | ')' => 1,
                // A question mark begins a word, as in `(p?x)`.
                first => {
                    let ends = |c: char| {
                        c.is_whitespace() || matches!(c, '(' | ')' | ';' | '?' | '\u{feff}')
                    };
                    let after = first.len_utf8();
                    rest[after..].find(ends).map_or(rest.len(), |at| after + at)
                }
            };
            let span = Span { start: self.at, end: self.at + len };
            self.at += len;
            return Some((span, &rest[..len]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(text: &str) -> Result<String, String> {
        fn show(node: &Node<'_>) -> String {
            match &node.kind {
                NodeKind::Word(word) => (*word).to_owned(),
                NodeKind::List(l) => {
                    format!("[{}]", l.iter().map(show).collect::<Vec<_>>().join(" "))
                }
            }
        }
        let source = SourceText::new("t", text);
        let nodes = read(&source).map_err(|e| e.to_string())?;
        Ok(nodes.iter().map(show).collect::<Vec<_>>().join(" "))
    }

    #[test]
    fn words_lists_and_comments() {
        assert_eq!(shape("\u{feff}(a(b)c;x)(\n d) e").unwrap(), "[a [b] c d] e");
        assert_eq!(shape(":precondition(and\t(p))").unwrap(), ":precondition [and [p]]");
        assert_eq!(shape("; only a comment").unwrap(), "");
        assert_eq!(shape("(p?x?y - t)").unwrap(), "[p ?x ?y - t]");
        assert_eq!(shape("a ; one\rb ; two\r\nc ; three\nd").unwrap(), "a b c d");
    }

    #[test]
    fn parentheses_that_do_not_match_are_located() {
        assert!(shape("(a\n (b)").unwrap_err().starts_with("t:1:1: error: expected `)`"));
        assert!(shape("(a)\n )").unwrap_err().starts_with("t:2:2: error: expected the end"));
    }

    #[test]
    fn nesting_is_bounded() {
        assert!(shape(&"(".repeat(1_000_000)).unwrap_err().contains("nested parentheses"));
        let deepest = format!("{}{}", "(".repeat(NESTING_MAX), ")".repeat(NESTING_MAX));
        assert!(shape(&deepest).is_ok());
    }
}
