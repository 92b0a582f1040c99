//! `groundloop task`: asks a run that serves for goals.

use std::time::Duration;

use super::reports::TaskReport;
use super::{Failure, exit, out};
use crate::clock::monotonic_ns;
use crate::messages::{Stop, Submission, TaskRequest, TaskResult, TaskState, TaskStatus, Verdict};
use crate::transport::topics::TASK_STATUS;
use crate::transport::wire::DeviceHeader;
use crate::transport::{Bus, BusConfig, TaskClient};

/// How often is looked whether the run is still there.
const LOOK_EVERY: Duration = Duration::from_millis(500);

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Submit a goal and wait for what becomes of it
    Submit(SubmitArgs),
    /// Cancel a goal that waits or runs
    Cancel(CancelArgs),
    /// Print what becomes of goals, until the run ends
    Watch(WatchArgs),
}

#[derive(Debug, clap::Args)]
pub(super) struct SubmitArgs {
    /// The goal: a sentence, or what its kind wants.
    text: String,
    /// The name of the run.
    #[arg(long, value_name = "NAME")]
    run: String,
    /// What reads the goal: see `groundloop parts goal`; without it, that of the run file.
    #[arg(long, value_name = "KIND")]
    kind: Option<String>,
    /// The goal's identity; without it, a new one. One that is known is answered, and not carried out again.
    #[arg(long, value_name = "ID")]
    id: Option<String>,
    /// Ends as soon as the goal waits its turn.
    #[arg(long)]
    detach: bool,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, clap::Args)]
pub(super) struct CancelArgs {
    /// The goal's identity.
    id: String,
    /// The name of the run.
    #[arg(long, value_name = "NAME")]
    run: String,
}

#[derive(Debug, clap::Args)]
pub(super) struct WatchArgs {
    /// The name of the run.
    #[arg(long, value_name = "NAME")]
    run: String,
}

/// Carries a verb out.
pub(super) fn run(verb: &Verb) -> Result<u8, Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(Failure::internal)?;
    runtime.block_on(async {
        match verb {
            Verb::Submit(args) => submit(args).await,
            Verb::Cancel(args) => cancel(args).await,
            Verb::Watch(args) => watch(args).await,
        }
    })
}

/// What is said of a goal, for people.
pub(super) fn told(TaskStatus { task, state }: &TaskStatus) -> String {
    let text = match state {
        TaskState::Queued { .. } => format!("\"{}\": ", task.text),
        TaskState::Running
        | TaskState::Done(_)
        | TaskState::Cancelled { .. }
        | TaskState::Refused { .. }
        | TaskState::Failed { .. } => String::new(),
    };
    let result = match state {
        TaskState::Done(result) => {
            let truth = match (&result.end, result.goal_in_simulator) {
                (Verdict::Reached, Some(true)) => ", and in the simulator",
                (Verdict::Reached, Some(false)) => ", but NOT in the simulator",
                _ => "",
            };
            let (done, failed) = (result.counts.skills_done, result.counts.skills_failed);
            format!("{truth}; {done} skills done, {failed} failed, {:.1} s", result.run_s)
        }
        TaskState::Queued { .. }
        | TaskState::Running
        | TaskState::Cancelled { .. }
        | TaskState::Refused { .. }
        | TaskState::Failed { .. } => String::new(),
    };
    format!("goal {}: {text}{state}{result}", task.id)
}

/// A client of a run that is there.
fn client(run: &str) -> Result<(Bus, TaskClient), Failure> {
    let bus = Bus::open(&BusConfig::for_run(run))?;
    if !serves(&bus)? {
        let message = format!(
            "no run of the name {run} takes goals; start it: groundloop serve CONFIG --run {run}"
        );
        return Err(Failure { message, code: exit::MISSING });
    }
    let client = TaskClient::open(&bus)?;
    Ok((bus, client))
}

/// Whether anybody says what becomes of goals.
fn serves(bus: &Bus) -> Result<bool, Failure> {
    Ok(bus.uses::<DeviceHeader, u8>(&TASK_STATUS)?[0] > 0)
}

/// Waits until the run is there no more.
async fn run_ends(bus: &Bus) -> Result<(), Failure> {
    while serves(bus)? {
        tokio::time::sleep(LOOK_EVERY).await;
    }
    Ok(())
}

fn has_ended(bus: &Bus) -> Failure {
    let message = format!("the run {} has ended", bus.run());
    Failure { message, code: exit::MISSING }
}

async fn submit(args: &SubmitArgs) -> Result<u8, Failure> {
    let (bus, mut client) = client(&args.run)?;
    let new = || format!("{:x}-{:x}", std::process::id(), monotonic_ns());
    let id = args.id.clone().unwrap_or_else(new);
    let task = Submission { id, kind: args.kind.clone(), text: args.text.clone() };
    let stream = out::Stream::beside(args.json);
    let (heard, mut is_taken) = tokio::sync::watch::channel(None);
    let carried = client.carry_out(&task, |status| {
        stream.line(&told(status));
        heard.send_replace(Some(status.clone()));
    });
    let status = tokio::select! {
        biased;
        status = carried => status?,
        taken = is_taken.wait_for(Option::is_some), if args.detach => {
            let taken = taken.ok().and_then(|status| status.clone());
            taken.ok_or_else(|| has_ended(&bus))?
        }
        ended = run_ends(&bus) => {
            ended?;
            return Err(has_ended(&bus));
        }
    };
    if args.json {
        out::json(&report(&status))?;
    }
    Ok(code(&status.state))
}

fn report(TaskStatus { task, state }: &TaskStatus) -> TaskReport<'_> {
    let result = if let TaskState::Done(result) = state { Some(result) } else { None };
    TaskReport {
        id: &task.id,
        text: &task.text,
        state: state.word(),
        verdict: result.map(|result| result.end.word()),
        reason: state.reason(),
        goal: result.map(|result| result.goal.as_str()),
        run_s: result.map(|result| result.run_s),
        goal_in_simulator: result.and_then(|result| result.goal_in_simulator),
    }
}

/// The exit code of what has become of a goal.
fn code(state: &TaskState) -> u8 {
    match state {
        TaskState::Queued { .. } | TaskState::Running => 0,
        TaskState::Done(TaskResult {
            end: Verdict::Reached,
            goal_in_simulator: Some(false),
            ..
        }) => exit::CHECK_FAILED,
        TaskState::Done(result) => result.end.exit_code(),
        TaskState::Cancelled { .. } => Verdict::Stopped(Stop::Request).exit_code(),
        TaskState::Refused { .. } => exit::BAD_INPUT,
        TaskState::Failed { .. } => exit::INTERNAL,
    }
}

async fn cancel(args: &CancelArgs) -> Result<u8, Failure> {
    let (bus, mut client) = client(&args.run)?;
    let request = TaskRequest::Cancel { id: args.id.clone() };
    client.ask(&request)?;
    loop {
        let status = tokio::select! {
            biased;
            status = client.next() => status?,
            () = tokio::time::sleep(LOOK_EVERY) => {
                if !serves(&bus)? {
                    return Err(has_ended(&bus));
                }
                client.ask(&request)?;
                continue;
            }
        };
        if status.task.id == args.id && status.state.is_over() {
            out::line(&told(&status));
            let is_refused = matches!(status.state, TaskState::Refused { .. });
            return Ok(if is_refused { exit::BAD_INPUT } else { 0 });
        }
    }
}

async fn watch(args: &WatchArgs) -> Result<u8, Failure> {
    let (bus, mut client) = client(&args.run)?;
    let mut ends = std::pin::pin!(run_ends(&bus));
    loop {
        tokio::select! {
            biased;
            status = client.next() => out::line(&told(&status?)),
            ended = &mut ends => {
                ended?;
                return Ok(0);
            }
        }
    }
}
