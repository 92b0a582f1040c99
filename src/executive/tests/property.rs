//! Whatever happens: no step leaves unless its precondition is known to hold right then.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::*;
use crate::logic::{Universe, bind, evaluate};

/// What the world does in one cycle.
#[derive(Debug, Clone)]
struct Event {
    /// Truth of every atom, in the order of [`atoms`].
    truths: Vec<Truth>,
    unsettled: u32,
    age_ms: u64,
    /// Indices into [`steps`]; none: there is no plan.
    plan: Option<Vec<usize>>,
    /// What the robot says of the last command.
    statuses: Vec<StatusKind>,
    holding: bool,
    phase: usize,
    /// How far the red block moves, metres.
    moved_m: f64,
}

fn atoms() -> Vec<Atom> {
    let unary = ["ontable", "clear", "holding"];
    let mut atoms: Vec<Atom> = Vec::new();
    for block in &BLOCKS[..2] {
        atoms.extend(unary.iter().map(|predicate| Atom::new(predicate, &[block])));
    }
    atoms.extend(["handempty arm", "handfull arm"].map(atom));
    atoms.extend(["on red_block blue_block", "on blue_block red_block"].map(atom));
    atoms
}

fn steps() -> Vec<Step> {
    let mut steps = Vec::new();
    for [a, b] in [["red_block", "blue_block"], ["blue_block", "red_block"]] {
        steps.extend(["pick_up", "put_down"].map(|action| Step::new(action, &[a, "arm"])));
        steps.extend(["stack", "unstack"].map(|action| Step::new(action, &[a, b, "arm"])));
    }
    steps
}

fn events() -> impl Strategy<Value = Vec<Event>> {
    let truth =
        prop_oneof![6 => Just(Truth::True), 1 => Just(Truth::Unknown), 2 => Just(Truth::False)];
    let truths = prop::collection::vec(truth, atoms().len());
    let unsettled = prop_oneof![4 => Just(0_u32), 1 => 1..3_u32];
    let age_ms = prop_oneof![4 => 0..=500_u64, 1 => 501..2000_u64];
    let plan = prop::collection::vec(0..steps().len(), 1..4);
    let kind = prop_oneof![
        Just(StatusKind::Accepted),
        Just(StatusKind::Done),
        Just(StatusKind::Failed("no".to_owned())),
        Just(StatusKind::Cancelled),
    ];
    let statuses = prop::collection::vec(kind, 0..3);
    let rest = (prop::bool::ANY, 0..8_usize, prop_oneof![3 => Just(0.0), 1 => 0.0..0.05]);
    let event = (truths, unsettled, age_ms, prop::option::weighted(0.9, plan), statuses, rest);
    let event = event.prop_map(|(truths, unsettled, age_ms, plan, statuses, rest)| {
        let (holding, phase, moved_m) = rest;
        Event { truths, unsettled, age_ms, plan, statuses, holding, phase, moved_m }
    });
    prop::collection::vec(event, 1..40)
}

/// The precondition's truth in the confirmed facts, worked out here.
fn precondition(episode: &Episode, step: &Step) -> Truth {
    let domain = &episode.config.domain;
    let action = domain.action(step.action.as_str()).unwrap();
    let objects = episode.scene.typed_objects();
    let universe = Universe { types: &domain.types, objects: &objects };
    let facts = episode.scene.confirmed();
    let bindings = bind(action, &step.args).unwrap();
    evaluate(&action.precondition, &bindings, &universe, &|atom| facts.truth(atom))
}

fn happen(episode: &mut Episode, event: &Event) {
    let facts = atoms().into_iter().zip(&event.truths).map(|(atom, truth)| fact(atom, *truth));
    episode.scene.facts = facts.collect();
    episode.scene.unsettled = event.unsettled;
    episode.age_ms = event.age_ms;
    episode.move_object("red_block", event.moved_m);
    let robot = episode.robot_mut();
    (robot.holding, robot.phase) = (event.holding, event.phase);
    let all = steps();
    episode.plan = match &event.plan {
        Some(plan) => {
            let steps: Vec<Step> = plan.iter().map(|i| all[*i].clone()).collect();
            PlanVerdict::Plan { cost: steps.len() as u64, steps }
        }
        None => PlanVerdict::Unsolvable { proof: "none".to_owned(), unknowns: true },
    };
}

/// Runs one episode; returns how many steps were started.
fn run(events: &[Event]) -> Result<u32, TestCaseError> {
    let mut episode = Episode::new();
    let limits = &mut episode.config.limits;
    (limits.failures_max, limits.revisits_max, limits.observing_s_max) = (999, 999, 999.0);
    let (mut n_started, mut busy) = (0, false);
    for event in events {
        happen(&mut episode, event);
        busy &= event.statuses.iter().all(|kind| *kind == StatusKind::Accepted);
        let last_id = episode.executive.last_command_id;
        let decision = episode.hear(&event.statuses);
        if let Some(step) = started(&decision) {
            let PlanVerdict::Plan { steps, .. } = &episode.plan else {
                return Err(TestCaseError::fail("started without a plan"));
            };
            prop_assert_eq!(&step, &steps[0].to_string());
            prop_assert_eq!(precondition(&episode, &steps[0]), Truth::True);
            prop_assert_eq!(event.unsettled, 0);
            prop_assert!(event.age_ms <= episode.config.limits.state_age_ms_max);
            prop_assert!(!busy, "{} starts while another step runs", step);
            prop_assert_eq!(decision.command.id, last_id + 1);
            busy = true;
            n_started += 1;
        }
        if decision.verdict.is_some() {
            break;
        }
    }
    Ok(n_started)
}

#[test]
fn no_step_leaves_unless_its_precondition_is_known_to_hold() {
    let n_started = Cell::new(0);
    let result = TestRunner::deterministic().run(&events(), |events| {
        n_started.set(n_started.get() + run(&events)?);
        Ok(())
    });
    result.unwrap_or_else(|error| panic!("{error}"));
    assert!(n_started.get() > 200, "{} steps were started: too few to tell", n_started.get());
}
