//! The decision hash: one number for all that an episode believed, planned and commanded.
//!
//! It is the SHA-256 of [`FORMAT`] and the [`encode`]d text of each answered cycle, in order. The
//! text is written out here word by word and rests on no name of a Rust type, so code may be moved
//! and renamed without changing it. No wall-clock value and no prose meant for people enters: the
//! same decisions give the same hash on any machine, however messages are worded.
//!
//! One cycle, a line for each thing, every line ended by `\n`, names in PDDL's spelling:
//!
//! ```text
//! cycle <cycle> frame <sequence> at <capture time, ns>
//! fact <atom> <this frame: true|false|unknown> <believed: true|false|unknown>      (each fact)
//! plan <cost>  and  step <step>  for each step, or one of
//!   unsolvable <whether unknown facts matter: true|false>, out-of-budget, unsupported,
//!   missing <object>…, inconsistent <atom>…
//! command <id> <continue|start|cancel|hold> [<step>]
//! waypoint <x> <y> <z> <yaw> <opening> <speed> <any|empty|holding> <retractable: true|false>
//! verdict <reached|planned|unsolvable|gave-up|stopped> [<bound>]                   (at the end)
//! ```
//!
//! Numbers of a waypoint are the bits of the IEEE 754 double in hexadecimal.

use std::fmt::Write as _;

use sha2::{Digest as _, Sha256};

use super::AnsweredCycle;
use crate::logic::Truth;
use crate::messages::{Command, CommandKind, Expect, Limit, PlanVerdict, Verdict, Waypoint};

/// What is hashed first: the name and version of the encoding. It changes when the text of equal
/// decisions changes.
pub const FORMAT: &str = "groundloop decisions 1\n";

/// A hash that grows cycle by cycle. A clone is a checkpoint.
#[derive(Debug, Clone)]
pub struct DecisionHash(Sha256);

impl Default for DecisionHash {
    fn default() -> Self {
        Self(Sha256::new_with_prefix(FORMAT))
    }
}

impl DecisionHash {
    /// Adds one answered cycle.
    pub fn add(&mut self, cycle: &AnsweredCycle<'_>) {
        self.0.update(encode(cycle));
    }

    /// The hash of all cycles so far, in hexadecimal.
    pub fn hex(&self) -> String {
        let digest = self.0.clone().finalize();
        digest.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
    }
}

/// The text of one answered cycle; see the top of this file.
pub fn encode(answered: &AnsweredCycle<'_>) -> String {
    let AnsweredCycle { scene, plan, command, verdict, .. } = *answered;
    let mut text = String::new();
    let cause = &scene.cause;
    let (cycle, sequence, capture_ns) = (cause.cycle, cause.frame_sequence, cause.capture_ns);
    line(&mut text, format_args!("cycle {cycle} frame {sequence} at {capture_ns}"));
    for fact in &scene.facts {
        let (raw, confirmed) = (truth_word(fact.raw), truth_word(fact.confirmed));
        line(&mut text, format_args!("fact {} {raw} {confirmed}", fact.atom));
    }
    encode_plan(&mut text, &plan.verdict);
    encode_command(&mut text, command);
    if let Some(verdict) = verdict {
        let bound = match verdict {
            Verdict::GaveUp { limit, .. } => format!(" {}", limit_word(*limit)),
            Verdict::Reached
            | Verdict::Planned
            | Verdict::Executed
            | Verdict::Unsolvable { .. }
            | Verdict::Stopped(_) => String::new(),
        };
        line(&mut text, format_args!("verdict {}{bound}", verdict.word()));
    }
    text
}

fn line(text: &mut String, words: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let written = writeln!(text, "{words}");
    debug_assert!(written.is_ok());
}

fn encode_plan(text: &mut String, verdict: &PlanVerdict) {
    fn list<T: ToString>(items: &[T]) -> String {
        items.iter().fold(String::new(), |text, item| text + " " + &item.to_string())
    }
    match verdict {
        PlanVerdict::Plan { steps, cost } => {
            line(text, format_args!("plan {cost}"));
            for step in steps {
                line(text, format_args!("step {step}"));
            }
        }
        PlanVerdict::Unsolvable { unknowns, .. } => {
            line(text, format_args!("unsolvable {unknowns}"));
        }
        PlanVerdict::OutOfBudget { .. } => line(text, format_args!("out-of-budget")),
        PlanVerdict::Unsupported { .. } => line(text, format_args!("unsupported")),
        PlanVerdict::Missing { objects } => line(text, format_args!("missing{}", list(objects))),
        PlanVerdict::Inconsistent { atoms } => {
            line(text, format_args!("inconsistent{}", list(atoms)));
        }
    }
}

fn encode_command(text: &mut String, command: &Command) {
    let kind = match &command.kind {
        CommandKind::Continue => "continue",
        CommandKind::Start(_) => "start",
        CommandKind::Cancel => "cancel",
        CommandKind::Hold => "hold",
    };
    // A motion for the sake of a better view serves no step.
    let step = command.step.as_ref().map(|step| format!(" {step}")).unwrap_or_default();
    line(text, format_args!("command {} {kind}{step}", command.id));
    if let CommandKind::Start(motion) = &command.kind {
        for waypoint in &motion.waypoints {
            encode_waypoint(text, waypoint);
        }
    }
}

fn encode_waypoint(text: &mut String, waypoint: &Waypoint) {
    let Waypoint { position, yaw_rad, opening_m, speed_m_s, expect, retractable } = waypoint;
    let numbers = [position.x, position.y, position.z, *yaw_rad, *opening_m, *speed_m_s];
    let bits = numbers.map(|x| format!("{:016x}", x.to_bits())).join(" ");
    let expect = match expect {
        Expect::Anything => "any",
        Expect::Empty => "empty",
        Expect::Holding => "holding",
    };
    line(text, format_args!("waypoint {bits} {expect} {retractable}"));
}

fn truth_word(truth: Truth) -> &'static str {
    match truth {
        Truth::True => "true",
        Truth::False => "false",
        Truth::Unknown => "unknown",
    }
}

fn limit_word(limit: Limit) -> &'static str {
    match limit {
        Limit::Cycles => "cycles",
        Limit::Seconds => "seconds",
        Limit::Observing => "observations",
        Limit::Unseen => "unseen-frames",
        Limit::PlannerTimeouts => "planner-timeouts",
        Limit::Failures => "failures",
        Limit::Revisits => "revisits",
        Limit::SkillTimeout => "skill-timeout",
        Limit::Planner => "planner",
        Limit::Restarts => "restarts",
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::messages::{AnswerKind, Motion, PlanMessage};
    use crate::pddl::{Atom, Name, Step};
    use crate::scene::{FrameRef, Origin, Scene, SceneFact};

    fn name(text: &str) -> Name {
        Name::new(text)
    }

    struct Cycle {
        scene: Scene,
        plan: PlanMessage,
        command: Command,
        verdict: Option<Verdict>,
    }

    impl Cycle {
        fn answered(&self) -> AnsweredCycle<'_> {
            AnsweredCycle {
                scene: &self.scene,
                plan: &self.plan,
                command: &self.command,
                kind: AnswerKind::Dispatch,
                verdict: self.verdict.as_ref(),
                answered_ns: 0,
            }
        }
    }

    fn cycle() -> Cycle {
        let cause = FrameRef { cycle: 3, frame_sequence: 4, capture_ns: 400, frame_send_ns: 77 };
        let fact = SceneFact {
            atom: Atom { predicate: name("on"), args: vec![name("a"), name("b")] },
            raw: Truth::Unknown,
            confirmed: Truth::True,
            origin: Origin::Remembered,
            confidence: 0.5,
        };
        let scene = Scene { cause, facts: vec![fact], detect_us: 9, ..Scene::default() };
        let step = Step { action: name("unstack"), args: vec![name("a"), name("b")] };
        let verdict = PlanVerdict::Plan { steps: vec![step.clone()], cost: 1 };
        let waypoint = Waypoint {
            position: Point3::new(0.0, 1.0, -2.0),
            yaw_rad: 0.0,
            opening_m: 0.5,
            speed_m_s: 1.0,
            expect: Expect::Empty,
            retractable: true,
        };
        let command = Command {
            id: 2,
            frame_sequence: 4,
            capture_ns: 400,
            kind: CommandKind::Start(Motion { waypoints: vec![waypoint] }),
            step: Some(step),
        };
        Cycle { scene, plan: PlanMessage::new(cause, verdict), command, verdict: None }
    }

    /// The encoding is a format: a change here is a new version of [`FORMAT`], and new hashes.
    #[test]
    fn a_cycle_is_written_as_documented() {
        let mut cycle = cycle();
        let detail = "told to people".to_owned();
        cycle.verdict = Some(Verdict::GaveUp { limit: Limit::Failures, detail });
        let expected = "cycle 3 frame 4 at 400\n\
            fact (on a b) unknown true\n\
            plan 1\n\
            step (unstack a b)\n\
            command 2 start (unstack a b)\n\
            waypoint 0000000000000000 3ff0000000000000 c000000000000000 0000000000000000 \
            3fe0000000000000 3ff0000000000000 empty true\n\
            verdict gave-up failures\n";
        assert_eq!(encode(&cycle.answered()), expected);
        let mut hash = DecisionHash::default();
        hash.add(&cycle.answered());
        let known = "ddb4a66c1985459bd3bfb17daa02034e6eb16542af3636824e8013ec5f62d1fd";
        assert_eq!(hash.hex(), known);
    }

    #[test]
    fn what_is_only_for_people_does_not_count_and_what_is_decided_does() {
        let hash = |change: fn(&mut Cycle)| {
            let mut cycle = cycle();
            change(&mut cycle);
            let mut hash = DecisionHash::default();
            hash.add(&cycle.answered());
            hash.hex()
        };
        let calm = hash(|_| {});
        assert_eq!(calm, hash(|cycle| cycle.scene.detect_us = 1));
        assert_eq!(calm, hash(|cycle| cycle.plan.plan_us = 1));
        assert_ne!(calm, hash(|cycle| cycle.scene.facts[0].confirmed = Truth::Unknown));
        assert_ne!(calm, hash(|cycle| cycle.command.id = 3));
        assert_ne!(calm, hash(|cycle| cycle.command.kind = CommandKind::Hold));
        assert_ne!(calm, hash(|cycle| cycle.verdict = Some(Verdict::Reached)));
    }
}
