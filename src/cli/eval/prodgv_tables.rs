//! How `groundloop eval prodg-v` prints its report.

use comfy_table::{Cell, Table};

use super::super::out::{self, Stream};
use super::super::table::{self, right};
use crate::eval::prodgv::{DomainReport, EvaluationReport, Ratio};

/// Prints what was measured, then for each domain the paper's figures beside it.
pub(super) fn print_report(report: &EvaluationReport) {
    out::line(&format!(
        "measured: grounder {}, detections {}, goals {}{}, planner {}",
        report.grounder,
        report.detections,
        report.goals,
        if report.repair_goals { " (repaired)" } else { "" },
        report.planner,
    ));
    out::line("");
    Stream::Output.table(measured(report));
    for (name, domain) in &report.domains {
        out::line("");
        Stream::Output.table(beside_published(report, name, domain));
    }
    out::line("");
    out::line(
        "P|R: precision and recall of observed facts, over the pairs. A state is exactly right without \
         a wrong\nor missing fact, as the reference counts; strictly right if also every detection is \
         one object of its\ntype, none is missed or invented, and no fact is unknown. Published rows \
         are quoted from the paper,\nover the whole data set; none is measured here. Their plan \
         validity mixes evaluated pairs with all\nfiles, which the measured table keeps apart.",
    );
    for (name, domain) in &report.domains {
        if !domain.failures.is_empty() {
            out::line("");
            Stream::Output.table(failures(name, domain));
        }
    }
}

/// Prints pair by pair, where that was asked for.
pub(super) fn print_details(report: &EvaluationReport) {
    for (name, domain) in &report.domains {
        for pair in &domain.details {
            out::line("");
            let counted = if pair.evaluated { "" } else { ", not evaluated" };
            out::line(&format!("{name} exemplar {}, test {}{counted}", pair.exemplar, pair.test));
            out::line(&format!("  goal     {}", pair.goal));
            pair.dropped.iter().for_each(|text| out::line(&format!("  dropped  {text}")));
            pair.anomalies.iter().for_each(|text| out::line(&format!("  anomaly    {text}")));
            pair.wrong.iter().for_each(|atom| out::line(&format!("  wrong    {atom}")));
            pair.missing.iter().for_each(|atom| out::line(&format!("  missing  {atom}")));
            pair.object_faults.iter().for_each(|text| out::line(&format!("  object   {text}")));
            out::line(&format!(
                "  {} right, {} unknown, {} inferred; plan of {} steps, {}",
                pair.tp,
                pair.unknown,
                pair.inferred,
                pair.plan_steps.map_or("-".to_owned(), |n| n.to_string()),
                if pair.success { "solves the true problem" } else { "no success" },
            ));
        }
    }
}

/// One row for each figure, one column for each domain.
fn measured(report: &EvaluationReport) -> Table {
    let mut table = table::plain();
    let names = report.domains.keys().map(right);
    table.set_header(std::iter::once(Cell::new("measured")).chain(names));
    let mut row = |label: &str, value: &dyn Fn(&DomainReport) -> String| {
        let cells = report.domains.values().map(|domain| right(value(domain)));
        table.add_row(std::iter::once(Cell::new(label)).chain(cells));
    };
    row("pairs", &|d| d.pairs.to_string());
    row("TP/FP/FN", &|d| format!("{}/{}/{}", d.tp, d.fp, d.fn_));
    row("P|R", &|d| pr(d.precision, d.recall, 3));
    row("states exactly right", &|d| of([d.exact_states, d.pairs]));
    row("states strictly right", &|d| of([d.strict_states, d.pairs]));
    row("facts unknown", &|d| d.unknown.to_string());
    row("facts inferred by constraints", &|d| d.inferred.to_string());
    row("anomalies", &|d| d.anomalies.to_string());
    row("goals repaired", &|d| d.goals_repaired.to_string());
    row("problems valid, all files", &|d| of(d.problem_valid));
    row("plans valid, pairs", &|d| of(d.plan_valid_pairs));
    row("plans valid, all files", &|d| of(d.plan_valid_all));
    row(&format!("task success ({})", report.planner), &|d| of(d.success));
    row("facts unlike the recorded, all files", &|d| {
        d.differs_from_recorded.map_or("-".to_owned(), |n| n.to_string())
    });
    if let Some(jitter) = report.jitter {
        let noise = format!("boxes ± {} px, mean of {}", jitter.px, jitter.seeds);
        row(&format!("{noise}: P|R"), &|d| {
            d.jitter.map_or("-".to_owned(), |j| pr(j.precision, j.recall, 3))
        });
        row(&format!("{noise}: F1"), &|d| share(d.jitter.and_then(|j| j.f1), 3));
        row(&format!("{noise}: states exactly right"), &|d| {
            d.jitter.map_or("-".to_owned(), |j| format!("{:.2}/{}", j.exact_states, d.pairs))
        });
    }
    table
}

/// The measured row of a domain, and below it the published ones.
fn beside_published(report: &EvaluationReport, name: &str, domain: &DomainReport) -> Table {
    let mut table = table::plain();
    table.set_header([
        name,
        "framework",
        "shot",
        "grounding",
        "planner",
        "P|R",
        "problems",
        "plans",
        "success",
    ]);
    table.add_row([
        Cell::new("measured"),
        Cell::new("groundloop"),
        right(1),
        Cell::new(format!("{}, {}", report.detections, report.grounder)),
        Cell::new(&report.planner),
        right(pr(domain.precision, domain.recall, 2)),
        right(ratio(domain.problem_valid)),
        right(ratio(domain.plan_valid_pairs)),
        right(ratio(domain.success)),
    ]);
    for row in &report.published {
        let figure = |figures: &std::collections::BTreeMap<String, f64>| {
            right(share(figures.get(name).copied(), 2))
        };
        let both = row.pr.get(name).copied();
        table.add_row([
            Cell::new("published"),
            Cell::new(&row.framework),
            right(row.shot),
            Cell::new(&row.grounding),
            Cell::new(&row.planner),
            right(both.map_or("-".to_owned(), |[p, r]| pr(Some(p), Some(r), 2))),
            figure(&row.problem_valid),
            figure(&row.plan_valid),
            figure(&row.success),
        ]);
    }
    table
}

fn failures(name: &str, domain: &DomainReport) -> Table {
    let mut table = table::plain();
    table.set_header([name, "exemplar", "test", "stage", "why"]);
    for failure in &domain.failures {
        table.add_row([
            Cell::new("failure"),
            right(failure.exemplar),
            right(failure.test),
            Cell::new(failure.stage.word()),
            Cell::new(&failure.why),
        ]);
    }
    table
}

fn pr(precision: Option<f64>, recall: Option<f64>, digits: usize) -> String {
    format!("{}|{}", share(precision, digits), share(recall, digits))
}

/// A share, or a dash where there is none.
fn share(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.digits$}"))
}

fn of([part, whole]: Ratio) -> String {
    format!("{part}/{whole}")
}

fn ratio([part, whole]: Ratio) -> String {
    share((whole > 0).then(|| part as f64 / whole as f64), 2)
}
