//! The loop, driven by hand: scenes, plans and statuses in, commands out.

mod dispatch;
mod endings;
mod open_loop;
mod planner_timeouts;
mod re_observing;
mod property;
mod safe_state;

use std::path::Path;

use nalgebra::Point3;

use super::*;
use crate::geometry::Aabb;
use crate::logic::Truth;
use crate::messages::{Deviation, PlanVerdict, StatusKind};
use crate::pddl::Atom;
use crate::run::{DomainFolder, load_run};
use crate::scene::{Origin, SceneFact, SceneObject, Visibility};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const FRAME_NS: u64 = 100_000_000;
const BLOCKS: [&str; 3] = ["red_block", "blue_block", "green_block"];

/// An episode whose eyes, planner and robot are the test.
#[derive(Clone)]
struct Episode {
    config: ExecutiveConfig,
    executive: Executive,
    scene: Scene,
    plan: PlanVerdict,
    /// Whether the goal speaks of all objects.
    of_all: bool,
    /// Whether the goal holds only by what was predicted.
    is_predicted: bool,
    is_doubted: bool,
    robot: Option<RobotState>,
    /// How old the scene is when it is looked at.
    age_ms: u64,
    robot_age_ms: u64,
    hold: Option<HoldCause>,
}

fn config(domain: &str) -> ExecutiveConfig {
    let folder = DomainFolder::read(&Path::new(ROOT).join("domains").join(domain)).unwrap();
    let run = load_run(&Path::new(ROOT).join("configs/blocksworld.toml"), &[]).unwrap();
    ExecutiveConfig {
        domain: folder.domain,
        skills: folder.skills.unwrap(),
        motion: run.robot.motion,
        limits: run.limits,
        mode: run.executive,
    }
}

/// A step or an atom from text such as `stack red_block blue_block arm`.
fn step(text: &str) -> Step {
    let words: Vec<&str> = text.split(' ').collect();
    Step::new(words[0], &words[1..])
}

fn atom(text: &str) -> Atom {
    let Step { action, args } = step(text);
    Atom { predicate: action, args }
}

fn fact(atom: Atom, truth: Truth) -> SceneFact {
    SceneFact { atom, raw: truth, confirmed: truth, origin: Origin::Observed, confidence: 1.0 }
}

fn object(name: &str, type_name: &str, x: f64) -> SceneObject {
    let centre = Point3::new(x, 0.0, 0.025);
    SceneObject {
        name: name.into(),
        type_name: type_name.into(),
        pixel_box: None,
        volume: Some(Aabb { centre, extent: [0.05; 3] }),
        score: 1.0,
        visibility: Visibility::Visible,
        seen_ns: 0,
    }
}

/// The full state of three blocks: who stands on whom, and what is held.
fn blocks(on: &[[&str; 2]], held: Option<&str>) -> Vec<Atom> {
    let mut atoms: Vec<Atom> = on.iter().map(|pair| Atom::new("on", pair)).collect();
    for block in BLOCKS.iter().filter(|b| held != Some(**b)) {
        if on.iter().all(|[above, _]| above != block) {
            atoms.push(Atom::new("ontable", &[block]));
        }
        if on.iter().all(|[_, below]| below != block) {
            atoms.push(Atom::new("clear", &[block]));
        }
    }
    atoms.extend(held.map(|block| Atom::new("holding", &[block])));
    let hand = if held.is_some() { "handfull" } else { "handempty" };
    atoms.push(Atom::new(hand, &["arm"]));
    atoms
}

impl Episode {
    /// Three blocks on the table; the goal holds already.
    fn new() -> Self {
        let xs = [-0.15, 0.0, 0.15];
        let mut objects: Vec<SceneObject> =
            BLOCKS.iter().zip(xs).map(|(name, x)| object(name, "block", x)).collect();
        let arm = object("arm", "robot", 0.0);
        objects.push(SceneObject { volume: None, visibility: Visibility::Implied, ..arm });
        let robot = RobotState {
            capture_ns: 0,
            position: Point3::new(0.0, 0.0, 0.5),
            yaw_rad: 0.0,
            opening_m: 0.1,
            holding: false,
            command_id: None,
            phase: 0,
            answered: None,
        };
        let mut episode = Self {
            config: config("blocksworld"),
            executive: Executive::default(),
            scene: Scene { objects, ..Scene::default() },
            plan: PlanVerdict::Plan { steps: Vec::new(), cost: 0 },
            of_all: false,
            is_predicted: false,
            is_doubted: false,
            robot: Some(robot),
            age_ms: 0,
            robot_age_ms: 0,
            hold: None,
        };
        episode.see(&blocks(&[], None));
        episode
    }

    /// From the next cycle on, these facts are confirmed, and nothing else.
    fn see(&mut self, atoms: &[Atom]) -> &mut Self {
        self.scene.facts = atoms.iter().map(|a| fact(a.clone(), Truth::True)).collect();
        let holding = atoms.iter().any(|a| a.predicate == "holding");
        self.robot_mut().holding = holding;
        self
    }

    /// From the next cycle on, the planner answers with these steps.
    fn plan(&mut self, steps: &[&str]) -> &mut Self {
        let steps: Vec<Step> = steps.iter().map(|text| step(text)).collect();
        let cost = steps.len() as u64;
        self.plan = PlanVerdict::Plan { steps, cost };
        self
    }

    fn robot_mut(&mut self) -> &mut RobotState {
        self.robot.as_mut().unwrap()
    }

    fn move_object(&mut self, name: &str, by_m: f64) {
        let object = self.scene.objects.iter_mut().find(|o| o.name == name).unwrap();
        object.volume.as_mut().unwrap().centre.y += by_m;
    }

    /// One frame later; the robot has said `kinds` of its last command.
    fn hear(&mut self, kinds: &[StatusKind]) -> Decision {
        let cause = &mut self.scene.cause;
        cause.cycle += 1;
        cause.frame_sequence += 1;
        cause.capture_ns += FRAME_NS;
        let capture_ns = cause.capture_ns;
        self.decide(kinds, capture_ns)
    }

    /// One frame later, but the scene is still that of the last picture; the robot has said `kinds`
    /// of its last command since.
    fn carry(&mut self, kinds: &[StatusKind]) -> Decision {
        self.scene.cause.cycle += 1;
        let now_ns = self.scene.cause.capture_ns + FRAME_NS;
        self.decide(kinds, now_ns)
    }

    fn decide(&mut self, kinds: &[StatusKind], capture_ns: u64) -> Decision {
        let command_id = self.executive.last_command_id;
        let status =
            |kind: &StatusKind| Status { sequence: 0, capture_ns, command_id, kind: kind.clone() };
        let statuses: Vec<Status> = kinds.iter().map(status).collect();
        let mut plan = PlanMessage::new(self.scene.cause, self.plan.clone());
        (plan.of_all, plan.is_predicted) = (self.of_all, self.is_predicted);
        plan.is_doubted = self.is_doubted;
        let input = CycleInput {
            scene: &self.scene,
            plan: &plan,
            robot: self.robot.as_ref(),
            robot_age_ns: self.robot_age_ms * 1_000_000,
            hold: self.hold,
            statuses: &statuses,
            now_ns: capture_ns + self.age_ms * 1_000_000,
        };
        self.executive.on(&self.config, &input)
    }

    /// One frame later; the robot is silent.
    fn cycle(&mut self) -> Decision {
        self.hear(&[])
    }

    /// Starts a step from the present scene.
    #[track_caller]
    fn start(&mut self, text: &str) {
        let decision = self.plan(&[text]).cycle();
        assert_eq!(
            started(&decision).as_deref(),
            Some(step(text).to_string().as_str()),
            "{decision:?}"
        );
    }

    /// Cycles until the episode ends, within `cycles_max` cycles; returns how many it took.
    #[track_caller]
    fn run_out(&mut self, cycles_max: u32) -> (u32, Verdict) {
        let ends = (1..=cycles_max).find_map(|n| Some((n, self.cycle().verdict?)));
        ends.expect("the episode goes on")
    }
}

/// The step that a decision starts.
fn started(decision: &Decision) -> Option<String> {
    let started = decision.dispatch.as_ref()?;
    assert!(matches!(decision.command.kind, CommandKind::Start(_)));
    assert_eq!(decision.command.step.as_ref(), Some(&started.step));
    assert_eq!(decision.command.id, started.command_id);
    Some(started.step.to_string())
}

/// Why a decision waits, does not trust, or cancels.
fn reasons(decision: &Decision) -> Vec<&str> {
    decision
        .events
        .iter()
        .filter_map(|event| {
            let (Event::Look { reason }
            | Event::Cancel { reason, .. }
            | Event::Failed { reason, .. }) = event
            else {
                return None;
            };
            Some(reason.as_str())
        })
        .collect()
}
