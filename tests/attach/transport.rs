//! The bus: newest wins, nothing reliable is lost, late joiners get what a topic keeps, name
//! spaces do not see one another.

#![expect(clippy::expect_used, reason = "a bus that does not open must fail the test")]

use std::num::NonZeroU32;
use std::sync::Arc;

use crate::common::TestRun;
use groundloop::transport::topics::{GOAL, RELIABLE_DEPTH, ROBOT_COMMAND, SCENE};
use groundloop::transport::wire::{CommandRecord, DeviceHeader, SCHEMA, SceneRecord, TaskHeader};
use groundloop::transport::{
    Bus, Delivery, Depth, Drops, Outgoing, Publisher, SendHook, Subscriber,
};

/// Loses the second message, sends the third twice, and the fourth behind the sixth.
#[derive(Debug)]
struct Clumsy;

impl SendHook for Clumsy {
    fn delivery(&self, message: Outgoing) -> Delivery {
        assert_eq!(message.topic, "robot/command");
        match message.sequence {
            1 => Delivery::Lost,
            2 => Delivery::Twice,
            3 => Delivery::Late(NonZeroU32::new(2).expect("2 is not 0")),
            _ => Delivery::Sent,
        }
    }
}

/// Whatever happens on the way, a reader goes on only.
#[tokio::test(flavor = "multi_thread")]
async fn lost_doubled_and_late_messages_are_no_news() {
    let test = open("disturbed");
    let commands: Publisher<DeviceHeader, CommandRecord> =
        test.bus.disturbed(Arc::new(Clumsy)).publisher(&ROBOT_COMMAND).unwrap();
    let mut all: Subscriber<DeviceHeader, CommandRecord> =
        test.bus.subscriber(&ROBOT_COMMAND, Depth::all(RELIABLE_DEPTH)).unwrap();
    let mut newest: Subscriber<DeviceHeader, CommandRecord> =
        test.bus.subscriber(&ROBOT_COMMAND, Depth::all(RELIABLE_DEPTH)).unwrap();
    for sequence in 0..=5 {
        commands.publish(device(sequence), &[CommandRecord::default()]).unwrap();
    }
    assert_eq!(newest.newest().await.unwrap().header().sequence, 5);
    let mut seen = Vec::new();
    while let Some(message) = all.poll_next().unwrap() {
        seen.push(message.header().sequence);
    }
    assert_eq!(seen, [0, 2, 4, 5]);
    assert_eq!(all.drops(), Drops { missed: 2, late: 2, ..Drops::default() });
}

/// A bus of its own: own root, own prefix.
struct TestBus {
    bus: Bus,
    run: TestRun,
}

fn open(name: &str) -> TestBus {
    let run = TestRun::new();
    let bus = Bus::open(&run.bus(name)).expect("the bus opens");
    TestBus { bus, run }
}

fn task(cycle: u64) -> TaskHeader {
    TaskHeader { cycle, ..TaskHeader::default() }
}

fn device(sequence: u64) -> DeviceHeader {
    DeviceHeader { schema: SCHEMA, sequence, ..DeviceHeader::default() }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_newest_message_wins_and_the_others_are_counted() {
    let test = open("newest");
    let scenes: Publisher<TaskHeader, SceneRecord> = test.bus.publisher(&SCENE).unwrap();
    let mut reader: Subscriber<TaskHeader, SceneRecord> =
        test.bus.subscriber(&SCENE, Depth::newest()).unwrap();
    scenes.publish(task(0), &[]).unwrap();
    assert_eq!(reader.newest().await.unwrap().header().cycle, 0);
    for cycle in 1..=9 {
        scenes.publish(task(cycle), &[SceneRecord::default(); 3]).unwrap();
    }
    let newest = reader.newest().await.unwrap();
    assert_eq!(newest.header().cycle, 9);
    assert_eq!(newest.records().len(), 3);
    assert_eq!(reader.drops(), Drops { missed: 7, ..Drops::default() });
}

/// Two readers of one topic: one wants the newest scene, the other one, a recorder, all of them.
#[tokio::test(flavor = "multi_thread")]
async fn how_much_waits_is_the_affair_of_each_reader() {
    let test = open("depth");
    let scenes: Publisher<TaskHeader, SceneRecord> = test.bus.publisher(&SCENE).unwrap();
    let mut viewer: Subscriber<TaskHeader, SceneRecord> =
        test.bus.subscriber(&SCENE, Depth::newest()).unwrap();
    let mut recorder: Subscriber<TaskHeader, SceneRecord> =
        test.bus.subscriber(&SCENE, Depth::all(64)).unwrap();
    for cycle in 0..64 {
        scenes.publish(task(cycle), &[SceneRecord::default(); 3]).unwrap();
    }
    assert_eq!(viewer.newest().await.unwrap().header().cycle, 63);
    for cycle in 0..64 {
        assert_eq!(recorder.next().await.unwrap().header().cycle, cycle);
    }
    assert_eq!(recorder.drops(), Drops::default());
    let error = test.bus.subscriber::<TaskHeader, SceneRecord>(&SCENE, Depth::all(65));
    let expect = "cannot open topic scene: 65 messages waiting, at most 64";
    assert_eq!(error.unwrap_err().to_string(), expect);
}

/// As many readers as a recorder, viewers and all actors of a large run are.
#[tokio::test(flavor = "multi_thread")]
async fn a_topic_has_room_for_many_readers() {
    let test = open("many");
    let scenes: Publisher<TaskHeader, SceneRecord> = test.bus.publisher(&SCENE).unwrap();
    let readers = (0..16).map(|_| test.bus.subscriber(&SCENE, Depth::newest()).unwrap());
    let mut readers: Vec<Subscriber<TaskHeader, SceneRecord>> = readers.collect();
    scenes.publish(task(1), &[SceneRecord::default()]).unwrap();
    for reader in &mut readers {
        assert_eq!(reader.newest().await.unwrap().header().cycle, 1);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reliable_topic_delivers_all_in_order() {
    let test = open("reliable");
    let commands: Publisher<DeviceHeader, CommandRecord> =
        test.bus.publisher(&ROBOT_COMMAND).unwrap();
    let mut reader: Subscriber<DeviceHeader, CommandRecord> =
        test.bus.subscriber(&ROBOT_COMMAND, Depth::all(RELIABLE_DEPTH)).unwrap();
    for sequence in 0..20 {
        commands.publish(device(sequence), &[CommandRecord::default()]).unwrap();
    }
    for sequence in 0..20 {
        assert_eq!(reader.next().await.unwrap().header().sequence, sequence);
    }
    assert_eq!(reader.drops(), Drops::default());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_late_joiner_gets_what_the_topic_keeps() {
    let test = open("late");
    let goal: Publisher<TaskHeader, u8> = test.bus.publisher(&GOAL).unwrap();
    goal.publish(task(0), b"(:goal (p))").unwrap();
    for _ in 0..3 {
        let mut late: Subscriber<TaskHeader, u8> =
            test.bus.subscriber(&GOAL, Depth::newest()).unwrap();
        assert_eq!(late.newest().await.unwrap().records(), b"(:goal (p))");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_message_of_another_schema_is_counted_and_skipped() {
    let test = open("schema");
    let scenes: Publisher<TaskHeader, SceneRecord> = test.bus.publisher(&SCENE).unwrap();
    let mut reader: Subscriber<TaskHeader, SceneRecord> =
        test.bus.subscriber(&SCENE, Depth::newest()).unwrap();
    scenes.publish(TaskHeader { schema: SCHEMA + 1, ..task(0) }, &[]).unwrap();
    scenes.publish(task(1), &[]).unwrap();
    assert_eq!(reader.newest().await.unwrap().header().cycle, 1);
    assert_eq!(reader.drops().foreign, 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn runs_do_not_see_one_another() {
    let test = open("spaces");
    let (ours, theirs) =
        (Bus::open(&test.run.bus("a")).unwrap(), Bus::open(&test.run.bus("b")).unwrap());
    let sender: Publisher<TaskHeader, SceneRecord> = theirs.publisher(&SCENE).unwrap();
    let mut reader: Subscriber<TaskHeader, SceneRecord> =
        ours.subscriber(&SCENE, Depth::newest()).unwrap();
    let own: Publisher<TaskHeader, SceneRecord> = ours.publisher(&SCENE).unwrap();
    sender.publish(task(1), &[]).unwrap();
    own.publish(task(2), &[]).unwrap();
    assert_eq!(reader.newest().await.unwrap().header().cycle, 2);
    assert_eq!(reader.drops(), Drops::default());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_long_message_grows_the_memory() {
    let test = open("grow");
    let goal: Publisher<TaskHeader, u8> = test.bus.publisher(&GOAL).unwrap();
    let mut reader: Subscriber<TaskHeader, u8> =
        test.bus.subscriber(&GOAL, Depth::newest()).unwrap();
    let long = vec![7_u8; 1 << 20];
    goal.publish(task(0), &long).unwrap();
    assert_eq!(reader.newest().await.unwrap().records(), &long[..]);
}

/// What cannot be opened is told in words, with what to do.
#[tokio::test(flavor = "multi_thread")]
async fn what_does_not_open_is_told_with_its_remedy() {
    let test = open("refused");
    let writers: Result<Vec<Publisher<TaskHeader, u8>>, _> =
        (0..=GOAL.writers_max).map(|_| test.bus.publisher(&GOAL)).collect();
    let said = writers.map(drop).unwrap_err().to_string();
    let expected = "cannot open shared memory for topic goal: exceeds max supported publishers \
                    (another process writes it already: end it, or give this run a `run` of its own)";
    assert_eq!(said, expected);
    let _goal: Publisher<TaskHeader, u8> = test.bus.publisher(&GOAL).unwrap();
    let readers: Result<Subscriber<TaskHeader, SceneRecord>, _> =
        test.bus.subscriber(&GOAL, Depth::newest());
    let said = readers.map(drop).unwrap_err().to_string();
    assert!(said.contains("incompatible types (a process of another version of"), "{said}");
    let said = Bus::open(&test.run.bus(&"x".repeat(65))).map(drop).unwrap_err().to_string();
    assert!(said.contains("expected 1 to 64 letters a-z, digits, '-', '_' or '.'"), "{said}");
}
