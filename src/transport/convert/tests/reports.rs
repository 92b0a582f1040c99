//! Events, verdicts, requests, decisions, health, and the run's description.

use super::*;
use crate::messages::{
    ActorHealth, AnswerKind, Control, DecisionMessage, Deviation, EpisodeCounts, EpisodeEnd, Event,
    EventMessage, FaultCounts, Limit, ReplanCause, RunDescriptor, Stop, Verdict,
};
use crate::transport::wire::{ControlRecord, DecisionRecord, SCHEMA};

fn atom(name: &str) -> Atom {
    Atom::new("clear", &[name])
}

fn step() -> Step {
    Step { action: "stack".into(), args: ["a", "b", "arm"].map(Name::new).to_vec() }
}

fn events() -> Vec<Event> {
    let deviation =
        Deviation { missing: vec![atom("a")], seen: vec![atom("b")], unknown: Vec::new() };
    let reason = "the gripper is empty: \"nothing\" – 5 µm".to_owned();
    let failure = ReplanCause::Failure { step: step(), reason: reason.clone() };
    vec![
        Event::Goal { goal: "(on a b)".to_owned(), said: vec!["a on b".to_owned()] },
        Event::State { facts: vec![atom("a")], unknown: vec![atom("b")], constrained: Vec::new() },
        Event::Plan { steps: vec![step(), step()], cost: 7 },
        Event::Started { step: step() },
        Event::Done { step: step(), seconds: 1.25 },
        Event::Failed { step: step(), reason: reason.clone(), failures: 3 },
        Event::Deviation(deviation.clone()),
        Event::Replan { causes: vec![ReplanCause::Deviation(deviation)], old: Some(step()) },
        Event::Replan { causes: vec![failure], old: None },
        Event::Cancel { step: step(), reason: reason.clone() },
        Event::Look { reason },
        Event::Paused,
        Event::Resumed,
        Event::End(Verdict::Reached),
        Event::End(Verdict::GaveUp { limit: Limit::Failures, detail: "9 failed".to_owned() }),
        Event::End(Verdict::Stopped(Stop::Request)),
    ]
}

#[test]
fn every_event_arrives_as_it_was_sent() {
    let context = context();
    for (sequence, event) in (0..).zip(events()) {
        let message = EventMessage { sequence, cause: CAUSE, event };
        let (header, text) = event_to_wire(&message, &context).unwrap();
        assert_eq!(event_from_wire(&header, &text, &context), Ok(message));
    }
}

#[test]
fn an_event_is_json_with_a_line_for_people() {
    let event = Event::Started { step: step() };
    let message = EventMessage { sequence: 4, cause: CAUSE, event };
    let (_, text) = event_to_wire(&message, &context()).unwrap();
    let expect = r#"{"text":"started (stack a b arm)","event":{"event":"started","step":{"action":"stack","args":["a","b","arm"]}}}"#;
    assert_eq!(String::from_utf8(text).unwrap(), expect);
}

#[test]
fn events_that_are_not_what_they_should_be_are_rejected() {
    let context = context();
    let event = Event::Failed { step: step(), reason: "so".to_owned(), failures: 1 };
    let message = EventMessage { sequence: 0, cause: CAUSE, event };
    let (header, text) = event_to_wire(&message, &context).unwrap();
    let text = String::from_utf8(text).unwrap();
    let foreign = StreamHeader { domain_hash: 0xdef, ..header };
    let rejected = event_from_wire(&foreign, text.as_bytes(), &context);
    assert_eq!(rejected.unwrap_err().field, "domain_hash");
    for (from, to, field) in [
        ("}}", "", "event"),
        ("\"failed\"", "\"fallen\"", "event"),
        ("\"stack\"", "\"steal\"", "action"),
        ("\"a\",\"b\"", "\"a\"", "arguments"),
        ("\"a\",\"b\"", "\"a\",\"(b)\"", "argument"),
        ("\"so\"", "\"so\\u001b[2J\"", "text"),
    ] {
        let changed = text.replace(from, to);
        let rejected = event_from_wire(&header, changed.as_bytes(), &context);
        assert_eq!(rejected.unwrap_err().field, field, "{changed}");
    }
}

#[test]
fn a_verdict_arrives_as_it_was_sent() {
    let context = context();
    let counts = EpisodeCounts { cycles: 9, replans: 2, skills_done: 3, skills_failed: 1 };
    for verdict in [
        Verdict::Planned,
        Verdict::Executed,
        Verdict::Unsolvable { proof: "delete relaxation".to_owned() },
        Verdict::GaveUp { limit: Limit::PlannerTimeouts, detail: "too late".to_owned() },
        Verdict::Stopped(Stop::Interrupt),
    ] {
        let end = EpisodeEnd { cause: CAUSE, verdict, counts, remaining: vec![step()] };
        let (header, text) = end_to_wire(&end, &context).unwrap();
        assert_eq!(end_from_wire(&header, &text, &context), Ok(end));
    }
}

#[test]
fn requests_and_decisions_arrive_as_they_were_sent() {
    for control in [
        Control::Stop(Stop::Interrupt),
        Control::Stop(Stop::Terminate),
        Control::Stop(Stop::Request),
        Control::Pause,
        Control::Resume,
        Control::Step,
    ] {
        assert_eq!(control_from_wire(&[control_to_wire(control)]), Ok(control));
    }
    for (request, reason, field) in [(4, 0, "request"), (0, 3, "stop reason")] {
        let rejected = control_from_wire(&[ControlRecord { request, reason }]);
        assert_eq!(rejected.unwrap_err().field, field);
    }
    let context = context();
    for kind in [AnswerKind::Continue, AnswerKind::Dispatch, AnswerKind::Replan] {
        let decision = DecisionMessage {
            sequence: 3,
            cause: CAUSE,
            plan_cycle: 6,
            kind,
            answered_ns: 9,
            is_last: kind == AnswerKind::Continue,
        };
        let (header, record) = decision_to_wire(&decision, &context);
        assert_eq!(decision_from_wire(&header, &[record], &context), Ok(decision));
        let strange = DecisionRecord { kind: 3, ..record };
        let rejected = decision_from_wire(&header, &[strange], &context);
        assert_eq!(rejected.unwrap_err().field, "decision kind");
    }
}

#[test]
fn health_arrives_as_it_was_sent() {
    let context = context();
    let health = |actor: &str| ActorHealth {
        actor: actor.to_owned(),
        is_alive: true,
        n_messages: 5,
        n_restarts: 1,
        n_missed: 2,
        n_rejected: 9,
        faults: FaultCounts::new([1, 2, 0, 3, 1, 1]),
        last_rejection: "320x240 – not 640x480".to_owned(),
    };
    let actors = vec![health("scene_parser"), health("planner")];
    let (header, records) = health_to_wire(8, &actors, &context).unwrap();
    assert_eq!(header.sequence, 8);
    assert_eq!(health_from_wire(&header, &records, &context), Ok(actors));
}

#[test]
fn a_description_gives_the_context_of_the_run() {
    let ours = context();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains/blocksworld/domain.pddl");
    let run = RunDescriptor {
        run_id: u64::MAX,
        run: "a".to_owned(),
        domain: "blocksworld".to_owned(),
        domain_text: std::fs::read_to_string(path).unwrap(),
        domain_hash: 0xabc,
        config: "seed = 1\n".to_owned(),
        seed: 1,
        program_version: "0".to_owned(),
        wire_schema: SCHEMA,
        takes_tasks: true,
    };
    let (_, text) = run_to_wire(&run).unwrap();
    let (read, context) = run_from_wire(&text).unwrap();
    assert_eq!(read, run);
    assert_eq!((context.run_id, context.domain_hash), (u64::MAX, 0xabc));
    assert_eq!(context.domain, ours.domain);
    let other = RunDescriptor { wire_schema: SCHEMA + 1, ..run.clone() };
    let rejected = run_from_wire(&run_to_wire(&other).unwrap().1);
    assert_eq!(rejected.unwrap_err().field, "wire_schema");
    let broken = RunDescriptor { domain_text: "(define".to_owned(), ..run };
    let rejected = run_from_wire(&run_to_wire(&broken).unwrap().1);
    assert_eq!(rejected.unwrap_err().field, "domain_text");
}
