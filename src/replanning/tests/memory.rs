//! What the cascade remembers: tasks, plans, tables, exclusions.

use super::*;

const BLOCKS: &str = "(define (domain blocks) (:types block)
  (:predicates (on ?x ?y - block) (table ?x - block) (clear ?x - block) (held ?x - block) (free)
    (fits ?x ?y - block))
  (:action pick :parameters (?x - block)
    :precondition (and (clear ?x) (table ?x) (free))
    :effect (and (held ?x) (not (table ?x)) (not (clear ?x)) (not (free))))
  (:action drop :parameters (?x - block) :precondition (held ?x)
    :effect (and (table ?x) (clear ?x) (free) (not (held ?x))))
  (:action stack :parameters (?x ?y - block) :precondition (and (held ?x) (clear ?y) (fits ?x ?y))
    :effect (and (on ?x ?y) (clear ?x) (free) (not (held ?x)) (not (clear ?y))))
  (:action unstack :parameters (?x ?y - block) :precondition (and (on ?x ?y) (clear ?x) (free))
    :effect (and (held ?x) (clear ?y) (not (on ?x ?y)) (not (clear ?x)) (not (free)))))";

fn blocks(names: &[&str]) -> Vec<Typed> {
    names.iter().map(|name| Typed::new(*name, "block")).collect()
}

/// All blocks on the table; every block fits on every other.
fn table_top(names: &[&str]) -> State {
    let mut state = State::from([Atom::new("free", &[])]);
    for name in names {
        state.insert(Atom::new("table", &[name]));
        state.insert(Atom::new("clear", &[name]));
        state.extend(names.iter().map(|below| Atom::new("fits", &[name, below])));
    }
    state
}

fn desk(names: &[&str], goal_text: &str, settings: CascadeSettings) -> Desk {
    let domain = domain(BLOCKS);
    let objects = blocks(names);
    let goal = goal(goal_text, &domain, &objects);
    Desk::new(&domain, &objects, goal, settings)
}

const TOWER: &str = "(and (on a b) (on b c))";

#[test]
fn each_source_answers_in_its_turn() {
    let mut desk = desk(&["a", "b", "c"], TOWER, settings(Reuse::Valid, &PlanSource::ALL));
    let start = table_top(&["a", "b", "c"]);
    let (source, steps) = desk.plan(&start);
    assert_eq!((source, steps.len()), (PlanSource::Search, 4));
    assert_eq!(desk.plan(&start), (PlanSource::Unchanged, steps.clone()));
    let picked = desk.after(&start, &steps[0]);
    assert_eq!(desk.plan(&picked), (PlanSource::Trajectory, steps[1..].to_vec()));
    // Somebody has taken the block out of the gripper and put it where it belongs.
    let stacked = desk.after(&picked, &steps[1]);
    let mut spared = stacked.clone();
    spared.remove(&Atom::new("table", &["c"]));
    assert_eq!(desk.plan(&spared), (PlanSource::Suffix, steps[2..].to_vec()), "c may lie anywhere");
    let other = desk.after(&start, &Step::new("pick", &["c"]));
    let (source, detour) = desk.plan(&other);
    assert_eq!((source, detour.len()), (PlanSource::Search, 5));
    assert!(matches!(desk.build_table(), Some(TableEnd::Built(_))));
    let worse = desk.after(&other, &Step::new("stack", &["c", "a"]));
    let (source, repaired) = desk.plan(&worse);
    assert_eq!((source, repaired.len()), (PlanSource::Table, 6));
    assert_eq!(desk.n_searches, 2);
    let done = repaired.iter().fold(worse, |state, step| desk.after(&state, step));
    assert_eq!(desk.plan(&done), (PlanSource::Goal, Vec::new()));
    let counters = desk.cascade.counters();
    let counted = PlanSource::ALL.map(|source| counters.of(source));
    assert_eq!(counted, [0, 1, 1, 1, 1, 1, 2, 0]);
}

#[test]
fn rungs_that_are_switched_off_do_not_answer() {
    let mut desk = desk(&["a", "b", "c"], TOWER, settings(Reuse::Valid, &[PlanSource::Search]));
    let start = table_top(&["a", "b", "c"]);
    let (_, steps) = desk.plan(&start);
    assert!(desk.build_table().is_none());
    let picked = desk.after(&start, &steps[0]);
    assert_eq!(desk.plan(&picked).0, PlanSource::Search);
}

#[test]
fn objects_that_come_and_go_cost_no_grounding_and_no_search() {
    let mut desk = desk(&["a", "b", "c"], TOWER, settings(Reuse::Valid, &PlanSource::ALL));
    let start = table_top(&["a", "b", "c"]);
    let (_, steps) = desk.plan(&start);
    let first = Arc::clone(desk.cascade.grounded().unwrap().0);
    desk.objects = blocks(&["a", "b", "c", "stranger"]);
    let more = table_top(&["a", "b", "c", "stranger"]);
    assert_eq!(
        desk.plan(&more),
        (PlanSource::Suffix, steps.clone()),
        "the plan is as good as before"
    );
    let second = Arc::clone(desk.cascade.grounded().unwrap().0);
    assert!(!Arc::ptr_eq(&first, &second));
    for (names, state, expected, source) in [
        (&["a", "b", "c"][..], &start, &first, PlanSource::Trajectory),
        (&["a", "b", "c", "stranger"], &more, &second, PlanSource::Suffix),
    ] {
        desk.objects = blocks(names);
        desk.objects.reverse(); // their order does not matter
        assert_eq!(desk.plan(state), (source, steps.clone()));
        assert!(Arc::ptr_eq(desk.cascade.grounded().unwrap().0, expected));
    }
    assert_eq!(desk.n_searches, 1);
}

#[test]
fn static_facts_are_taken_as_they_are_seen() {
    let mut desk = desk(&["a", "b", "c"], "(on a b)", settings(Reuse::Valid, &PlanSource::ALL));
    let start = table_top(&["a", "b", "c"]);
    assert_eq!(desk.plan(&start).1.len(), 2);
    let mut narrow = start.clone();
    narrow.remove(&Atom::new("fits", &["a", "b"]));
    let reply = desk.ask(&narrow);
    assert!(matches!(reply.end, CascadeEnd::NoPlan(Outcome::Unsolvable { .. })), "{reply:?}");
    assert_eq!(desk.plan(&start).1.len(), 2, "now it fits again");
    // A static fact that takes the memo of another one is not mistaken for it.
    narrow.insert(Atom::new("fits", &["c", "c"]));
    let reply = desk.ask(&narrow);
    assert!(matches!(reply.end, CascadeEnd::NoPlan(Outcome::Unsolvable { .. })), "{reply:?}");
}

#[test]
fn unknown_facts_are_false_and_remembered() {
    let mut desk = desk(&["a", "b"], "(on a b)", settings(Reuse::Valid, &[]));
    let start = table_top(&["a", "b"]);
    desk.observe(&start).unwrap();
    assert!(!desk.cascade.has_unknowns());
    let told = |atom: &Atom| if atom.predicate == "free" { Truth::Unknown } else { Truth::True };
    let objects = desk.objects.iter().map(|o| (&o.name, &o.types[0]));
    desk.cascade.observe(objects, start.iter().map(|atom| (atom, told(atom)))).unwrap();
    assert!(desk.cascade.has_unknowns());
    let (observed_task, state) = desk.cascade.grounded().unwrap();
    assert!(!observed_task.facts(state).contains(&Atom::new("free", &[])));
    assert!(observed_task.facts(state).contains(&Atom::new("table", &["a"])));
}

#[test]
fn a_step_that_fails_makes_plans_and_tables_be_priced_anew() {
    let mut desk = desk(&["a", "b", "c"], TOWER, settings(Reuse::Optimal, &PlanSource::ALL));
    let start = table_top(&["a", "b", "c"]);
    let (_, steps) = desk.plan(&start);
    assert!(desk.build_table().is_some());
    assert!(desk.build_table().is_none(), "one is enough");
    let other = desk.after(&start, &Step::new("pick", &["c"]));
    assert_eq!(desk.plan(&other).0, PlanSource::Table);
    desk.failures.insert(steps[0].clone(), 1);
    assert_eq!(desk.plan(&other).0, PlanSource::Search, "the table does not know of the failure");
    assert!(desk.build_table().is_some());
    let back = desk.after(&other, &Step::new("stack", &["c", "b"]));
    assert_eq!(desk.plan(&back).0, PlanSource::Table);
    assert_eq!(desk.n_searches, 2);
}

#[test]
fn a_table_that_would_be_too_large_is_not_asked_for_again() {
    let mut settings = settings(Reuse::Valid, &PlanSource::ALL);
    settings.table.states_max = 3;
    let mut desk = desk(&["a", "b", "c"], TOWER, settings);
    let start = table_top(&["a", "b", "c"]);
    desk.plan(&start);
    let end = desk.build_table();
    let Some(TableEnd::TooLarge("planner.table.states_max", 3)) = end else { panic!("{end:?}") };
    desk.plan(&desk.after(&start, &Step::new("pick", &["c"])));
    assert!(desk.build_table().is_none());
}

#[test]
fn without_a_plan_in_time_the_old_one_is_better_than_none() {
    let mut desk = desk(&["a", "b", "c"], TOWER, settings(Reuse::Optimal, &PlanSource::ALL));
    let start = table_top(&["a", "b", "c"]);
    let (_, steps) = desk.plan(&start);
    desk.failures.insert(steps[1].clone(), 1);
    (desk.budget.optimal_expansions_max, desk.budget.greedy_expansions_max) = (1, 1);
    assert_eq!(desk.plan(&start), (PlanSource::Search, steps));
    let other = desk.after(&start, &Step::new("pick", &["c"]));
    let reply = desk.ask(&other);
    assert!(matches!(reply.end, CascadeEnd::NoPlan(Outcome::OutOfBudget { .. })), "{reply:?}");
}

#[test]
fn facts_that_exclude_each_other_are_named_and_not_planned_on() {
    let mut settings = settings(Reuse::Valid, &PlanSource::ALL);
    let right = table_top(&["x", "y"]);
    settings.reference_states = vec![right];
    let mut desk = desk(&["a", "b", "c"], TOWER, settings.clone());
    let start = table_top(&["a", "b", "c"]);
    let mut wrong = start.clone();
    wrong.insert(Atom::new("held", &["a"]));
    let reply = desk.ask(&wrong);
    let CascadeEnd::Inconsistent(atoms) = reply.end else { panic!("{reply:?}") };
    for atom in [Atom::new("held", &["a"]), Atom::new("table", &["a"])] {
        assert!(atoms.contains(&atom), "{atoms:?}");
    }
    assert_eq!((reply.source, desk.n_searches), (PlanSource::Mutex, 0));
    assert_eq!(desk.plan(&start).0, PlanSource::Search);
    // Where two blocks were held in a state that is right, two may be held.
    let held = [Atom::new("held", &["x"]), Atom::new("held", &["y"])].into();
    let clear = ["x", "y"].map(|x| Atom::new("clear", &[x])).into();
    settings.reference_states = vec![held, clear];
    let mut two_arms = self::desk(&["a", "b", "c"], TOWER, settings);
    let state = State::from([Atom::new("held", &["a"]), Atom::new("held", &["b"])]);
    assert_ne!(two_arms.ask(&state).source, PlanSource::Mutex);
}

/// Objects that no task can be grounded for are told once, not at every observation.
#[test]
fn a_task_that_cannot_be_grounded_is_an_error() {
    let mut settings = settings(Reuse::Valid, &PlanSource::ALL);
    settings.grounding.actions_max = 10;
    let mut desk = desk(&["a", "b", "c"], TOWER, settings);
    let start = table_top(&["a", "b", "c"]);
    for _ in 0..2 {
        let error = desk.observe(&start).unwrap_err();
        assert!(error.to_string().contains("grounding.actions_max"), "{error}");
        assert_eq!(desk.cascade.query(&BTreeMap::new()), CascadeResult::Search);
        assert!(desk.cascade.grounded().is_none());
    }
}

#[test]
fn names_need_not_be_the_very_same_text() {
    let mut desk = desk(&["a", "b"], "(on a b)", settings(Reuse::Valid, &PlanSource::ALL));
    let start = table_top(&["a", "b"]);
    desk.plan(&start);
    let objects: Vec<(Name, Name)> =
        ["a", "b"].map(|name| (Name::from(name), Name::from("block"))).into();
    let again = table_top(&["a", "b"]);
    let facts = again.iter().map(|atom| (atom, Truth::True));
    desk.cascade.observe(objects.iter().map(|(n, t)| (n, t)), facts).unwrap();
    let CascadeResult::Reply(reply) = desk.cascade.query(&BTreeMap::new()) else { panic!() };
    assert_eq!(reply.source, PlanSource::Unchanged);
}
