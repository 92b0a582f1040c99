//! Messages about the task: goal, plan, dispatches, outcomes.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::Sub;

use super::PlanSource;
use crate::logic::Truth;
use crate::pddl::{Atom, Condition, Name, Step, Term, Typed};
use crate::scene::FrameRef;

/// The goal, constant for the episode.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalMessage {
    /// What must hold.
    pub goal: Condition,
    /// Objects that the goal names.
    pub named: Vec<Typed>,
    /// The goal in the domain's words, one clause each, for people; none where its source has no words.
    pub said: Vec<String>,
}

/// What the goal parser says of a scene.
#[derive(Debug, Clone, PartialEq)]
pub enum GoalUpdate {
    /// The goal cannot be understood from what has been seen so far.
    Pending {
        /// The cycle of the newest scene that was looked at.
        cycle: u64,
    },
    /// The goal; it does not change any more.
    Known(GoalMessage),
}

impl GoalMessage {
    /// A goal with the objects that it names: the expected ones, and those among `seen`.
    pub fn new(goal: Condition, expected: Vec<Typed>, seen: &[Typed]) -> Self {
        let names = named_objects(&goal);
        let mut named: BTreeSet<Typed> = expected.into_iter().collect();
        named.extend(seen.iter().filter(|typed| names.contains(&typed.name)).cloned());
        Self { goal, named: named.into_iter().collect(), said: Vec::new() }
    }
}

/// The objects that a condition names.
pub fn named_objects(condition: &Condition) -> BTreeSet<Name> {
    let mut names = BTreeSet::new();
    collect_objects(condition, &mut names);
    names
}

fn collect_objects(condition: &Condition, names: &mut BTreeSet<Name>) {
    let mut add = |term: &Term| {
        if let Term::Object(name) = term {
            names.insert(name.clone());
        }
    };
    match condition {
        Condition::True | Condition::False => {}
        Condition::Atom(literal) => literal.args.iter().for_each(add),
        Condition::Equal(left, right) => [left, right].into_iter().for_each(&mut add),
        Condition::Not(inner) | Condition::Exists(_, inner) | Condition::Forall(_, inner) => {
            collect_objects(inner, names);
        }
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                collect_objects(part, names);
            }
        }
    }
}

/// The planner's answer for one scene.
#[derive(Debug, Clone, PartialEq)]
pub enum PlanVerdict {
    /// These steps lead to the goal; none when it holds already.
    Plan {
        /// In order.
        steps: Vec<Step>,
        /// Their cost.
        cost: u64,
    },
    /// No plan exists. `unknowns` says that unknown facts could change this.
    Unsolvable {
        /// The kind of proof.
        proof: String,
        /// Whether unknown facts matter.
        unknowns: bool,
    },
    /// A limit was met.
    OutOfBudget {
        /// Its key in the run file.
        limit: String,
    },
    /// The domain or goal uses something that no planner here understands.
    Unsupported {
        /// The PDDL feature, as the domain writes it.
        feature: String,
    },
    /// The goal names objects that nobody has seen.
    Missing {
        /// Their names.
        objects: Vec<Name>,
    },
    /// Facts are believed that cannot hold together: nothing is planned on them.
    Inconsistent {
        /// These, in order.
        atoms: Vec<Atom>,
    },
}

impl PlanVerdict {
    /// Whether the goal holds: nothing is left to do.
    pub fn is_goal(&self) -> bool {
        matches!(self, Self::Plan { steps, .. } if steps.is_empty())
    }
}

impl fmt::Display for PlanVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fn list<T: ToString>(items: &[T]) -> String {
            items.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
        }
        match self {
            Self::Plan { steps, cost } => write!(f, "a plan of {} steps, cost {cost}", steps.len()),
            Self::Unsolvable { proof, unknowns: false } => write!(f, "unsolvable: {proof}"),
            Self::Unsolvable { proof, unknowns: true } => {
                write!(f, "unsolvable while facts are unknown: {proof}")
            }
            Self::OutOfBudget { limit } => write!(f, "out of budget: {limit}"),
            Self::Unsupported { feature } => write!(f, "unsupported: {feature}"),
            Self::Missing { objects } if objects.is_empty() => f.write_str("no goal yet"),
            Self::Missing { objects } => {
                write!(f, "objects of the goal have not been seen: {}", list(objects))
            }
            Self::Inconsistent { atoms } => {
                write!(f, "facts exclude each other: {}", list(atoms))
            }
        }
    }
}

/// A plan for one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanMessage {
    /// The scene's frame.
    pub cause: FrameRef,
    /// The answer.
    pub verdict: PlanVerdict,
    /// Whether the goal speaks of all objects of a type, so that one that is hidden counts.
    pub of_all: bool,
    /// Whether the goal holds only if what a step that has ended should have changed is so, which nobody has
    /// seen yet.
    pub is_predicted: bool,
    /// Whether the goal holds, and an anomaly says of an object that it speaks of what cannot be.
    pub is_doubted: bool,
    /// Which source of the plan-reuse cascade gave it; none when the question could not be put.
    pub source: Option<PlanSource>,
    /// States expanded for it.
    pub expansions: u64,
    /// Time spent, microseconds (latency only).
    pub plan_us: u32,
    /// Time spent on taking in the facts (latency only).
    pub observe: Spent,
    /// Time spent on the answer, before it is put into names (latency only).
    pub decide: Spent,
}

impl PlanMessage {
    /// A verdict without figures.
    pub fn new(cause: FrameRef, verdict: PlanVerdict) -> Self {
        let (observe, decide) = (Spent::default(), Spent::default());
        Self {
            cause,
            verdict,
            of_all: false,
            is_predicted: false,
            is_doubted: false,
            source: None,
            expansions: 0,
            plan_us: 0,
            observe,
            decide,
        }
    }
}

/// Time spent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Spent {
    /// Processor time of the thread, nanoseconds.
    pub cpu_ns: u64,
    /// Wall-clock time, nanoseconds.
    pub wall_ns: u64,
}

impl Sub for Spent {
    type Output = Self;

    /// What was spent since `earlier`; nothing where a clock has gone backwards.
    fn sub(self, earlier: Self) -> Self {
        Self {
            cpu_ns: self.cpu_ns.saturating_sub(earlier.cpu_ns),
            wall_ns: self.wall_ns.saturating_sub(earlier.wall_ns),
        }
    }
}

/// What a step changes when it is carried out from a known state.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Effects {
    /// Atoms that become true.
    pub add: BTreeSet<Atom>,
    /// Atoms that become false; disjoint from `add`.
    pub delete: BTreeSet<Atom>,
}

impl Effects {
    /// What becomes of an atom; `None` when it keeps its value.
    pub fn truth(&self, atom: &Atom) -> Option<Truth> {
        if self.add.contains(atom) {
            Some(Truth::True)
        } else {
            self.delete.contains(atom).then_some(Truth::False)
        }
    }
}

/// A step that the robot has been told to carry out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dispatch {
    /// Number in the executor's stream of dispatches.
    pub sequence: u64,
    /// The frame that the decision rests on.
    pub cause: FrameRef,
    /// The command that carries its motion.
    pub command_id: u64,
    /// Ground action that the robot was told to carry out.
    pub step: Step,
    /// What it changes, as predicted from the scene that it was decided on.
    pub effects: Effects,
}

/// How a dispatched step ended, in the executor's judgement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StepOutcome {
    /// Number in the executor's stream of outcomes.
    pub sequence: u64,
    /// Ground action that the robot was told to carry out.
    pub step: Step,
    /// Whether it did what it was to do.
    pub succeeded: bool,
    /// How often this very step has failed so far.
    pub failures: u32,
}
