//! `groundloop run`: closed-loop episodes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use comfy_table::{Cell, Table};
use indicatif::{ProgressBar, ProgressStyle};
use tokio::sync::watch;

use super::begin::{join_bus, listen, on_runtime, read_run};
use super::narrate::{Narrator, Style};
use super::out::Stream;
use super::reports::{EpisodeError, RunReport};
use super::services::ServiceArgs;
use super::table::{self, right};
use super::{Failure, exit, out};
use crate::actors::{SnapshotMoment, SnapshotRequest};
use crate::messages::{Control, EventMessage, Stop, Verdict};
use crate::metrics::{EpisodeReport, FaultRecord, Quantiles, UntrueDispatch};
use crate::run::{
    Episode, EpisodeOptions, PreparedRun, RunConfig, RunError, load_run, run_episode, told_to_stop,
};
use crate::transport::convert::{control_to_wire, device_header};
use crate::transport::topics::CONTROL;
use crate::transport::wire::{ControlRecord, DeviceHeader};
use crate::transport::{EventReader, Publisher};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The run file, or the name of a shipped one.
    config: PathBuf,
    /// Overrides a key of the run file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// The first seed; without it, the run file's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// How many episodes are run, one after another, with seeds counting up from the first; for many, or on all
    /// processors: `groundloop sweep`.
    #[arg(long, value_name = "N", default_value_t = 1,
          value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    episodes: u64,
    /// The name of the run on the bus; without it, the run file's.
    #[arg(long, value_name = "NAME")]
    run: Option<String>,
    /// What `$data` stands for in the run file.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    #[command(flatten)]
    services: ServiceArgs,
    /// Writes a picture of what was understood, of the first settled cycle with a plan.
    #[arg(long, value_name = "FILE.png")]
    snapshot: Option<PathBuf>,
    /// The first cycle that the picture may show.
    #[arg(long, value_name = "CYCLE", default_value_t = 0)]
    snapshot_from: u64,
    /// Shows every fact of a state and every step of a plan, over several lines.
    #[arg(short, long)]
    verbose: bool,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let sets = [args.sets.clone(), args.services.sets()].concat();
    let mut config = load_run(&args.config, &sets)?;
    config.seed = args.seed.unwrap_or(config.seed);
    config.run = args.run.clone().or(config.run);
    args.snapshot.as_deref().map_or(Ok(()), has_a_folder)?;
    on_runtime(episodes(args, config))
}

/// A picture is drawn in mid-episode, which is too late to learn that it cannot be written.
fn has_a_folder(path: &Path) -> Result<(), RunError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if folder.is_none_or(Path::is_dir) {
        return Ok(());
    }
    let reason = "there is no such folder".to_owned();
    Err(RunError::Snapshot { path: path.display().to_string(), reason })
}

async fn episodes(args: &Args, config: RunConfig) -> Result<u8, Failure> {
    let mut stop = listen().map_err(Failure::internal)?;
    let first_seed = config.seed;
    let prepared = read_run(config, args.data.clone(), &mut stop).await?;
    let (mut reports, mut errors) = (Vec::new(), Vec::new());
    let mut worst = 0;
    let bar = bar(args);
    for seed in first_seed..first_seed.saturating_add(args.episodes) {
        let mut prepared = prepared.clone();
        prepared.config.seed = seed;
        let episode = match Box::pin(watched(args, &prepared, &mut stop)).await? {
            Ok(episode) => episode,
            // What one seed meets, the next ones may not; what is wrong with the run file they all meet.
            Err(RunError::Fatal(error)) if args.episodes > 1 => {
                let failure = Failure::from(RunError::from(error));
                worst = worst.max(failure.code);
                bar.suspend(|| out::note(&format!("seed {seed}: error: {}", failure.message)));
                errors.push(EpisodeError { seed, reason: failure.message });
                bar.inc(1);
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        if let Some(reason) = &episode.snapshot_fault {
            out::error(&format!("the picture is not written: {reason}"));
            worst = worst.max(exit::INTERNAL);
        } else if let Some(path) = args.snapshot.as_ref().filter(|path| !path.is_file()) {
            out::note(&format!("{}: no settled cycle with a plan to draw", path.display()));
        }
        let verdict = &episode.end.verdict;
        worst = worst.max(verdict.exit_code());
        if episode.report.is_false() || episode.report.n_against_evidence() > 0 {
            worst = worst.max(exit::CHECK_FAILED);
        }
        let stopped = matches!(verdict, Verdict::Stopped(_));
        if args.episodes == 1 && *verdict == Verdict::Planned && !args.json {
            episode.report.plan.iter().for_each(|step| out::line(step));
        }
        if args.episodes > 1 {
            bar.suspend(|| progress(args, &episode.report));
        }
        bar.inc(1);
        reports.push(episode.report);
        if stopped {
            break;
        }
    }
    bar.finish_and_clear();
    finish(args, &reports, &errors)?;
    Ok(worst)
}

/// Runs one episode; tells what its topic `event` says, and sends a stop to its topic `control`.
async fn watched(
    args: &Args,
    prepared: &PreparedRun,
    stop: &mut watch::Receiver<Option<Stop>>,
) -> Result<Result<Episode, RunError>, Failure> {
    let bus = join_bus(prepared, stop).await?;
    let controls: Publisher<DeviceHeader, ControlRecord> = bus.publisher(&CONTROL)?;
    let mut events = EventReader::open(&bus)?;
    let mut teller = Teller::new(prepared, Stream::beside(args.json), args.verbose);
    teller.is_quiet = args.episodes > 1;
    let snapshot = args.snapshot.clone().map(|path| SnapshotRequest {
        path,
        from_cycle: args.snapshot_from,
        moment: SnapshotMoment::Planned,
    });
    let episode = run_episode(prepared, EpisodeOptions { bus, snapshot });
    tokio::pin!(episode);
    let mut is_stopped = false;
    let ended = loop {
        tokio::select! {
            biased;
            event = events.next() => teller.tell(&event?),
            why = told_to_stop(stop), if !is_stopped => {
                is_stopped = true;
                let request = control_to_wire(Control::Stop(why));
                controls.publish(device_header(0, 0), &[request])?;
            }
            ended = &mut episode => break ended,
        }
    };
    while let Some(event) = events.poll()? {
        teller.tell(&event);
    }
    Ok(ended)
}

/// Tells people what happens.
pub(super) struct Teller {
    narrator: Narrator,
    stream: Stream,
    is_quiet: bool,
}

impl Teller {
    pub(super) fn new(prepared: &PreparedRun, stream: Stream, verbose: bool) -> Self {
        let orders = prepared.folder.perception.constraints.strict_order.clone();
        let style = Style { colour: stream.has_colours(), verbose, orders };
        Self { narrator: Narrator::new(style), stream, is_quiet: false }
    }

    pub(super) fn tell(&mut self, message: &EventMessage) {
        let EventMessage { cause, event, .. } = message;
        if !self.is_quiet {
            let columns = self.stream.columns();
            self.stream.line(&self.narrator.tell(cause.capture_ns, cause.cycle, event, columns));
        }
    }
}

/// Progress over the episodes, on standard error, where that is a terminal.
fn bar(args: &Args) -> ProgressBar {
    if args.episodes == 1 {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(args.episodes);
    match ProgressStyle::with_template("{bar:40} {pos}/{len} episodes, {eta} left") {
        Ok(style) => bar.with_style(style),
        Err(error) => {
            tracing::debug!(%error, "progress is shown plainly");
            bar
        }
    }
}

fn progress(args: &Args, report: &EpisodeReport) {
    let EpisodeReport { seed, verdict, sim_seconds, skills_done, replans, .. } = report;
    let why = if *verdict == Verdict::Reached.word() {
        String::new()
    } else {
        format!(": {}", report.reason)
    };
    let text = format!(
        "seed {seed}: {verdict} after {sim_seconds:.1} s, {skills_done} skills, {replans} replans{why}"
    );
    Stream::beside(args.json).line(&text);
}

fn finish(args: &Args, reports: &[EpisodeReport], errors: &[EpisodeError]) -> Result<(), Failure> {
    match reports {
        [report] if args.json && args.episodes == 1 => out::json(&RunReport::One(report)),
        episodes if args.json => out::json(&RunReport::Several { episodes, errors }),
        [report] if args.episodes == 1 => {
            out::line("");
            Stream::Output.table(latency_table(report));
            out::line(&summary(report));
            let told = [untrue_steps(report), faults(&report.faults)];
            told.iter().flatten().for_each(|told| out::line(told));
            Ok(())
        }
        reports => {
            out::line("");
            Stream::Output.table(episode_table(reports));
            let told = reports.iter().map(|r| (r.seed, r.verdict, r.goal_in_simulator));
            out::line(&tally(&told.collect::<Vec<_>>()));
            if !errors.is_empty() {
                let seeds: Vec<String> = errors.iter().map(|e| e.seed.to_string()).collect();
                out::line(&format!("ended without a verdict: seeds {}", seeds.join(", ")));
            }
            if let Some(told) = against_evidence(reports) {
                out::line(&told);
            }
            Ok(())
        }
    }
}

/// How many episodes have reached their goals, and in how many the goals really hold: of each its seed, its
/// verdict, and whether its goal holds in the simulator.
fn tally(episodes: &[(u64, &str, Option<bool>)]) -> String {
    let reached = episodes.iter().filter(|(_, verdict, _)| *verdict == "reached");
    let mut told = vec![format!("reached {}/{}", reached.clone().count(), episodes.len())];
    let truths: Vec<bool> = episodes.iter().filter_map(|(_, _, holds)| *holds).collect();
    if !truths.is_empty() {
        let n_true = truths.iter().filter(|holds| **holds).count();
        told.push(format!(", the goal holds in the simulator in {n_true}/{}", truths.len()));
    }
    let wrong = reached.filter(|(_, _, holds)| *holds == Some(false));
    let wrong: Vec<String> = wrong.map(|(seed, _, _)| seed.to_string()).collect();
    if !wrong.is_empty() {
        let seeds = wrong.join(", ");
        told.push(format!("\nFALSE: reached, but not in the simulator: seeds {seeds}"));
    }
    told.concat()
}

/// The seeds of the episodes that started a step against what could be known.
fn against_evidence(reports: &[EpisodeReport]) -> Option<String> {
    let seeds = reports.iter().filter(|report| report.n_against_evidence() > 0);
    let seeds: Vec<String> = seeds.map(|report| report.seed.to_string()).collect();
    let seeds = seeds.join(", ");
    (!seeds.is_empty()).then(|| format!("AGAINST EVIDENCE: a step was started: seeds {seeds}"))
}

/// The steps that were started though their preconditions did not really hold.
fn untrue_steps(report: &EpisodeReport) -> Option<String> {
    let audit = report.dispatches.as_ref()?;
    let steps = audit.against_truth.iter().map(|dispatch| {
        let UntrueDispatch { frame, step, unmet, untrue_for_frames, is_against_evidence } =
            dispatch;
        let known = if *is_against_evidence { "AGAINST EVIDENCE" } else { "not known yet" };
        let unmet = unmet.join(", ");
        format!("#{frame} {step}: {unmet}, for {untrue_for_frames} frames, {known}")
    });
    let steps: Vec<String> = steps.collect();
    let told = format!("started though it did not really hold:\n  {}", steps.join("\n  "));
    (!steps.is_empty()).then_some(told)
}

/// Whether the goal holds in the simulator, for a table.
fn truth_word(report: &EpisodeReport) -> &'static str {
    match report.goal_in_simulator {
        Some(true) => "yes",
        Some(false) => "no",
        None => "",
    }
}

fn summary(report: &EpisodeReport) -> String {
    let truth = match report.goal_in_simulator {
        _ if report.is_false() => "FALSE: the goal does not hold in the simulator\n",
        Some(true) => "the goal holds in the simulator\n",
        Some(false) => "the goal does not hold in the simulator\n",
        None => "",
    };
    format!(
        "{}: {}\n{truth}seed {}, {} cycles, {} frames, {} replans, {} skills done, {} failed\n\
         {:.1} s run time in {:.1} s wall clock ({:.1}x), {:.1} ms CPU per frame\n\
         decision hash {}",
        report.verdict,
        report.reason,
        report.seed,
        report.cycles,
        report.frames,
        report.replans,
        report.skills_done,
        report.skills_failed,
        report.sim_seconds,
        report.wall_seconds,
        report.sim_seconds / report.wall_seconds.max(1e-9),
        report.cpu_ms_per_frame,
        report.decision_hash.get(..16).unwrap_or_default(),
    )
}

/// How many faults of the run file happened, by their kinds, and how many could not.
fn faults(records: &[FaultRecord]) -> Option<String> {
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for record in records.iter().filter(|record| record.happened) {
        *kinds.entry(&record.kind).or_default() += 1;
    }
    let happened: usize = kinds.values().sum();
    let list: Vec<String> = kinds.iter().map(|(kind, n)| format!("{n} {kind}")).collect();
    let list = if list.is_empty() { String::new() } else { format!(" ({})", list.join(", ")) };
    let refused = records.len() - happened;
    let latest = |frames: fn(&FaultRecord) -> Option<u64>, what: &str| {
        let most = records.iter().filter_map(frames).max();
        most.map_or_else(String::new, |frames| format!("\n  {what} after {frames} frames at most"))
    };
    let noticed = latest(|record| record.noticed_after_frames, "noticed");
    let recovered = latest(|record| record.recovered_after_frames, "made good");
    (!records.is_empty()).then(|| {
        format!("faults: {happened} happened{list}, {refused} could not{noticed}{recovered}")
    })
}

fn latency_table(report: &EpisodeReport) -> Table {
    let mut table = table::plain();
    table.set_header(["latency (µs)", "count", "p50", "p99", "max"]);
    let latency = &report.latency_us;
    let mut row = |name: String, q: &Quantiles| {
        let numbers = [q.count, q.p50, q.p99, q.max].map(right);
        table.add_row(std::iter::once(Cell::new(name)).chain(numbers));
    };
    for (kind, quantiles) in &latency.frame_to_command {
        row(format!("frame → command, {kind}"), quantiles);
    }
    row("  pixels → objects".to_owned(), &latency.detect);
    row("  objects → scene graph".to_owned(), &latency.ground);
    row("  scene graph → plan".to_owned(), &latency.plan);
    table
}

fn episode_table(reports: &[EpisodeReport]) -> Table {
    let mut table = table::plain();
    table.set_header([
        "seed",
        "verdict",
        "true",
        "cycles",
        "replans",
        "done",
        "failed",
        "run time (s)",
        "wall (s)",
        "CPU/frame (ms)",
        "continue p50 (µs)",
        "replan p50 (µs)",
        "decisions",
    ]);
    for report in reports {
        let kinds = &report.latency_us.frame_to_command;
        let p50 = |kind: &str| kinds.get(kind).map_or(0, |q| q.p50);
        table.add_row([
            right(report.seed),
            Cell::new(report.verdict),
            Cell::new(truth_word(report)),
            right(report.cycles),
            right(report.replans),
            right(report.skills_done),
            right(report.skills_failed),
            right(format!("{:.1}", report.sim_seconds)),
            right(format!("{:.1}", report.wall_seconds)),
            right(format!("{:.1}", report.cpu_ms_per_frame)),
            right(p50("continue")),
            right(p50("replan")),
            Cell::new(report.decision_hash.get(..12).unwrap_or_default()),
        ]);
    }
    table
}

impl From<crate::transport::TransportError> for Failure {
    fn from(error: crate::transport::TransportError) -> Self {
        RunError::from(error).into()
    }
}

#[cfg(test)]
mod tests {
    use super::tally;

    /// What is reached and not so is a class of its own.
    #[test]
    fn false_verdicts_are_told_by_their_seeds() {
        let (yes, no) = (Some(true), Some(false));
        let episodes =
            [(1, "reached", yes), (2, "gave-up", no), (3, "reached", no), (5, "reached", no)];
        let told = "reached 3/4, the goal holds in the simulator in 1/4\n\
                    FALSE: reached, but not in the simulator: seeds 3, 5";
        assert_eq!(tally(&episodes), told);
        let told = "reached 1/2, the goal holds in the simulator in 1/2";
        assert_eq!(tally(&episodes[..2]), told);
        assert_eq!(tally(&[(1, "planned", None)]), "reached 0/1", "without a simulator");
    }
}
