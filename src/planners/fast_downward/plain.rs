//! A problem in the part of PDDL that Fast Downward reads: names of ASCII, and at most one type for
//! each thing.

use std::collections::{BTreeMap, BTreeSet};

use crate::pddl::{
    Action, Atom, Axiom, Condition, CostTerm, Domain, Effect, Literal, Name, Problem, Signature,
    Term, Typed, Types,
};

/// Stands before a type's name where a predicate stands for the type.
const IS_A: &str = "is-a--";

/// Which names were replaced.
#[derive(Debug, Default)]
pub(super) struct OwnNames {
    /// Own names by those that stand for them.
    by_plain: BTreeMap<Name, Name>,
}

impl OwnNames {
    /// The name that this one stands for.
    pub(super) fn own(&self, plain: &Name) -> Name {
        self.by_plain.get(plain).unwrap_or(plain).clone()
    }

    /// A message with the own names in it.
    pub(super) fn in_text(&self, text: &str) -> String {
        let replaced =
            |text: String, (plain, own): (&Name, &Name)| text.replace(plain.as_str(), own.as_str());
        self.by_plain.iter().rev().fold(text.to_owned(), replaced)
    }
}

/// Puts a problem in plain words. Where a thing has several types, or a type several parents, all types
/// become predicates.
pub(super) fn plain(domain: &mut Domain, problem: &mut Problem) -> OwnNames {
    if !has_plain_types(domain, problem) {
        types_to_predicates(domain, problem);
    }
    let mut names = Renaming::default();
    names.domain(domain);
    names.problem(problem);
    OwnNames { by_plain: names.by_plain }
}

fn has_plain_types(domain: &Domain, problem: &Problem) -> bool {
    let mut is_plain = domain.types.parents.values().all(|parents| parents.len() <= 1);
    let mut look = |typed: &[Typed]| is_plain &= typed.iter().all(|t| t.types.len() <= 1);
    look(&domain.constants);
    look(&problem.objects);
    domain.predicates.iter().chain(&domain.functions).for_each(|s| look(&s.params));
    each_variables(domain, problem, &mut |variables| look(variables));
    is_plain
}

/// Visits the variables of actions, rules and quantifiers.
fn each_variables(domain: &Domain, problem: &Problem, look: &mut dyn FnMut(&[Typed])) {
    fn condition(c: &Condition, look: &mut dyn FnMut(&[Typed])) {
        match c {
            Condition::Not(inner) => condition(inner, look),
            Condition::And(parts) | Condition::Or(parts) => {
                for part in parts {
                    condition(part, look);
                }
            }
            Condition::Exists(variables, inner) | Condition::Forall(variables, inner) => {
                look(variables);
                condition(inner, look);
            }
            Condition::True | Condition::False | Condition::Atom(_) | Condition::Equal(..) => {}
        }
    }
    fn effect(e: &Effect, look: &mut dyn FnMut(&[Typed])) {
        match e {
            Effect::And(parts) => parts.iter().for_each(|part| effect(part, look)),
            Effect::When(c, inner) => {
                condition(c, look);
                effect(inner, look);
            }
            Effect::Forall(variables, inner) => {
                look(variables);
                effect(inner, look);
            }
            Effect::Add(_) | Effect::Delete(_) | Effect::Cost(_) => {}
        }
    }
    for action in &domain.actions {
        look(&action.params);
        condition(&action.precondition, look);
        effect(&action.effect, look);
    }
    for axiom in &domain.axioms {
        look(&axiom.head.params);
        condition(&axiom.body, look);
    }
    condition(&problem.goal, look);
}

/// Replaces every type by a predicate of one object.
fn types_to_predicates(domain: &mut Domain, problem: &mut Problem) {
    let all: BTreeSet<Name> = domain.known_types();
    let types = std::mem::take(&mut domain.types);
    let objects = domain.constants.iter().chain(&problem.objects);
    for object in objects.cloned().collect::<Vec<Typed>>() {
        let of = all.iter().filter(|name| types.fits(&object.types, std::slice::from_ref(*name)));
        let facts = of.map(|name| Atom { predicate: is_a(name), args: vec![object.name.clone()] });
        problem.init.extend(facts.collect::<Vec<Atom>>());
    }
    let untyped = |list: &mut Vec<Typed>| list.iter_mut().for_each(|typed| typed.types.clear());
    untyped(&mut domain.constants);
    untyped(&mut problem.objects);
    let signatures = domain.predicates.iter_mut().chain(&mut domain.functions);
    signatures.for_each(|signature| untyped(&mut signature.params));
    for Action { params, precondition, effect, .. } in &mut domain.actions {
        *precondition = Condition::And(vec![typing(params), condition(precondition)]);
        *effect = typed_effect(effect);
        untyped(params);
    }
    for Axiom { head, body } in &mut domain.axioms {
        *body = Condition::And(vec![typing(&head.params), condition(body)]);
        untyped(&mut head.params);
    }
    problem.goal = condition(&problem.goal);
    domain.predicates.extend(all.iter().map(|name| Signature {
        name: is_a(name),
        params: vec![Typed { name: "x".into(), types: Vec::new() }],
    }));
    domain.types = Types::default();
}

fn is_a(name: &Name) -> Name {
    Name::new(format!("{IS_A}{name}"))
}

/// That every variable is of one of its types.
fn typing(variables: &[Typed]) -> Condition {
    let typed = variables.iter().filter(|variable| !variable.types.is_empty());
    let of = |variable: &Typed| {
        let args = vec![Term::Var(variable.name.clone())];
        let is = |name: &Name| Literal { predicate: is_a(name), args: args.clone() };
        Condition::Or(variable.types.iter().map(|name| Condition::Atom(is(name))).collect())
    };
    Condition::And(typed.map(of).collect())
}

fn untyped(variables: &[Typed]) -> Vec<Typed> {
    variables.iter().map(|v| Typed { name: v.name.clone(), types: Vec::new() }).collect()
}

/// A condition with types as conditions.
fn condition(c: &Condition) -> Condition {
    match c {
        Condition::True | Condition::False | Condition::Atom(_) | Condition::Equal(..) => c.clone(),
        Condition::Not(inner) => Condition::Not(Box::new(condition(inner))),
        Condition::And(parts) => Condition::And(parts.iter().map(condition).collect()),
        Condition::Or(parts) => Condition::Or(parts.iter().map(condition).collect()),
        Condition::Exists(variables, inner) => {
            let inner = Condition::And(vec![typing(variables), condition(inner)]);
            Condition::Exists(untyped(variables), Box::new(inner))
        }
        Condition::Forall(variables, inner) => {
            let other = Condition::Not(Box::new(typing(variables)));
            let inner = Condition::Or(vec![other, condition(inner)]);
            Condition::Forall(untyped(variables), Box::new(inner))
        }
    }
}

/// An effect with types as conditions.
fn typed_effect(e: &Effect) -> Effect {
    match e {
        Effect::Add(_) | Effect::Delete(_) | Effect::Cost(_) => e.clone(),
        Effect::And(parts) => Effect::And(parts.iter().map(typed_effect).collect()),
        Effect::When(c, inner) => Effect::When(condition(c), Box::new(typed_effect(inner))),
        Effect::Forall(variables, inner) => {
            let inner = Effect::When(typing(variables), Box::new(typed_effect(inner)));
            Effect::Forall(untyped(variables), Box::new(inner))
        }
    }
}

/// Replaces names that are not ASCII.
#[derive(Default)]
struct Renaming {
    by_plain: BTreeMap<Name, Name>,
}

impl Renaming {
    fn name(&mut self, name: &mut Name) {
        if name.as_str().is_ascii() {
            return;
        }
        let spelt = |c: char| {
            if c.is_ascii() { c.to_string() } else { format!("--{:x}--", u32::from(c)) }
        };
        let plain = Name::new(name.as_str().chars().map(spelt).collect::<String>());
        self.by_plain.insert(plain.clone(), std::mem::replace(name, plain));
    }

    fn typed(&mut self, list: &mut [Typed]) {
        for Typed { name, types } in list {
            self.name(name);
            for name in types {
                self.name(name);
            }
        }
    }

    fn signature(&mut self, signature: &mut Signature) {
        self.name(&mut signature.name);
        self.typed(&mut signature.params);
    }

    fn term(&mut self, term: &mut Term) {
        match term {
            Term::Var(name) | Term::Object(name) => self.name(name),
        }
    }

    fn literal(&mut self, literal: &mut Literal) {
        self.name(&mut literal.predicate);
        literal.args.iter_mut().for_each(|term| self.term(term));
    }

    fn atom(&mut self, mut atom: Atom) -> Atom {
        self.name(&mut atom.predicate);
        atom.args.iter_mut().for_each(|name| self.name(name));
        atom
    }

    fn condition(&mut self, c: &mut Condition) {
        match c {
            Condition::True | Condition::False => {}
            Condition::Atom(literal) => self.literal(literal),
            Condition::Equal(a, b) => {
                self.term(a);
                self.term(b);
            }
            Condition::Not(inner) => self.condition(inner),
            Condition::And(parts) | Condition::Or(parts) => {
                for part in parts {
                    self.condition(part);
                }
            }
            Condition::Exists(variables, inner) | Condition::Forall(variables, inner) => {
                self.typed(variables);
                self.condition(inner);
            }
        }
    }

    fn effect(&mut self, e: &mut Effect) {
        match e {
            Effect::And(parts) => parts.iter_mut().for_each(|part| self.effect(part)),
            Effect::Add(literal)
            | Effect::Delete(literal)
            | Effect::Cost(CostTerm::Function(literal)) => self.literal(literal),
            Effect::Cost(CostTerm::Number(_)) => {}
            Effect::When(c, inner) => {
                self.condition(c);
                self.effect(inner);
            }
            Effect::Forall(variables, inner) => {
                self.typed(variables);
                self.effect(inner);
            }
        }
    }

    fn domain(&mut self, domain: &mut Domain) {
        self.name(&mut domain.name);
        let parents = std::mem::take(&mut domain.types.parents);
        for (mut name, mut above) in parents {
            self.name(&mut name);
            for name in &mut above {
                self.name(name);
            }
            domain.types.parents.insert(name, above);
        }
        self.typed(&mut domain.constants);
        let signatures = domain.predicates.iter_mut().chain(&mut domain.functions);
        signatures.for_each(|signature| self.signature(signature));
        for Axiom { head, body } in &mut domain.axioms {
            self.signature(head);
            self.condition(body);
        }
        for Action { name, params, precondition, effect } in &mut domain.actions {
            self.name(name);
            self.typed(params);
            self.condition(precondition);
            self.effect(effect);
        }
    }

    fn problem(&mut self, problem: &mut Problem) {
        self.name(&mut problem.domain);
        self.typed(&mut problem.objects);
        let init = std::mem::take(&mut problem.init);
        problem.init = init.into_iter().map(|atom| self.atom(atom)).collect();
        let costs = std::mem::take(&mut problem.costs);
        problem.costs = costs.into_iter().map(|(atom, cost)| (self.atom(atom), cost)).collect();
        self.condition(&mut problem.goal);
    }
}
