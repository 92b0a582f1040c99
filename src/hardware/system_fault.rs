//! Faults of the loop itself: actors that fail or stall, and messages that are lost, doubled or late.

use std::num::NonZeroU32;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FaultConfig;
use crate::clock::ClockKind;
use crate::mismatch::{Mismatch, quoted};
use crate::settings::near_hint;
use crate::transport::topics::{
    CONTROL, CameraTopics, GOAL, PLAN, ROBOT_COMMAND, RUN, SCENE, TOPICS, VERDICT,
};

/// Actors that every run has; cameras come beside them.
const ACTORS: [&str; 5] = ["goal_parser", "planner", "robot", "scene_parser", "skill_executor"];

/// One thing that goes wrong with an actor or a message. Written in run files with the key `kind`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum SystemFault {
    /// The actor panics at the message, and is restarted. With `message`.
    Panic {},
    /// The actor stands still before it handles the message. With `message`.
    Stall {
        /// For how long, seconds of wall-clock time.
        for_s: f64,
    },
    /// The planner answers as if its deadline had passed without a plan. With `message = "planner"`.
    DeadlineMissed {},
    /// The goal source is not asked: it is as if its service were not there. With `message = "goal_parser"`.
    SourceDown {},
    /// The message is not published. With `sent`.
    Lose {},
    /// The message is published twice. With `sent`.
    Duplicate {},
    /// The message is held back and published behind later ones. With `sent`.
    Delay {
        /// How many messages of its topic go before it; without the key 1.
        messages: Option<NonZeroU32>,
    },
}

/// What of a run decides which faults its loop can have.
#[derive(Debug, Clone, Copy)]
pub struct LoopShape<'a> {
    /// Which clock drives it.
    pub clock: ClockKind,
    /// Names of its cameras, `main` included.
    pub cameras: &'a [&'a str],
}

impl LoopShape<'_> {
    /// Whether a frame is not answered in lockstep when a message of this topic is lost.
    pub fn waits_for(&self, topic: &str) -> bool {
        let mut cameras = self.cameras.iter().map(|name| CameraTopics::of(name));
        // One of several cameras without depth has its frame refused.
        let is_frame = cameras.any(|camera| {
            topic == camera.rgb.name || (self.cameras.len() > 1 && topic == camera.depth.name)
        });
        is_frame || [SCENE, PLAN, GOAL, ROBOT_COMMAND].iter().any(|waited| waited.name == topic)
    }

    fn actors(&self) -> Vec<&'static str> {
        let cameras = self.cameras.iter().map(|name| CameraTopics::of(name).camera);
        cameras.chain(ACTORS).collect()
    }

    /// What the loop publishes on.
    fn topics(&self) -> Vec<&'static str> {
        let cameras = self.cameras.iter().map(|name| CameraTopics::of(name));
        let cameras = cameras.flat_map(|camera| [camera.rgb.name, camera.depth.name]);
        let own = TOPICS.iter().filter(|topic| **topic != CONTROL && **topic != RUN);
        let mut topics: Vec<&str> = cameras.chain(own.map(|topic| topic.name)).collect();
        topics.sort_unstable();
        topics.dedup();
        topics
    }
}

impl SystemFault {
    /// The kinds that need `message`, as run files have them.
    const OF_ACTORS: [&'static str; 4] = ["panic", "stall", "deadline_missed", "source_down"];
    /// The kinds that need `sent`.
    const OF_MESSAGES: [&'static str; 3] = ["lose", "duplicate", "delay"];

    /// Reads the `action` of a `[[fault]]`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(action: &toml::Table) -> Result<Self, toml::de::Error> {
        action.clone().try_into()
    }

    /// What is wrong with a fault for this loop: a trigger and an action that do not go together, an
    /// actor or a topic that there is not, a number that cannot be. `at` is where it stands.
    pub(crate) fn mismatch(
        fault: &FaultConfig,
        at: &str,
        shape: &LoopShape<'_>,
    ) -> Option<Mismatch> {
        let kind = fault.action.get("kind").and_then(toml::Value::as_str).unwrap_or_default();
        let is_of = |kinds: &[&str]| kinds.contains(&kind);
        let wrong = |key: &str, expected: String, got: String| {
            Some(Mismatch::new(format!("{at}.{key}"), expected, got))
        };
        let (trigger, said, kinds, known) = match (&fault.message, &fault.sent) {
            (Some(actor), _) => ("message", actor, &Self::OF_ACTORS[..], shape.actors()),
            (None, Some(topic)) => ("sent", topic, &Self::OF_MESSAGES[..], shape.topics()),
            (None, None) => {
                let needed =
                    [("message", is_of(&Self::OF_ACTORS)), ("sent", is_of(&Self::OF_MESSAGES))];
                let (trigger, _) = needed.into_iter().find(|(_, is_it)| *is_it)?;
                let expected = format!("{trigger} as the trigger of {}", quoted(kind));
                return Some(Mismatch::new(at, expected, "another one"));
            }
        };
        if !known.contains(&said.as_str()) {
            let expected = format!("one of {}", known.join(", "));
            let got = format!("{}{}", quoted(said), near_hint(said, known));
            return wrong(trigger, expected, got);
        }
        if !is_of(kinds) {
            let expected = format!("one of {} beside {trigger}", kinds.join(", "));
            return wrong("action.kind", expected, quoted(kind));
        }
        if fault.after_s.is_some() {
            return wrong("after_s", format!("none beside {trigger}"), "a value".to_owned());
        }
        let only = [("deadline_missed", "planner"), ("source_down", "goal_parser")];
        if let Some((kind, actor)) =
            only.iter().find(|(only, actor)| *only == kind && said != actor)
        {
            let expected = format!("{} beside {}", quoted(actor), quoted(kind));
            return wrong("message", expected, quoted(said));
        }
        if let Some(mismatch) = fault.never_ends(said, kind, at) {
            return Some(mismatch);
        }
        match Self::read(&fault.action) {
            Ok(Self::Stall { for_s }) if !(for_s.is_finite() && for_s > 0.0) => {
                let expected = "a finite number above 0".to_owned();
                wrong("action.for_s", expected, for_s.to_string())
            }
            Ok(_) => None,
            Err(error) => {
                let got = error.message().trim_end().to_owned();
                wrong("action", format!("the options of {}", quoted(kind)), got)
            }
        }
    }
}

impl FaultConfig {
    /// A loop that never hears of its goal, of a scene or of a plan decides nothing, not even its end.
    fn never_ends(&self, topic: &str, kind: &str, at: &str) -> Option<Mismatch> {
        let is_needed = [GOAL, SCENE, PLAN, VERDICT].iter().any(|needed| needed.name == topic);
        let is_kept = ["lose", "delay"].contains(&kind);
        let is_always = self.every == Some(true) && self.probability.unwrap_or(1.0) >= 1.0;
        (is_needed && is_kept && is_always).then(|| {
            let expected =
                format!("a number below 1 beside every = true: nothing ends without {topic}");
            Mismatch::new(format!("{at}.probability"), expected, "1, or none")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: LoopShape<'_> =
        LoopShape { clock: ClockKind::Lockstep, cameras: &["main", "back"] };

    fn said(fault: &str) -> String {
        let fault: FaultConfig = toml::from_str(fault).unwrap();
        let mismatch = fault.mismatch("fault[0]");
        let mismatch = mismatch.or_else(|| SystemFault::mismatch(&fault, "fault[0]", &SHAPE));
        mismatch.map(|mismatch| mismatch.to_string()).unwrap_or_default()
    }

    #[test]
    fn what_does_not_go_together_is_told_with_what_to_change() {
        for (fault, expected) in [
            ("message = 'planner'\naction = { kind = 'panic' }", ""),
            ("message = 'camera/back'\nevery = true\naction = { kind = 'stall', for_s = 0.1 }", ""),
            (
                "sent = 'camera/back/depth'\nprobability = 0.5\naction = { kind = 'delay', messages = 3 }",
                "",
            ),
            (
                "message = 'planer'\naction = { kind = 'panic' }",
                "fault[0].message: expected one of camera, camera/back, goal_parser, planner, robot, scene_parser, \
                 skill_executor, got \"planer\"; did you mean \"planner\"?",
            ),
            (
                "sent = 'control'\naction = { kind = 'lose' }",
                "fault[0].sent: expected one of camera/back/depth,",
            ),
            (
                "message = 'planner'\naction = { kind = 'drop' }",
                "fault[0].action.kind: expected one of panic, stall, deadline_missed, source_down beside message, got \"drop\"",
            ),
            (
                "sent = 'plan'\naction = { kind = 'panic' }",
                "fault[0].action.kind: expected one of lose, duplicate, delay beside sent, got \"panic\"",
            ),
            (
                "at_s = 1\naction = { kind = 'panic' }",
                "fault[0]: expected message as the trigger of \"panic\", got another one",
            ),
            (
                "message = 'robot'\naction = { kind = 'deadline_missed' }",
                "fault[0].message: expected \"planner\" beside \"deadline_missed\", got \"robot\"",
            ),
            (
                "sent = 'plan'\nafter_s = 1\naction = { kind = 'lose' }",
                "fault[0].after_s: expected none beside sent, got a value",
            ),
            (
                "sent = 'verdict'\nevery = true\naction = { kind = 'lose' }",
                "fault[0].probability: expected a number below 1 beside every = true: nothing ends without verdict",
            ),
            (
                "message = 'planner'\naction = { kind = 'stall', for_s = -1 }",
                "fault[0].action.for_s: expected a finite number above 0, got -1",
            ),
            (
                "sent = 'plan'\naction = { kind = 'delay', messages = 0 }",
                "fault[0].action: expected the options of \"delay\", got invalid value: integer `0`",
            ),
            (
                "sent = 'plan'\nat_s = 1\naction = { kind = 'lose' }",
                "fault[0]: expected one of at_s, during, after, holding, frame, message and sent, got at_s and sent",
            ),
        ] {
            let said = said(fault);
            assert!(
                said.starts_with(expected) && said.is_empty() == expected.is_empty(),
                "{fault}\n{said}"
            );
        }
    }

    #[test]
    fn lockstep_waits_for_what_leads_to_a_command() {
        for topic in
            ["camera/main/rgb", "camera/back/depth", "scene", "plan", "goal", "robot/command"]
        {
            assert!(SHAPE.waits_for(topic), "{topic}");
        }
        for topic in ["robot/state", "robot/status", "dispatch", "outcome", "event", "verdict"] {
            assert!(!SHAPE.waits_for(topic), "{topic}");
        }
        let one = LoopShape { cameras: &["main"], ..SHAPE };
        assert!(!one.waits_for("camera/main/depth"), "a frame without depth is answered");
    }
}
