//! The report of a sweep as one page that needs nothing beside it.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::design::SweepDesign;
use super::record::SweepRecord;
use super::report::{SweepReport, SweepTally};

const STYLE: &str = "
body { font: 15px/1.5 system-ui, sans-serif; color: #222; margin: 2em auto; max-width: 66em; padding: 0 1em; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .25em .8em .25em 0; text-align: left; border-bottom: 1px solid #ddd; vertical-align: top; }
td.n, th.n { text-align: right; }
.wrong { color: #b84700; font-weight: 600; }
figure { margin: 1.5em 0; } figure img { max-width: 100%; border-radius: 6px; }
figcaption { margin-bottom: .4em; } code { font-size: .9em; overflow-wrap: anywhere; }
svg { max-width: 100%; height: auto; }
.scroll { overflow-x: auto; }
";

/// A picture of how an episode ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FailurePicture {
    /// The episode's number.
    pub index: u64,
    /// A PNG file.
    pub png: Vec<u8>,
}

/// Everything that the page shows.
#[derive(Debug)]
pub struct SweepPage<'a> {
    /// The counts.
    pub report: &'a SweepReport,
    /// Which episodes there are.
    pub design: &'a SweepDesign,
    /// The plot, as SVG.
    pub plot: &'a str,
    /// Pictures of some failures.
    pub pictures: &'a [FailurePicture],
    /// What the sweep file says.
    pub spec: &'a str,
}

impl SweepPage<'_> {
    /// The page as HTML.
    pub fn html(&self) -> String {
        let SweepReport { name, expected, all, failures, .. } = self.report;
        let title = format!("Sweep {name}");
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { (title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { (title) }
                    p { (all.episodes) " of " (expected) " episodes. Success: " (share(all)) "." (wrong(all)) }
                    (PreEscaped(self.plot))
                    (self.table())
                    h2 { "Failures" }
                    @if failures.is_empty() { p { "There are none." } }
                    @for failure in self.pictured() { (failure) }
                    @if !failures.is_empty() { (self.failures()) }
                    h2 { "The sweep file" }
                    pre { code { (self.spec) } }
                }
            }
        };
        page.into_string()
    }

    fn table(&self) -> Markup {
        let points = &self.report.points;
        let factors: Vec<&String> =
            points.first().map(|point| point.factors.keys().collect()).unwrap_or_default();
        let of_levels = self.report.levels.iter().map(|l| (vec![&l.factor, &l.level], &l.tally));
        let of_points = points.iter().map(|p| (p.factors.values().collect(), &p.tally));
        let (titles, rows): (Vec<&str>, Vec<(Vec<&String>, &SweepTally)>) = if points.is_empty() {
            (vec!["factor", "level"], of_levels.collect())
        } else {
            (factors.into_iter().map(String::as_str).collect(), of_points.collect())
        };
        html! {
            h2 { "Results" }
            div.scroll { table {
                thead { tr {
                    @for title in titles { th { (title) } }
                    th.n { "success" } th.n { "95 %" } th.n { "false" } th.n { "errors" } th.n { "faults" }
                    th.n { "steps" } th.n { "untrue" } th.n { "against evidence" } th.n { "run time (s)" }
                } }
                tbody { @for (names, tally) in rows { tr {
                    @for name in names { td { (name) } }
                    td.n { (tally.successes) "/" (tally.episodes) }
                    td.n { (interval(tally)) }
                    td.n { (tally.false_reached) } td.n { (tally.errors) } td.n { (tally.faults) }
                    td.n { (tally.dispatches) } td.n { (tally.against_truth) }
                    td.n { (tally.against_evidence) } td.n { (format!("{:.1}", tally.sim_seconds_mean)) }
                } } }
            } }
        }
    }

    fn failures(&self) -> Markup {
        html! {
            div.scroll { table {
                thead { tr { th.n { "episode" } th { "factors" } th.n { "seed" } th { "ended" } th { "why" } } }
                tbody { @for record in &self.report.failures { tr {
                    td.n { (record.index) }
                    td { (factors(record)) }
                    td.n { (record.seed) }
                    td class=[record.is_wrong().then_some("wrong")] { (ended(record)) }
                    td { (record.reason) }
                } } }
            } }
        }
    }

    fn pictured(&self) -> impl Iterator<Item = Markup> {
        self.pictures.iter().filter_map(|picture| {
            let mut failures = self.report.failures.iter();
            let record = failures.find(|record| record.index == picture.index)?;
            let plan = self.design.episode(picture.index)?;
            let data = format!("data:image/png;base64,{}", STANDARD.encode(&picture.png));
            let alt = format!("What was believed at the end of episode {}", record.index);
            Some(html! {
                figure {
                    figcaption {
                        "Episode " (record.index) " (" (factors(record)) ", seed " (record.seed) "): "
                        b { (ended(record)) } ": " (record.reason) br;
                        code { (plan.command()) }
                    }
                    img src=(data) alt=(alt);
                }
            })
        })
    }
}

fn share(tally: &SweepTally) -> String {
    format!("{} of {} ({})", tally.successes, tally.episodes, interval(tally))
}

fn interval(tally: &SweepTally) -> String {
    let [low, high] = tally.success_share_95.map(|edge| edge * 100.0);
    format!("{low:.1}–{high:.1} %")
}

/// What must never be, where it is.
fn wrong(tally: &SweepTally) -> Markup {
    html! {
        @if tally.false_reached > 0 {
            " " span.wrong { "Said to be reached and not so: " (tally.false_reached) "." }
        }
        @if tally.against_evidence > 0 {
            " " span.wrong { "Steps against what could be known: " (tally.against_evidence) "." }
        }
        @if tally.errors > 0 { " " span.wrong { "Ended without a verdict: " (tally.errors) "." } }
    }
}

fn factors(record: &SweepRecord) -> String {
    let factors = record.factors.iter().map(|(factor, level)| format!("{factor} {level}"));
    factors.collect::<Vec<_>>().join(", ")
}

fn ended(record: &SweepRecord) -> String {
    if record.is_false() {
        return "FALSE: said to be reached".to_owned();
    }
    let evidence = if record.against_evidence > 0 { ", AGAINST EVIDENCE" } else { "" };
    format!("{}{evidence}", record.verdict.replace('_', " "))
}
