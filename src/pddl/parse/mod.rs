//! Forms to trees. Everything is checked where it is read, while the place in the text is known.

mod typed;
mod condition;
mod effect;
mod requirements;
mod domain;
mod problem;
mod plan;

use std::collections::BTreeSet;

pub use domain::{parse_domain, parse_rules};
pub use plan::parse_plan;
pub use problem::{parse_facts, parse_goal, parse_problem};

use super::check::{Scope, Vocabulary};
use super::error::{ErrorKind, PddlError, SourcePosition, SourceText, Span, Warning};
use super::sexpr::{Node, quote};
use super::{NUMBER_DIGITS_MAX, Name, Number, Typed};
use requirements::Feature;

/// Reads one source: knows where it is, collects warnings and the features that were used.
struct Reader<'s> {
    source: &'s SourceText,
    context: Vec<String>,
    /// Of each kind the first, with how many there were.
    warnings: Vec<(String, Warning, usize)>,
    /// Features used, each where it was used first.
    used: Vec<(Feature, Span)>,
}

/// Reads conditions and effects against a vocabulary.
struct Body<'r, 's, 'v> {
    reader: &'r mut Reader<'s>,
    vocabulary: &'v Vocabulary,
    scope: Scope,
    /// Predicates that rules define; effects must leave them alone.
    derived: &'v BTreeSet<Name>,
}

impl<'s> Reader<'s> {
    fn new(source: &'s SourceText) -> Self {
        Self { source, context: Vec::new(), warnings: Vec::new(), used: Vec::new() }
    }

    fn error(&self, kind: ErrorKind, span: Span, message: impl Into<String>) -> PddlError {
        let context = match self.context.as_slice() {
            [] => String::new(),
            parts => format!("in {}", parts.join(", ")),
        };
        PddlError {
            kind,
            place: Box::new(SourcePosition::new(self.source, span)),
            message: message.into(),
            context,
            help: None,
        }
    }

    fn syntax(&self, span: Span, message: impl Into<String>) -> PddlError {
        self.error(ErrorKind::Syntax, span, message)
    }

    fn semantics(&self, span: Span, message: impl Into<String>) -> PddlError {
        self.error(ErrorKind::Semantics, span, message)
    }

    fn unsupported(&self, span: Span, feature: &str) -> PddlError {
        let kind = ErrorKind::Unsupported { feature: feature.to_owned() };
        self.error(kind, span, format!("{feature} are not supported"))
    }

    /// Notes something odd. Of each kind the first is told, and how many more there are.
    fn warn(&mut self, kind: &str, span: Span, message: impl Into<String>) {
        if let Some((.., n)) = self.warnings.iter_mut().find(|(known, ..)| known == kind) {
            *n += 1;
        } else {
            self.warnings.push((kind.to_owned(), Warning { span, message: message.into() }, 1));
        }
    }

    /// What was odd, in the order of the text.
    fn into_warnings(self) -> Vec<Warning> {
        let told = |(_, mut warning, n): (String, Warning, usize)| {
            if n > 1 {
                warning.message = format!("{} ({} more like it)", warning.message, n - 1);
            }
            warning
        };
        let mut warnings: Vec<Warning> = self.warnings.into_iter().map(told).collect();
        warnings.sort_by_key(|w| w.span);
        warnings
    }

    fn uses(&mut self, feature: Feature, span: Span) {
        if self.used.iter().all(|(f, _)| *f != feature) {
            self.used.push((feature, span));
        }
    }

    /// Runs `read` with one more line of context; the context stays when it fails.
    fn within<T>(
        &mut self,
        context: impl Into<String>,
        read: impl FnOnce(&mut Self) -> Result<T, PddlError>,
    ) -> Result<T, PddlError> {
        self.context.push(context.into());
        let value = read(self)?;
        self.context.pop();
        Ok(value)
    }

    fn word(&self, node: &Node<'s>, expected: &str) -> Result<&'s str, PddlError> {
        node.word().ok_or_else(|| {
            self.syntax(node.span, format!("expected {expected}, got {}", node.describe()))
        })
    }

    fn list<'n>(&self, node: &'n Node<'s>, expected: &str) -> Result<&'n [Node<'s>], PddlError> {
        node.list().ok_or_else(|| {
            self.syntax(node.span, format!("expected {expected}, got {}", node.describe()))
        })
    }

    /// A decimal number, exactly as it is written.
    fn number(&self, node: &Node<'s>, word: &str) -> Result<Number, PddlError> {
        Number::parse(word).ok_or_else(|| {
            let message = format!("expected a number, got {}", node.describe());
            let mut error = self.semantics(node.span, message);
            let is_long = word.parse::<f64>().is_ok_and(f64::is_finite);
            error.help =
                is_long.then(|| format!("numbers have at most {NUMBER_DIGITS_MAX} digits"));
            error
        })
    }

    /// A name of a type, predicate, action or object: neither variable, keyword nor dash.
    fn name(&self, node: &Node<'s>, expected: &str) -> Result<Name, PddlError> {
        let word = self.word(node, expected)?;
        if word == "-" || word.starts_with(['?', ':']) {
            let message = format!("expected {expected}, got {}", quote(word));
            return Err(self.syntax(node.span, message));
        }
        Ok(Name::new(word))
    }

    /// The single form of a file.
    fn single<'n>(&self, forms: &'n [Node<'s>], expected: &str) -> Result<&'n Node<'s>, PddlError> {
        match forms {
            [form] => Ok(form),
            [] => {
                let end = self.source.text.len();
                let span = Span { start: end, end };
                Err(self.syntax(span, format!("expected {expected}, got an empty text")))
            }
            // A model's answer, a report, a mail.
            [first, ..] if first.word().is_some() => {
                let message = format!("expected {expected}, got {}", first.describe());
                let mut error = self.syntax(first.span, message);
                error.help = Some(
                    "leave out the text around the form, or begin its lines with `;`".to_owned(),
                );
                Err(error)
            }
            [_, next, ..] => {
                let message = format!("expected the end of the file, got {}", next.describe());
                let mut error = self.syntax(next.span, message);
                error.help = next.word().map(|_| {
                    "leave out the text after the form, or begin its lines with `;`".to_owned()
                });
                Err(error)
            }
        }
    }

    /// Refuses a second declaration of the same name.
    fn refuse_duplicates(
        &self,
        names: &[Typed],
        spans: &[Span],
        what: &str,
    ) -> Result<(), PddlError> {
        let mut seen = BTreeSet::new();
        for (typed, span) in names.iter().zip(spans) {
            if !seen.insert(&typed.name) {
                let message = format!("the {what} `{}` is declared twice", typed.name);
                return Err(self.semantics(*span, message));
            }
        }
        Ok(())
    }
}

/// The part of a list after its first member.
fn tail<T>(members: &[T]) -> &[T] {
    members.get(1..).unwrap_or(&[])
}

#[cfg(test)]
mod tests;
