//! The cascade's laws on small random tasks, against brute force by direct interpretation.

mod laws;
mod memory;
mod random;
mod replanner;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::*;
use crate::logic::{Bindings, Facts, Truth, Universe, bind, derive, effects, evaluate};
use crate::messages::{PlanSource, Reuse};
use crate::pddl::{
    Atom, Condition, Domain, Name, SourceText, Step, Typed, parse_domain, parse_goal,
};
use crate::planning::{
    Budget, GroundingLimits, NO_PENALTIES, Outcome, PlanAnswer, PlanRequest, TaskError, validate,
};

/// Atoms that hold.
type State = BTreeSet<Atom>;

const PENALTY: u32 = 3;

fn domain(text: &str) -> Arc<Domain> {
    let parsed = parse_domain(&SourceText::new("domain", text));
    Arc::new(parsed.unwrap_or_else(|e| panic!("{}", e.render())).value)
}

fn goal(text: &str, domain: &Domain, objects: &[Typed]) -> Condition {
    let parsed = parse_goal(&SourceText::new("goal", text), domain, objects);
    parsed.unwrap_or_else(|e| panic!("{}", e.render()))
}

fn settings(reuse: Reuse, sources: &[PlanSource]) -> CascadeSettings {
    CascadeSettings {
        reuse,
        sources: sources.iter().copied().collect(),
        failure_penalty: PENALTY,
        table: TableLimits { states_max: 10_000, bytes_max: 1 << 24 },
        grounding: GroundingLimits::standard(),
        reference_states: Vec::new(),
    }
}

/// A cascade with somebody who searches for it.
struct Desk {
    domain: Arc<Domain>,
    objects: Vec<Typed>,
    cascade: Cascade,
    failures: BTreeMap<Step, u32>,
    budget: Budget,
    n_searches: u32,
}

impl Desk {
    fn new(
        domain: &Arc<Domain>,
        objects: &[Typed],
        goal: Condition,
        settings: CascadeSettings,
    ) -> Self {
        Self {
            domain: Arc::clone(domain),
            objects: objects.to_vec(),
            cascade: Cascade::new(Arc::clone(domain), goal, Arc::new(settings)),
            failures: BTreeMap::new(),
            budget: Budget::standard(),
            n_searches: 0,
        }
    }

    fn observe(&mut self, state: &State) -> Result<(), TaskError> {
        let objects = self.objects.iter().map(|o| (&o.name, &o.types[0]));
        let facts = state.iter().map(|atom| (atom, Truth::True));
        self.cascade.observe(objects, facts).map_err(Clone::clone)
    }

    /// The answer to a state.
    fn ask(&mut self, state: &State) -> CascadeReply {
        self.observe(state).unwrap();
        let reply = match self.cascade.query(&self.failures) {
            CascadeResult::Reply(reply) => reply,
            CascadeResult::Search => {
                self.n_searches += 1;
                let answer = self.search(state);
                self.cascade.accept(answer, &self.failures)
            }
        };
        self.cascade.prepare();
        reply
    }

    fn search(&self, state: &State) -> PlanAnswer {
        let (observed_task, _) = self.cascade.grounded().unwrap();
        let penalties = self.failures.iter().map(|(step, n)| (step.clone(), n * PENALTY)).collect();
        observed_task.solver.solve(state, &penalties, &self.budget, &|| false)
    }

    /// Builds the table that is wanted, if one is.
    fn build_table(&mut self) -> Option<TableEnd> {
        let job = self.cascade.wanted_table()?;
        let end = job.run(&|| false);
        self.cascade.adopt_table(&job, end.clone());
        Some(end)
    }

    /// The steps of an answer, checked by the validator.
    #[track_caller]
    fn checked(&self, state: &State, suffix: &PlanSuffix) -> Vec<Step> {
        let steps = self.cascade.steps(suffix);
        let request = PlanRequest {
            objects: &self.objects,
            init: state,
            goal: self.cascade.goal(),
            costs: &BTreeMap::new(),
            minimise_cost: false,
            penalties: &NO_PENALTIES,
        };
        let verdict = validate(&self.domain, &request, &steps);
        assert!(verdict.is_valid(), "{verdict:?}\n{steps:?}\n{state:?}");
        assert_eq!(suffix.cost, steps.len() as u64);
        steps
    }

    /// The steps of the answer to a state, and who gave it.
    #[track_caller]
    fn plan(&mut self, state: &State) -> (PlanSource, Vec<Step>) {
        let reply = self.ask(state);
        let CascadeEnd::Plan(suffix) = &reply.end else { panic!("{reply:?}") };
        (reply.source, self.checked(state, suffix))
    }

    /// The state after a step, which must be possible.
    #[track_caller]
    fn after(&self, state: &State, step: &Step) -> State {
        successor(&self.domain, &self.objects, state, step).unwrap()
    }
}

/// The state after a step, derived atoms left out; `None` when the step is not possible.
fn successor(domain: &Domain, objects: &[Typed], state: &State, step: &Step) -> Option<State> {
    let universe = Universe { types: &domain.types, objects };
    let derived = |state: &State| {
        let basic = state.iter().filter(|atom| !is_derived(domain, atom)).cloned().collect();
        derive(&domain.axioms, &universe, &Facts::new(basic))
    };
    let facts = derived(state);
    let action = domain.action(step.action.as_str()).unwrap();
    let bindings = bind(action, &step.args).unwrap();
    let truth = |atom: &Atom| facts.truth(atom);
    if !evaluate(&action.precondition, &bindings, &universe, &truth).is_true() {
        return None;
    }
    let after = effects(action, &bindings, &universe, &truth).apply(&facts).known;
    Some(after.into_iter().filter(|atom| !is_derived(domain, atom)).collect())
}

fn is_derived(domain: &Domain, atom: &Atom) -> bool {
    domain.axioms.iter().any(|axiom| axiom.head.name == atom.predicate)
}

fn holds(domain: &Domain, objects: &[Typed], state: &State, condition: &Condition) -> bool {
    let universe = Universe { types: &domain.types, objects };
    let facts = derive(&domain.axioms, &universe, &Facts::new(state.clone()));
    evaluate(condition, &Bindings::new(), &universe, &|atom: &Atom| facts.truth(atom)).is_true()
}
