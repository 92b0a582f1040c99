//! Small random tasks: propositions, nested conditions, conditional effects, derived atoms.

use proptest::prelude::*;

use super::*;

/// Propositions that actions change.
pub(super) const N_ATOMS: usize = 5;

/// A random task: every action is without parameters.
#[derive(Debug, Clone)]
pub(super) struct RandomTask {
    pub(super) text: String,
    pub(super) goal: String,
    /// Bits of two states.
    pub(super) states: [usize; 2],
    /// How often each action has failed.
    pub(super) failures: Vec<u32>,
}

impl RandomTask {
    pub(super) fn domain(&self) -> Arc<Domain> {
        domain(&self.text)
    }

    pub(super) fn goal(&self, domain: &Domain) -> Condition {
        goal(&self.goal, domain, &[])
    }

    pub(super) fn failures(&self) -> BTreeMap<Step, u32> {
        let step = |idx: usize| Step::new(&format!("a{idx}"), &[]);
        let failed = self.failures.iter().enumerate().filter(|(_, n)| **n > 0);
        failed.map(|(idx, n)| (step(idx), *n)).collect()
    }
}

/// The state of which the given bits hold.
pub(super) fn state(bits: usize) -> State {
    let holds = |idx: &usize| bits >> idx & 1 == 1;
    (0..N_ATOMS).filter(holds).map(|idx| Atom::new(&format!("p{idx}"), &[])).collect()
}

fn literal(names: &'static [&'static str]) -> impl Strategy<Value = String> {
    (prop::sample::select(names), any::<bool>()).prop_map(|(name, positive)| {
        if positive { format!("({name})") } else { format!("(not ({name}))") }
    })
}

const BASIC: &[&str] = &["p0", "p1", "p2", "p3", "p4"];
const ALL: &[&str] = &["p0", "p1", "p2", "p3", "p4", "d0", "d1"];

fn condition(names: &'static [&'static str]) -> impl Strategy<Value = String> {
    let conjunction = |parts: Vec<String>| format!("(and {})", parts.join(" "));
    prop_oneof![
        3 => prop::collection::vec(literal(names), 1..4).prop_map(conjunction),
        1 => (prop::collection::vec(literal(names), 2..4), literal(names))
            .prop_map(|(parts, other)| format!("(and {other} (or {}))", parts.join(" "))),
    ]
}

fn effect(names: &'static [&'static str], conditional: u32) -> impl Strategy<Value = String> {
    let simple = literal(BASIC);
    let guarded = (condition(names), literal(BASIC)).prop_map(|(c, e)| format!("(when {c} {e})"));
    let one = prop_oneof![4 => simple.boxed(), conditional => guarded.boxed()];
    prop::collection::vec(one, 1..4).prop_map(|parts| format!("(and {})", parts.join(" ")))
}

/// Tasks with derived atoms and conditional effects, or plain ones.
pub(super) fn tasks(plain: bool) -> impl Strategy<Value = RandomTask> {
    let names = if plain { BASIC } else { ALL };
    let action = (condition(names), effect(names, u32::from(!plain)));
    let rules = (condition(BASIC), condition(&["p0", "p1", "p2", "p3", "p4", "d0"]));
    let actions = prop::collection::vec(action, 1..7);
    let failures = prop::collection::vec(prop_oneof![2 => Just(0), 1 => 1..3_u32], 7);
    let states = prop::array::uniform2(0..1_usize << N_ATOMS);
    (actions, rules, condition(names), states, failures).prop_map(
        move |(actions, rules, goal, states, failures)| {
            let actions = actions.iter().enumerate().map(|(idx, (precondition, effect))| {
                format!(
                    "(:action a{idx} :parameters () :precondition {precondition} :effect {effect})"
                )
            });
            let actions: String = actions.collect();
            let rules = format!("(:derived (d0) {}) (:derived (d1) {})", rules.0, rules.1);
            let rules = if plain { "" } else { rules.as_str() };
            let predicates = format!("({})", ALL.join(") ("));
            let text =
                format!("(define (domain random) (:predicates {predicates}) {rules} {actions})");
            RandomTask { text, goal, states, failures }
        },
    )
}

/// Penalised cost to the goal of every state, by relaxing all transitions until nothing changes.
pub(super) fn distances(
    domain: &Domain,
    goal: &Condition,
    failures: &BTreeMap<Step, u32>,
) -> Vec<Option<u64>> {
    let n_states = 1 << N_ATOMS;
    let mut distances: Vec<Option<u64>> =
        (0..n_states).map(|bits| holds(domain, &[], &state(bits), goal).then_some(0)).collect();
    let mut transitions = Vec::new();
    for bits in 0..n_states {
        for action in &domain.actions {
            let step = Step { action: action.name.clone(), args: Vec::new() };
            let cost = 1 + u64::from(failures.get(&step).copied().unwrap_or(0) * PENALTY);
            if let Some(after) = successor(domain, &[], &state(bits), &step) {
                let after = (0..n_states).find(|&other| state(other) == after).unwrap();
                transitions.push((bits, after, cost));
            }
        }
    }
    loop {
        let before = distances.clone();
        for &(from, to, cost) in &transitions {
            if let Some(rest) = distances[to] {
                let through = rest + cost;
                distances[from] = Some(distances[from].map_or(through, |known| known.min(through)));
            }
        }
        if before == distances {
            return distances;
        }
    }
}
