//! What every source promises, on random tasks.

use proptest::prelude::*;

use super::random::{N_ATOMS, RandomTask, distances, state, tasks};
use super::*;
use crate::replanning::current_plan::{CurrentPlan, SuffixFound, leads_to_goal};
use crate::replanning::observed_task::statics_of;

fn price(steps: &[Step], failures: &BTreeMap<Step, u32>) -> u64 {
    let cost = |step| 1 + u64::from(failures.get(step).copied().unwrap_or(0) * PENALTY);
    steps.iter().map(cost).sum()
}

/// A table that knows the given states, built in one or two goes.
fn table(desk: &mut Desk, states: &[&State]) -> Arc<DistanceTable> {
    desk.observe(states[0]).unwrap();
    let (observed_task, _) = desk.cascade.grounded().unwrap();
    let observed_task = Arc::clone(observed_task);
    let task = observed_task.task();
    let penalties = desk.failures.iter().map(|(step, n)| (step.clone(), n * PENALTY)).collect();
    let costs: Arc<[u64]> =
        observed_task.solver.costs(&observed_task.solver.penalties(&penalties)).into();
    let mut base = None;
    for state in states {
        let limits = TableLimits { states_max: 10_000, bytes_max: 1 << 24 };
        let (observed_task, costs) = (Arc::clone(&observed_task), Arc::clone(&costs));
        let job = TableJob { start: task.state(state), observed_task, costs, base, limits };
        let TableEnd::Built(table) = job.run(&|| false) else { panic!("too large") };
        base = Some(table);
    }
    base.unwrap()
}

/// Two states; the second has the facts of the first that no action changes.
fn same_statics(domain: &Domain, states: [usize; 2]) -> [State; 2] {
    let [first, mut second] = states.map(state);
    let statics = statics_of(domain, state((1 << N_ATOMS) - 1).iter().map(|a| (a, Truth::True)));
    for idx in 0..N_ATOMS {
        let atom = Atom::new(&format!("p{idx}"), &[]);
        if statics.contains(&atom) {
            if first.contains(&atom) {
                second.insert(atom)
            } else {
                second.remove(&atom)
            };
        }
    }
    [first, second]
}

fn check_table(task: &RandomTask) {
    let domain = task.domain();
    let goal = task.goal(&domain);
    let failures = task.failures();
    let expected = distances(&domain, &goal, &failures);
    let mut desk = Desk::new(&domain, &[], goal, settings(Reuse::Valid, &PlanSource::ALL));
    desk.failures.clone_from(&failures);
    let [first, second] = same_statics(&domain, task.states);
    let extended = table(&mut desk, &[&first, &second]);
    let fresh = table(&mut desk, &[&second]);
    assert!(fresh.n_states() <= extended.n_states());
    desk.observe(&second).unwrap();
    let observed_task = Arc::clone(desk.cascade.grounded().unwrap().0);
    let mut n_known = 0;
    for (bits, expected) in expected.iter().enumerate() {
        let here = state(bits);
        desk.observe(&here).unwrap();
        let (now, packed) = desk.cascade.grounded().unwrap();
        if now.statics != observed_task.statics {
            continue; // what no action changes is otherwise there
        }
        let packed = packed.to_vec();
        if let Some(distance) = fresh.distance(&packed) {
            assert_eq!(extended.distance(&packed), Some(distance), "extension = fresh build");
            assert_eq!(extended.next_action(&packed), fresh.next_action(&packed));
        }
        let Some((distance, operators)) = extended.plan(&packed) else { continue };
        n_known += 1;
        assert_eq!(operators.first().copied(), extended.next_action(&packed));
        match (distance, *expected) {
            (Distance::Dead, None) => {}
            (Distance::Cost(cost), Some(expected)) => {
                assert_eq!(cost, expected, "{here:?}");
                let cost = operators.len() as u64;
                let suffix =
                    PlanSuffix { operators: operators.into(), at: 0, cost, proven_optimal: true };
                assert_eq!(price(&desk.checked(&here, &suffix), &failures), expected);
            }
            other => panic!("{other:?} for {here:?}"),
        }
    }
    assert!(n_known >= extended.n_states(), "every state that the table knows was looked at");
}

/// A cascade that is asked for one state after the other.
fn check_queries(task: &RandomTask, reuse: Reuse, sources: &[PlanSource], states: &[usize]) {
    let domain = task.domain();
    let goal = task.goal(&domain);
    let mut desk = Desk::new(&domain, &[], goal.clone(), settings(reuse, sources));
    let mut expected = distances(&domain, &goal, &desk.failures);
    for (idx, &bits) in states.iter().enumerate() {
        if idx == states.len() / 2 {
            desk.failures = task.failures();
            expected = distances(&domain, &goal, &desk.failures);
        }
        let here = state(bits);
        let reply = desk.ask(&here);
        let allowed =
            [PlanSource::Goal, PlanSource::Unchanged, PlanSource::Search].contains(&reply.source);
        assert!(allowed || sources.contains(&reply.source), "{reply:?}");
        match (&reply.end, expected[bits]) {
            (CascadeEnd::Plan(suffix), Some(expected)) => {
                let price = price(&desk.checked(&here, suffix), &desk.failures);
                assert!(price >= expected);
                assert!(price == expected || !suffix.proven_optimal);
                assert!(price == expected || reuse == Reuse::Valid, "{reply:?}");
            }
            (CascadeEnd::NoPlan(Outcome::Unsolvable { .. }), None) => {}
            other => panic!("{other:?}"),
        }
        if idx % 3 == 2 {
            desk.build_table();
        }
    }
}

fn switched() -> impl Strategy<Value = Vec<PlanSource>> {
    let others = vec![PlanSource::Trajectory, PlanSource::Suffix, PlanSource::Table];
    prop::sample::subsequence(others, 0..=3)
}

proptest! {
    #[test]
    fn tables_know_what_brute_force_finds(task in tasks(false)) {
        check_table(&task);
    }

    #[test]
    fn every_source_gives_plans_that_work(
        task in tasks(false),
        sources in switched(),
        states in prop::collection::vec(0..1_usize << N_ATOMS, 1..16),
    ) {
        check_queries(&task, Reuse::Valid, &sources, &states);
        check_queries(&task, Reuse::Optimal, &sources, &states);
    }

    #[test]
    fn suffixes_of_plans_work_from_just_the_states_that_are_said(task in tasks(true)) {
        prop_assume!(check_suffixes(&task));
    }

    #[test]
    fn suffixes_are_found_with_derived_atoms_and_conditional_effects_too(task in tasks(false)) {
        prop_assume!(check_suffixes(&task));
    }

    #[test]
    fn what_is_observed_is_what_was_told(task in tasks(false), bits in 0..1_usize << N_ATOMS) {
        let domain = task.domain();
        let goal = task.goal(&domain);
        let mut desk = Desk::new(&domain, &[], goal, settings(Reuse::Valid, &[]));
        let here = state(bits);
        desk.observe(&here).unwrap();
        let (observed_task, packed) = desk.cascade.grounded().unwrap();
        let universe = Universe { types: &domain.types, objects: &[] };
        let complete = derive(&domain.axioms, &universe, &Facts::new(here.clone())).known;
        let facts = observed_task.facts(packed);
        for atom in &facts {
            prop_assert!(complete.contains(atom), "{} was not told", atom);
        }
        for atom in observed_task.task().atoms() {
            prop_assert_eq!(facts.contains(atom), complete.contains(atom), "{}", atom);
        }
        let expected = observed_task.task().state(&here);
        prop_assert_eq!(packed, expected.as_slice());
    }
}

/// The shortest suffix that works, by trying them all, for a plan from the farthest state; `false`
/// where no state has a plan with a step.
fn check_suffixes(random: &RandomTask) -> bool {
    let domain = random.domain();
    let goal = random.goal(&domain);
    let mut desk = Desk::new(&domain, &[], goal.clone(), settings(Reuse::Valid, &[]));
    let distances = distances(&domain, &goal, &BTreeMap::new());
    let farthest = distances.iter().zip(0..).max_by_key(|(distance, _)| **distance);
    let Some((Some(1..), bits)) = farthest else { return false };
    let start = state(bits);
    let reply = desk.ask(&start);
    let CascadeEnd::Plan(suffix) = reply.end else { panic!("{:?}", reply.end) };
    let (observed_task, _) = desk.cascade.grounded().unwrap();
    let task = observed_task.task();
    let costs = vec![1; task.n_actions()].into();
    let first = task.state(&start);
    let current_plan =
        CurrentPlan::new(task, Some(&first), Arc::clone(&suffix.operators), costs, false);
    for bits in 0..1 << N_ATOMS {
        let packed = task.state(&state(bits));
        if task.is_goal(&packed) {
            continue;
        }
        let works = |at: &usize| leads_to_goal(task, &packed, &suffix.operators[*at..]).is_ok();
        let expected = (0..suffix.operators.len()).rev().find(works);
        let found = current_plan.valid_suffix(task, &packed);
        assert_eq!(found, expected.map_or(SuffixFound::None, SuffixFound::At), "{:?}", state(bits));
        if let Some(at) = current_plan.on_trajectory(&packed) {
            assert!(works(&at));
        }
    }
    assert_eq!(current_plan.on_trajectory(&first), Some(0), "a plan never comes back to its start");
    true
}

/// Free operators must not be walked in circles.
#[test]
fn tables_of_free_operators_lead_to_the_goal() {
    let text = "(define (domain ring) (:predicates (p0) (p1) (p2))
      (:action a0 :parameters () :precondition (p0) :effect (and (not (p0)) (p1)))
      (:action a1 :parameters () :precondition (p1) :effect (and (not (p1)) (p0)))
      (:action a2 :parameters () :precondition (p1) :effect (and (not (p1)) (p2)))
      (:action a3 :parameters () :precondition (p0) :effect (and (not (p0)) (p2))))";
    let domain = domain(text);
    let goal = goal("(p2)", &domain, &[]);
    let mut desk = Desk::new(&domain, &[], goal, settings(Reuse::Valid, &[]));
    let start = state(1);
    desk.observe(&start).unwrap();
    let (observed_task, packed) = desk.cascade.grounded().unwrap();
    // a3 costs something, the others do not: the way over p1 is as good as free.
    let costs = [0, 0, 0, 7].into();
    let limits = TableLimits { states_max: 100, bytes_max: 1 << 20 };
    let (observed_task, start) = (Arc::clone(observed_task), packed.to_vec());
    let job = TableJob { observed_task, costs, start: start.clone(), base: None, limits };
    let TableEnd::Built(table) = job.run(&|| false) else { panic!("too large") };
    assert_eq!(table.plan(&start), Some((Distance::Cost(0), vec![0, 2])));
}
