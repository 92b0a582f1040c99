//! The backend against programs that play Fast Downward well and badly.

use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::*;
use crate::parts::PartChoice;
use crate::pddl::{Problem, SourceText, parse_domain, parse_problem};
use crate::planners::PlannerInputs;
use crate::planning::Budget;

const DOMAIN: &str = "(define (domain d) (:predicates (p) (q))
    (:action a :parameters () :precondition (p) :effect (q)))";
const PROBLEM: &str = "(define (problem x) (:domain d) (:init (p)) (:goal (q)))";

/// A program that is being started by one test would keep another test's script open for writing,
/// and such a script cannot be run.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

struct Bench {
    _alone: MutexGuard<'static, ()>,
    folder: tempfile::TempDir,
    domain: Domain,
    problem: Problem,
}

impl Bench {
    fn new() -> Self {
        let domain = parse_domain(&SourceText::new("domain", DOMAIN)).unwrap().value;
        let problem = parse_problem(&SourceText::new("problem", PROBLEM), &domain).unwrap().value;
        let alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        Self { _alone: alone, folder: tempfile::tempdir().unwrap(), domain, problem }
    }

    /// A driver with this body; `$2` is the plan file.
    fn driver(&self, body: &str) -> PathBuf {
        self.script("driver", body)
    }

    fn script(&self, name: &str, body: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::write(&path, format!("#!/bin/sh\n{body}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    fn make(&self, options: &str) -> Result<FastDownward, PartError> {
        let options: toml::Table = options.parse().unwrap();
        let file = self.folder.path().join("run.toml");
        let choice = PartChoice::new("planner.name", PART.name).with_options(Some(&options), file);
        let inputs = PlannerInputs { budget: &Budget::standard() };
        FastDownward::new(&PartContext { choice: &choice, inputs, environment: |_| None })
    }

    /// What comes of a driver with this body.
    fn ask(&self, body: &str, options: &str) -> BackendAnswer {
        self.driver(body);
        let planner = self.make(&format!("program = \"driver\"\n{options}")).unwrap();
        planner.solve(&self.domain, &PlanRequest::new(&self.problem), &|| false)
    }
}

fn reason(outcome: &Outcome) -> &str {
    let Outcome::BadInput { reason } = outcome else { panic!("{outcome:?}") };
    reason
}

const PLANS: &str = "printf '(a)\\n; cost = 1 (unit cost)\\n' > \"$2\"";

#[test]
fn a_plan_is_read_and_checked() {
    let answer = Bench::new().ask(&format!("echo 'Expanded 7 state(s).'; {PLANS}"), "");
    let Outcome::Solved(plan) = &answer.outcome else { panic!("{answer:?}") };
    assert_eq!((plan.cost, plan.proven_optimal, answer.expanded), (1, false, 7));
    assert_eq!(plan.steps, [Step::new("a", &[])]);
}

#[test]
fn a_plan_that_came_before_the_memory_ended_counts() {
    let answer = Bench::new().ask(&format!("{PLANS}; exit 1"), "");
    assert!(matches!(answer.outcome, Outcome::Solved(_)), "{answer:?}");
}

#[test]
fn exit_codes_mean_what_they_mean() {
    let bench = Bench::new();
    let outcome = |code: u8| bench.ask(&format!("echo why >&2; exit {code}"), "").outcome;
    for code in [10, 11] {
        assert!(matches!(outcome(code), Outcome::Unsolvable { .. }), "{code}");
    }
    for code in [12, 20, 21, 22, 23, 24] {
        assert!(matches!(outcome(code), Outcome::OutOfBudget { .. }), "{code}");
    }
    let key = "planner.options.satisficing_search";
    for (code, said) in [
        (31, "its translator refuses the task: why".to_owned()),
        (33, format!("it does not know the search {key}: why")),
        (34, format!("the search {key} does not support what the task uses: why")),
        (37, "why".to_owned()),
    ] {
        let feature = format!("fast-downward: {said}");
        assert_eq!(outcome(code), Outcome::Unsupported { feature }, "{code}");
    }
    assert!(reason(&outcome(30)).contains("exit 30: why"));
    let killed = bench.ask("kill -SEGV $$", "").outcome;
    assert!(reason(&killed).contains("signal 11"), "{killed:?}");
}

#[test]
fn a_search_that_is_refused_gives_way_to_the_blind_one() {
    let body = format!("case \"$6\" in *lmcut*) exit 34;; esac; {PLANS}");
    let answer = Bench::new().ask(&body, "optimal = true");
    let Outcome::Solved(plan) = &answer.outcome else { panic!("{answer:?}") };
    assert!(plan.proven_optimal);
}

#[test]
fn what_is_no_plan_is_not_believed() {
    let bench = Bench::new();
    for (body, why) in [
        ("echo '(((' > \"$2\"", "cannot be read"),
        ("head -c 1000 /dev/urandom > \"$2\"", "its file"),
        ("printf '(b)' > \"$2\"", "no action `b`"),
        ("printf '' > \"$2\"", "goal not reached"),
        ("exit 0", "its file"),
    ] {
        let outcome = bench.ask(body, "").outcome;
        assert!(reason(&outcome).contains(why), "{body}: {outcome:?}");
    }
}

/// Both pipes get more than any pipe holds, before the plan is written.
#[test]
fn stray_output_blocks_nobody() {
    let flood = "head -c 4000000 /dev/zero; head -c 4000000 /dev/zero >&2";
    let answer = Bench::new().ask(&format!("{flood}; {PLANS}"), "");
    assert!(matches!(answer.outcome, Outcome::Solved(_)), "{answer:?}");
}

/// A child of the program that ignores TERM dies with it, and holds nobody up.
#[test]
fn at_the_deadline_the_children_die_too() {
    let bench = Bench::new();
    let file = bench.folder.path().join("child");
    let child = "trap '' TERM; while :; do sleep 1; done";
    let body = format!("sh -c \"{child}\" & echo $! > {}; wait", file.display());
    let answer = bench.ask(&body, "timeout_s = 1");
    let limit = "planner.options.timeout_s";
    assert_eq!(answer.outcome, Outcome::OutOfBudget { limit, value: 1 });
    let child = std::fs::read_to_string(&file).unwrap();
    check_dead(child.trim());
}

/// A child that outlives the program is killed, although it holds the pipes.
#[test]
fn what_is_left_behind_is_cleared_away() {
    let bench = Bench::new();
    let file = bench.folder.path().join("child");
    let body = format!("sleep 1000 & echo $! > {}; {PLANS}", file.display());
    let answer = bench.ask(&body, "");
    assert!(matches!(answer.outcome, Outcome::Solved(_)), "{answer:?}");
    check_dead(std::fs::read_to_string(&file).unwrap().trim());
}

/// Waits until a process is gone, or a zombie that nobody has collected yet.
fn check_dead(pid: &str) {
    let stat = Path::new("/proc").join(pid).join("stat");
    while let Ok(text) = std::fs::read_to_string(&stat) {
        if text.contains(") Z") {
            return;
        }
        std::thread::yield_now();
    }
}

#[test]
fn an_interrupt_ends_it() {
    let bench = Bench::new();
    bench.driver("sleep 1000");
    let planner = bench.make("program = \"driver\"").unwrap();
    let answer = planner.solve(&bench.domain, &PlanRequest::new(&bench.problem), &|| true);
    assert_eq!(answer.outcome, Outcome::Interrupted);
}

#[test]
fn the_wheel_is_found_and_its_halves_are_run() {
    let bench = Bench::new();
    let wheel = bench.folder.path().join("wheel");
    let binaries = wheel.join("downward/builds/release/bin");
    std::fs::create_dir_all(&binaries).unwrap();
    let search = "test \"$(cat)\" = translated && printf '(a)' > \"$4\"";
    bench.script("wheel/downward/builds/release/bin/downward", search);
    let python = format!(
        "case \"$1\" in -c) printf %s {};; -m) test -f \"$3\" && printf translated > \"$6\";; esac",
        wheel.display()
    );
    bench.script("python", &python);
    let planner = bench.make("python = \"./python\"").unwrap();
    let answer = planner.solve(&bench.domain, &PlanRequest::new(&bench.problem), &|| false);
    assert!(matches!(answer.outcome, Outcome::Solved(_)), "{answer:?}");
}

#[test]
fn what_is_missing_is_named_with_the_line_that_installs_it() {
    let bench = Bench::new();
    bench.script("bare_python", "exit 0");
    for options in ["program = \"nowhere\"", "python = \"./nowhere\"", "python = \"./bare_python\""]
    {
        let error = bench.make(options).unwrap_err();
        assert!(matches!(error, PartError::Missing { .. }), "{options}: {error}");
        assert!(error.to_string().contains("pip install up-fast-downward"), "{error}");
    }
}

#[test]
fn options_that_cannot_be_are_refused_by_name() {
    let bench = Bench::new();
    for (options, word) in [("timeout_s = 0", "timeout_s"), ("timeout = 1", "timeout")] {
        let error = bench.make(options).unwrap_err().to_string();
        assert!(error.contains("run.toml: planner.options") && error.contains(word), "{error}");
    }
}
