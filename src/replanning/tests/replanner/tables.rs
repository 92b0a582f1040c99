//! When distance tables are asked for and taken over, and what is measured meanwhile.

use super::*;

/// Notes what it is asked to do; has no table before it is waited for.
#[derive(Default)]
struct Noting {
    calls: Vec<(&'static str, u64)>,
}

impl Noting {
    fn note(&mut self, call: &'static str, request: &TableRequest) {
        self.calls.push((call, request.number));
    }

    fn take(&mut self) -> Vec<(&'static str, u64)> {
        std::mem::take(&mut self.calls)
    }
}

impl TableBuilder for Noting {
    fn start(&mut self, request: &TableRequest) {
        self.note("start", request);
    }

    fn ready(&mut self, request: &TableRequest) -> Option<TableEnd> {
        self.note("ready", request);
        None
    }

    fn wait(&mut self, request: &TableRequest) -> TableEnd {
        self.note("wait", request);
        BuildInPlace.wait(request)
    }
}

/// A desk that uses tables.
fn desk_with_tables(adoption: Adoption) -> Desk {
    let table = TableConfig { states_max: 1000, bytes_max: 1 << 20, adopt_after_cycles: 0 };
    let mut desk = Desk::with(TOWER, &PlannerConfig { table, ..config() });
    desk.replanner = desk.replanner.adopting(adoption);
    desk
}

fn at_cycle(cycle: u64, scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.cause.cycle = cycle;
    scene
}

#[test]
fn a_table_is_waited_for_at_its_cycle_and_answers_from_then_on() {
    let mut desk = desk_with_tables(Adoption::AfterCycles(3));
    let (tower, mut tables) = (scene(&[]), Noting::default());
    let cycle = |desk: &mut Desk, tables: &mut Noting, cycle: u64, scene: &Scene| {
        let message = desk.cycle(&at_cycle(cycle, scene), Deadlines::NONE, tables);
        (message, tables.take())
    };
    let (first, calls) = cycle(&mut desk, &mut tables, 1, &tower);
    assert_eq!((first.source, calls), (Some(PlanSource::Search), vec![("start", 1)]));
    let (_, calls) = cycle(&mut desk, &mut tables, 3, &tower);
    assert_eq!(calls, [("start", 1)], "a restarted builder hears of it again");
    let disturbed = scene(&[["a", "c"]]);
    let restarted = &mut desk.replanner.clone();
    let (answer, calls) = cycle(&mut desk, &mut tables, 4, &disturbed);
    assert_eq!(calls, [("wait", 1)], "the table is there: no other is wanted");
    assert_eq!((answer.source, answer.expansions), (Some(PlanSource::Table), 0));
    let PlanVerdict::Plan { steps, cost: 6 } = &answer.verdict else { panic!("{answer:?}") };
    desk.check_reaches(&disturbed, steps);
    assert_eq!(desk.n_calls(), 1);
    // From the checkpoint before, whoever misses the cycle itself decides the same later.
    std::mem::swap(&mut desk.replanner, restarted);
    let (again, _) = cycle(&mut desk, &mut tables, 9, &disturbed);
    assert_eq!(again.verdict, answer.verdict);
}

#[test]
fn in_real_time_a_table_is_taken_over_when_it_is_ready() {
    let mut desk = desk_with_tables(Adoption::WhenReady);
    let mut tables = Noting::default();
    desk.cycle(&at_cycle(1, &scene(&[])), Deadlines::NONE, &mut tables);
    desk.cycle(&at_cycle(9, &scene(&[])), Deadlines::NONE, &mut tables);
    assert_eq!(tables.take(), [("start", 1), ("ready", 1), ("start", 1)]);
    let disturbed = at_cycle(10, &scene(&[["a", "c"]]));
    let answer = desk.cycle(&disturbed, Deadlines::NONE, &mut BuildInPlace);
    assert_eq!(answer.source, Some(PlanSource::Table));
}

#[test]
fn time_spent_is_copied_and_decides_nothing() {
    let mut desk = Desk::new(TOWER);
    let calls = AtomicU32::new(0);
    let spent = || {
        let n = u64::from(calls.fetch_add(1, Ordering::Relaxed));
        Spent { cpu_ns: 10 * n, wall_ns: 2_000 * n * n }
    };
    let scene = scene(&[]);
    let query = ReplanQuery { scene: &scene, goal: &desk.goal, failures: &desk.failures };
    let message = desk.replanner.plan(query, Deadlines::NONE, &spent, &mut BuildNever);
    assert_eq!(message.observe, Spent { cpu_ns: 10, wall_ns: 2_000 });
    assert_eq!(message.decide, Spent { cpu_ns: 10, wall_ns: 6_000 });
    assert_eq!(message.plan_us, 18);
}
