//! The world that the scenes show: states of a problem, changed by interpreting the domain. It
//! shares nothing with the planner that is measured.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng as _;

use crate::logic::{Bindings, Demand, Facts, Universe, bind, effects, evaluate};
use crate::pddl::{Action, Atom, Domain, Name, Problem, Step, Typed};

/// How many random tuples are tried before all of them are looked through.
const TRIES: usize = 4000;

/// A problem with a current state.
#[derive(Debug, Clone)]
pub(super) struct World<'a> {
    domain: &'a Domain,
    /// Constants included.
    objects: Vec<Typed>,
    /// For each action and parameter, the objects that may stand there.
    ranges: Vec<Vec<Vec<Name>>>,
    /// What holds.
    pub(super) facts: Facts,
}

impl<'a> World<'a> {
    /// The problem's world in its first state.
    pub(super) fn new(domain: &'a Domain, problem: &Problem) -> Self {
        let known = |o: &&Typed| domain.constants.iter().all(|c| c.name != o.name);
        let mut objects = domain.constants.clone();
        objects.extend(problem.objects.iter().filter(known).cloned());
        let universe = Universe { types: &domain.types, objects: &objects };
        let range = |param: &Typed| universe.of(&param.types).cloned().collect();
        let ranges = |action: &Action| action.params.iter().map(range).collect();
        let ranges = domain.actions.iter().map(ranges).collect();
        Self { domain, objects, ranges, facts: Facts::new(problem.init.clone()) }
    }

    /// All objects, constants included.
    pub(super) fn objects(&self) -> &[Typed] {
        &self.objects
    }

    /// Takes a step, if it can be taken.
    pub(super) fn take(&mut self, step: &Step) -> bool {
        let Some(action) = self.domain.action(step.action.as_str()) else { return false };
        let Some(bindings) = bind(action, &step.args) else { return false };
        self.apply(action, &bindings)
    }

    fn apply(&mut self, action: &Action, bindings: &Bindings) -> bool {
        let universe = Universe { types: &self.domain.types, objects: &self.objects };
        let derived = Demand::new(&self.domain.axioms, universe, &self.facts);
        let truth = |atom: &Atom| derived.truth(atom);
        if !evaluate(&action.precondition, bindings, &universe, &truth).is_true() {
            return false;
        }
        let changes = effects(action, bindings, &universe, &truth);
        self.facts = changes.apply(&self.facts);
        true
    }

    /// Takes a random step; `false` when there is none.
    pub(super) fn take_any(&mut self, rng: &mut ChaCha8Rng) -> bool {
        let usable: Vec<usize> = (0..self.ranges.len())
            .filter(|&a| self.ranges[a].iter().all(|range| !range.is_empty()))
            .collect();
        if usable.is_empty() {
            return false;
        }
        for _ in 0..TRIES {
            let action = usable[below(rng, usable.len())];
            let ranges = &self.ranges[action];
            let args = ranges.iter().map(|range| range[below(rng, range.len())].clone());
            let args: Vec<Name> = args.collect();
            if self.try_args(action, &args) {
                return true;
            }
        }
        usable.iter().any(|&action| self.take_first(action, &mut Vec::new()))
    }

    fn try_args(&mut self, action: usize, args: &[Name]) -> bool {
        let action = &self.domain.actions[action];
        bind(action, args).is_some_and(|bindings| self.apply(action, &bindings))
    }

    /// Takes the first step of an action that can be taken.
    fn take_first(&mut self, action: usize, args: &mut Vec<Name>) -> bool {
        let Some(range) = self.ranges[action].get(args.len()).cloned() else {
            return self.try_args(action, args);
        };
        range.into_iter().any(|name| {
            args.push(name);
            let taken = self.take_first(action, args);
            args.pop();
            taken
        })
    }

    /// Takes `n` random steps.
    pub(super) fn random_walk(&mut self, n: u32, rng: &mut ChaCha8Rng) {
        for _ in 0..n {
            if !self.take_any(rng) {
                break;
            }
        }
    }
}

/// A number below `n`, which must not be 0.
pub(super) fn below(rng: &mut ChaCha8Rng, n: usize) -> usize {
    (rng.next_u64() % n.max(1) as u64) as usize
}
