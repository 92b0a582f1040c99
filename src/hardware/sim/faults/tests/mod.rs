//! Faults in a simulated world with a robot that carries out motions: when they happen, what each does,
//! and how it is told apart from the others.

mod sensing;

use std::fs;
use std::path::Path;

use groundloop_sim::BodyTruth;
use nalgebra::Point3;
use proptest::prelude::*;
use tempfile::TempDir;

use super::*;
use crate::clock::ClockKind;
use crate::files::Folder;
use crate::hardware::Robot;
use crate::hardware::sim::{SimHardware, SimSetup};
use crate::messages::{Command, CommandKind, Expect, Motion, Status, StatusKind, Waypoint};
use crate::pddl::Step;
use crate::run::load_run;

const RATE_HZ: f64 = 30.0;
/// Red on blue, and green and yellow beside them.
const SCENE: &str = r#"
    [arrangement]
    kind = "fixed"
    stacks = [
        { at_m = [0.0, 0.0], bodies = ["blue_block", "red_block"] },
        { at_m = [0.15, 0.0], bodies = ["green_block"] },
        { at_m = [-0.15, 0.0], bodies = ["yellow_block"] },
    ]
"#;

/// A simulated robot with faults, and what it has said.
struct Bench {
    hardware: SimHardware,
    robot: Box<dyn Robot>,
    said: Vec<Status>,
    n_frames: u64,
    n_commands: u64,
}

fn faults(text: &str) -> Vec<FaultConfig> {
    let table: toml::Table = text.parse().unwrap();
    table["fault"].clone().try_into().unwrap()
}

fn bench(faults_text: &str, seed: u64) -> Bench {
    let folder = TempDir::new().unwrap();
    let blocks = ["blue", "red", "green", "yellow"].map(|colour| {
        let shape = "shape = { kind = \"block\", size_m = 0.05 }";
        format!("[[bodies]]\nname = \"{colour}_block\"\n{shape}\ncolour = \"#d0282c\"\n")
    });
    fs::write(folder.path().join("scene.toml"), blocks.concat() + SCENE).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = load_run(&root.join("configs/blocksworld.toml"), &[]).unwrap();
    let mut sim = config.sim().unwrap();
    "scene.toml".clone_into(&mut sim.scene);
    let setup = SimSetup {
        sim: &sim,
        folder: &Folder::Disk(folder.path().to_owned()),
        faults: &faults(faults_text),
        clock: ClockKind::Lockstep,
        rate_hz: RATE_HZ,
        seed,
    };
    let hardware = SimHardware::build(&setup).unwrap();
    let robot = hardware.robot();
    Bench { hardware, robot, said: Vec::new(), n_frames: 0, n_commands: 0 }
}

impl Bench {
    fn tell(&mut self, kind: CommandKind, step: Option<&str>) {
        let step = step.map(|text| {
            let words: Vec<&str> = text.split(' ').collect();
            Step::new(words[0], &words[1..])
        });
        self.n_commands += u64::from(matches!(kind, CommandKind::Start(_)));
        let (id, frame_sequence) = (self.n_commands, self.n_frames);
        self.robot.accept(&Command { id, frame_sequence, capture_ns: 0, kind, step });
        self.n_frames += 1;
        self.said.extend(self.robot.pending());
        self.robot.published();
    }

    /// The robot says what it says first, so that a frame may be captured.
    fn open(&mut self) {
        self.robot.published();
    }

    /// Answers a frame with "continue".
    fn answer(&mut self, frame_sequence: u64) {
        self.n_frames = frame_sequence;
        self.tell(CommandKind::Continue, None);
    }

    fn wait(&mut self, seconds: f64) {
        for _ in 0..(seconds * RATE_HZ) as u64 {
            self.tell(CommandKind::Continue, None);
        }
    }

    /// Carries out a motion; how it ended, and after how many seconds.
    fn carry_out(&mut self, step: &str, waypoints: &[Waypoint]) -> (StatusKind, f64) {
        let start = self.n_frames;
        let motion = Motion { waypoints: waypoints.to_vec() };
        self.tell(CommandKind::Start(motion), Some(step));
        while self.n_frames < start + 600 {
            let id = self.n_commands;
            let is_end = |s: &&Status| s.command_id == id && s.kind != StatusKind::Accepted;
            if let Some(end) = self.said.iter().find(is_end) {
                return (end.kind.clone(), (self.n_frames - start) as f64 / RATE_HZ);
            }
            self.tell(CommandKind::Continue, None);
        }
        panic!("no end of {step}");
    }

    fn body(&self, name: &str) -> BodyTruth {
        self.hardware.oracle().0.body(name).expect("it is in the world").clone()
    }

    fn held(&self) -> Option<String> {
        self.hardware.look(|world| world.held().map(str::to_owned)).1
    }

    /// Takes green.
    fn pick(&mut self) -> (StatusKind, f64) {
        let at = self.body("green_block").position;
        self.carry_out("pick_up green_block arm", &pick(at))
    }

    /// Puts what is held onto red.
    fn stack(&mut self) -> (StatusKind, f64) {
        let onto = self.body("red_block").position;
        self.carry_out("stack green_block red_block arm", &place(onto.x, onto.y, 0.127))
    }

    fn kinds(&self) -> Vec<(String, bool)> {
        self.hardware.faults().into_iter().map(|record| (record.kind, record.happened)).collect()
    }
}

fn waypoint([x, y, z]: [f64; 3], opening_m: f64, expect: Expect) -> Waypoint {
    let position = Point3::new(x, y, z);
    Waypoint { position, yaw_rad: 0.0, opening_m, speed_m_s: 0.6, expect, retractable: true }
}

fn pick(at: Point3<f64>) -> Vec<Waypoint> {
    let (over, there) = ([at.x, at.y, 0.35], [at.x, at.y, at.z]);
    vec![
        waypoint(over, 0.066, Expect::Empty),
        waypoint(there, 0.066, Expect::Empty),
        waypoint(there, 0.0, Expect::Holding),
        waypoint(over, 0.0, Expect::Holding),
    ]
}

fn place(x: f64, y: f64, z: f64) -> Vec<Waypoint> {
    vec![
        waypoint([x, y, 0.35], 0.0, Expect::Holding),
        waypoint([x, y, z], 0.0, Expect::Holding),
        waypoint([x, y, z], 0.066, Expect::Empty),
        waypoint([x, y, 0.35], 0.066, Expect::Empty),
    ]
}

fn fault(keys: &str, action: &str) -> String {
    format!("[[fault]]\n{keys}\naction = {{ {action} }}\n")
}

/// What a step comes to without any fault: the others are told apart from it.
#[test]
fn without_faults_green_is_taken_and_stands_on_red() {
    let mut bench = bench(&fault("at_s = 99.0", "kind = 'drop'"), 1);
    let (taken, _) = bench.pick();
    assert_eq!((taken, bench.held().as_deref()), (StatusKind::Done, Some("green_block")));
    let (placed, seconds) = bench.stack();
    assert_eq!(placed, StatusKind::Done);
    assert!(seconds < 3.0, "{seconds}");
    bench.wait(1.0);
    assert_eq!(bench.body("green_block").on.as_deref(), Some("red_block"));
    assert_eq!(bench.kinds(), []);
}

#[test]
fn a_missed_grasp_fails_once_and_leaves_the_object_where_it_is() {
    let mut bench = bench(&fault("during = 'pick_up'", "kind = 'miss_grasp'"), 1);
    let before = bench.body("green_block").position;
    let failed = StatusKind::Failed("nothing is in the gripper".to_owned());
    assert_eq!(bench.pick().0, failed);
    assert!((bench.body("green_block").position - before).norm() < 0.002);
    assert_eq!(bench.kinds(), [("miss_grasp".to_owned(), true)]);
    assert_eq!(bench.pick().0, StatusKind::Done, "the next grasp holds");
}

#[test]
fn what_is_dropped_falls_where_it_is() {
    let text = fault("holding = 'green_block'\nafter_s = 0.4", "kind = 'drop'");
    let mut bench = bench(&text, 1);
    assert_eq!(bench.pick().0, StatusKind::Failed("nothing is in the gripper".to_owned()));
    bench.wait(1.0);
    let [record] = &bench.hardware.faults()[..] else { panic!("one fault") };
    assert_eq!(
        (record.objects.as_slice(), record.happened),
        (&["green_block".to_owned()][..], true)
    );
    assert_eq!(record.said, "the gripper drops green_block");
    assert!(bench.body("green_block").position.z < 0.06);
}

#[test]
fn what_slips_sinks_before_it_falls_at_a_time_that_the_seed_draws() {
    let mut times = Vec::new();
    for seed in 1..=4 {
        let mut bench = bench(&fault("after = 'pick_up'", "kind = 'slip'"), seed);
        assert_eq!(bench.pick().0, StatusKind::Done);
        let below = |bench: &Bench| {
            let tool_z = bench.robot.state().1.position.z;
            tool_z - bench.body("green_block").position.z
        };
        let (start, first) = (bench.n_frames, below(&bench));
        let mut lowest = first;
        while bench.held().is_some() {
            lowest = below(&bench);
            bench.tell(CommandKind::Continue, None);
            assert!(bench.n_frames < start + 60, "it does not fall");
        }
        let frames = bench.n_frames - start;
        assert!((7..=38).contains(&frames), "{frames} frames");
        let sunk = lowest - first;
        assert!((0.002..0.02).contains(&sunk), "it sinks before it falls: {sunk} m");
        times.push(frames);
    }
    times.dedup();
    assert!(times.len() > 1, "the seed draws when: {times:?}");
}

#[test]
fn a_release_off_its_goal_is_off_by_as_much() {
    // In mid-motion, and before the motion begins.
    for keys in ["during = 'stack'\nafter_s = 0.3", "after = 'pick_up'", "at_s = 0.0"] {
        let mut bench = bench(&fault(keys, "kind = 'place_off', by_m = [0.0, -0.015]"), 1);
        assert_eq!(bench.pick().0, StatusKind::Done);
        assert_eq!(bench.stack().0, StatusKind::Done, "{keys}");
        bench.wait(1.0);
        let [green, red] = ["green_block", "red_block"].map(|name| bench.body(name).position);
        assert!((green.y - red.y + 0.015).abs() < 0.003, "{keys}: {green} {red}");
        assert!((green.x - red.x).abs() < 0.003 && green.z > 0.12, "{keys}: {green} {red}");
        assert_eq!(bench.kinds(), [("place_off".to_owned(), true)]);
    }
}

#[test]
fn a_motion_that_hangs_stands_still_and_then_goes_on() {
    let text = fault("during = 'pick_up'\nafter_s = 0.3", "kind = 'hang', for_s = 2.0");
    let mut hanging = bench(&text, 1);
    let at = hanging.body("green_block").position;
    hanging
        .tell(CommandKind::Start(Motion { waypoints: pick(at) }), Some("pick_up green_block arm"));
    hanging.wait(1.0);
    let [first, later] = [0.5, 0.0].map(|seconds| {
        let at = hanging.robot.state().1.position;
        hanging.wait(seconds);
        at
    });
    assert_eq!(first, later, "it stands still");
    assert_eq!(hanging.said.len(), 1, "accepted, and no more: {:?}", hanging.said);
    let mut hanging = bench(&text, 1);
    let (end, seconds) = hanging.pick();
    let (_, undisturbed) = bench(&fault("at_s = 99.0", "kind = 'drop'"), 1).pick();
    assert_eq!(end, StatusKind::Done);
    assert!((2.0..2.8).contains(&(seconds - undisturbed)), "{seconds} {undisturbed}");
}

/// A motion that is broken off while it hangs goes up once it can.
#[test]
fn a_motion_that_hangs_can_be_broken_off() {
    let text = fault("during = 'pick_up'\nafter_s = 0.8", "kind = 'hang', for_s = 2.0");
    let mut bench = bench(&text, 1);
    let at = bench.body("green_block").position;
    bench.tell(CommandKind::Start(Motion { waypoints: pick(at) }), Some("pick_up green_block arm"));
    bench.wait(1.5);
    let before = bench.robot.state().1.position;
    bench.tell(CommandKind::Cancel, None);
    bench.wait(0.7);
    assert_eq!(bench.robot.state().1.position, before, "it stands still all the same");
    assert_eq!(bench.said.len(), 1, "it hangs: {:?}", bench.said);
    bench.wait(2.0);
    assert_eq!(bench.said.last().unwrap().kind, StatusKind::Cancelled);
}

#[test]
fn a_false_success_is_reported_and_nothing_is_done() {
    let before = |bench: &Bench| bench.body("green_block").position;
    // The running step, and the next one.
    for keys in ["during = 'pick_up'\nafter_s = 0.3", "at_s = 0.0"] {
        let mut bench = bench(&fault(keys, "kind = 'false_success'"), 1);
        let at = before(&bench);
        assert_eq!((bench.pick().0, bench.held()), (StatusKind::Done, None), "{keys}");
        assert!((before(&bench) - at).norm() < 0.001);
        assert_eq!(bench.kinds(), [("false_success".to_owned(), true)]);
        assert_eq!(bench.pick().0, StatusKind::Done);
        assert!(bench.held().is_some(), "{keys}: only once");
    }
    let mut bench = bench(&fault("during = 'stack'", "kind = 'false_success'"), 1);
    bench.pick();
    assert_eq!(bench.stack().0, StatusKind::Done);
    assert_eq!(bench.held().as_deref(), Some("green_block"), "it was not let go");
}

#[test]
fn jammed_jaws_neither_close_nor_open_while_the_arm_moves() {
    let mut open =
        bench(&fault("during = 'pick_up'\nafter_s = 0.5", "kind = 'jam', for_s = 5.0"), 1);
    assert_eq!(open.pick().0, StatusKind::Failed("nothing is in the gripper".to_owned()));
    assert!((open.robot.state().1.opening_m - 0.066).abs() < 0.001, "the jaws stay open");
    open.wait(5.0);
    assert_eq!(open.pick().0, StatusKind::Done, "they move again");

    let mut full = bench(&fault("during = 'stack'", "kind = 'jam', for_s = 5.0"), 1);
    full.pick();
    let still = StatusKind::Failed("something is still in the gripper".to_owned());
    assert_eq!((full.stack().0, full.held().as_deref()), (still, Some("green_block")));
    assert!(full.robot.state().1.position.z > 0.3, "the arm moves");
}

#[test]
fn a_fault_that_does_not_fit_is_written_down_with_its_reason() {
    let text = ["kind = 'drop'", "kind = 'slip'", "kind = 'put_back', object = 'any'"];
    let text: String = text.map(|action| fault("at_s = 0.5", action)).concat();
    let mut bench = bench(&text, 1);
    bench.wait(1.0);
    let records = bench.hardware.faults();
    assert_eq!(records.len(), 3);
    assert!(records.iter().all(|record| !record.happened && record.at_ns / 10_000_000 == 50));
    assert!(records[1].said.contains("holds nothing"), "{}", records[1].said);
    assert_eq!(records[2].said, "fault: there is no object that it could be done to");
    assert_eq!(records.iter().map(|record| record.fault).collect::<Vec<_>>(), [0, 1, 2]);
}

#[test]
fn what_is_due_at_0_has_happened_before_the_first_frame() {
    let text = fault("at_s = 0", "kind = 'remove', object = 'green_block'")
        + &fault("at_s = 1", "kind = 'put_back', object = 'green_block'");
    let mut bench = bench(&text, 1);
    assert_eq!(bench.hardware.oracle().0.body("green_block"), None);
    bench.wait(1.5);
    assert!(bench.body("green_block").on_table);
}

/// `any` means an object that the fault fits, and another seed another one.
#[test]
fn an_unnamed_object_is_drawn_from_the_seed() {
    let drawn = |action: &str, seed: u64| {
        let mut bench = bench(&fault("at_s = 0.1", action), seed);
        bench.wait(0.5);
        let [record] = &bench.hardware.faults()[..] else { panic!("one fault") };
        assert!(record.happened, "{}", record.said);
        record.objects.clone()
    };
    let displaced: Vec<_> =
        (0..8).map(|seed| drawn("kind = 'displace', object = 'any'", seed)).collect();
    assert!(displaced.iter().any(|objects| *objects != displaced[0]), "{displaced:?}");
    assert!(displaced.iter().all(|objects| objects != &["blue_block"]), "{displaced:?}");
    for seed in 0..8 {
        assert_eq!(drawn("kind = 'knock_over', object = 'any'", seed), ["red_block"]);
    }
}

#[test]
fn nth_every_and_after_choose_among_occasions() {
    let put_down = |bench: &mut Bench| {
        let at = [0.22, -0.05, 0.027];
        bench.carry_out("put_down green_block arm", &place(at[0], at[1], at[2])).0
    };
    let action = "kind = 'displace', object = 'yellow_block'";
    let count = |keys: &str| {
        let mut bench = bench(&fault(keys, action), 1);
        [0; 3].map(|_| {
            bench.pick();
            put_down(&mut bench);
            bench.wait(0.1);
            bench.hardware.faults().len()
        })
    };
    assert_eq!(count("during = 'pick_up'"), [1, 1, 1]);
    assert_eq!(count("during = 'pick_up'\nnth = 2"), [0, 1, 1]);
    assert_eq!(count("during = 'pick_up'\nevery = true"), [1, 2, 3]);
    assert_eq!(count("after = '(put_down green_block arm)'\nevery = true"), [1, 2, 3]);
    assert_eq!(count("holding = 'any'\nevery = true"), [1, 2, 3]);
    assert_eq!(count("holding = 'red_block'\nevery = true"), [0, 0, 0]);
    assert_eq!(count("during = 'stack'\nevery = true"), [0, 0, 0]);
    assert_eq!(count("during = 'pick_up'\nevery = true\nprobability = 0"), [0, 0, 0]);
}

/// A step has ended whether it was carried out or not.
#[test]
fn after_a_step_means_after_a_failed_one_too() {
    let text = fault("during = 'pick_up'", "kind = 'miss_grasp'")
        + &fault("after = 'pick_up'", "kind = 'displace', object = 'yellow_block'");
    let mut bench = bench(&text, 1);
    assert!(matches!(bench.pick().0, StatusKind::Failed(_)));
    bench.wait(0.1);
    let ended_ns = bench.said.last().unwrap().capture_ns;
    let [missed, displaced] = &bench.hardware.faults()[..] else { panic!("two faults") };
    assert!(missed.at_ns < ended_ns && displaced.at_ns > ended_ns && displaced.happened);
}

#[test]
fn every_kind_belongs_to_the_group_that_reads_it() {
    let schema = serde_json::to_value(schemars::schema_for!(ActingFault)).unwrap();
    let kinds = schema["oneOf"].as_array().unwrap().iter();
    let kinds: Vec<&str> =
        kinds.map(|kind| kind["properties"]["kind"]["const"].as_str().unwrap()).collect();
    assert_eq!(kinds, ActingFault::KINDS);
}

/// Occurrences at which a fault of a probability happens, of a hundred.
fn happening(seed: u64, fault_idx: usize, probability: f64) -> Vec<u64> {
    let action = "kind = 'drop'";
    let keys = format!("during = 'stack'\nevery = true\nprobability = {probability:?}");
    let text = fault("at_s = 1e6", action).repeat(fault_idx) + &fault(&keys, action);
    let mut schedule = FaultSchedule::new(&faults(&text), seed).unwrap();
    let step = Step::new("stack", &["a", "b"]);
    let mut happening = Vec::new();
    for occasion in 1..=100 {
        schedule.note(Occasion::Started(&step), occasion);
        happening.extend(schedule.due(occasion).iter().map(|due| due.tag.occurrence));
    }
    happening
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(40) })]

    /// What is drawn depends on seed, fault and occurrence alone, and no two faults share it.
    #[test]
    fn the_same_seed_gives_the_same_schedule(
        seed in any::<u64>(),
        fault_idx in 0..4_usize,
        probability in 0.3..0.7_f64,
    ) {
        let first = happening(seed, fault_idx, probability);
        prop_assert_eq!(&first, &happening(seed, fault_idx, probability));
        prop_assert_ne!(&first, &happening(seed ^ 1, fault_idx, probability));
        prop_assert_ne!(&first, &happening(seed, fault_idx + 1, probability));
        let n_expected = 100.0 * probability;
        prop_assert!((first.len() as f64 - n_expected).abs() < 30.0, "{} of 100", first.len());
        // A likelier fault happens wherever a less likely one does.
        let likelier = happening(seed, fault_idx, probability + 0.2);
        prop_assert!(first.iter().all(|occasion| likelier.contains(occasion)));
    }

    /// A time between two is drawn between them.
    #[test]
    fn a_time_is_drawn_between_its_bounds(seed in any::<u64>(), low in 0.0..5.0_f64, more in 0.1..5.0_f64) {
        let text = fault(&format!("at_s = [{low:?}, {:?}]", low + more), "kind = 'drop'");
        let mut schedule = FaultSchedule::new(&faults(&text), seed).unwrap();
        let nanoseconds = |seconds: f64| (seconds * 1e9) as u64;
        prop_assert!(schedule.due(nanoseconds(low).saturating_sub(1)).is_empty());
        prop_assert_eq!(schedule.due(nanoseconds(low + more)).len(), 1);
    }
}
