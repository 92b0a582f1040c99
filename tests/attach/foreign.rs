//! Messages of another domain on the topics of an episode: they are dropped, and change nothing.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use crate::common::{TestRun, runtime, small};
use groundloop::transport::topics::{GOAL, OUTCOME, PLAN, SCENE};
use groundloop::transport::wire::{OutcomeRecord, SceneRecord, StepRecord, TaskHeader};
use groundloop::transport::{Bus, BusConfig, Depth, Publisher, Subscriber};
use tokio::sync::watch;

/// No domain's hash.
const FOREIGN: u64 = 1;

/// Answers each scene of a run at once with foreign messages, until told to stop.
async fn answer(bus: BusConfig, mut stop: watch::Receiver<bool>) -> u64 {
    let bus = Bus::open(&bus).unwrap();
    let mut heard: Subscriber<TaskHeader, SceneRecord> =
        bus.subscriber(&SCENE, Depth::newest()).unwrap();
    let scenes: Publisher<TaskHeader, SceneRecord> = bus.publisher(&SCENE).unwrap();
    let plans: Publisher<TaskHeader, StepRecord> = bus.publisher(&PLAN).unwrap();
    let goals: Publisher<TaskHeader, u8> = bus.publisher(&GOAL).unwrap();
    let outcomes: Publisher<TaskHeader, OutcomeRecord> = bus.publisher(&OUTCOME).unwrap();
    let mut n_answered = 0;
    loop {
        let header = tokio::select! {
            scene = heard.next() => *scene.unwrap().header(),
            _ = stop.wait_for(|stop| *stop) => return n_answered,
        };
        if header.domain_hash != FOREIGN {
            let foreign = TaskHeader { domain_hash: FOREIGN, ..header };
            scenes.publish(foreign, &[SceneRecord::default()]).unwrap();
            plans.publish(foreign, &[StepRecord::default()]).unwrap();
            goals.publish(foreign, b"(:goal (and))").unwrap();
            outcomes.publish(foreign, &[OutcomeRecord::default()]).unwrap();
            n_answered += 1;
        }
    }
}

#[test]
fn foreign_messages_change_no_decision() {
    let config = small(
        "blocksworld.toml",
        &["sim.scene=scenes/three_blocks.toml", "goal.text=red over blue over green"],
    );
    let calm = TestRun::new().run(config.clone()).unwrap();
    let run = TestRun::new();
    let stop = watch::Sender::new(false);
    let (disturbed, n_answered) = std::thread::scope(|scope| {
        let foreign = answer(run.bus("test"), stop.subscribe());
        let foreign = scope.spawn(move || runtime().block_on(foreign));
        let episode = run.run(config);
        stop.send_replace(true);
        (episode.unwrap(), foreign.join().unwrap())
    });
    assert!(n_answered > 10, "{n_answered}");
    assert_eq!(disturbed.report.verdict, "reached");
    assert_eq!(disturbed.report.decision_hash, calm.report.decision_hash);
}
