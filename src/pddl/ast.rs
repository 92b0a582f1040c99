//! The typed tree of a PDDL domain or problem.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::{Deserialize, Serialize};

use super::{Name, Number};

/// A ground atom: a predicate over objects.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Atom {
    /// Declared in `:predicates`, or `=`.
    pub predicate: Name,
    /// The objects, in the predicate's order.
    pub args: Vec<Name>,
}

impl Atom {
    /// Makes an atom from text, lower-casing every part.
    pub fn new(predicate: &str, args: &[&str]) -> Self {
        Self { predicate: predicate.into(), args: args.iter().map(|&a| a.into()).collect() }
    }
}

impl fmt::Display for Atom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}", self.predicate)?;
        for arg in &self.args {
            write!(f, " {arg}")?;
        }
        f.write_str(")")
    }
}

/// A name with its type; several types stand for `(either …)`, none for `object`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Typed {
    /// The object, constant or variable (without its question mark).
    pub name: Name,
    /// The alternatives of its type.
    pub types: Vec<Name>,
}

impl Typed {
    /// A name of exactly one type.
    pub fn new(name: impl Into<Name>, type_name: impl Into<Name>) -> Self {
        Self { name: name.into(), types: vec![type_name.into()] }
    }
}

/// A predicate's or function's name and parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signature {
    /// Its name.
    pub name: Name,
    /// Its parameters.
    pub params: Vec<Typed>,
}

/// A variable or an object inside a condition or effect.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Term {
    /// A variable, without its question mark.
    Var(Name),
    /// A constant or object.
    Object(Name),
}

/// An atom over terms.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Literal {
    /// Declared in `:predicates`, or `=`.
    pub predicate: Name,
    /// Its arguments.
    pub args: Vec<Term>,
}

/// A goal description (PDDL's `GD`): preconditions, goals, axiom bodies.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Condition {
    /// Holds always; the empty conjunction is written this way too.
    True,
    /// Holds never.
    False,
    /// The atom holds.
    Atom(Literal),
    /// Both terms are the same object.
    Equal(Term, Term),
    /// Negation.
    Not(Box<Condition>),
    /// Conjunction.
    And(Vec<Condition>),
    /// Disjunction; `(imply a b)` is `(or (not a) b)`.
    Or(Vec<Condition>),
    /// Holds for some binding.
    Exists(Vec<Typed>, Box<Condition>),
    /// Holds for every binding.
    Forall(Vec<Typed>, Box<Condition>),
}

/// What an action adds to `total-cost`.
#[derive(Debug, Clone, PartialEq, PartialOrd)]
pub enum CostTerm {
    /// A constant of the text.
    Number(Number),
    /// A function of the action's parameters, given by the problem.
    Function(Literal),
}

/// What an action changes (PDDL 2.1 with conditional effects and action costs).
#[derive(Debug, Clone, PartialEq, PartialOrd)]
pub enum Effect {
    /// All of them.
    And(Vec<Effect>),
    /// The atom becomes true.
    Add(Literal),
    /// The atom becomes false, unless the same step adds it.
    Delete(Literal),
    /// Conditional effect.
    When(Condition, Box<Effect>),
    /// For every binding.
    Forall(Vec<Typed>, Box<Effect>),
    /// `(increase (total-cost) …)`.
    Cost(CostTerm),
}

/// An action schema.
#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    /// Its name.
    pub name: Name,
    /// Its parameters.
    pub params: Vec<Typed>,
    /// Its precondition.
    pub precondition: Condition,
    /// Its effect.
    pub effect: Effect,
}

/// A `:derived` rule: the head holds wherever the body does.
#[derive(Debug, Clone, PartialEq)]
pub struct Axiom {
    /// The derived predicate with its parameters.
    pub head: Signature,
    /// What implies the head.
    pub body: Condition,
}

/// The type hierarchy: each declared type with its parents (several for `(either …)`).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Types {
    /// Parents by type; a type without an entry hangs directly below `object`.
    pub parents: BTreeMap<Name, Vec<Name>>,
}

impl Types {
    /// Whether `child` is `ancestor` or below it. Everything is below `object`.
    pub fn is_a(&self, child: &Name, ancestor: &Name) -> bool {
        self.is_a_within(child, ancestor, self.parents.len())
    }

    fn is_a_within(&self, child: &Name, ancestor: &Name, depth_max: usize) -> bool {
        child == ancestor
            || *ancestor == "object"
            || depth_max > 0
                && self.parents.get(child).is_some_and(|parents| {
                    parents.iter().any(|p| self.is_a_within(p, ancestor, depth_max - 1))
                })
    }

    /// Whether an object of `types` may stand where one of `wanted` is asked for.
    pub fn fits(&self, types: &[Name], wanted: &[Name]) -> bool {
        wanted.is_empty() || types.iter().any(|t| wanted.iter().any(|w| self.is_a(t, w)))
    }
}

/// A parsed and checked domain.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    /// Its name.
    pub name: Name,
    /// Declared `:requirements`, colon included, as written.
    pub requirements: BTreeSet<Name>,
    /// The type hierarchy.
    pub types: Types,
    /// Objects of every problem.
    pub constants: Vec<Typed>,
    /// Declared predicates.
    pub predicates: Vec<Signature>,
    /// Declared numeric functions (only costs are understood).
    pub functions: Vec<Signature>,
    /// `:derived` rules.
    pub axioms: Vec<Axiom>,
    /// Action schemas.
    pub actions: Vec<Action>,
}

impl Domain {
    /// The predicate of that name.
    pub fn predicate(&self, name: &str) -> Option<&Signature> {
        self.predicates.iter().find(|p| p.name == name)
    }

    /// The action of that name.
    pub fn action(&self, name: &str) -> Option<&Action> {
        self.actions.iter().find(|a| a.name == name)
    }

    /// Every type that the domain declares or uses.
    pub fn known_types(&self) -> BTreeSet<Name> {
        let declared = self.types.parents.iter().flat_map(|(t, ps)| ps.iter().chain([t]));
        let of_predicates = self.predicates.iter().flat_map(|p| &p.params);
        let used = of_predicates.chain(self.actions.iter().flat_map(|a| &a.params));
        declared.chain(used.flat_map(|t| &t.types)).cloned().collect()
    }
}

/// One step of a plan: an action applied to objects.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Name of the action schema.
    pub action: Name,
    /// The objects, in the action's order.
    pub args: Vec<Name>,
}

impl Step {
    /// Makes a step from text, lower-casing every part.
    pub fn new(action: &str, args: &[&str]) -> Self {
        Self { action: action.into(), args: args.iter().map(|&a| a.into()).collect() }
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}", self.action)?;
        for arg in &self.args {
            write!(f, " {arg}")?;
        }
        f.write_str(")")
    }
}

/// A parsed and checked problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Its name.
    pub name: Name,
    /// The domain it says it belongs to.
    pub domain: Name,
    /// Its objects, without the domain's constants.
    pub objects: Vec<Typed>,
    /// What holds at first; repeated facts count once.
    pub init: BTreeSet<Atom>,
    /// Values of numeric functions (`(= (distance a b) 3)`).
    pub costs: BTreeMap<Atom, Number>,
    /// What must hold in the end.
    pub goal: Condition,
    /// Whether `(:metric minimize (total-cost))` is asked for.
    pub minimise_cost: bool,
}
