//! Typed lists: `a b - block c - (either disk peg)`.

use super::super::check::{Vocabulary, did_you_mean};
use super::super::error::{PddlError, Span};
use super::super::sexpr::{Node, NodeKind, quote};
use super::super::{Name, Typed};
use super::Reader;
use super::requirements::Feature;

/// What the names of a typed list stand for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Variables, which begin with a question mark.
    Variable,
    /// Objects, constants or types.
    Name,
}

/// A typed list with the place of each name and the place of each type that was written.
pub(super) struct TypedList {
    pub(super) items: Vec<Typed>,
    pub(super) spans: Vec<Span>,
    pub(super) types: Vec<(Name, Span)>,
}

/// A part of a typed list, after a dash that was written without a space has been split off.
enum Token<'n, 's> {
    Item(Name, Span),
    Dash(Span),
    Type(&'n Node<'s>),
    GluedType(Name, Span),
}

impl<'s> Reader<'s> {
    /// Reads a typed list without checking that its types exist.
    pub(super) fn typed_list(
        &mut self,
        nodes: &[Node<'s>],
        kind: Kind,
        what: &str,
    ) -> Result<TypedList, PddlError> {
        let mut list = TypedList { items: Vec::new(), spans: Vec::new(), types: Vec::new() };
        let mut untyped_from = 0;
        let mut dash: Option<Span> = None;
        for token in self.tokens(nodes, kind, what)? {
            let types = match token {
                Token::Item(name, span) => {
                    list.items.push(Typed { name, types: Vec::new() });
                    list.spans.push(span);
                    continue;
                }
                Token::Dash(span) => {
                    if untyped_from == list.items.len() {
                        let message = format!("expected a {what} before `-`");
                        return Err(self.syntax(span, message));
                    }
                    self.uses(Feature::Typing, span);
                    dash = Some(span);
                    continue;
                }
                Token::Type(node) => self.type_names(node)?,
                Token::GluedType(name, span) => vec![(name, span)],
            };
            dash = None;
            // Whatever is an `object` needs no type.
            let any = types.iter().any(|(name, _)| *name == "object");
            let names: Vec<Name> =
                if any { Vec::new() } else { types.iter().map(|t| t.0.clone()).collect() };
            for item in &mut list.items[untyped_from..] {
                item.types.clone_from(&names);
            }
            untyped_from = list.items.len();
            list.types.extend(types);
        }
        match dash {
            None => Ok(list),
            Some(span) => Err(self.syntax(span, "expected a type after `-`")),
        }
    }

    /// Reads a typed list whose types must exist.
    pub(super) fn checked_typed_list(
        &mut self,
        nodes: &[Node<'s>],
        kind: Kind,
        what: &str,
        vocabulary: &Vocabulary,
    ) -> Result<TypedList, PddlError> {
        let list = self.typed_list(nodes, kind, what)?;
        for (name, span) in &list.types {
            if !vocabulary.has_type(name) {
                let mut error = self.semantics(*span, format!("unknown type `{name}`"));
                error.help = did_you_mean(name, vocabulary.types.parents.keys());
                return Err(error);
            }
        }
        Ok(list)
    }

    /// Reads the parameters of an action or rule or the variables of a quantifier.
    pub(super) fn variables(
        &mut self,
        nodes: &[Node<'s>],
        what: &str,
        vocabulary: &Vocabulary,
    ) -> Result<TypedList, PddlError> {
        let list = self.checked_typed_list(nodes, Kind::Variable, what, vocabulary)?;
        self.refuse_duplicates(&list.items, &list.spans, what)?;
        Ok(list)
    }

    fn tokens<'n>(
        &self,
        nodes: &'n [Node<'s>],
        kind: Kind,
        what: &str,
    ) -> Result<Vec<Token<'n, 's>>, PddlError> {
        let mut tokens = Vec::with_capacity(nodes.len());
        let mut after_dash = false;
        for (idx, node) in nodes.iter().enumerate() {
            if after_dash {
                tokens.push(Token::Type(node));
                after_dash = false;
                continue;
            }
            let word = self.word(node, &format!("a {what}"))?;
            let next_is_dash = nodes.get(idx + 1).is_some_and(|n| n.is("-"));
            if word == "-" {
                tokens.push(Token::Dash(node.span));
                after_dash = true;
            } else if let Some(type_name) = word.strip_prefix('-') {
                tokens.push(Token::Dash(node.span));
                tokens.push(Token::GluedType(Name::new(type_name), node.span));
            } else if kind == Kind::Name {
                tokens.push(Token::Item(self.name(node, &format!("a {what}"))?, node.span));
            } else {
                let glued = word.strip_suffix('-').filter(|_| !next_is_dash);
                let variable = glued.unwrap_or(word);
                tokens.push(Token::Item(self.variable(variable, node.span, what)?, node.span));
                if glued.is_some() {
                    tokens.push(Token::Dash(node.span));
                    after_dash = true;
                }
            }
        }
        Ok(tokens)
    }

    /// The name of a variable, which is written with a question mark.
    fn variable(&self, word: &str, span: Span, what: &str) -> Result<Name, PddlError> {
        match word.strip_prefix('?') {
            Some(name) if !name.is_empty() => Ok(Name::new(name)),
            _ => {
                let got = quote(word);
                let mut error = self.syntax(span, format!("expected a {what}, got {got}"));
                error.help = Some("variables begin with `?`".to_owned());
                Err(error)
            }
        }
    }

    /// A type, or the alternatives of `(either …)`.
    fn type_names(&self, node: &Node<'s>) -> Result<Vec<(Name, Span)>, PddlError> {
        match &node.kind {
            NodeKind::Word(_) => Ok(vec![(self.name(node, "a type")?, node.span)]),
            NodeKind::List(members) if members.len() > 1 && members[0].is("either") => {
                let names = super::tail(members).iter();
                names.map(|n| Ok((self.name(n, "a type")?, n.span))).collect()
            }
            NodeKind::List(_) => {
                let got = node.describe();
                let message = format!("expected a type or `(either …)`, got {got}");
                Err(self.syntax(node.span, message))
            }
        }
    }
}
