//! What conditions and effects mean, by direct interpretation.
//!
//! This is the reference: the validator, the completion rules and the check before dispatch use it,
//! and the planner is tested against it.

use std::collections::{BTreeMap, BTreeSet};

use super::variables::{Bindings, substitute};
use super::{Facts, Truth};
use crate::pddl::{
    Action, Atom, Condition, CostTerm, Effect, Literal, NUMBER_DIGITS_MAX, Name, Number, Term,
    Typed, Types,
};

/// The objects that variables range over.
#[derive(Debug, Clone, Copy)]
pub struct Universe<'a> {
    /// The type hierarchy.
    pub types: &'a Types,
    /// All objects, constants included.
    pub objects: &'a [Typed],
}

impl<'a> Universe<'a> {
    /// The objects of one of the given types, in the order of `objects`; of all types for none.
    pub fn of(&self, types: &[Name]) -> impl Iterator<Item = &'a Name> {
        let hierarchy = self.types;
        let fitting = self.objects.iter().filter(move |o| hierarchy.fits(&o.types, types));
        fitting.map(|o| &o.name)
    }

    /// Whether `object` exists and is of one of the given types.
    pub fn has(&self, object: &Name, types: &[Name]) -> bool {
        self.of(types).any(|o| o == object)
    }
}

/// The truth value of a condition, in Kleene's strong three-valued logic.
///
/// `truth` gives the value of ground atoms. An atom with a variable that is not bound is unknown.
pub fn evaluate(
    condition: &Condition,
    bindings: &Bindings,
    universe: &Universe<'_>,
    truth: &dyn Fn(&Atom) -> Truth,
) -> Truth {
    let of = |inner: &Condition| evaluate(inner, bindings, universe, truth);
    match condition {
        Condition::True => Truth::True,
        Condition::False => Truth::False,
        Condition::Atom(literal) => ground(literal, bindings).map_or(Truth::Unknown, |a| truth(&a)),
        Condition::Equal(left, right) => match (object(left, bindings), object(right, bindings)) {
            (Some(left), Some(right)) => Truth::from(left == right),
            _ => Truth::Unknown,
        },
        Condition::Not(inner) => of(inner).negate(),
        Condition::And(parts) => least(parts.iter().map(of)),
        Condition::Or(parts) => greatest(parts.iter().map(of)),
        Condition::Exists(variables, inner) => {
            quantified(variables, inner, bindings, universe, truth, Truth::True)
        }
        Condition::Forall(variables, inner) => {
            quantified(variables, inner, bindings, universe, truth, Truth::False)
        }
    }
}

/// The value of a quantifier that is decided by one `decisive` instance.
fn quantified(
    variables: &[Typed],
    inner: &Condition,
    bindings: &Bindings,
    universe: &Universe<'_>,
    truth: &dyn Fn(&Atom) -> Truth,
    decisive: Truth,
) -> Truth {
    let Some((first, others)) = variables.split_first() else {
        return evaluate(inner, bindings, universe, truth);
    };
    // Without objects to bind, an instance does not exist, whatever the other variables are.
    if others.iter().any(|v| universe.of(&v.types).next().is_none()) {
        return decisive.negate();
    }
    let mut bindings = bindings.clone();
    for hidden in others {
        bindings.remove(&hidden.name);
    }
    let mut result = decisive.negate();
    for object in universe.of(&first.types) {
        bindings.insert(first.name.clone(), object.clone());
        // Atoms of variables yet to be bound are unknown, so what is decided now stays so.
        let mut value = evaluate(inner, &bindings, universe, truth);
        if value == Truth::Unknown && !others.is_empty() {
            value = quantified(others, inner, &bindings, universe, truth, decisive);
        }
        if value == decisive {
            return decisive;
        }
        if value == Truth::Unknown {
            result = Truth::Unknown;
        }
    }
    result
}

/// Conjunction; looks no further than the first false value.
fn least(values: impl Iterator<Item = Truth>) -> Truth {
    let mut result = Truth::True;
    for value in values {
        result = result.min(value);
        if result.is_false() {
            break;
        }
    }
    result
}

/// Disjunction; looks no further than the first true value.
fn greatest(values: impl Iterator<Item = Truth>) -> Truth {
    let mut result = Truth::False;
    for value in values {
        result = result.max(value);
        if result.is_true() {
            break;
        }
    }
    result
}

/// Binds an action's parameters to objects; `None` when their numbers differ.
pub fn bind(action: &Action, args: &[Name]) -> Option<Bindings> {
    let names = action.params.iter().map(|p| p.name.clone());
    (args.len() == action.params.len()).then(|| names.zip(args.iter().cloned()).collect())
}

/// What an action changes in one state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes {
    /// Atoms that become true.
    pub add: BTreeSet<Atom>,
    /// Atoms that become false. Disjoint from `add`: adding wins.
    pub delete: BTreeSet<Atom>,
    /// Atoms of which it is not known whether they change, because a condition is unknown.
    /// Disjoint from `add` and `delete`.
    pub unknown: BTreeSet<Atom>,
    /// The numbers added to `total-cost`.
    pub cost_numbers: Vec<Number>,
    /// The functions added to `total-cost`.
    pub cost_functions: Vec<Atom>,
}

impl Changes {
    /// The state after these changes.
    pub fn apply(&self, before: &Facts) -> Facts {
        let mut after = before.clone();
        for (atoms, truth) in [
            (&self.delete, Truth::False),
            (&self.add, Truth::True),
            (&self.unknown, Truth::Unknown),
        ] {
            for atom in atoms {
                after.set(atom.clone(), truth);
            }
        }
        after
    }

    /// What the action adds to `total-cost`, given the functions' values.
    ///
    /// # Errors
    /// [`CostError`] when a function has no value that is a cost.
    pub fn cost(&self, values: &BTreeMap<Atom, Number>) -> Result<Number, CostError> {
        let numbers = self.cost_numbers.iter().map(|&number| Ok(number));
        let functions = self.cost_functions.iter().map(|function| cost_of(function, values));
        numbers.chain(functions).try_fold(Number::default(), |sum: Number, cost| {
            sum.checked_add(cost?).ok_or(CostError::TooLarge)
        })
    }
}

/// Why an action has no cost.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CostError {
    /// A function was given no value.
    #[error("expected a value of the cost {0}, got none")]
    NoValue(Atom),
    /// A function has a value below 0.
    #[error("expected a cost {0} of 0 or more, got {1}")]
    Negative(Atom, Number),
    /// A sum has more than [`NUMBER_DIGITS_MAX`] digits.
    #[error("expected costs of at most {NUMBER_DIGITS_MAX} digits, got a sum of more")]
    TooLarge,
}

/// The value of a cost function.
///
/// # Errors
/// [`CostError`] when it has none that is a cost.
pub fn cost_of(function: &Atom, values: &BTreeMap<Atom, Number>) -> Result<Number, CostError> {
    match values.get(function) {
        None => Err(CostError::NoValue(function.clone())),
        Some(&cost) if cost.is_negative() => Err(CostError::Negative(function.clone(), cost)),
        Some(&cost) => Ok(cost),
    }
}

/// What an action changes in the state that `truth` describes. Its precondition is not looked at.
pub fn effects(
    action: &Action,
    bindings: &Bindings,
    universe: &Universe<'_>,
    truth: &dyn Fn(&Atom) -> Truth,
) -> Changes {
    let mut collector = Collector::new(universe, truth);
    collector.collect(&action.effect, bindings, Truth::True);
    collector.finish()
}

/// Gathers effects, certain and possible ones apart.
struct Collector<'a> {
    universe: &'a Universe<'a>,
    truth: &'a dyn Fn(&Atom) -> Truth,
    certain: Changes,
    maybe_add: BTreeSet<Atom>,
    maybe_delete: BTreeSet<Atom>,
}

impl<'a> Collector<'a> {
    fn new(universe: &'a Universe<'a>, truth: &'a dyn Fn(&Atom) -> Truth) -> Self {
        let (maybe_add, maybe_delete) = (BTreeSet::new(), BTreeSet::new());
        Self { universe, truth, certain: Changes::default(), maybe_add, maybe_delete }
    }

    /// `fires` is the truth of all conditions around the effect; never false.
    fn collect(&mut self, effect: &Effect, bindings: &Bindings, fires: Truth) {
        match effect {
            Effect::And(parts) => {
                for part in parts {
                    self.collect(part, bindings, fires);
                }
            }
            Effect::Add(literal) => {
                let certain = &mut self.certain.add;
                let target = if fires.is_true() { certain } else { &mut self.maybe_add };
                target.extend(ground(literal, bindings));
            }
            Effect::Delete(literal) => {
                let certain = &mut self.certain.delete;
                let target = if fires.is_true() { certain } else { &mut self.maybe_delete };
                target.extend(ground(literal, bindings));
            }
            Effect::When(condition, inner) => {
                let holds = evaluate(condition, bindings, self.universe, self.truth);
                if !holds.is_false() {
                    self.collect(inner, bindings, fires.min(holds));
                }
            }
            Effect::Forall(variables, inner) => {
                for inner_bindings in assignments(variables, bindings, self.universe) {
                    self.collect(inner, &inner_bindings, fires);
                }
            }
            Effect::Cost(CostTerm::Number(number)) => self.certain.cost_numbers.push(*number),
            Effect::Cost(CostTerm::Function(literal)) => {
                self.certain.cost_functions.extend(ground(literal, bindings));
            }
        }
    }

    fn finish(mut self) -> Changes {
        let Changes { add, delete, unknown, .. } = &mut self.certain;
        delete.retain(|atom| !add.contains(atom));
        for atom in self.maybe_add.iter().filter(|a| !add.contains(a)) {
            let contested = delete.contains(atom) || self.maybe_delete.contains(atom);
            if contested || !(self.truth)(atom).is_true() {
                unknown.insert(atom.clone());
            }
        }
        for atom in self.maybe_delete.iter().filter(|a| !add.contains(a) && !delete.contains(a)) {
            if !(self.truth)(atom).is_false() {
                unknown.insert(atom.clone());
            }
        }
        delete.retain(|atom| !unknown.contains(atom));
        self.certain
    }
}

/// The unknown ground atoms that keep a condition from being decided; none when it is decided.
pub fn mentioned_unknowns(
    condition: &Condition,
    bindings: &Bindings,
    universe: &Universe<'_>,
    truth: &dyn Fn(&Atom) -> Truth,
) -> BTreeSet<Atom> {
    if evaluate(condition, bindings, universe, truth) != Truth::Unknown {
        return BTreeSet::new();
    }
    let of = |inner: &Condition, bindings: &Bindings| {
        mentioned_unknowns(inner, bindings, universe, truth)
    };
    match condition {
        Condition::True | Condition::False | Condition::Equal(..) => BTreeSet::new(),
        Condition::Atom(literal) => ground(literal, bindings).into_iter().collect(),
        Condition::Not(inner) => of(inner, bindings),
        Condition::And(parts) | Condition::Or(parts) => {
            parts.iter().flat_map(|part| of(part, bindings)).collect()
        }
        Condition::Exists(variables, inner) | Condition::Forall(variables, inner) => {
            assignments(variables, bindings, universe).flat_map(|b| of(inner, &b)).collect()
        }
    }
}

/// Why a condition does not hold, one reason for each part that fails, for example
/// "(clear b) does not hold"; empty when the condition holds.
pub fn unsatisfied(
    condition: &Condition,
    bindings: &Bindings,
    universe: &Universe<'_>,
    truth: &dyn Fn(&Atom) -> Truth,
) -> Vec<String> {
    let reason = |part: Condition| {
        let value = evaluate(&part, &Bindings::new(), universe, truth);
        if let (Condition::Not(inner), true) = (&part, value.is_false()) {
            return format!("{inner} holds");
        }
        let verdict = if value.is_false() { "does not hold" } else { "is not known to hold" };
        format!("{part} {verdict}")
    };
    failing(condition, bindings, universe, truth).into_iter().map(reason).collect()
}

/// The parts of a condition that do not hold, or are not known to, with objects in place of variables;
/// empty when the condition holds.
pub fn failing(
    condition: &Condition,
    bindings: &Bindings,
    universe: &Universe<'_>,
    truth: &dyn Fn(&Atom) -> Truth,
) -> Vec<Condition> {
    if evaluate(condition, bindings, universe, truth).is_true() {
        return Vec::new();
    }
    match condition {
        Condition::And(parts) => {
            parts.iter().flat_map(|p| failing(p, bindings, universe, truth)).collect()
        }
        Condition::Forall(variables, inner) => assignments(variables, bindings, universe)
            .flat_map(|b| failing(inner, &b, universe, truth))
            .collect(),
        Condition::True
        | Condition::False
        | Condition::Atom(_)
        | Condition::Equal(..)
        | Condition::Not(_)
        | Condition::Or(_)
        | Condition::Exists(..) => vec![substitute(condition, bindings)],
    }
}

/// The object a term stands for.
pub(super) fn object(term: &Term, bindings: &Bindings) -> Option<Name> {
    match term {
        Term::Var(name) => bindings.get(name).cloned(),
        Term::Object(name) => Some(name.clone()),
    }
}

/// The literal with its variables replaced; `None` when one is not bound.
pub(super) fn ground(literal: &Literal, bindings: &Bindings) -> Option<Atom> {
    let args = literal.args.iter().map(|term| object(term, bindings));
    Some(Atom { predicate: literal.predicate.clone(), args: args.collect::<Option<_>>()? })
}

/// Every way to bind `variables` in addition to (and hiding) `bindings`, in the objects' order.
pub(super) fn assignments<'a>(
    variables: &'a [Typed],
    bindings: &Bindings,
    universe: &Universe<'a>,
) -> impl Iterator<Item = Bindings> + use<'a> {
    let domains: Vec<Vec<&Name>> =
        variables.iter().map(|v| universe.of(&v.types).collect()).collect();
    let mut current = bindings.clone();
    let mut digits = vec![0; variables.len()];
    let mut finished = domains.iter().any(Vec::is_empty);
    std::iter::from_fn(move || {
        if finished {
            return None;
        }
        for ((variable, domain), &digit) in variables.iter().zip(&domains).zip(&digits) {
            current.insert(variable.name.clone(), domain[digit].clone());
        }
        // Count up, the last variable fastest.
        finished = true;
        for (digit, domain) in digits.iter_mut().zip(&domains).rev() {
            *digit += 1;
            if *digit < domain.len() {
                finished = false;
                break;
            }
            *digit = 0;
        }
        Some(current.clone())
    })
}

#[cfg(test)]
mod tests;
