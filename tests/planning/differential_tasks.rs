//! Random small tasks of any domain, and brute force over them by direct interpretation.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::rc::Rc;

use groundloop::logic::{Bindings, Facts, Universe, bind, derive, effects, evaluate};
use groundloop::pddl::{Atom, Condition, Domain, Literal, Name, Problem, Step, Term, Typed};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// Most objects of a shipped problem that tasks are made from.
const OBJECTS_MAX: usize = 8;
/// Most objects of an arbitrary task.
const ARBITRARY_OBJECTS_MAX: usize = 6;
/// Most steps of a random walk.
const WALK_STEPS_MAX: usize = 12;
/// Most parts of a goal.
const GOAL_PARTS_MAX: usize = 3;

/// What brute force has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Brute {
    /// The number of steps of a shortest plan.
    Cheapest(u64),
    /// No state that can be reached has the goal.
    Unsolvable,
    /// There are more states than it looks at.
    TooMany,
}

/// The states of some objects, with what can be done in them; worked out as they are asked for,
/// and kept, since many tasks have the same objects.
struct Space {
    domain: Domain,
    objects: Vec<Typed>,
    steps: Vec<Step>,
    next: RefCell<BTreeMap<State, Rc<Vec<State>>>>,
}

type State = BTreeSet<Atom>;

/// One random task.
pub(crate) struct SmallTask {
    pub(crate) problem: Problem,
    space: Rc<Space>,
}

/// An endless row of random tasks of one domain.
pub(crate) struct Tasks<'a> {
    domain: &'a Domain,
    /// Shipped problems that are small enough, with their spaces.
    shipped: Vec<(Problem, Rc<Space>)>,
    dice: ChaCha8Rng,
}

impl<'a> Tasks<'a> {
    pub(crate) fn new(domain: &'a Domain, shipped: Vec<Problem>, seed: u64) -> Self {
        let small = shipped.into_iter().filter(|problem| problem.objects.len() <= OBJECTS_MAX);
        let shipped = small.map(|problem| {
            let space = Rc::new(Space::new(domain, &problem.objects));
            (problem, space)
        });
        let shipped: Vec<_> = shipped.collect();
        assert!(!shipped.is_empty(), "no shipped problem is small enough");
        Self { domain, shipped, dice: ChaCha8Rng::seed_from_u64(seed) }
    }

    fn below(&mut self, n: usize) -> usize {
        (self.dice.next_u64() % n as u64) as usize
    }

    /// A state of a shipped problem with a goal that can be reached from there, or any goal.
    fn walked(&mut self) -> SmallTask {
        let at = self.below(self.shipped.len());
        let (problem, space) = self.shipped[at].clone();
        let init = self.walk(&space, problem.init.clone());
        let reached = self.walk(&space, init.clone());
        let goal =
            if self.below(2) == 0 { self.goal_in(&space, &reached) } else { self.any_goal(&space) };
        self.task(&space, init, goal)
    }

    /// Any objects, any facts, any goal: nothing has to make sense.
    fn arbitrary(&mut self) -> SmallTask {
        let types: Vec<Name> = self.domain.known_types().into_iter().collect();
        let objects = (0..=self.below(ARBITRARY_OBJECTS_MAX)).map(|number| {
            let type_name = types[self.below(types.len())].clone();
            Typed::new(Name::new(format!("{type_name}{number}")), type_name)
        });
        let objects: Vec<Typed> = objects.collect();
        let space = Rc::new(Space::new(self.domain, &objects));
        let share = 1 + self.below(3);
        let atoms = space.atoms();
        let init = atoms.into_iter().filter(|_| self.below(4) < share).collect();
        let goal = self.any_goal(&space);
        self.task(&space, init, goal)
    }

    fn task(&mut self, space: &Rc<Space>, init: State, goal: Condition) -> SmallTask {
        let constants = &self.domain.constants;
        let known = |o: &&Typed| constants.iter().all(|c| c.name != o.name);
        let problem = Problem {
            name: "small".into(),
            domain: self.domain.name.clone(),
            objects: space.objects.iter().filter(known).cloned().collect(),
            init,
            costs: BTreeMap::new(),
            goal,
            minimise_cost: false,
        };
        SmallTask { problem, space: Rc::clone(space) }
    }

    fn walk(&mut self, space: &Space, mut state: State) -> State {
        for _ in 0..self.below(WALK_STEPS_MAX + 1) {
            let next = space.next(&state);
            if next.is_empty() {
                break;
            }
            state.clone_from(&next[self.below(next.len())]);
        }
        state
    }

    /// Some of what holds and of what does not hold in a state.
    fn goal_in(&mut self, space: &Space, state: &State) -> Condition {
        let atoms = space.atoms();
        let parts = (0..=self.below(GOAL_PARTS_MAX)).map(|_| {
            // Most atoms are false in most states.
            let holding: Vec<&Atom> = atoms.iter().filter(|atom| state.contains(atom)).collect();
            let from_holding = self.below(4) > 0 && !holding.is_empty();
            let atom = if from_holding {
                holding[self.below(holding.len())]
            } else {
                &atoms[self.below(atoms.len())]
            };
            literal(atom, state.contains(atom))
        });
        Condition::And(parts.collect())
    }

    fn any_goal(&mut self, space: &Space) -> Condition {
        let atoms = space.atoms();
        if atoms.is_empty() {
            return Condition::True;
        }
        let parts = (0..=self.below(GOAL_PARTS_MAX)).map(|_| {
            let atom = &atoms[self.below(atoms.len())];
            let value = self.below(4) > 0;
            literal(atom, value)
        });
        let parts = parts.collect();
        if self.below(4) == 0 { Condition::Or(parts) } else { Condition::And(parts) }
    }
}

impl Iterator for Tasks<'_> {
    type Item = SmallTask;

    fn next(&mut self) -> Option<SmallTask> {
        Some(if self.below(4) > 0 { self.walked() } else { self.arbitrary() })
    }
}

fn literal(atom: &Atom, value: bool) -> Condition {
    let args = atom.args.iter().cloned().map(Term::Object).collect();
    let holds = Condition::Atom(Literal { predicate: atom.predicate.clone(), args });
    if value { holds } else { Condition::Not(Box::new(holds)) }
}

impl Space {
    fn new(domain: &Domain, objects: &[Typed]) -> Self {
        let mut all = domain.constants.clone();
        let known = |o: &&Typed| domain.constants.iter().all(|c| c.name != o.name);
        all.extend(objects.iter().filter(known).cloned());
        let mut space = Self {
            domain: domain.clone(),
            objects: all,
            steps: Vec::new(),
            next: RefCell::default(),
        };
        for action in &domain.actions {
            let tuples = space.tuples(&action.params).into_iter();
            let step = |args| Step { action: action.name.clone(), args };
            space.steps.extend(tuples.map(step).collect::<Vec<_>>());
        }
        space
    }

    fn universe(&self) -> Universe<'_> {
        Universe { types: &self.domain.types, objects: &self.objects }
    }

    fn tuples(&self, params: &[Typed]) -> Vec<Vec<Name>> {
        let mut tuples: Vec<Vec<Name>> = vec![vec![]];
        for param in params {
            let extended = tuples.iter().flat_map(|tuple| {
                let universe = self.universe();
                let objects: Vec<Name> = universe.of(&param.types).cloned().collect();
                objects.into_iter().map(|o| [tuple.clone(), vec![o]].concat()).collect::<Vec<_>>()
            });
            tuples = extended.collect();
        }
        tuples
    }

    /// Every atom of a predicate that is not derived.
    fn atoms(&self) -> Vec<Atom> {
        let mut atoms = Vec::new();
        for predicate in &self.domain.predicates {
            if self.domain.axioms.iter().all(|axiom| axiom.head.name != predicate.name) {
                let tuples = self.tuples(&predicate.params).into_iter();
                atoms.extend(tuples.map(|args| Atom { predicate: predicate.name.clone(), args }));
            }
        }
        atoms
    }

    /// The states that one step leads to.
    fn next(&self, state: &State) -> Rc<Vec<State>> {
        if let Some(known) = self.next.borrow().get(state) {
            return Rc::clone(known);
        }
        let universe = self.universe();
        let facts = derive(&self.domain.axioms, &universe, &Facts::new(state.clone()));
        let truth = |atom: &Atom| facts.truth(atom);
        let mut found = BTreeSet::new();
        for step in &self.steps {
            let action = self.domain.action(step.action.as_str()).unwrap();
            let bindings = bind(action, &step.args).unwrap();
            if evaluate(&action.precondition, &bindings, &universe, &truth).is_true() {
                let changes = effects(action, &bindings, &universe, &truth);
                found.insert(changes.apply(&Facts::new(state.clone())).known);
            }
        }
        found.remove(state);
        let found = Rc::new(found.into_iter().collect::<Vec<_>>());
        self.next.borrow_mut().insert(state.clone(), Rc::clone(&found));
        found
    }

    fn holds(&self, goal: &Condition, state: &State) -> bool {
        let universe = self.universe();
        let facts = derive(&self.domain.axioms, &universe, &Facts::new(state.clone()));
        evaluate(goal, &Bindings::new(), &universe, &|atom| facts.truth(atom)).is_true()
    }
}

impl SmallTask {
    /// Breadth-first search over interpreted states.
    pub(crate) fn brute_force(&self, states_max: usize) -> Brute {
        let mut seen = BTreeSet::from([self.problem.init.clone()]);
        let mut open = VecDeque::from([(self.problem.init.clone(), 0)]);
        while let Some((state, length)) = open.pop_front() {
            if self.space.holds(&self.problem.goal, &state) {
                return Brute::Cheapest(length);
            }
            for next in self.space.next(&state).iter() {
                if seen.len() >= states_max {
                    return Brute::TooMany;
                }
                if seen.insert(next.clone()) {
                    open.push_back((next.clone(), length + 1));
                }
            }
        }
        Brute::Unsolvable
    }
}
