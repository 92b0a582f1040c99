//! Effects of actions.

use super::super::check::did_you_mean;
use super::super::error::PddlError;
use super::super::sexpr::Node;
use super::super::{CostTerm, Effect, Literal, Name, Signature};
use super::condition::KEYWORDS;
use super::requirements::Feature;
use super::{Body, tail};

impl<'s> Body<'_, 's, '_> {
    /// Reads an effect; `conditional` says whether it stands inside a `when`.
    pub(super) fn effect(
        &mut self,
        node: &Node<'s>,
        conditional: Conditional,
    ) -> Result<Effect, PddlError> {
        let members = self.reader.list(node, "an effect in parentheses")?;
        let args = tail(members);
        let head = node.head().unwrap_or_default();
        match head.as_str() {
            "" if members.is_empty() => Ok(Effect::And(Vec::new())),
            "and" => {
                let parts = args.iter().map(|n| self.effect(n, conditional));
                Ok(Effect::And(parts.collect::<Result<_, _>>()?))
            }
            "not" => {
                let [inner] = self.operands(node, args)?;
                Ok(Effect::Delete(self.changed(inner)?))
            }
            "when" => {
                self.reader.uses(Feature::ConditionalEffects, node.span);
                let [condition, effect] = self.operands(node, args)?;
                let condition = self.condition(condition)?;
                let effect = self.effect(effect, Conditional::Yes)?;
                Ok(Effect::When(condition, Box::new(effect)))
            }
            "forall" => {
                self.reader.uses(Feature::ConditionalEffects, node.span);
                let [variables, effect] = self.operands(node, args)?;
                let variables = self.bound_variables(variables)?;
                let before = self.scope.enter(&variables);
                let effect = Box::new(self.effect(effect, conditional)?);
                self.scope.leave(before);
                Ok(Effect::Forall(variables, effect))
            }
            "increase" => self.cost(node, args, conditional),
            _ => match unsupported_effect(&head) {
                Some(feature) if !self.vocabulary.predicates.contains_key(head.as_str()) => {
                    Err(self.reader.unsupported(node.span, feature))
                }
                _ => Ok(Effect::Add(self.changed(node)?)),
            },
        }
    }

    /// An atom that an action may change.
    fn changed(&mut self, node: &Node<'s>) -> Result<Literal, PddlError> {
        if node.head().as_deref().is_some_and(|h| KEYWORDS.contains(&h)) {
            let message = format!("expected an atom, got {}", node.describe());
            return Err(self.reader.syntax(node.span, message));
        }
        let literal = self.literal(node)?;
        if self.derived.contains(&literal.predicate) {
            let message = format!("`{}` is derived, so no action can change it", literal.predicate);
            let mut error = self.reader.semantics(node.span, message);
            error.help =
                Some("a rule that completes an observed state goes into its own file".into());
            return Err(error);
        }
        Ok(literal)
    }

    /// `(increase (total-cost) …)`.
    fn cost(
        &mut self,
        node: &Node<'s>,
        args: &[Node<'s>],
        conditional: Conditional,
    ) -> Result<Effect, PddlError> {
        let [target, amount] = self.operands(node, args)?;
        if target.head().as_deref() != Some("total-cost") {
            return Err(self.reader.unsupported(node.span, "numeric fluents"));
        }
        if conditional == Conditional::Yes {
            return Err(self.reader.unsupported(node.span, "costs that depend on the state"));
        }
        self.reader.uses(Feature::ActionCosts, node.span);
        if let Some(word) = amount.word() {
            let value = self.reader.number(amount, word)?;
            if value.is_negative() {
                let message = format!("expected a cost of 0 or more, got {}", amount.describe());
                return Err(self.reader.semantics(amount.span, message));
            }
            return Ok(Effect::Cost(CostTerm::Number(value)));
        }
        let members = amount.list().unwrap_or_default();
        let Some(first) = members.first() else {
            return Err(self
                .reader
                .syntax(amount.span, "expected a number or a function, got `()`"));
        };
        if first.word().is_some_and(|w| matches!(w, "+" | "-" | "*" | "/")) {
            return Err(self.reader.unsupported(amount.span, "numeric expressions"));
        }
        let name = self.reader.name(first, "a function")?;
        let signature = self.function(&name, first)?;
        let args = self.arguments(amount, tail(members), &signature)?;
        Ok(Effect::Cost(CostTerm::Function(Literal { predicate: name, args })))
    }

    /// The declared function of that name.
    pub(super) fn function(&self, name: &Name, node: &Node<'s>) -> Result<Signature, PddlError> {
        self.vocabulary.functions.get(name).cloned().ok_or_else(|| {
            let mut error = self.reader.semantics(node.span, format!("unknown function `{name}`"));
            error.help = did_you_mean(name, self.vocabulary.functions.keys());
            error
        })
    }
}

/// Whether an effect stands inside a `when`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Conditional {
    No,
    Yes,
}

/// The feature behind an effect that is PDDL but not understood here.
fn unsupported_effect(head: &str) -> Option<&'static str> {
    match head {
        "decrease" | "assign" | "scale-up" | "scale-down" => Some("numeric fluents"),
        "probabilistic" => Some("probabilistic effects"),
        "oneof" => Some("nondeterministic effects"),
        _ => None,
    }
}
