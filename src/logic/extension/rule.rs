//! Rules as joins: which atom of a body is matched when, decided once.

use std::collections::{BTreeMap, BTreeSet};

use super::Symbols;
use crate::logic::variables::{free_variables, replaced, replaced_in_literal};
use crate::pddl::{Axiom, Condition, Name, Term, Typed};

/// A rule, ready to be evaluated.
#[derive(Debug)]
pub(super) struct Rule {
    /// Relation of the head.
    pub(super) head: usize,
    /// The head's parameters, then those of existential quantifiers.
    pub(super) variables: Vec<Typed>,
    pub(super) n_params: usize,
    pub(super) steps: Vec<Step>,
}

/// One step of a join. Every variable is bound by exactly one step.
#[derive(Debug)]
pub(super) enum Step {
    /// A conjunct whose variables are bound, and which is no atom of the next two kinds.
    Check(Condition),
    /// A positive atom: goes through the rows that agree with what is bound.
    Match(Pattern),
    /// A variable that no atom binds: goes through all its objects.
    Range(usize),
}

/// An atom that is matched with the rows of a relation.
#[derive(Debug)]
pub(super) struct Pattern {
    pub(super) relation: usize,
    /// Bound places.
    pub(super) known: Vec<(usize, Arg)>,
    /// (place, variable) where a variable bound by this very step stands again.
    pub(super) again: Vec<(usize, usize)>,
    /// (place, variable) of what this step binds.
    pub(super) free: Vec<(usize, usize)>,
}

/// An argument that is known when its step is reached.
#[derive(Debug, Clone, Copy)]
pub(super) enum Arg {
    /// The variable at that place.
    Variable(usize),
    /// Index among the objects of the universe.
    Object(u32),
}

/// A body taken apart: conjuncts, with existential quantifiers lifted to further variables.
struct Body {
    variables: Vec<Typed>,
    /// Positive atoms, as relation and arguments.
    atoms: Vec<(usize, Vec<Arg>)>,
    /// Everything else, with the variables each part needs.
    rest: Vec<(Condition, Vec<usize>)>,
}

impl Rule {
    /// Compiles a rule.
    pub(super) fn new(axiom: &Axiom, symbols: &mut Symbols) -> Self {
        let n_params = axiom.head.params.len();
        let head = symbols.relation(&axiom.head.name, n_params);
        let variables = axiom.head.params.clone();
        let mut body = Body { variables, atoms: Vec::new(), rest: Vec::new() };
        body.split(&axiom.body, &BTreeMap::new(), symbols);
        let steps = body.steps();
        Self { head, variables: body.variables, n_params, steps }
    }

    /// Whether different bindings give different heads.
    pub(super) fn is_injective(&self) -> bool {
        self.n_params == self.variables.len()
    }
}

impl Body {
    fn split(
        &mut self,
        condition: &Condition,
        renaming: &BTreeMap<Name, Term>,
        symbols: &mut Symbols,
    ) {
        match condition {
            Condition::And(parts) => {
                for part in parts {
                    self.split(part, renaming, symbols);
                }
            }
            Condition::Exists(variables, inner) => {
                let mut renaming = renaming.clone();
                for Typed { name, types } in variables {
                    // No name that was read contains a parenthesis, so this one is new.
                    let fresh = Name::new(format!("{name}({})", self.variables.len()));
                    self.variables.push(Typed { name: fresh.clone(), types: types.clone() });
                    renaming.insert(name.clone(), Term::Var(fresh));
                }
                self.split(inner, &renaming, symbols);
            }
            Condition::Atom(literal) => {
                let literal = replaced_in_literal(literal, renaming);
                let args = literal.args.iter().map(|term| self.arg(term, symbols)).collect();
                self.atoms.push((symbols.relation(&literal.predicate, literal.args.len()), args));
            }
            Condition::True
            | Condition::False
            | Condition::Equal(..)
            | Condition::Not(_)
            | Condition::Or(_)
            | Condition::Forall(..) => {
                let condition = replaced(condition, renaming);
                let mut needed = BTreeSet::new();
                free_variables(&condition, &mut needed);
                let needed = needed.iter().filter_map(|name| self.place(name)).collect();
                self.rest.push((condition, needed));
            }
        }
    }

    fn place(&self, variable: &Name) -> Option<usize> {
        self.variables.iter().position(|v| v.name == *variable)
    }

    fn arg(&self, term: &Term, symbols: &mut Symbols) -> Arg {
        match term {
            Term::Object(name) => Arg::Object(symbols.object(name)),
            // An unbound variable, which the parser refuses, matches no object.
            Term::Var(name) => {
                self.place(name).map_or_else(|| Arg::Object(symbols.object(name)), Arg::Variable)
            }
        }
    }

    /// The order of the join: checks as soon as they can be made, else the atom with the fewest
    /// free variables, the first one on a tie; variables that no atom binds come last.
    fn steps(&mut self) -> Vec<Step> {
        let mut bound = vec![false; self.variables.len()];
        let mut steps = Vec::new();
        loop {
            let ready =
                |(_, needed): &mut (Condition, Vec<usize>)| needed.iter().all(|&v| bound[v]);
            steps.extend(self.rest.extract_if(.., ready).map(|(check, _)| Step::Check(check)));
            let n_free = |(_, args): &(usize, Vec<Arg>)| {
                args.iter().filter(|arg| matches!(arg, Arg::Variable(v) if !bound[*v])).count()
            };
            let next = (0..self.atoms.len()).min_by_key(|&idx| n_free(&self.atoms[idx]));
            if let Some(idx) = next {
                let (relation, args) = self.atoms.remove(idx);
                steps.push(matching(relation, &args, &mut bound));
            } else if let Some(variable) = bound.iter().position(|bound| !bound) {
                bound[variable] = true;
                steps.push(Step::Range(variable));
            } else {
                return steps;
            }
        }
    }
}

fn matching(relation: usize, args: &[Arg], bound: &mut [bool]) -> Step {
    let (mut known, mut again, mut free) = (Vec::new(), Vec::new(), Vec::<(usize, usize)>::new());
    for (place, arg) in args.iter().enumerate() {
        match *arg {
            Arg::Variable(variable) if free.iter().any(|(_, v)| *v == variable) => {
                again.push((place, variable));
            }
            Arg::Variable(variable) if !bound[variable] => free.push((place, variable)),
            Arg::Variable(_) | Arg::Object(_) => known.push((place, *arg)),
        }
    }
    for &(_, variable) in &free {
        bound[variable] = true;
    }
    Step::Match(Pattern { relation, known, again, free })
}
