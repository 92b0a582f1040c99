//! Replanning over a changing scene, with the project's own planner.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::logic::{Bindings, Facts, Truth, Universe, bind, effects, evaluate};
use crate::messages::{GoalMessage, PlanMessage, PlanSource, PlanVerdict, Spent};
use crate::pddl::{Atom, Domain, Number, SourceText, Step, Typed, parse_goal};
use crate::planners::{Deadlines, PlanQuery, Planner, PlannerConfig, TableConfig};
use crate::planning::{Budget, Outcome, Plan, PlanAnswer, Statistics};
use crate::replanning::*;
use crate::run::DomainFolder;
use crate::scene::{Origin, Scene, SceneFact, SceneObject, Visibility};

mod tables;

const PENALTY: u32 = 5;

/// Counts how often it is asked.
#[derive(Debug)]
struct Counting {
    inner: Box<dyn Planner>,
    n_calls: AtomicU32,
}

impl Planner for Counting {
    fn plan(&self, query: &PlanQuery<'_>) -> PlanAnswer {
        self.n_calls.fetch_add(1, Ordering::Relaxed);
        self.inner.plan(query)
    }
}

struct Desk {
    domain: Arc<Domain>,
    planner: Arc<Counting>,
    replanner: Replanner,
    goal: GoalMessage,
    failures: BTreeMap<Step, u32>,
}

fn config() -> PlannerConfig {
    let budget = Budget {
        greedy_expansions_max: 10_000,
        optimal_expansions_max: 10_000,
        ..Budget::standard()
    };
    let rungs = vec![
        PlanSource::Trajectory,
        PlanSource::Suffix,
        PlanSource::Table,
        PlanSource::Search,
        PlanSource::Improve,
    ];
    PlannerConfig { failure_penalty: PENALTY, rungs, ..PlannerConfig::single("embedded", &budget) }
}

fn blocks_and_arm() -> Vec<Typed> {
    let blocks = ["a", "b", "c"].map(|name| Typed::new(name, "block"));
    blocks.into_iter().chain([Typed::new("arm", "robot")]).collect()
}

fn step(text: &str) -> Step {
    let words: Vec<&str> = text.split(' ').collect();
    Step::new(words[0], &words[1..])
}

/// Blocks a, b and c: who stands on whom; nothing is held.
fn scene(on: &[[&str; 2]]) -> Scene {
    let mut atoms: Vec<Atom> = on.iter().map(|pair| Atom::new("on", pair)).collect();
    atoms.push(Atom::new("handempty", &["arm"]));
    for block in ["a", "b", "c"] {
        if on.iter().all(|[above, _]| *above != block) {
            atoms.push(Atom::new("ontable", &[block]));
        }
        if on.iter().all(|[_, below]| *below != block) {
            atoms.push(Atom::new("clear", &[block]));
        }
    }
    scene_of(&Facts::new(atoms.into_iter().collect()))
}

fn scene_of(facts: &Facts) -> Scene {
    let fact = |(atom, truth): (&Atom, Truth)| SceneFact {
        atom: atom.clone(),
        raw: truth,
        confirmed: truth,
        origin: Origin::Observed,
        confidence: 1.0,
    };
    let known = facts.known.iter().map(|atom| (atom, Truth::True));
    let unknown = facts.unknown.iter().map(|atom| (atom, Truth::Unknown));
    let object = |typed: Typed| SceneObject {
        name: typed.name,
        type_name: typed.types[0].clone(),
        pixel_box: None,
        volume: None,
        score: 1.0,
        visibility: Visibility::Visible,
        seen_ns: 0,
    };
    Scene {
        objects: blocks_and_arm().into_iter().map(object).collect(),
        facts: known.chain(unknown).map(fact).collect(),
        ..Scene::default()
    }
}

impl Desk {
    fn new(goal: &str) -> Self {
        Self::with(goal, &config())
    }

    fn with(goal: &str, config: &PlannerConfig) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains/blocksworld");
        let domain = Arc::new(DomainFolder::read(&path).unwrap().domain);
        let objects = blocks_and_arm();
        let goal = parse_goal(&SourceText::new("goal", goal), &domain, &objects).unwrap();
        let inner = config.planner(Path::new("run.toml"), |_| None).unwrap();
        let planner = Arc::new(Counting { inner, n_calls: AtomicU32::new(0) });
        let replanner =
            Replanner::new(Arc::clone(&domain), Arc::clone(&planner) as _, config, Vec::new())
                .adopting(Adoption::WhenReady);
        let goal = GoalMessage::new(goal, Vec::new(), &objects);
        Self { domain, planner, replanner, goal, failures: BTreeMap::new() }
    }

    /// One cycle with a builder of tables and deadlines, as the planner actor goes through it.
    fn cycle(
        &mut self,
        scene: &Scene,
        deadlines: Deadlines<'_>,
        tables: &mut dyn TableBuilder,
    ) -> PlanMessage {
        let query = ReplanQuery { scene, goal: &self.goal, failures: &self.failures };
        let message = self.replanner.plan(query, deadlines, &Spent::default, tables);
        self.replanner.prepare(tables);
        message
    }

    fn ask(&mut self, scene: &Scene) -> PlanVerdict {
        self.cycle(scene, Deadlines::NONE, &mut BuildNever).verdict
    }

    #[track_caller]
    fn plan(&mut self, scene: &Scene) -> Vec<Step> {
        let verdict = self.ask(scene);
        let PlanVerdict::Plan { steps, .. } = verdict else { panic!("{verdict:?}") };
        steps
    }

    /// How often the planner was asked.
    fn n_calls(&self) -> u32 {
        self.planner.n_calls.load(Ordering::Relaxed)
    }

    /// The scene after some steps; each must be possible.
    #[track_caller]
    fn after(&self, scene: &Scene, steps: &[Step]) -> Scene {
        let objects = blocks_and_arm();
        let universe = Universe { types: &self.domain.types, objects: &objects };
        let mut facts = scene.confirmed();
        for step in steps {
            let action = self.domain.action(step.action.as_str()).unwrap();
            let bindings = bind(action, &step.args).unwrap();
            let truth = |atom: &Atom| facts.truth(atom);
            assert!(evaluate(&action.precondition, &bindings, &universe, &truth).is_true());
            let changes = effects(action, &bindings, &universe, &truth);
            facts = changes.apply(&facts);
        }
        scene_of(&facts)
    }

    #[track_caller]
    fn check_reaches(&self, scene: &Scene, steps: &[Step]) {
        let objects = blocks_and_arm();
        let universe = Universe { types: &self.domain.types, objects: &objects };
        let facts = self.after(scene, steps).confirmed();
        let truth = |atom: &Atom| facts.truth(atom);
        assert!(evaluate(&self.goal.goal, &Bindings::new(), &universe, &truth).is_true());
    }
}

const TOWER: &str = "(and (on a b) (on b c))";

#[test]
fn the_rest_of_a_plan_is_kept_while_its_steps_are_done() {
    let mut desk = Desk::new(TOWER);
    let table = scene(&[]);
    let plan = desk.plan(&table);
    let steps = ["pick_up b arm", "stack b c arm", "pick_up a arm", "stack a b arm"].map(step);
    assert_eq!(plan, steps);
    for n_done in 1..=3 {
        let now = desk.after(&table, &plan[..n_done]);
        assert_eq!(desk.plan(&now), plan[n_done..]);
    }
    assert_eq!(desk.n_calls(), 1);
    assert_eq!(desk.plan(&desk.after(&table, &plan)), []);
}

#[test]
fn steps_that_somebody_else_has_done_are_skipped() {
    let mut desk = Desk::new(TOWER);
    desk.plan(&scene(&[]));
    let suffix = desk.plan(&scene(&[["b", "c"]]));
    assert_eq!(suffix, ["pick_up a arm", "stack a b arm"].map(step));
    assert_eq!(desk.n_calls(), 1);
}

/// Always gives the same plan.
#[derive(Debug)]
struct Scripted(Vec<Step>);

impl Planner for Scripted {
    fn plan(&self, _: &PlanQuery<'_>) -> PlanAnswer {
        let outcome = Outcome::Solved(Plan {
            steps: self.0.clone(),
            cost: 4,
            cost_unit: Number::ONE,
            penalty: 0,
            lower_bound: 0,
            proven_optimal: false,
        });
        PlanAnswer { outcome, statistics: Statistics::default() }
    }
}

#[test]
fn the_shortest_suffix_that_leads_to_the_goal_is_followed() {
    let mut desk = Desk::new("(on b c)");
    let detour = ["pick_up a arm", "put_down a arm", "pick_up b arm", "stack b c arm"].map(step);
    let planner = Arc::new(Scripted(detour.to_vec()));
    desk.replanner = Replanner::new(Arc::clone(&desk.domain), planner, &config(), Vec::new());
    let table = scene(&[]);
    assert_eq!(desk.plan(&table), detour);
    let back = desk.after(&table, &detour[..1]);
    assert_eq!(desk.plan(&back), detour[1..]);
    assert_eq!(desk.plan(&table), detour[2..], "the whole plan would do, too");
}

#[test]
fn the_same_question_is_asked_once() {
    let mut desk = Desk::new("(and (on a b) (on b a))");
    let first = desk.ask(&scene(&[]));
    assert_eq!(desk.ask(&scene(&[])), first);
    assert_eq!(desk.n_calls(), 1);
}

#[test]
fn a_deviation_that_breaks_the_plan_gets_a_new_one() {
    let mut desk = Desk::new(TOWER);
    let plan = desk.plan(&scene(&[]));
    // Somebody put a onto c: b cannot go there now.
    let disturbed = scene(&[["a", "c"]]);
    let repaired = desk.plan(&disturbed);
    assert_eq!(repaired[0], step("unstack a c arm"));
    desk.check_reaches(&disturbed, &repaired);
    assert_eq!(desk.n_calls(), 2);
    let back = desk.plan(&scene(&[]));
    assert_eq!(back.len(), plan.len(), "the way from the table is as short as before");
}

#[test]
fn a_step_that_fails_again_and_again_gives_way_to_another() {
    let mut desk = Desk::new("(exists (?y - block) (on a ?y))");
    let plan = desk.plan(&scene(&[]));
    assert_eq!(plan.len(), 2);
    let others = |last: &Step| plan[0] == step("pick_up a arm") && last.action == "stack";
    assert!(others(&plan[1]), "{plan:?}");
    desk.failures.insert(plan[1].clone(), 1);
    let second = desk.plan(&scene(&[]));
    assert_eq!(second.len(), 2);
    assert_ne!(second[1], plan[1], "the other block will do");
    desk.failures.insert(second[1].clone(), 2);
    assert_eq!(desk.plan(&scene(&[]))[1], plan[1], "now this one has failed less often");
}

#[test]
fn a_step_without_an_alternative_is_tried_again() {
    let mut desk = Desk::new("(on a b)");
    let plan = desk.plan(&scene(&[]));
    desk.failures.insert(plan[1].clone(), 3);
    assert_eq!(desk.plan(&scene(&[])), plan);
    assert_eq!(desk.n_calls(), 2);
}

#[test]
fn goal_objects_that_nobody_has_seen_are_named() {
    let mut desk = Desk::new("(on a b)");
    let mut before = scene(&[]);
    before.objects.retain(|o| o.name != "a");
    before.facts.retain(|f| !f.atom.args.contains(&"a".into()));
    assert_eq!(desk.ask(&before), PlanVerdict::Missing { objects: vec!["a".into()] });
    assert_eq!(desk.n_calls(), 0);
    assert_eq!(desk.plan(&scene(&[])).len(), 2, "until it is seen");
}

#[test]
fn a_goal_that_holds_needs_no_steps_and_no_planner() {
    let mut desk = Desk::new("(on a b)");
    let verdict = desk.ask(&scene(&[["a", "b"]]));
    assert_eq!(verdict, PlanVerdict::Plan { steps: Vec::new(), cost: 0 });
    assert_eq!(desk.n_calls(), 0);
}

/// Whether a prediction decides that the goal holds, or does not matter to it. That something is so no
/// more may be a prediction, too.
#[test]
fn a_goal_that_holds_by_a_prediction_only_is_said_to() {
    for (goal, on, predicted, is_predicted) in [
        ("(on a b)", &[["a", "b"]][..], "a b", true),
        ("(on a b)", &[["a", "b"], ["b", "c"]], "b c", false),
        ("(not (on a b))", &[], "a b", true),
        ("(not (on a b))", &[["b", "c"]], "b c", false),
        ("(exists (?x - block) (on ?x c))", &[["b", "c"]], "b c", true),
    ] {
        let mut scene = scene(on);
        let atom = Atom::new("on", &predicted.split(' ').collect::<Vec<_>>());
        let confirmed = scene.confirmed().truth(&atom);
        scene.facts.retain(|fact| fact.atom != atom);
        let (raw, origin, confidence) = (Truth::Unknown, Origin::Predicted, 1.0);
        scene.facts.push(SceneFact { atom, raw, confirmed, origin, confidence });
        let message = Desk::new(goal).cycle(&scene, Deadlines::NONE, &mut BuildNever);
        assert!(message.verdict.is_goal(), "{goal}");
        assert_eq!(message.is_predicted, is_predicted, "{goal}");
    }
}

#[test]
fn what_cannot_be_is_unsolvable_and_says_whether_unknown_facts_matter() {
    let mut desk = Desk::new("(and (on a b) (on b a))");
    let unknowns_matter = |verdict| {
        let PlanVerdict::Unsolvable { unknowns, proof } = verdict else { panic!("{verdict:?}") };
        assert!(!proof.is_empty());
        unknowns
    };
    let mut seen = scene(&[]);
    assert!(!unknowns_matter(desk.ask(&seen)));
    let atom = Atom::new("on", &["a", "b"]);
    let (raw, confirmed) = (Truth::Unknown, Truth::Unknown);
    seen.facts.push(SceneFact {
        atom,
        raw,
        confirmed,
        origin: Origin::Remembered,
        confidence: 0.0,
    });
    assert!(unknowns_matter(desk.ask(&seen)));
}

#[test]
fn the_limit_that_was_met_is_named() {
    let config = PlannerConfig { expansions_max: 1, optimal_expansions_max: 1, ..config() };
    let mut desk = Desk::with(TOWER, &config);
    let verdict = desk.ask(&scene(&[["c", "b"], ["b", "a"]]));
    let PlanVerdict::OutOfBudget { limit } = verdict else { panic!("{verdict:?}") };
    assert!(limit.ends_with("expansions_max = 1"), "{limit}");
}

#[test]
fn a_planner_without_options_refuses_them() {
    let options = "speed = 1".parse().unwrap();
    let config = PlannerConfig { options: Some(options), ..config() };
    let error = config.planner(Path::new("run.toml"), |_| None).unwrap_err().to_string();
    let wanted = "run.toml: planner.options.speed: the planner \"embedded\" has no options";
    assert_eq!(error, wanted);
}

/// Answers only while nobody interrupts.
#[derive(Debug)]
struct Impatient;

impl Planner for Impatient {
    fn plan(&self, query: &PlanQuery<'_>) -> PlanAnswer {
        assert!((query.deadlines.hard)());
        PlanAnswer { outcome: Outcome::Interrupted, statistics: Statistics::default() }
    }
}

#[test]
fn a_search_that_was_interrupted_is_tried_again_in_the_same_state() {
    let mut desk = Desk::new(TOWER);
    let table = scene(&[]);
    let patient = desk.replanner.clone();
    desk.replanner =
        Replanner::new(Arc::clone(&desk.domain), Arc::new(Impatient), &config(), Vec::new());
    for _ in 0..2 {
        let passed = Deadlines { soft: &|| true, hard: &|| true };
        let message = desk.cycle(&table, passed, &mut BuildNever);
        assert_eq!(message.source, Some(PlanSource::Search));
        assert!(matches!(message.verdict, PlanVerdict::OutOfBudget { .. }), "{message:?}");
    }
    desk.replanner = patient;
    assert_eq!(desk.plan(&table).len(), 4);
}

#[test]
fn facts_that_exclude_each_other_are_no_state_to_plan_from() {
    let mut desk = Desk::new(TOWER);
    let right = scene(&[["a", "b"]]).confirmed();
    let planner = Arc::clone(&desk.planner) as Arc<dyn Planner>;
    desk.replanner = Replanner::new(Arc::clone(&desk.domain), planner, &config(), vec![right]);
    let mut wrong = scene(&[]).confirmed();
    wrong.known.insert(Atom::new("holding", &["a"]));
    let PlanVerdict::Inconsistent { atoms } = desk.ask(&scene_of(&wrong)) else { panic!() };
    assert!(atoms.contains(&Atom::new("holding", &["a"])), "{atoms:?}");
    assert_eq!(desk.n_calls(), 0);
    assert_eq!(desk.plan(&scene(&[])).len(), 4);
}

#[test]
fn a_plan_that_does_not_work_is_refused_by_its_step() {
    let mut desk = Desk::new("(on b c)");
    let wrong = ["pick_up b arm", "stack b a arm", "pick_up a arm"].map(step);
    let planner = Arc::new(Scripted(wrong.to_vec()));
    desk.replanner = Replanner::new(Arc::clone(&desk.domain), planner, &config(), Vec::new());
    let verdict = desk.ask(&scene(&[]));
    let PlanVerdict::Unsupported { feature } = verdict else { panic!("{verdict:?}") };
    assert_eq!(feature, "step 3 of the plan, (pick_up a arm), is not possible");
}

/// A cheapest plan is worth half of the time, any plan the rest of it.
#[test]
fn in_a_hurry_any_plan_will_do() {
    let disturbed = scene(&[["c", "b"], ["b", "a"]]);
    let mut desk = Desk::new(TOWER);
    let hurry = Deadlines { soft: &|| true, hard: &|| false };
    let message = desk.cycle(&disturbed, hurry, &mut BuildNever);
    assert_eq!(message.source, Some(PlanSource::Search));
    let PlanVerdict::Plan { steps, .. } = message.verdict else { panic!("{message:?}") };
    desk.check_reaches(&disturbed, &steps);
}
