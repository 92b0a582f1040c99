//! The ground task: packed atoms, actions, rules and goal.

pub(crate) mod formula;
pub(crate) mod schema;
pub(crate) mod ground;
mod seeds;
mod instantiate;
mod prune;
mod axioms;
pub(crate) mod state;
mod successors;
mod pack;

use std::collections::{BTreeMap, BTreeSet};

use super::GroundingLimits;
use super::heuristics::Prepared;
use crate::pddl::{Atom, Condition, Domain, Effect, Name, Step, Typed};
use axioms::Axioms;
use formula::{Formula, Test};
use ground::{GroundCost, GroundEffect, Grounder, Kind};
use instantiate::{Relation, binding_of, instances};
use pack::Packing;
use schema::{Compiler, Schema, SlotEffect, Symbols};
use seeds::Mentions;
use successors::Successors;

/// Why a task could not be grounded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TaskError {
    /// A limit was met.
    #[error("{limit} ({value}) is used up")]
    OutOfBudget {
        /// Name of the limit.
        limit: &'static str,
        /// Its value.
        value: u64,
    },
    /// A condition, fact or goal names something that the domain or the objects lack.
    #[error("expected a declared predicate, object or variable, got `{name}`")]
    UnknownName {
        /// The name.
        name: Name,
    },
    /// An action's cost is a function that was given no value.
    #[error("expected a value of the cost {function}, got none")]
    NoCost {
        /// The function.
        function: Atom,
    },
    /// The derived predicates depend on their own negation.
    #[error(transparent)]
    NotStratified(#[from] crate::pddl::NotStratified),
}

impl TaskError {
    pub(crate) fn limit(limit: &'static str, value: u64) -> Self {
        Self::OutOfBudget { limit, value }
    }
}

/// Which states a task has to serve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coverage {
    /// Those reachable from the given facts: the smallest task.
    Reachable,
    /// Every state over the given objects that agrees with the given facts on the predicates that
    /// no action changes. The goal may be asked for from any of them.
    AllStates,
}

/// What a task is made from.
#[derive(Debug, Clone, Copy)]
pub struct TaskInput<'a> {
    /// The domain.
    pub domain: &'a Domain,
    /// The objects, with or without the domain's constants.
    pub objects: &'a [Typed],
    /// What holds at first.
    pub init: &'a BTreeSet<Atom>,
    /// The goal.
    pub goal: &'a Condition,
    /// Values of cost functions.
    pub costs: &'a BTreeMap<Atom, f64>,
    /// Whether actions cost what they add to `total-cost`; otherwise each costs 1.
    pub minimise_cost: bool,
}

/// A ground action.
#[derive(Debug, Clone)]
pub(crate) struct Operator {
    pub(crate) step: Step,
    pub(crate) cost: u64,
    pub(crate) precondition: Formula,
    pub(crate) effects: Vec<GroundEffect>,
    pub(crate) test: Test,
    pub(crate) changes: Vec<PackedEffect>,
}

/// Changes under one condition, as masks: (word, bits).
#[derive(Debug, Clone)]
pub(crate) struct PackedEffect {
    pub(crate) test: Test,
    pub(crate) clear: Vec<(u32, u64)>,
    pub(crate) set: Vec<(u32, u64)>,
}

/// A task, ready to be searched.
#[derive(Debug, Clone)]
pub struct Task {
    /// The atoms in bit order: those that actions change, then the derived ones.
    pub(crate) atoms: Vec<Atom>,
    pub(crate) ids: BTreeMap<Atom, u32>,
    /// Words of a packed state.
    pub(crate) words: usize,
    pub(crate) operators: Vec<Operator>,
    pub(crate) successors: Successors,
    pub(crate) goal: Formula,
    pub(crate) goal_test: Test,
    /// (head, body) of every rule.
    pub(crate) rules: Vec<(u32, Formula)>,
    /// Derived atoms that depend on themselves.
    pub(crate) recursive: BTreeSet<u32>,
    pub(crate) axioms: Axioms,
    /// How many units of cost make 1.
    pub(crate) cost_scale: u64,
    pub(crate) prepared: Prepared,
}

/// A task before packing; atoms have the grounder's numbers.
pub(crate) struct Draft {
    pub(crate) actions: Vec<DraftAction>,
    pub(crate) rules: Vec<(u32, Formula)>,
    pub(crate) goal: Formula,
}

/// An action of a [`Draft`].
pub(crate) struct DraftAction {
    pub(crate) schema: usize,
    pub(crate) args: Vec<u32>,
    pub(crate) precondition: Formula,
    pub(crate) effects: Vec<GroundEffect>,
    pub(crate) cost: GroundCost,
}

impl Draft {
    /// Replaces literals everywhere and drops what can no longer happen.
    pub(crate) fn replace(&mut self, literal: &impl Fn(u32, bool) -> Formula) {
        for action in &mut self.actions {
            action.precondition = action.precondition.replaced(literal);
            for effect in &mut action.effects {
                effect.condition = effect.condition.replaced(literal);
            }
            action.effects.retain(|e| e.condition != Formula::False);
        }
        let happens = |a: &DraftAction| a.precondition != Formula::False && !a.effects.is_empty();
        self.actions.retain(happens);
        for (_, body) in &mut self.rules {
            *body = body.replaced(literal);
        }
        self.rules.retain(|(_, body)| *body != Formula::False);
        self.goal = self.goal.replaced(literal);
    }
}

impl Task {
    /// Grounds a task.
    ///
    /// # Errors
    /// A limit that was met, a name that is not declared, a cost without a value.
    pub fn new(
        input: &TaskInput<'_>,
        coverage: Coverage,
        limits: &GroundingLimits,
    ) -> Result<Self, TaskError> {
        let symbols = Symbols::new(input.domain, input.objects);
        check_sizes(input.domain, &symbols, limits)?;
        let kinds = kinds(input.domain, &symbols);
        let facts = numbered(input.init, &symbols)?;
        let is_static = |(p, _): &&(u32, Vec<u32>)| kinds[*p as usize] == Kind::Static;
        let statics: Vec<_> = facts.iter().filter(is_static).cloned().collect();
        let mut grounder = Grounder::new(&symbols, kinds, &statics, limits);
        let mut draft = draft(input, &symbols, &statics, &mut grounder, limits)?;
        if coverage == Coverage::Reachable {
            let mut initial = vec![false; grounder.atoms.len()];
            for (predicate, args) in facts {
                if grounder.kind(predicate) == Kind::Fluent {
                    let atom = grounder.atom(predicate, args)? as usize;
                    // Atoms that nothing mentions are of no interest.
                    initial.get_mut(atom).into_iter().for_each(|value| *value = true);
                }
            }
            prune::unreachable(&mut draft, &initial);
        }
        Packing { input, symbols: &symbols, grounder: &grounder }.pack(draft)
    }

    /// The packed state of some facts; what the task does not mention is left out.
    pub(crate) fn state(&self, facts: &BTreeSet<Atom>) -> Vec<u64> {
        let mut state = vec![0; self.words];
        for id in facts.iter().filter_map(|atom| self.ids.get(atom)) {
            state[*id as usize / 64] |= 1 << (id % 64);
        }
        self.axioms.complete(&mut state);
        state
    }

    /// Whether the goal holds in a packed state.
    pub(crate) fn is_goal(&self, state: &[u64]) -> bool {
        self.goal_test.holds(state)
    }

    /// Writes the state after an action into `after`.
    pub(crate) fn apply(&self, operator: &Operator, before: &[u64], after: &mut Vec<u64>) {
        after.clear();
        after.extend_from_slice(before);
        // Two passes: whatever is deleted first may be added after, so adding wins.
        let fires = |e: &&PackedEffect| e.test.is_empty() || e.test.holds(before);
        for effect in operator.changes.iter().filter(fires) {
            effect.clear.iter().for_each(|&(word, bits)| after[word as usize] &= !bits);
        }
        for effect in operator.changes.iter().filter(fires) {
            effect.set.iter().for_each(|&(word, bits)| after[word as usize] |= bits);
        }
        self.axioms.complete(after);
    }

    /// How many atoms can change, derived ones included.
    pub fn n_atoms(&self) -> usize {
        self.atoms.len()
    }

    /// How many ground actions there are.
    pub fn n_actions(&self) -> usize {
        self.operators.len()
    }
}

impl Operator {
    /// Whether the precondition holds.
    pub(crate) fn applicable(&self, state: &[u64]) -> bool {
        self.test.holds(state)
    }
}

/// Refuses tasks whose atoms cannot be numbered by mixed radix.
fn check_sizes(
    domain: &Domain,
    symbols: &Symbols<'_>,
    limits: &GroundingLimits,
) -> Result<(), TaskError> {
    let (n_objects, n_predicates) =
        (symbols.objects.len() as u128, symbols.predicates.len() as u128);
    let fits = domain.predicates.iter().all(|p| {
        let n_args = u32::try_from(p.params.len()).unwrap_or(u32::MAX);
        n_objects.checked_pow(n_args).and_then(|n| n.checked_mul(n_predicates)).is_some()
    });
    if fits {
        Ok(())
    } else {
        Err(TaskError::limit("grounding.atoms_max", limits.atoms_max as u64))
    }
}

/// Who changes each predicate.
pub(crate) fn kinds(domain: &Domain, symbols: &Symbols<'_>) -> Vec<Kind> {
    fn mark(effect: &Effect, symbols: &Symbols<'_>, kinds: &mut [Kind]) {
        match effect {
            Effect::And(parts) => parts.iter().for_each(|p| mark(p, symbols, kinds)),
            Effect::Add(literal) | Effect::Delete(literal) => {
                if let Some(predicate) = symbols.predicate(&literal.predicate) {
                    kinds[predicate as usize] = Kind::Fluent;
                }
            }
            Effect::When(_, inner) | Effect::Forall(_, inner) => mark(inner, symbols, kinds),
            Effect::Cost(_) => {}
        }
    }
    let mut kinds = vec![Kind::Static; symbols.predicates.len()];
    domain.actions.iter().for_each(|action| mark(&action.effect, symbols, &mut kinds));
    for axiom in &domain.axioms {
        if let Some(predicate) = symbols.predicate(&axiom.head.name) {
            kinds[predicate as usize] = Kind::Derived;
        }
    }
    kinds
}

/// The facts with numbers in place of names.
fn numbered(
    facts: &BTreeSet<Atom>,
    symbols: &Symbols<'_>,
) -> Result<Vec<(u32, Vec<u32>)>, TaskError> {
    let known = |id: Option<u32>, name: &Name| {
        id.ok_or_else(|| TaskError::UnknownName { name: name.clone() })
    };
    let number = |atom: &Atom| {
        let predicate = known(symbols.predicate(&atom.predicate), &atom.predicate)?;
        let args = atom.args.iter().map(|a| known(symbols.object(a), a));
        Ok((predicate, args.collect::<Result<_, _>>()?))
    };
    facts.iter().map(number).collect()
}

/// Instantiates actions, goal and, as far as they are asked for, rules.
fn draft(
    input: &TaskInput<'_>,
    symbols: &Symbols<'_>,
    statics: &[(u32, Vec<u32>)],
    grounder: &mut Grounder<'_>,
    limits: &GroundingLimits,
) -> Result<Draft, TaskError> {
    let mut relations: Vec<Relation> = Vec::new();
    relations.resize_with(symbols.predicates.len(), Relation::default);
    for (predicate, args) in statics {
        relations[*predicate as usize].push(args.clone());
    }
    let goal = Compiler::new(symbols).goal(input.goal)?;
    let schemas = input.domain.actions.iter().map(|a| Compiler::new(symbols).action(a));
    let schemas = schemas.collect::<Result<Vec<_>, _>>()?;
    let rules = input.domain.axioms.iter().map(|axiom| Compiler::new(symbols).rule(axiom));
    let rules = rules.collect::<Result<Vec<_>, _>>()?;
    let mut mentions = Mentions::new(symbols.predicates.len());
    mentions.condition(&goal.condition);
    for rule in &rules {
        mentions.condition(&rule.condition);
    }
    for schema in &schemas {
        mentions.condition(&schema.condition);
        mentions.effect(&schema.result);
    }
    let goal = grounder.condition(&goal.condition, &mut vec![0; goal.n_slots], true)?;
    let mut actions = Vec::new();
    for (idx, schema) in schemas.iter().enumerate() {
        let seeds = mentions.seeds(schema);
        for args in instances(schema, &seeds, &relations, grounder)? {
            actions.extend(ground_action(idx, schema, args, grounder)?);
            if actions.len() > limits.actions_max {
                return Err(TaskError::limit("grounding.actions_max", limits.actions_max as u64));
            }
        }
    }
    let rules = ground_rules(&rules, grounder)?;
    Ok(Draft { actions, rules, goal })
}

/// One action, unless its precondition cannot hold or it changes nothing.
fn ground_action(
    idx: usize,
    schema: &Schema<SlotEffect>,
    args: Vec<u32>,
    grounder: &mut Grounder<'_>,
) -> Result<Option<DraftAction>, TaskError> {
    let mut binding = binding_of(&args, schema.n_slots);
    let precondition = grounder.condition(&schema.condition, &mut binding, true)?;
    if precondition == Formula::False {
        return Ok(None);
    }
    let mut out = (Vec::new(), GroundCost::default());
    grounder.effect(&schema.result, &mut binding, &Formula::True, &mut out)?;
    let (effects, cost) = out;
    Ok(Some(DraftAction { schema: idx, args, precondition, effects, cost }))
}

/// The rules of every derived atom that some condition mentions, directly or through rules.
fn ground_rules(
    schemas: &[Schema<u32>],
    grounder: &mut Grounder<'_>,
) -> Result<Vec<(u32, Formula)>, TaskError> {
    let mut rules = Vec::new();
    let mut next = 0;
    while let Some((predicate, args)) = grounder.atoms.get(next).cloned() {
        for schema in schemas.iter().filter(|s| s.result == predicate) {
            let fits = args.iter().zip(&schema.params).all(|(arg, range)| range.contains(arg));
            if fits {
                let mut binding = binding_of(&args, schema.n_slots);
                let body = grounder.condition(&schema.condition, &mut binding, true)?;
                if body != Formula::False {
                    rules.push((next as u32, body));
                }
            }
        }
        next += 1;
    }
    Ok(rules)
}
