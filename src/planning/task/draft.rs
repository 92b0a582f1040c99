//! The task before packing: every instance of actions, rules and goal that can matter.

use super::formula::Formula;
use super::ground::Grounder;
use super::instance::{DraftAction, ground_action};
use super::instantiate::{Relation, binding_of, instances};
use super::lowering::{LiftedAction, LiftedRule, Lowering, Symbols};
use super::reach::reachable;
use super::seeds::Mentions;
use super::{Fact, TaskError, TaskInput};
use crate::planning::GroundingLimits;

/// A task before packing; atoms have the grounder's numbers.
pub(super) struct Draft {
    pub(super) actions: Vec<DraftAction>,
    pub(super) rules: Vec<(u32, Formula)>,
    pub(super) goal: Formula,
}

impl Draft {
    /// Replaces literals everywhere and drops what can no longer happen.
    pub(super) fn replace(&mut self, literal: &impl Fn(u32, bool) -> Formula) {
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

/// Instantiates actions, goal and, as far as they are asked for, rules; with `fluents`, the facts that
/// actions change, those actions alone that are reachable from them.
pub(super) fn draft(
    input: &TaskInput<'_>,
    symbols: &Symbols<'_>,
    (statics, fluents): (&[Fact], Option<&[Fact]>),
    grounder: &mut Grounder<'_>,
    limits: &GroundingLimits,
) -> Result<Draft, TaskError> {
    let mut relations: Vec<Relation> = Vec::new();
    relations.resize_with(symbols.predicates.len(), Relation::default);
    for (predicate, args) in statics {
        relations[*predicate as usize].push(args.clone());
    }
    let goal = Lowering::new(symbols).goal(input.goal)?;
    let schemas = input.domain.actions.iter().map(|a| Lowering::new(symbols).action(a));
    let schemas = schemas.collect::<Result<Vec<_>, _>>()?;
    let rules = input.domain.axioms.iter().map(|axiom| Lowering::new(symbols).rule(axiom));
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
    let actions = match fluents {
        Some(fluents) => reachable(&schemas, (&mentions, fluents), relations, grounder, limits)?,
        None => all_instances(&schemas, &mentions, &relations, grounder, limits)?,
    };
    let rules = ground_rules(&rules, grounder)?;
    Ok(Draft { actions, rules, goal })
}

/// Every instance whose static preconditions hold.
fn all_instances(
    schemas: &[LiftedAction],
    mentions: &Mentions,
    relations: &[Relation],
    grounder: &mut Grounder<'_>,
    limits: &GroundingLimits,
) -> Result<Vec<DraftAction>, TaskError> {
    let mut actions = Vec::new();
    for (idx, schema) in schemas.iter().enumerate() {
        let seeds = mentions.seeds(schema);
        for args in instances(schema, &seeds, relations, grounder)? {
            actions.extend(ground_action(idx, schema, args, grounder)?);
            if actions.len() > limits.actions_max {
                return Err(TaskError::limit("grounding.actions_max", limits.actions_max as u64));
            }
        }
    }
    Ok(actions)
}

/// The rules of every derived atom that some condition mentions, directly or through rules.
fn ground_rules(
    lifted: &[LiftedRule],
    grounder: &mut Grounder<'_>,
) -> Result<Vec<(u32, Formula)>, TaskError> {
    let mut rules = Vec::new();
    let mut next = 0;
    while let Some((predicate, args)) = grounder.atoms.get(next).cloned() {
        for schema in lifted.iter().filter(|s| s.result == predicate) {
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
