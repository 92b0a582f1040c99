//! Actors on a bus, driven by hand.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::skill_executor::{self, SkillExecutorArgs};
use super::{Checkpoint, CommandLine, Monitor};
use crate::clock::ClockKind;
use crate::executive::ExecutiveConfig;
use crate::messages::{PlanMessage, PlanVerdict};
use crate::run::{DomainFolder, load_run};
use crate::scene::{FrameRef, Scene};
use crate::transport::convert::{WireContext, decision_from_wire, plan_to_wire, scene_to_wire};
use crate::transport::topics::{DECISION, PLAN, RELIABLE_DEPTH, SCENE};
use crate::transport::{Bus, BusConfig, Depth};

/// The executor of a run in which nothing acts.
fn executor(bus: &Bus) -> SkillExecutorArgs {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = DomainFolder::read(&root.join("domains/blocksworld")).unwrap();
    let run = load_run(&root.join("configs/blocksworld.toml"), &[]).unwrap();
    let config = ExecutiveConfig {
        domain: folder.domain.clone(),
        skills: folder.skills.unwrap(),
        motion: None,
        limits: run.limits,
        mode: run.executive,
    };
    SkillExecutorArgs {
        bus: bus.clone(),
        context: Arc::new(WireContext::new(1, folder.hash, folder.domain)),
        config: Arc::new(config),
        clock: ClockKind::Lockstep,
        commands: Arc::new(CommandLine::open(bus).unwrap()),
        frame_s: 0.1,
        robot_wait: Duration::from_secs(10),
        checkpoint: Checkpoint::default(),
        monitor: Monitor::default(),
    }
}

/// A reader is not connected to all its topics at the same moment: the plan may come before the scene
/// that it was made for. In lockstep nobody sends another one.
#[tokio::test]
async fn a_plan_that_comes_before_its_scene_is_answered() {
    let root = tempfile::tempdir().unwrap();
    let prefix = root.path().file_name().unwrap().to_str().unwrap().replace('.', "");
    let path = Some(root.path().to_owned());
    let bus = Bus::open(&BusConfig { root: path, prefix, run: "early".to_owned() }).unwrap();
    let mut decisions = bus.subscriber(&DECISION, Depth::all(RELIABLE_DEPTH)).unwrap();
    let [plans, scenes] = [&PLAN, &SCENE];
    let (plans, scenes) = (bus.publisher(plans).unwrap(), bus.publisher(scenes).unwrap());
    let args = Arc::new(executor(&bus));
    let context = Arc::clone(&args.context);
    let served = tokio::spawn(skill_executor::serve(args));

    let cause = FrameRef { cycle: 7, ..FrameRef::default() };
    let plan = PlanMessage::new(cause, PlanVerdict::Missing { objects: Vec::new() });
    let (header, records) = plan_to_wire(&plan, &context).unwrap();
    plans.publish(header, &records).unwrap();
    // The executor has taken the plan in when nothing else is left to do.
    for _ in 0..1000 {
        tokio::task::yield_now().await;
    }
    let scene = Scene { cause, ..Scene::default() };
    let (header, records) = scene_to_wire(&scene, &context).unwrap();
    scenes.publish(header, &records).unwrap();

    let message = decisions.next().await.unwrap();
    let decision = decision_from_wire(message.header(), message.records(), &context).unwrap();
    assert_eq!((decision.plan_cycle, decision.cause.cycle), (7, 7));
    served.abort();
}
