//! Whatever fails, in whatever order: no robot is told to go on while nobody watches it, and none goes on for long.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::*;
use crate::messages::Motion;

const BOUNDS: WatchBounds =
    WatchBounds { unwatched_ms_max: 1000, state_age_ms_max: 500, frame_s: 0.1 };

const fn ms(ms: u64) -> u64 {
    ms * 1_000_000
}

/// The table of `docs/safe-state.md`, row by row: at the bound the robot goes on, beyond it it holds.
#[test]
fn each_row_of_the_table_holds_the_robot() {
    let fine = Watch::default();
    assert_eq!(fine.hold_cause(&BOUNDS), None);
    let said = |watch: Watch, bounds: &WatchBounds| {
        watch.hold_cause(bounds).map(|cause| cause.to_string()).unwrap_or_default()
    };
    let rows = [
        (Watch { is_over: true, ..fine }, fine, "the episode has ended"),
        (Watch { is_paused: true, ..fine }, fine, "the loop is paused"),
        (
            Watch { plan_ns: ms(1001), ..fine },
            Watch { plan_ns: ms(1000), ..fine },
            "no frame has led to a plan for 1001 ms (limits.unwatched_ms_max, three frames: 1000)",
        ),
        (
            Watch { robot_ns: ms(1001), ..fine },
            Watch { robot_ns: ms(1000), ..fine },
            "no state of the robot for 1001 ms (limits.unwatched_ms_max, three frames: 1000)",
        ),
        (
            Watch { scene_age_ns: ms(1501), ..fine },
            Watch { scene_age_ns: ms(1500), ..fine },
            "the newest scene is 1501 ms old (limits.state_age_ms_max + limits.unwatched_ms_max: \
             1500)",
        ),
        (
            Watch { robot_age_ns: ms(1501), ..fine },
            Watch { robot_age_ns: ms(1500), ..fine },
            "the newest state of the robot is 1501 ms old (limits.state_age_ms_max + \
             limits.unwatched_ms_max: 1500)",
        ),
    ];
    for (held, free, expect) in rows {
        assert_eq!(said(held, &BOUNDS), format!("the robot holds: {expect}"));
        assert_eq!(free.hold_cause(&BOUNDS), None, "{expect}");
    }
    let slow = WatchBounds { frame_s: 1.0, ..BOUNDS };
    let between = Watch { plan_ns: ms(2900), robot_ns: ms(2900), ..fine };
    assert_eq!(between.hold_cause(&slow), None, "a slow camera is slow");
}

#[test]
fn nothing_that_moves_passes_while_the_robot_must_hold() {
    let start = || CommandKind::Start(Motion { waypoints: Vec::new() });
    let cause = Some(&HoldCause::Paused);
    assert_eq!(safe_command(start(), cause), CommandKind::Hold);
    assert_eq!(safe_command(CommandKind::Continue, cause), CommandKind::Hold);
    assert_eq!(safe_command(CommandKind::Cancel, cause), CommandKind::Cancel, "it stops, too");
    assert_eq!(safe_command(start(), None), start());
}

/// A step that runs is held; one that would start waits, and starts once somebody watches again.
#[test]
fn the_loop_holds_and_starts_nothing_while_nobody_watches() {
    let overdue = Overdue { ms: 2000.0, ms_max: 1000.0 };
    let mut episode = Episode::new();
    episode.hold = Some(HoldCause::NoRobotState(overdue));
    let pick = "pick_up red_block arm";
    let decision = episode.plan(&[pick]).cycle();
    assert_eq!((started(&decision), &decision.command.kind), (None, &CommandKind::Hold));
    episode.hold = None;
    assert!(started(&episode.cycle()).is_some());
    episode.hold = Some(HoldCause::OldScene(overdue));
    assert_eq!(episode.cycle().command.kind, CommandKind::Hold);
    episode.hold = None;
    assert_eq!(episode.cycle().command.kind, CommandKind::Continue);
}

// ── a model of everything around the executor ────────────────────────────────────────────────────

/// One tick of the model, milliseconds.
const TICK_MS: u64 = 50;
/// Ticks between two frames, and between two beats of the executor.
const TICKS_EACH: u64 = 2;
/// `robot.command_age_ms_max`.
const COMMAND_AGE_MS_MAX: u64 = 1000;
/// Parts that may fail: camera, detector, scene parser, planner, what the robot says, executor.
const PARTS: usize = 6;
const EXECUTOR: usize = PARTS - 1;

/// What happens before a tick.
#[derive(Debug, Clone, Copy)]
enum Happens {
    /// Nothing, for so many ticks.
    Time(u64),
    Fails(usize),
    Recovers(usize),
    Pause,
    Resume,
    Stop,
    /// The process of the run is killed: no actor lives, and nobody starts any again.
    Killed,
}

fn happenings() -> impl Strategy<Value = Vec<Happens>> {
    let one = prop_oneof![
        8 => (1..40_u64).prop_map(Happens::Time),
        4 => (0..PARTS).prop_map(Happens::Fails),
        4 => (0..PARTS).prop_map(Happens::Recovers),
        1 => Just(Happens::Pause),
        2 => Just(Happens::Resume),
        1 => Just(Happens::Stop),
        1 => Just(Happens::Killed),
    ];
    prop::collection::vec(one, 1..60)
}

/// The world around the executor: times are ticks.
#[derive(Debug, Clone)]
struct World {
    now: u64,
    works: [bool; PARTS],
    is_paused: bool,
    is_over: bool,
    /// When the picture was captured that the newest scene rests on.
    scene: u64,
    plan: u64,
    state: u64,
    /// When the robot was last told anything.
    told: u64,
    moves: bool,
    /// When everything was last as it should be.
    watched: u64,
}

impl World {
    fn new() -> Self {
        Self {
            now: 1000,
            works: [true; PARTS],
            is_paused: false,
            is_over: false,
            scene: 1000,
            plan: 1000,
            state: 1000,
            told: 1000,
            moves: false,
            watched: 1000,
        }
    }

    fn happen(&mut self, happens: Happens) {
        match happens {
            Happens::Time(_) => {}
            Happens::Fails(part) => self.works[part] = false,
            Happens::Recovers(part) => self.works[part] = true,
            Happens::Pause => self.is_paused = self.works[EXECUTOR] || self.is_paused,
            Happens::Resume => {
                self.is_paused &= !self.works[EXECUTOR];
                self.plan = if self.works[EXECUTOR] { self.now } else { self.plan };
            }
            Happens::Stop => self.is_over |= self.works[EXECUTOR],
            Happens::Killed => self.works = [false; PARTS],
        }
    }

    fn hold_cause(&self) -> Option<HoldCause> {
        let since = |then: u64| ms((self.now - then) * TICK_MS);
        let watch = Watch {
            is_over: self.is_over,
            is_paused: self.is_paused,
            plan_ns: since(self.plan),
            robot_ns: since(self.state),
            scene_age_ns: since(self.scene),
            robot_age_ns: since(self.state),
        };
        watch.hold_cause(&BOUNDS)
    }

    /// The robot is told something that moves it, or nothing does.
    fn tell(&mut self, wanted: CommandKind) {
        let command = safe_command(wanted, self.hold_cause().as_ref());
        self.told = self.now;
        match command {
            CommandKind::Start(_) => self.moves = true,
            CommandKind::Hold | CommandKind::Cancel => self.moves = false,
            CommandKind::Continue => {}
        }
    }

    fn tick(&mut self) {
        self.now += 1;
        let is_frame = self.now.is_multiple_of(TICKS_EACH);
        let [camera, detector, parser, planner, states, executor] = self.works;
        if states {
            self.state = self.now;
        }
        // While its detector is silent, a parser goes on with the scene that it has.
        let leads_to_scene = is_frame && camera && parser;
        if leads_to_scene && detector {
            self.scene = self.now;
        }
        if executor {
            if leads_to_scene && planner && !self.is_paused && !self.is_over {
                self.plan = self.now;
                let start = CommandKind::Start(Motion { waypoints: Vec::new() });
                self.tell(if self.moves { CommandKind::Continue } else { start });
            } else if is_frame {
                self.tell(CommandKind::Continue);
            }
        }
        if self.moves && (self.now - self.told) * TICK_MS > COMMAND_AGE_MS_MAX {
            self.moves = false;
        }
        if self.works == [true; PARTS] && !self.is_paused && !self.is_over {
            self.watched = self.now;
        }
    }
}

/// Lets it happen; for how many ticks the robot has moved.
fn live(happenings: &[Happens]) -> Result<u64, TestCaseError> {
    let mut world = World::new();
    let mut n_moved = 0;
    let longest_ms = BOUNDS.age_ms_max() as u64 + COMMAND_AGE_MS_MAX + 4 * TICK_MS;
    for happens in happenings {
        world.happen(*happens);
        let n_ticks = if let Happens::Time(n) = happens { *n } else { 1 };
        for _ in 0..n_ticks {
            let before = world.clone();
            world.tick();
            let (told_now, cause) = (world.told == world.now, world.hold_cause());
            prop_assert!(!(told_now && cause.is_some() && world.moves), "{cause:?}: {before:?}");
            let alone_ms = (world.now - world.watched) * TICK_MS;
            prop_assert!(!world.moves || alone_ms <= longest_ms, "{alone_ms} ms: {before:?}");
            n_moved += u64::from(world.moves);
        }
    }
    Ok(n_moved)
}

#[test]
fn no_sequence_of_faults_leaves_a_robot_that_goes_on_while_nobody_watches() {
    let (n_moved, n_cases) = (Cell::new(0), Cell::new(0_u64));
    let result = TestRunner::deterministic().run(&happenings(), |happenings| {
        n_moved.set(n_moved.get() + live(&happenings)?);
        n_cases.set(n_cases.get() + 1);
        Ok(())
    });
    result.unwrap_or_else(|error| panic!("{error}"));
    let per_case = n_moved.get() / n_cases.get();
    assert!(per_case > 5, "the robot moves for {per_case} ticks a sequence: too few to tell");
}
