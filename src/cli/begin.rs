//! What verbs that run the loop begin with: a runtime, signals, the run file, the bus.

use std::path::PathBuf;
use std::time::Duration;

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

use super::{Failure, out};
use crate::messages::{Stop, Verdict};
use crate::run::{PreparedRun, RunConfig, told_to_stop};
use crate::transport::{Bus, BusConfig};

/// Threads of the runtime: the loop is a pipeline, more would not help one episode.
const WORKERS: usize = 2;
/// How long is waited for threads that are still at work when the episodes are over.
const SHUTDOWN_MAX: Duration = Duration::from_secs(1);

/// Carries a verb out that waits for more than one thing at a time.
pub(super) fn on_runtime(verb: impl Future<Output = Result<u8, Failure>>) -> Result<u8, Failure> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(WORKERS)
        .enable_all()
        .build()
        .map_err(Failure::internal)?;
    let ended = runtime.block_on(verb);
    // A thread that is lost in a slow service ends with the process.
    runtime.shutdown_timeout(SHUTDOWN_MAX);
    ended
}

/// Reads everything that a run file names, unless somebody says stop before.
pub(super) async fn read_run(
    config: RunConfig,
    data: Option<PathBuf>,
    stop: &mut watch::Receiver<Option<Stop>>,
) -> Result<PreparedRun, Failure> {
    let read = move || PreparedRun::read(config, data.as_deref());
    let prepared = unless_stopped(stop, read).await??;
    for warning in &prepared.folder.warnings {
        tracing::warn!(warning, "domain.pddl");
    }
    Ok(prepared)
}

/// Joins the bus, unless somebody says stop before.
pub(super) async fn join_bus(
    prepared: &PreparedRun,
    stop: &mut watch::Receiver<Option<Stop>>,
) -> Result<Bus, Failure> {
    let bus = BusConfig::for_run(prepared.config.run_name());
    Ok(unless_stopped(stop, move || Bus::open(&bus)).await??)
}

/// What a call comes to that may take long or for ever, unless somebody says stop before.
async fn unless_stopped<T: Send + 'static>(
    stop: &mut watch::Receiver<Option<Stop>>,
    call: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Failure> {
    tokio::select! {
        done = tokio::task::spawn_blocking(call) => done.map_err(Failure::internal),
        why = told_to_stop(stop) => {
            let code = Verdict::Stopped(why).exit_code();
            Err(Failure { message: "stopped before the run had begun".to_owned(), code })
        }
    }
}

/// Turns Ctrl-C, SIGTERM and SIGHUP into a stop that the loop carries out; a second one ends at once.
pub(super) fn listen() -> std::io::Result<watch::Receiver<Option<Stop>>> {
    let (sender, receiver) = watch::channel(None);
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let mut hang_up = signal(SignalKind::hangup())?;
    tokio::spawn(async move {
        let mut next = async || {
            tokio::select! {
                _ = interrupt.recv() => Stop::Interrupt,
                _ = terminate.recv() => Stop::Terminate,
                _ = hang_up.recv() => Stop::Terminate,
            }
        };
        sender.send_replace(Some(next().await));
        tokio::select! {
            again = next() => end_at_once(again),
            () = sender.closed() => {}
        }
    });
    Ok(receiver)
}

/// What a second signal asks for, whatever the loop is waiting for.
#[expect(clippy::exit, reason = "nothing else may be waited for")]
fn end_at_once(stop: Stop) {
    out::note("ended at once: the robot may not have been told to hold");
    std::process::exit(Verdict::Stopped(stop).exit_code().into());
}
