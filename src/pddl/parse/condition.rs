//! Conditions: preconditions, goals, bodies of rules.

use super::super::check::{Fit, did_you_mean, term_text, type_text};
use super::super::error::{PddlError, Span};
use super::super::sexpr::Node;
use super::super::{Condition, Literal, Name, Signature, Term, Typed};
use super::requirements::Feature;
use super::{Body, tail};

/// Heads of lists that are read as something else than an atom.
pub(super) const KEYWORDS: &[&str] =
    &["and", "or", "not", "imply", "exists", "forall", "when", "=", "either", "increase"];

impl<'s> Body<'_, 's, '_> {
    /// Reads a condition.
    pub(super) fn condition(&mut self, node: &Node<'s>) -> Result<Condition, PddlError> {
        let members = self.reader.list(node, "a condition in parentheses")?;
        let args = tail(members);
        let Some(head) = node.head() else {
            // `()` is widely written for the empty conjunction.
            return if members.is_empty() { Ok(Condition::True) } else { Err(self.no_head(node)) };
        };
        match head.as_str() {
            "and" if args.is_empty() => Ok(Condition::True),
            "or" if args.is_empty() => Ok(Condition::False),
            "and" => Ok(Condition::And(self.conditions(args)?)),
            "or" => {
                self.reader.uses(Feature::DisjunctivePreconditions, node.span);
                Ok(Condition::Or(self.conditions(args)?))
            }
            "not" => {
                let [inner] = self.operands(node, args)?;
                if inner.head().as_deref() != Some("=") {
                    self.reader.uses(Feature::NegativePreconditions, node.span);
                }
                Ok(Condition::Not(Box::new(self.condition(inner)?)))
            }
            "imply" => {
                self.reader.uses(Feature::DisjunctivePreconditions, node.span);
                let [premise, conclusion] = self.operands(node, args)?;
                let refuted = Condition::Not(Box::new(self.condition(premise)?));
                Ok(Condition::Or(vec![refuted, self.condition(conclusion)?]))
            }
            "=" => self.equality(node, args),
            "exists" | "forall" => self.quantified(node, &head, args),
            _ => match unsupported_condition(&head) {
                Some(feature) if !self.vocabulary.predicates.contains_key(head.as_str()) => {
                    Err(self.reader.unsupported(node.span, feature))
                }
                _ => Ok(Condition::Atom(self.literal(node)?)),
            },
        }
    }

    fn conditions(&mut self, nodes: &[Node<'s>]) -> Result<Vec<Condition>, PddlError> {
        nodes.iter().map(|n| self.condition(n)).collect()
    }

    fn equality(&mut self, node: &Node<'s>, args: &[Node<'s>]) -> Result<Condition, PddlError> {
        self.reader.uses(Feature::Equality, node.span);
        let [left, right] = self.operands(node, args)?;
        if let Some(list) = [left, right].into_iter().find(|n| n.list().is_some()) {
            return Err(self.reader.unsupported(list.span, "numeric conditions"));
        }
        Ok(Condition::Equal(self.term(left)?.0, self.term(right)?.0))
    }

    fn quantified(
        &mut self,
        node: &Node<'s>,
        head: &str,
        args: &[Node<'s>],
    ) -> Result<Condition, PddlError> {
        let exists = head == "exists";
        let feature = if exists {
            Feature::ExistentialPreconditions
        } else {
            Feature::UniversalPreconditions
        };
        self.reader.uses(feature, node.span);
        let [variables, inner] = self.operands(node, args)?;
        let variables = self.bound_variables(variables)?;
        let before = self.scope.enter(&variables);
        let inner = Box::new(self.condition(inner)?);
        self.scope.leave(before);
        Ok(if exists {
            Condition::Exists(variables, inner)
        } else {
            Condition::Forall(variables, inner)
        })
    }

    /// The variables of a quantifier. They may hide outer ones, which is worth a warning.
    pub(super) fn bound_variables(&mut self, node: &Node<'s>) -> Result<Vec<Typed>, PddlError> {
        let nodes = self.reader.list(node, "the quantified variables in parentheses")?;
        let list = self.reader.variables(nodes, "variable", self.vocabulary)?;
        for (variable, span) in list.items.iter().zip(&list.spans) {
            if self.scope.types_of(&variable.name).is_some() {
                let message = format!("`?{}` hides an outer variable", variable.name);
                self.reader.warn("hidden variable", *span, message);
            }
        }
        Ok(list.items)
    }

    /// Reads an atom of a declared predicate.
    pub(super) fn literal(&mut self, node: &Node<'s>) -> Result<Literal, PddlError> {
        let members = self.reader.list(node, "an atom in parentheses")?;
        let Some(first) = members.first() else {
            return Err(self.no_head(node));
        };
        let predicate = self.reader.name(first, "a predicate")?;
        let Some(signature) = self.vocabulary.predicates.get(&predicate) else {
            let mut error =
                self.reader.semantics(first.span, format!("unknown predicate `{predicate}`"));
            error.help = did_you_mean(&predicate, self.vocabulary.predicates.keys());
            return Err(error);
        };
        let args = self.arguments(node, tail(members), signature)?;
        Ok(Literal { predicate, args })
    }

    /// Reads the arguments of a predicate or function and compares them with its parameters.
    pub(super) fn arguments(
        &mut self,
        node: &Node<'s>,
        args: &[Node<'s>],
        signature: &Signature,
    ) -> Result<Vec<Term>, PddlError> {
        if args.len() != signature.params.len() {
            let (expected, got) = (signature.params.len(), args.len());
            let plural = if expected == 1 { "" } else { "s" };
            let message =
                format!("expected {expected} argument{plural} of `{}`, got {got}", signature.name);
            return Err(self.reader.semantics(node.span, message));
        }
        let mut terms = Vec::with_capacity(args.len());
        for (arg, param) in args.iter().zip(&signature.params) {
            let (term, types) = self.term(arg)?;
            self.check_type(arg.span, &term, &types, param, &signature.name)?;
            terms.push(term);
        }
        Ok(terms)
    }

    fn check_type(
        &mut self,
        span: Span,
        term: &Term,
        types: &[Name],
        param: &Typed,
        of: &Name,
    ) -> Result<(), PddlError> {
        let fit = match term {
            Term::Var(_) => self.vocabulary.fit(types, &param.types),
            Term::Object(_) if self.vocabulary.object_fits(types, &param.types) => Fit::Always,
            Term::Object(_) => Fit::Never,
        };
        if fit == Fit::Always {
            return Ok(());
        }
        let (shown, got) = (term_text(term), type_text(types));
        let expected = type_text(&param.types);
        let message = format!("expected a `{expected}` as `?{}` of `{of}`", param.name);
        let message = format!("{message}, got `{shown}` of type `{got}`");
        if fit == Fit::Never {
            return Err(self.reader.semantics(span, message));
        }
        self.reader.warn("wider variable", span, message);
        Ok(())
    }

    /// Reads a variable or an object, with its type.
    pub(super) fn term(&mut self, node: &Node<'s>) -> Result<(Term, Vec<Name>), PddlError> {
        let word = self.reader.word(node, "a variable or an object")?;
        if let Some(variable) = word.strip_prefix('?') {
            let name = Name::new(variable);
            if let Some(types) = self.scope.types_of(&name).map(<[Name]>::to_vec) {
                return Ok((Term::Var(name), types));
            }
            let message = format!("the variable `?{name}` is not bound here");
            let mut error = self.reader.semantics(node.span, message);
            let help = did_you_mean(&name, self.scope.names());
            error.help = help.map(|help| help.replacen('`', "`?", 1));
            return Err(error);
        }
        let name = self.reader.name(node, "a variable or an object")?;
        if let Some(types) = self.vocabulary.objects.get(&name) {
            return Ok((Term::Object(name), types.clone()));
        }
        let mut error = self.reader.semantics(node.span, format!("unknown object `{name}`"));
        let is_variable = self.scope.names().any(|v| *v == name);
        error.help = if is_variable {
            Some(format!("did you mean `?{name}`?"))
        } else {
            did_you_mean(&name, self.vocabulary.objects.keys())
        };
        Err(error)
    }

    /// Exactly `N` operands of a keyword.
    pub(super) fn operands<'n, const N: usize>(
        &self,
        node: &Node<'s>,
        args: &'n [Node<'s>],
    ) -> Result<&'n [Node<'s>; N], PddlError> {
        if let Ok(operands) = args.try_into() {
            return Ok(operands);
        }
        let head = node.head().unwrap_or_default();
        let message = format!("expected {N} operand(s) of `{head}`, got {}", args.len());
        Err(self.reader.syntax(node.span, message))
    }

    fn no_head(&self, node: &Node<'s>) -> PddlError {
        let message = format!("expected a predicate or a keyword, got {}", node.describe());
        self.reader.syntax(node.span, message)
    }
}

/// The feature behind a condition that is PDDL but not understood here.
fn unsupported_condition(head: &str) -> Option<&'static str> {
    match head {
        "<" | ">" | "<=" | ">=" => Some("numeric conditions"),
        "preference" => Some("preferences"),
        "always" | "sometime" | "within" | "at-most-once" | "sometime-after"
        | "sometime-before" | "always-within" | "hold-during" | "hold-after" => {
            Some("trajectory constraints")
        }
        _ => None,
    }
}
