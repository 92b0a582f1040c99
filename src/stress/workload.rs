//! Kinds of workload: how the world changes from one scene to the next.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::world::{World, below};
use crate::logic::{Facts, Truth};
use crate::pddl::{Atom, Domain, Name, Problem, Step, Typed};
use crate::scene::{FrameRef, Origin, Scene, SceneFact, SceneObject, Visibility};

/// How the world changes from one scene to the next.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Workload {
    /// The first step of the plan is done.
    Progress,
    /// Somebody else does a random step; every second scene, in between the plan is followed.
    Deviation,
    /// A fact is believed no more, or newly believed, for one scene.
    Flip,
    /// An object is gone for one scene.
    Objects,
    /// A random reachable state.
    Random,
}

impl Workload {
    /// Its value in `feeds` of stress files, and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Progress => "progress",
            Self::Deviation => "deviation",
            Self::Flip => "flip",
            Self::Objects => "objects",
            Self::Random => "random",
        }
    }
}

/// What one scene shows to the planner.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct View {
    /// All objects, constants included.
    pub objects: Vec<Typed>,
    /// Facts that are known of them, and those that are unknown.
    pub facts: Facts,
    /// Whether its plan counts; scenes that only lead from one to the next do not.
    pub counts: bool,
}

impl View {
    /// The scene that shows it: everything is seen and settled.
    pub fn scene(&self, cycle: u64) -> Scene {
        let fact = |(atom, truth): (&Atom, Truth)| SceneFact {
            atom: atom.clone(),
            raw: truth,
            confirmed: truth,
            origin: Origin::Observed,
            confidence: 1.0,
        };
        let object = |typed: &Typed| SceneObject {
            name: typed.name.clone(),
            type_name: typed.types.first().cloned().unwrap_or_else(|| "object".into()),
            pixel_box: None,
            volume: None,
            score: 1.0,
            visibility: Visibility::Visible,
            seen_ns: 0,
        };
        let known = self.facts.known.iter().map(|atom| (atom, Truth::True));
        let unknown = self.facts.unknown.iter().map(|atom| (atom, Truth::Unknown));
        Scene {
            cause: FrameRef { cycle, frame_sequence: cycle, ..FrameRef::default() },
            objects: self.objects.iter().map(object).collect(),
            facts: known.chain(unknown).map(fact).collect(),
            ..Scene::default()
        }
    }
}

/// Makes one view after the other. The same seed and plans give the same views.
#[derive(Debug)]
pub struct WorkloadGenerator<'a> {
    workload: Workload,
    world: World<'a>,
    /// Where walks to random states begin: in a world where not all can be undone, one long walk
    /// would end where no plan leads out.
    initial: Facts,
    walk_steps: u32,
    rng: ChaCha8Rng,
    /// Whether the next view is a disturbed one.
    disturb: bool,
}

impl<'a> WorkloadGenerator<'a> {
    /// A generator that starts at a random state.
    pub fn new(
        workload: Workload,
        (domain, problem): (&'a Domain, &Problem),
        walk_steps: u32,
        seed: u64,
    ) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut world = World::new(domain, problem);
        let initial = world.facts.clone();
        world.random_walk(walk_steps, &mut rng);
        Self { workload, world, initial, walk_steps, rng, disturb: false }
    }

    /// What the world looks like now.
    pub fn now(&self) -> View {
        let (objects, facts) = (self.world.objects().to_vec(), self.world.facts.clone());
        View { objects, facts, counts: false }
    }

    /// The next view, where the newest plan begins with `next`.
    pub fn next(&mut self, next: Option<&Step>) -> View {
        self.disturb = !self.disturb;
        match self.workload {
            Workload::Progress => {
                self.follow(next);
                View { counts: true, ..self.now() }
            }
            Workload::Random => {
                self.start_again();
                View { counts: true, ..self.now() }
            }
            Workload::Deviation if self.disturb => {
                self.world.take_any(&mut self.rng);
                View { counts: true, ..self.now() }
            }
            Workload::Flip if self.disturb => {
                let mut view = self.now();
                flip(&mut view.facts, &view.objects, &mut self.rng);
                View { counts: true, ..view }
            }
            Workload::Objects if self.disturb => self.without_one(),
            Workload::Flip | Workload::Objects => {
                self.follow(next);
                // That it is there again is as much of a change.
                View { counts: true, ..self.now() }
            }
            Workload::Deviation => {
                self.follow(next);
                self.now()
            }
        }
    }

    /// Follows the plan; at its end the world is set to another state.
    fn follow(&mut self, next: Option<&Step>) {
        if !next.is_some_and(|step| self.world.take(step)) {
            self.start_again();
        }
    }

    /// Goes to a random state.
    fn start_again(&mut self) {
        self.world.facts.clone_from(&self.initial);
        self.world.random_walk(self.walk_steps, &mut self.rng);
    }

    fn without_one(&mut self) -> View {
        let mut view = self.now();
        let gone = view.objects.remove(below(&mut self.rng, view.objects.len())).name;
        view.facts.known.retain(|atom| !atom.args.contains(&gone));
        View { counts: true, ..view }
    }
}

/// Changes what is known of one atom: a known one becomes unknown or false; of an unknown one it
/// is believed that it holds for another object.
fn flip(facts: &mut Facts, objects: &[Typed], rng: &mut ChaCha8Rng) {
    let known: Vec<Atom> = facts.known.iter().cloned().collect();
    if known.is_empty() {
        return;
    }
    let atom = known[below(rng, known.len())].clone();
    match below(rng, 3) {
        0 => facts.set(atom, Truth::False),
        1 => facts.set(atom, Truth::Unknown),
        _ => {
            let mut other = atom;
            let types_of = |name: &Name| objects.iter().find(|o| o.name == *name).map(|o| &o.types);
            if let Some(arg) = other.args.last().cloned() {
                let alike = objects.iter().filter(|o| Some(&o.types) == types_of(&arg));
                let alike: Vec<&Typed> = alike.collect();
                if let (Some(last), false) = (other.args.last_mut(), alike.is_empty()) {
                    *last = alike[below(rng, alike.len())].name.clone();
                }
            }
            facts.set(other, Truth::True);
        }
    }
}
