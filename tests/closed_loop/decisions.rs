//! What the loop decides is pinned: the same seeds give the same decision hashes as ever.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use crate::common::{episode, project};
use groundloop::run::load_run;

/// Seeds of each run file that are checked here; the list has twenty.
const SEEDS: [u64; 2] = [1, 2];

/// A line of the list: run file, seed, verdict, goal in the simulator, cycles, decision hash.
fn pins() -> Vec<[String; 6]> {
    let text = std::fs::read_to_string(project("tests/pins/decisions.tsv")).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let columns = lines.map(|line| line.split('\t').map(str::to_owned).collect::<Vec<_>>());
    columns.map(|columns| columns.try_into().unwrap()).collect()
}

#[test]
fn the_list_has_twenty_seeds_of_each_simulated_run_file() {
    let pins = pins();
    let names: std::collections::BTreeSet<&String> = pins.iter().map(|pin| &pin[0]).collect();
    assert_eq!(names.len(), 6);
    for name in names {
        let seeds = pins.iter().filter(|pin| pin[0] == *name).map(|pin| pin[1].clone());
        assert!(seeds.eq((1..=20).map(|seed| seed.to_string())), "{name}");
    }
}

#[test]
fn decisions_are_as_pinned() {
    let mut n_checked = 0;
    for [name, seed, verdict, holds, cycles, hash] in pins() {
        let seed: u64 = seed.parse().unwrap();
        if !SEEDS.contains(&seed) {
            continue;
        }
        let mut config = load_run(&project("configs").join(&name), &[]).unwrap();
        config.seed = seed;
        let report = episode(config).report;
        assert_eq!(report.n_against_evidence(), 0, "{name}, seed {seed}: {:?}", report.dispatches);
        let got = [report.verdict.to_owned(), report.cycles.to_string(), report.decision_hash];
        assert_eq!(got, [verdict, cycles, hash], "{name}, seed {seed}");
        assert_eq!(report.goal_in_simulator.unwrap().to_string(), holds, "{name}, seed {seed}");
        n_checked += 1;
    }
    assert_eq!(n_checked, 6 * SEEDS.len());
}
