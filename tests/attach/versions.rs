//! Two versions of the program on one bus: each refuses the other by name, and none misreads what the other says.
//! Cameras and robots of another version: `silence.rs` and `robot_alone.rs`.

use crate::common::external;
use crate::common::{Process, runtime, unique_run};
use groundloop::messages::{Command, CommandKind, RunDescriptor};
use groundloop::transport::convert::{command_to_wire, device_header, run_to_wire};
use groundloop::transport::topics::{ROBOT_COMMAND, RUN};
use groundloop::transport::wire::{CommandRecord, DeviceHeader, SCHEMA};
use groundloop::transport::{Bus, BusConfig, Publisher, join};
use iceoryx2::prelude::*;

const OTHER: u32 = SCHEMA + 1;

/// What a reader says of messages of another schema.
fn refusal() -> String {
    format!("a message of schema {OTHER}, and this program reads schema {SCHEMA}: run one version")
}

/// Camera and robot of this version, a run of another one.
#[test]
fn hardware_refuses_a_run_of_another_version() {
    let name = unique_run("other-run");
    let mut hardware = external::hardware(&name, &[]);
    runtime().block_on(async {
        let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
        let commands: Publisher<DeviceHeader, CommandRecord> =
            bus.publisher(&ROBOT_COMMAND).unwrap();
        let kind = CommandKind::Continue;
        let command = Command { id: 1, frame_sequence: 0, capture_ns: 0, kind, step: None };
        let header = DeviceHeader { schema: OTHER, ..device_header(0, 0) };
        commands.publish(header, &[command_to_wire(&command).unwrap()]).unwrap();
        hardware.wait_for_line(&refusal());
    });
}

fn description(domain_text: &str) -> RunDescriptor {
    RunDescriptor {
        run_id: 7,
        run: "other".to_owned(),
        domain: "d".to_owned(),
        domain_text: domain_text.to_owned(),
        domain_hash: 1,
        config: String::new(),
        seed: 1,
        program_version: "9.9.9".to_owned(),
        wire_schema: SCHEMA,
        takes_tasks: false,
    }
}

/// A viewer of this version passes a run of another version by.
#[test]
fn a_viewer_joins_no_run_of_another_version() {
    let name = unique_run("other-viewed");
    runtime().block_on(async {
        let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
        let runs: Publisher<DeviceHeader, u8> = bus.publisher(&RUN).unwrap();
        let (header, text) = run_to_wire(&description("not read")).unwrap();
        runs.publish(DeviceHeader { schema: OTHER, ..header }, &text).unwrap();
        let good = "(define (domain d) (:predicates (p)))";
        let (header, text) = run_to_wire(&description(good)).unwrap();
        let joined = join(&bus);
        tokio::pin!(joined);
        // It looks at what there is, and goes on waiting.
        assert!(futures_now(joined.as_mut()).await.is_none());
        runs.publish(header, &text).unwrap();
        assert_eq!(joined.await.unwrap().0.domain_text, good);
    });
}

/// What a future comes to at once, if it does.
async fn futures_now<F: Future + Unpin>(mut future: F) -> Option<F::Output> {
    tokio::select! {
        biased;
        done = &mut future => Some(done),
        () = std::future::ready(()) => None,
    }
}

/// A header of another layout, as a version has that changed it.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("groundloop.DeviceHeader.v99")]
#[repr(C)]
struct OtherHeader {
    schema: u32,
    more: [u64; 9],
}

/// Layouts that differ do not even share a topic.
#[test]
fn a_run_does_not_start_on_a_topic_of_another_layout() {
    let name = unique_run("other-layout");
    let _bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
    let place = BusConfig::for_run(name.clone());
    let mut config = Config::default();
    let root = format!("/dev/shm/groundloop-{}", rustix::process::getuid().as_raw());
    config.global.set_root_path(&root.as_str().try_into().unwrap());
    config.global.prefix = place.prefix.as_str().try_into().unwrap();
    let node = NodeBuilder::new().config(&config).create::<ipc_threadsafe::Service>().unwrap();
    let service = ServiceName::new(&format!("groundloop/{name}/robot/state")).unwrap();
    let other = node.service_builder(&service).publish_subscribe::<[u8]>();
    let _other = other.user_header::<OtherHeader>().create().unwrap();
    let ended = external::run(&name, &[]).0.end();
    assert_eq!(ended.status.code(), Some(1), "{}", ended.stderr);
    let expect = "cannot open shared memory for topic robot/state: incompatible types (a process of another \
                  version of groundloop has it open";
    assert!(ended.stderr.contains(expect), "{}", ended.stderr);
}

/// A name that a run of another version has is taken all the same.
#[test]
fn a_second_run_of_a_name_is_refused_whatever_the_version_of_the_first() {
    let name = unique_run("other-first");
    runtime().block_on(async {
        let bus = Bus::open(&BusConfig::for_run(name.clone())).unwrap();
        let runs: Publisher<DeviceHeader, u8> = bus.publisher(&RUN).unwrap();
        runs.publish(DeviceHeader { schema: OTHER, ..DeviceHeader::default() }, b"{}").unwrap();
        let second = Process::start(&["run", external::CONFIG, "--run", &name]);
        let ended = tokio::task::spawn_blocking(|| second.end()).await.unwrap();
        assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
        assert!(ended.stderr.contains("has a writer already"), "{}", ended.stderr);
    });
}
