//! The competition corpus, beside Fast Downward.

use std::{env, fs};

use groundloop::parts::{PartChoice, PartContext};
use groundloop::planners::{FastDownward, PlannerInputs};
use groundloop::planning::{Budget, PlanRequest, plan};

use super::{cost, cpu_ms, data, read, source};

/// Most states that a search expands.
const EXPANSIONS_MAX: u64 = 20_000_000;

/// Every instance of the corpus, beside Fast Downward: as measured now, or as recorded.
pub(super) fn measure(optimal: bool) {
    let Some(root) = data("ipc") else { return };
    let recorded = fs::read_to_string(root.join("fast_downward.csv")).unwrap();
    let config = if optimal { "astar_lmcut" } else { "lama_first" };
    let fast_downward = fast_downward(optimal);
    let theirs = if fast_downward.is_some() { "now" } else { "recorded elsewhere" };
    println!(
        "\n| corpus, {config} | cost | theirs | CPU ms | Fast Downward's ({theirs}) | expanded |"
    );
    println!("|---|---|---|---|---|---|");
    let (mut ours_ms, mut theirs_ms, mut n_solved) = (0.0, 0.0, 0);
    for line in recorded.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        if fields[2] != config || optimal && fields[3] != "1" {
            continue;
        }
        let folder = root.join(fields[0]);
        let texts = (source(&folder.join("domain.pddl")), source(&folder.join(fields[1])));
        let mut budget = Budget { greedy_expansions_max: EXPANSIONS_MAX, ..Budget::standard() };
        budget.optimal_expansions_max = if optimal { EXPANSIONS_MAX } else { 0 };
        let ((domain, problem, answer), ms) = cpu_ms(|| {
            let (domain, problem) = read(&texts.0, &texts.1);
            let answer = plan(&domain, &PlanRequest::new(&problem), &budget);
            (domain, problem, answer)
        });
        let request = PlanRequest::new(&problem);
        let found = cost(&domain, &request, &answer.outcome);
        let (their_cost, their_ms) = if let Some(planner) = &fast_downward {
            let theirs = planner.solve(&domain, &request, &|| false);
            (cost(&domain, &request, &theirs.outcome), theirs.cpu_ns as f64 / 1e6)
        } else {
            let ms = [5, 6].iter().filter_map(|&i| fields[i].parse::<f64>().ok()).sum();
            (fields[4].parse().ok(), ms)
        };
        n_solved += usize::from(found.is_some());
        if found.is_some() && their_cost.is_some() {
            ours_ms += ms;
            theirs_ms += their_ms;
        }
        let shown = |cost: Option<f64>| cost.map_or("–".to_owned(), |cost| cost.to_string());
        println!(
            "| {} {} | {} | {} | {ms:.1} | {their_ms:.0} | {} |",
            fields[0],
            fields[1].trim_end_matches(".pddl"),
            shown(found),
            shown(their_cost),
            answer.statistics.expanded()
        );
    }
    println!(
        "\n{n_solved} solved; where both solve: {ours_ms:.0} ms against {theirs_ms:.0} ms ({:.2})",
        ours_ms / theirs_ms
    );
}

fn fast_downward(optimal: bool) -> Option<FastDownward> {
    let python = env::var_os("GROUNDLOOP_FAST_DOWNWARD")?.into_string().ok()?;
    let options = format!("python = '{python}'\noptimal = {optimal}\ntimeout_s = 60\n");
    let options: toml::Table = options.parse().unwrap();
    let choice = PartChoice::new("bench", "fast-downward").with_options(Some(&options), "bench");
    let inputs = PlannerInputs { budget: &Budget::standard() };
    let context = PartContext { choice: &choice, inputs, environment: |_| None };
    Some(FastDownward::new(&context).unwrap_or_else(|e| panic!("{e}")))
}
