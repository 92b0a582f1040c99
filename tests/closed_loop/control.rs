//! Pause, step, resume and stop, asked for by another process on the bus; and a process that joins.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::sync::Arc;

use crate::common::{Process, SMALL_CAMERA, TestRun, runtime, small, unique_run};
use groundloop::messages::{
    ActorHealth, Control, DecisionMessage, Event, PlanVerdict, Stop, Verdict,
};
use groundloop::metrics::EpisodeReport;
use groundloop::run::{EpisodeOptions, PreparedRun, run_episode};
use groundloop::transport::convert::{
    WireContext, control_to_wire, decision_from_wire, device_header, end_from_wire,
    health_from_wire, plan_from_wire, scene_from_wire,
};
use groundloop::transport::topics::{CONTROL, DECISION, HEALTH, PLAN, SCENE, VERDICT};
use groundloop::transport::wire::{
    ControlRecord, DecisionRecord, DeviceHeader, HealthRecord, SceneRecord, StepRecord,
    StreamHeader, TaskHeader,
};
use groundloop::transport::{Bus, Depth, EventReader, Publisher, Subscriber, join};

/// Somebody at another node of the bus who steers the run.
struct Operator<'a> {
    bus: &'a Bus,
    controls: Publisher<DeviceHeader, ControlRecord>,
    decisions: Subscriber<StreamHeader, DecisionRecord>,
    events: EventReader,
    context: WireContext,
}

impl<'a> Operator<'a> {
    async fn at(bus: &'a Bus) -> Self {
        let controls = bus.publisher(&CONTROL).unwrap();
        let decisions = bus.subscriber(&DECISION, Depth::all(64)).unwrap();
        let events = EventReader::open(bus).unwrap();
        let (_, context) = join(bus).await.unwrap();
        Self { bus, controls, decisions, events, context }
    }

    fn ask(&self, control: Control) {
        self.controls.publish(device_header(0, 0), &[control_to_wire(control)]).unwrap();
    }

    async fn hear(&mut self, wanted: fn(&Event) -> bool) {
        while !wanted(&self.events.next().await.unwrap().event) {}
    }

    async fn decision(&mut self) -> DecisionMessage {
        let message = self.decisions.next().await.unwrap();
        decision_from_wire(message.header(), message.records(), &self.context).unwrap()
    }
}

/// An episode that an operator steers, who is gone when that is done.
fn steered<T>(
    sets: &[&str],
    steer: impl AsyncFnOnce(&mut Operator<'_>) -> T,
) -> (EpisodeReport, T) {
    let run = TestRun::new();
    let prepared = PreparedRun::read(small("blocksworld.toml", sets), None).unwrap();
    runtime().block_on(async {
        let bus = Bus::open(&run.bus("test")).unwrap();
        let theirs = Bus::open(&run.bus("test")).unwrap();
        let episode = run_episode(&prepared, EpisodeOptions { bus, snapshot: None });
        let steering = async {
            let mut operator = Operator::at(&theirs).await;
            steer(&mut operator).await
        };
        let (episode, steered) = tokio::join!(episode, steering);
        (episode.unwrap().report, steered)
    })
}

#[test]
fn a_paused_loop_answers_no_frame_but_those_it_is_stepped_through() {
    let (report, ()) = steered(&[], async |operator| {
        operator.hear(|event| matches!(event, Event::Started { .. })).await;
        operator.ask(Control::Pause);
        operator.hear(|event| *event == Event::Paused).await;
        // Every answer from before the pause has been told by now.
        let mut last = operator.decision().await;
        while let Some(message) = operator.decisions.poll_next().unwrap() {
            let (header, records) = (message.header(), message.records());
            last = decision_from_wire(header, records, &operator.context).unwrap();
        }
        for n in 1..=3 {
            operator.ask(Control::Step);
            let stepped = operator.decision().await;
            assert_eq!(stepped.cause.cycle, last.cause.cycle + n);
            assert!(operator.decisions.poll_next().unwrap().is_none(), "one cycle a step");
        }
        operator.ask(Control::Resume);
        operator.hear(|event| *event == Event::Resumed).await;
        operator.decision().await;
    });
    let calm = TestRun::new().run(small("blocksworld.toml", &[])).unwrap();
    assert_eq!(report.verdict, "reached");
    assert_eq!(report.decision_hash, calm.report.decision_hash, "a pause decides nothing");
}

#[test]
fn a_loop_that_is_stopped_while_it_is_paused_has_answered_nothing_more() {
    let (report, n_answered) = steered(&[], async |operator| {
        operator.decision().await;
        operator.ask(Control::Pause);
        operator.hear(|event| *event == Event::Paused).await;
        let mut n_answered = 1;
        while operator.decisions.poll_next().unwrap().is_some() {
            n_answered += 1;
        }
        operator.ask(Control::Stop(Stop::Request));
        operator.hear(|event| matches!(event, Event::End(_))).await;
        n_answered
    });
    assert_eq!((report.verdict, report.cycles), ("stopped", n_answered));
    assert_eq!(report.reason, "stopped on request; the robot was told to hold");
}

/// A pause in real time makes the robot hold; the step that it breaks off is done again.
#[test]
fn a_pause_in_real_time_holds_the_robot_and_the_goal_is_reached_all_the_same() {
    let (report, ()) = steered(&["clock=realtime"], async |operator| {
        operator.hear(|event| matches!(event, Event::Started { .. })).await;
        operator.ask(Control::Pause);
        operator.hear(|event| *event == Event::Paused).await;
        operator.ask(Control::Resume);
        operator.hear(|event| matches!(event, Event::Started { .. })).await;
    });
    assert_eq!((report.verdict, report.skills_failed), ("reached", 0), "{report:#?}");
}

/// A pause lasts though it is longer than a frame may be missing, and though who asked is gone.
#[test]
fn a_pause_outlasts_the_wait_for_a_frame() {
    let wait_s = 1.0;
    let n_reports = 4; // twice a second
    let (report, ()) = steered(&[&format!("camera.wait_s={wait_s}")], async |operator| {
        operator.decision().await;
        operator.ask(Control::Pause);
        operator.hear(|event| *event == Event::Paused).await;
        operator.controls = operator.bus.publisher(&CONTROL).unwrap();
        let mut healths: Subscriber<StreamHeader, HealthRecord> =
            operator.bus.subscriber(&HEALTH, Depth::all(64)).unwrap();
        for _ in 0..n_reports {
            healths.next().await.unwrap();
        }
        operator.ask(Control::Resume);
        operator.hear(|event| *event == Event::Resumed).await;
    });
    assert_eq!(report.verdict, "reached", "{report:#?}");
}

/// What a process that joins late has read of a run in another process.
async fn watch(bus: &Bus) -> (WireContext, usize, usize, Vec<ActorHealth>, Verdict) {
    let (run, context) = join(bus).await.unwrap();
    assert_eq!((run.run.as_str(), run.domain.as_str()), (bus.run(), "blocksworld"));
    assert!(run.config.contains("clock"), "{}", run.config);
    assert_eq!(run.program_version, env!("CARGO_PKG_VERSION"));
    let mut scenes: Subscriber<TaskHeader, SceneRecord> =
        bus.subscriber(&SCENE, Depth::all(64)).unwrap();
    let mut plans: Subscriber<TaskHeader, StepRecord> =
        bus.subscriber(&PLAN, Depth::all(64)).unwrap();
    let mut healths: Subscriber<StreamHeader, HealthRecord> =
        bus.subscriber(&HEALTH, Depth::all(64)).unwrap();
    let mut verdicts: Subscriber<StreamHeader, u8> =
        bus.subscriber(&VERDICT, Depth::newest()).unwrap();
    let read =
        |m: groundloop::transport::Received<_, _>| end_from_wire(m.header(), m.records(), &context);
    let (mut n_facts, mut n_steps, mut health) = (0, 0, Vec::new());
    loop {
        tokio::select! {
            scene = scenes.next() => {
                let message = scene.unwrap();
                let scene = scene_from_wire(message.header(), message.records(), &context);
                n_facts += scene.unwrap().facts.len();
            }
            plan = plans.next() => {
                let message = plan.unwrap();
                let plan = plan_from_wire(message.header(), message.records(), &context);
                if let PlanVerdict::Plan { steps, .. } = plan.unwrap().verdict {
                    n_steps += steps.len();
                }
            }
            report = healths.next() => {
                let message = report.unwrap();
                health = health_from_wire(message.header(), message.records(), &context).unwrap();
            }
            end = verdicts.newest_of(read) => {
                return (context, n_facts, n_steps, health, end.unwrap().verdict);
            }
        }
    }
}

#[test]
fn another_process_joins_by_the_description_and_reads_scenes_plans_events_and_health() {
    let name = unique_run("join");
    let sets = SMALL_CAMERA.iter().flat_map(|set| ["--set", *set]);
    let args = ["run", "configs/blocksworld.toml", "--json", "--run", name.as_str()];
    // Clearing what dead processes left may take longer than the episode.
    let bus = Bus::open(&groundloop::transport::BusConfig::for_run(name.as_str())).unwrap();
    let run = Process::start(&args.into_iter().chain(sets).collect::<Vec<_>>());
    let (told, seen) = runtime().block_on(async {
        let mut events = EventReader::open(&bus).unwrap();
        let told = async {
            let mut told = Vec::new();
            loop {
                let event = events.next().await.unwrap().event;
                told.push(event);
                if let Some(Event::End(verdict)) = told.last() {
                    return (verdict.clone(), told.len());
                }
            }
        };
        tokio::join!(told, watch(&bus))
    });
    let ((verdict, n_events), (context, n_facts, n_steps, health, end)) = (told, seen);
    assert_eq!((&verdict, &end), (&Verdict::Reached, &Verdict::Reached));
    assert!(n_events > 5 && n_facts > 0 && n_steps > 0, "{n_events} {n_facts} {n_steps}");
    assert_eq!(Arc::new(context).domain.name.as_str(), "blocksworld");
    let actors: Vec<&str> = health.iter().map(|actor| actor.actor.as_str()).collect();
    let expected = ["camera", "goal_parser", "planner", "robot", "scene_parser", "skill_executor"];
    assert_eq!(actors, expected);
    assert!(health.iter().all(|actor| actor.is_alive && actor.n_restarts == 0), "{health:?}");
    let ended = run.end();
    assert_eq!(ended.json()["verdict"], "reached", "{}", ended.stderr);
}
