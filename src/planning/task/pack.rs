//! From a draft over the grounder's numbers to packed masks.

use std::collections::{BTreeMap, BTreeSet};

use super::axioms::{Axioms, RuleSet};
use super::draft::Draft;
use super::formula::{Formula, Test};
use super::ground::{GroundEffect, Grounder};
use super::instance::DraftAction;
use super::lowering::Symbols;
use super::operator::{Operator, PackedEffect};
use super::predicate_kind::PredicateKind;
use super::successors::Successors;
use super::{Task, TaskError, TaskInput, costs, prune};
use crate::logic::{CostError, cost_of};
use crate::pddl::{Atom, Name, Number, Step, stratify};

/// Turns a draft into a task: renumbers the atoms that matter and packs everything.
pub(super) struct Packing<'a> {
    pub(super) input: &'a TaskInput<'a>,
    pub(super) symbols: &'a Symbols<'a>,
    pub(super) grounder: &'a Grounder<'a>,
}

impl Packing<'_> {
    /// Packs a draft.
    pub(super) fn pack(&self, mut draft: Draft) -> Result<Task, TaskError> {
        let n_before = self.grounder.atoms.len();
        let relevant = prune::irrelevant(&mut draft, n_before);
        let of_kind = |kind: PredicateKind| {
            (0..n_before as u32).filter(move |&a| relevant_kind(self.grounder, a) == kind)
        };
        let kept = of_kind(PredicateKind::Fluent).chain(of_kind(PredicateKind::Derived));
        let kept: Vec<u32> = kept.filter(|&a| relevant[a as usize]).collect();
        let is_fluent = |a: &&u32| relevant_kind(self.grounder, **a) == PredicateKind::Fluent;
        let n_fluents = kept.iter().filter(is_fluent).count() as u32;
        let mut number = vec![0; n_before];
        kept.iter().zip(0..).for_each(|(&old, new)| number[old as usize] = new);
        draft.replace(&|atom, wanted| Formula::literal(number[atom as usize], wanted));

        let atoms: Vec<Atom> = kept.iter().map(|&old| self.atom(old)).collect();
        let ids = atoms.iter().cloned().zip(0..).collect();
        let words = atoms.len().div_ceil(64).max(1);
        let rules = draft.rules.into_iter();
        let rules: Vec<(u32, Formula)> =
            rules.map(|(head, body)| (number[head as usize], body)).collect();
        let axioms = self.axioms(&rules, &atoms, n_fluents)?;
        let (costs, cost_unit) = costs::in_common_unit(&self.costs(&draft.actions)?)?;
        let operators = draft
            .actions
            .into_iter()
            .zip(costs)
            .map(|(action, cost)| self.operator(action, cost, &number));
        let operators: Vec<Operator> = operators.collect();
        let successors = Successors::new(&operators, atoms.len(), words);
        let goal_test = Test::new(&draft.goal);
        let recursive = recursive_heads(&rules, &atoms);
        let goal = draft.goal;
        Ok(Task {
            atoms,
            ids,
            words,
            operators,
            successors,
            goal,
            goal_test,
            rules,
            recursive,
            axioms,
            cost_unit,
        })
    }

    fn object(&self, object: u32) -> Name {
        self.symbols.objects[object as usize].name.clone()
    }

    fn atom(&self, number: u32) -> Atom {
        let (predicate, args) = &self.grounder.atoms[number as usize];
        let predicate = self.symbols.predicates[*predicate as usize].clone();
        Atom { predicate, args: args.iter().map(|&a| self.object(a)).collect() }
    }

    fn axioms(
        &self,
        rules: &[(u32, Formula)],
        atoms: &[Atom],
        n_fluents: u32,
    ) -> Result<Axioms, TaskError> {
        let axioms = &self.input.domain.axioms;
        let strata = stratify(axioms)?;
        let strata = strata.iter().map(|stratum| {
            let heads: BTreeSet<&Name> =
                stratum.rules.iter().map(|&idx| &axioms[idx].head.name).collect();
            let of_stratum =
                rules.iter().filter(|(head, _)| heads.contains(&atoms[*head as usize].predicate));
            let rules = of_stratum.map(|(head, body)| (*head, Test::new(body))).collect();
            RuleSet { rules, recursive: stratum.recursive }
        });
        Ok(Axioms::new(strata.collect(), n_fluents))
    }

    fn operator(&self, action: DraftAction, cost: u64, number: &[u32]) -> Operator {
        let DraftAction { action, args, precondition, mut effects, .. } = action;
        for (atom, _) in effects.iter_mut().flat_map(|e| &mut e.changes) {
            *atom = number[*atom as usize];
        }
        let step = Step {
            action: self.input.domain.actions[action].name.clone(),
            args: args.iter().map(|&a| self.object(a)).collect(),
        };
        let masks = |effect: &GroundEffect, added: bool| {
            let mut words: BTreeMap<u32, u64> = BTreeMap::new();
            for (atom, _) in effect.changes.iter().filter(|(_, a)| *a == added) {
                *words.entry(atom / 64).or_default() |= 1 << (atom % 64);
            }
            words.into_iter().collect()
        };
        let changes = effects.iter().map(|effect| PackedEffect {
            test: Test::new(&effect.condition),
            clear: masks(effect, false),
            set: masks(effect, true),
        });
        let changes = changes.collect();
        let test = Test::new(&precondition);
        Operator { step, cost, precondition, effects, test, changes }
    }

    /// What each action costs.
    fn costs(&self, actions: &[DraftAction]) -> Result<Vec<Number>, TaskError> {
        if !self.input.minimise_cost {
            return Ok(vec![Number::ONE; actions.len()]);
        }
        let value = |(name, args): &(Name, Vec<u32>)| {
            let args = args.iter().map(|&a| self.object(a)).collect();
            cost_of(&Atom { predicate: name.clone(), args }, self.input.costs)
        };
        let cost = |action: &DraftAction| {
            let numbers = action.cost.numbers.iter().map(|&number| Ok(number));
            let mut terms = numbers.chain(action.cost.functions.iter().map(value));
            terms.try_fold(Number::default(), |sum, term| {
                sum.checked_add(term?).ok_or(CostError::TooLarge)
            })
        };
        Ok(actions.iter().map(cost).collect::<Result<_, _>>()?)
    }
}

fn relevant_kind(grounder: &Grounder<'_>, atom: u32) -> PredicateKind {
    grounder.kind(grounder.atoms[atom as usize].0)
}

/// The heads whose predicate depends on itself, whatever the way.
fn recursive_heads(rules: &[(u32, Formula)], atoms: &[Atom]) -> BTreeSet<u32> {
    let predicate = |atom: u32| &atoms[atom as usize].predicate;
    let mut uses: BTreeMap<&Name, BTreeSet<&Name>> = BTreeMap::new();
    for (head, body) in rules {
        let used = uses.entry(predicate(*head)).or_default();
        body.each_literal(&mut |atom, _| {
            used.insert(predicate(atom));
        });
    }
    let reaches_itself = |head: &Name| {
        let mut seen = BTreeSet::new();
        let mut open = vec![head];
        while let Some(name) = open.pop() {
            let used = uses.get(name).into_iter().flatten().copied();
            open.extend(used.filter(|&next| seen.insert(next)));
        }
        seen.contains(head)
    };
    let recursive: BTreeSet<&Name> = uses.keys().copied().filter(|&h| reaches_itself(h)).collect();
    let heads = rules.iter().map(|(head, _)| *head);
    heads.filter(|&head| recursive.contains(predicate(head))).collect()
}
