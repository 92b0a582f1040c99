//! A long-lived run: goals from the bus, one after another, on hardware that lives on.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the test")]

use std::collections::BTreeMap;

use crate::common::{TestRun, runtime, small};
use groundloop::messages::{
    CommandKind, Event, Stop, Submission, TaskRequest, TaskState, TaskStatus, Verdict,
};
use groundloop::metrics::EpisodeReport;
use groundloop::run::{PreparedRun, ServeNews, ServeOptions, serve};
use groundloop::transport::convert::command_from_wire;
use groundloop::transport::topics::{ROBOT_COMMAND, TASK_STATUS};
use groundloop::transport::wire::{CommandRecord, DeviceHeader};
use groundloop::transport::{Bus, Depth, EventReader, Subscriber, TaskClient};
use tokio::sync::{mpsc, watch};

const THREE_BLOCKS: &str = "sim.scene=scenes/three_blocks.toml";
const UP: &str = "red over blue over green";
const DOWN: &str = "green over blue over red";

/// Ten goals for three blocks, and what is read out of them.
const TEN: [(&str, &str); 10] = [
    (UP, "(and (on red_block blue_block) (on blue_block green_block))"),
    (DOWN, "(and (on green_block blue_block) (on blue_block red_block))"),
    ("blue over red", "(on blue_block red_block)"),
    ("red over green", "(on red_block green_block)"),
    ("green over red", "(on green_block red_block)"),
    (UP, "(and (on red_block blue_block) (on blue_block green_block))"),
    ("blue over green", "(on blue_block green_block)"),
    (DOWN, "(and (on green_block blue_block) (on blue_block red_block))"),
    ("red over blue", "(on red_block blue_block)"),
    ("blue over red over green", "(and (on blue_block red_block) (on red_block green_block))"),
];

fn submission(id: &str, text: &str) -> Submission {
    Submission { id: id.to_owned(), kind: None, text: text.to_owned() }
}

fn submit(id: &str, text: &str) -> TaskRequest {
    TaskRequest::Submit(submission(id, text))
}

fn cancel(id: &str) -> TaskRequest {
    TaskRequest::Cancel { id: id.to_owned() }
}

/// Reports of the episodes that came to a verdict.
fn reports(told: &Told) -> Vec<EpisodeReport> {
    told.iter().filter_map(|(_, report)| report.clone()).collect()
}

fn hashes(reports: Vec<EpisodeReport>) -> Vec<String> {
    reports.into_iter().map(|report| report.decision_hash).collect()
}

/// What a long-lived run told its own process: each status, with the report of an episode.
type Told = Vec<(TaskStatus, Option<EpisodeReport>)>;

/// Somebody who asks, at a node of the bus of its own.
struct Client {
    bus: Bus,
    tasks: TaskClient,
}

impl Client {
    fn ask(&mut self, request: &TaskRequest) {
        self.tasks.ask(request).unwrap();
    }

    /// What is said next of a goal.
    async fn next_of(&mut self, id: &str) -> TaskState {
        loop {
            let status = self.tasks.next().await.unwrap();
            if status.task.id == id {
                return status.state;
            }
        }
    }

    /// What becomes of a goal that has been submitted.
    async fn end_of(&mut self, id: &str) -> TaskState {
        loop {
            let state = self.next_of(id).await;
            if state.is_over() {
                return state;
            }
        }
    }

    async fn carry_out(&mut self, id: &str, text: &str) -> TaskState {
        self.tasks.carry_out(&submission(id, text), |_| {}).await.unwrap().state
    }
}

/// A long-lived run that somebody asks for goals, and then stops. The run's own account is given, too.
fn served<T>(sets: &[&str], ask: impl AsyncFnOnce(&mut Client) -> T) -> (T, Told) {
    let run = TestRun::new();
    let sets = [&[THREE_BLOCKS], sets].concat();
    let prepared = PreparedRun::read(small("blocksworld.toml", &sets), None).unwrap();
    runtime().block_on(async {
        let bus = Bus::open(&run.bus("test")).unwrap();
        let theirs = Bus::open(&run.bus("test")).unwrap();
        let (stop, stopped) = watch::channel(None);
        let (news, mut heard) = mpsc::channel(1024);
        let serving = serve(&prepared, ServeOptions { bus, stop: stopped, news });
        let asking = async {
            let told = heard.recv().await.unwrap();
            assert!(matches!(told, ServeNews::Ready), "{told:?}");
            let tasks = TaskClient::open(&theirs).unwrap();
            let answer = ask(&mut Client { bus: theirs, tasks }).await;
            stop.send_replace(Some(Stop::Terminate));
            answer
        };
        let (ended, answer) = tokio::join!(serving, asking);
        assert_eq!(ended.unwrap(), (Stop::Terminate, false));
        let mut told = Vec::new();
        while let Ok(news) = heard.try_recv() {
            let ServeNews::Status(status, report) = news else { panic!("ready twice") };
            told.push((*status, report.map(|report| *report)));
        }
        (answer, told)
    })
}

#[track_caller]
fn is_reached(state: &TaskState, goal: &str) {
    let TaskState::Done(result) = state else { panic!("{state}") };
    assert_eq!((&result.end, result.goal_in_simulator), (&Verdict::Reached, Some(true)), "{goal}");
    assert_eq!(result.goal, goal);
}

/// The first `n` goals, which all wait from the start; the identities of the motions that the robot was told.
fn goals_of(n: usize) -> (Vec<TaskState>, Vec<u64>, Told) {
    let ((states, ids), told) = served(&[], async |client| {
        let mut commands: Subscriber<DeviceHeader, CommandRecord> =
            client.bus.subscriber(&ROBOT_COMMAND, Depth::all(64)).unwrap();
        let mut started = Vec::new();
        for (idx, (text, _)) in TEN.iter().take(n).enumerate() {
            client.ask(&submit(&format!("goal-{idx}"), text));
        }
        let mut states = Vec::new();
        while states.len() < n {
            let id = format!("goal-{}", states.len());
            tokio::select! {
                biased;
                command = commands.next() => {
                    let command = command.unwrap();
                    let command = command_from_wire(command.header(), command.records()).unwrap();
                    if let CommandKind::Start(_) = command.kind {
                        started.push(command.id);
                    }
                }
                state = client.end_of(&id) => states.push(state),
            }
        }
        (states, started)
    });
    (states, ids, told)
}

#[test]
fn ten_goals_are_reached_one_after_another_and_the_same_each_time() {
    let (states, ids, told) = goals_of(TEN.len());
    for (state, (_, goal)) in states.iter().zip(TEN) {
        is_reached(state, goal);
    }
    assert!(ids.len() > TEN.len() && ids.is_sorted_by(|a, b| a < b), "motions: {ids:?}");
    let first = reports(&told);
    assert_eq!(first.len(), TEN.len());
    for report in &first {
        let audit = report.dispatches.as_ref().unwrap();
        assert_eq!(audit.n_dispatches, report.skills_done, "those of this goal: {report:#?}");
        assert_eq!((audit.against_truth.len(), report.frames), (0, report.cycles), "{report:#?}");
    }
    let (_, _, again) = goals_of(2);
    let (first, again) = (hashes(first), hashes(reports(&again)));
    assert_eq!(first[..2], again, "decisions do not depend on the machine");
}

#[test]
fn a_goal_that_cannot_be_read_is_refused_and_the_next_is_taken() {
    let ((), told) = served(&[], async |client| {
        let refused = |state: TaskState, said: &str| {
            let TaskState::Refused { reason } = &state else { panic!("{state}") };
            assert!(reason.contains(said), "{reason}");
        };
        is_reached(&client.carry_out("1", UP).await, TEN[0].1);
        refused(client.carry_out("2", "the moon over blue").await, "\"moon\" is not a word");
        let kind = Some("telepathy".to_owned());
        let task = Submission { kind, ..submission("3", UP) };
        let status = client.tasks.carry_out(&task, |_| {}).await.unwrap();
        refused(status.state, "expected image or instruction");
        let kind = Some("logical".to_owned());
        let task = Submission { kind: kind.clone(), ..submission("4", "(on red_block") };
        let status = client.tasks.carry_out(&task, |_| {}).await.unwrap();
        refused(status.state, "goal 4");
        let task = Submission { kind, ..submission("5", "(on green_block red_block)") };
        let status = client.tasks.carry_out(&task, |_| {}).await.unwrap();
        is_reached(&status.state, "(on green_block red_block)");
    });
    assert_eq!(told.iter().filter(|(_, report)| report.is_some()).count(), 2);
}

/// What a goal comes to is a result, whatever it is.
#[test]
fn a_goal_that_gives_up_does_not_end_the_run() {
    let sets = ["limits.unseen_s_max=1"];
    served(&sets, async |client| {
        let kind = Some("logical".to_owned());
        let task = Submission { kind, ..submission("1", "(on red_block sofa)") };
        let status = client.tasks.carry_out(&task, |_| {}).await.unwrap();
        let TaskState::Done(result) = &status.state else { panic!("{}", status.state) };
        assert_eq!(result.end.word(), "gave-up");
        is_reached(&client.carry_out("2", UP).await, TEN[0].1);
    });
}

/// A goal that is cancelled while the robot carries something: it holds, and the next goal goes on from there.
#[test]
fn what_runs_is_cancelled_in_the_middle_of_a_step_and_what_waits_is_taken_away() {
    served(&[], async |client| {
        let mut events = EventReader::open(&client.bus).unwrap();
        client.ask(&submit("runs", UP));
        client.ask(&submit("waits", DOWN));
        let is_carrying = |event: &Event| matches!(event, Event::Started { step } if step.action.as_str() == "put_down");
        while !is_carrying(&events.next().await.unwrap().event) {}
        client.ask(&cancel("waits"));
        let TaskState::Cancelled { reason } = client.end_of("waits").await else { panic!() };
        assert!(reason.contains("before it had begun"), "{reason}");
        client.ask(&cancel("runs"));
        let TaskState::Cancelled { reason } = client.end_of("runs").await else { panic!() };
        assert!(reason.contains("the robot was told to hold"), "{reason}");
        is_reached(&client.carry_out("next", DOWN).await, TEN[1].1);
        client.ask(&cancel("nobody"));
        let TaskState::Refused { reason } = client.end_of("nobody").await else { panic!() };
        assert_eq!(reason, "no goal of this id is known");
    });
}

#[test]
fn a_repeated_request_is_answered_and_not_carried_out_twice() {
    let ((), told) = served(&[], async |client| {
        for _ in 0..3 {
            client.ask(&submit("one", UP));
        }
        let first = client.end_of("one").await;
        is_reached(&first, TEN[0].1);
        client.ask(&submit("one", DOWN));
        assert_eq!(client.end_of("one").await, first);
    });
    let words: Vec<&str> = told.iter().map(|(status, _)| status.state.word()).collect();
    assert_eq!(words, ["queued", "running", "done"]);
}

#[test]
fn what_does_not_fit_into_the_queue_is_refused() {
    served(&["serve.queue_max=1"], async |client| {
        client.ask(&submit("runs", UP));
        while client.next_of("runs").await != TaskState::Running {}
        client.ask(&submit("waits", DOWN));
        client.ask(&submit("much", "red over blue"));
        let TaskState::Refused { reason } = client.end_of("much").await else { panic!() };
        assert!(reason.contains("serve.queue_max"), "{reason}");
        is_reached(&client.end_of("waits").await, TEN[1].1);
        is_reached(&client.carry_out("much", "red over blue").await, TEN[8].1);
    });
}

/// Whoever comes late hears what has become of goals; viewers hear the events of all of them.
#[test]
fn late_joiners_and_viewers_hear_of_every_goal() {
    served(&[], async |client| {
        let mut events = EventReader::open(&client.bus).unwrap();
        let watching = async {
            let (mut goals, mut n_ends) = (Vec::new(), 0);
            while n_ends < 2 {
                let event = events.next().await.unwrap().event;
                n_ends += usize::from(event == Event::End(Verdict::Reached));
                if let Event::Goal { goal, .. } = event {
                    goals.push(goal);
                }
            }
            goals
        };
        let asking = async {
            is_reached(&client.carry_out("1", UP).await, TEN[0].1);
            is_reached(&client.carry_out("2", DOWN).await, TEN[1].1);
        };
        let (goals, ()) = tokio::join!(watching, asking);
        assert_eq!(goals, [TEN[0].1, TEN[1].1]);

        let mut late = TaskClient::open(&client.bus).unwrap();
        let mut known: BTreeMap<String, TaskStatus> = BTreeMap::new();
        while !known.get("2").is_some_and(|status| status.state.is_over()) {
            let status = late.next().await.unwrap();
            known.insert(status.task.id.clone(), status);
        }
        assert_eq!(known["1"].task, submission("1", UP));
        is_reached(&known["1"].state, TEN[0].1);
        let uses = client.bus.uses::<DeviceHeader, u8>(&TASK_STATUS).unwrap();
        assert_eq!(uses[0], 1, "one writer");
    });
}
