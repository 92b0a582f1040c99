//! Waiting, until a signal says stop.

use tokio::sync::watch;

use super::Failure;
use crate::messages::{Stop, Verdict};

/// What a call comes to that may take long or for ever, unless somebody says stop before.
pub(super) async fn unless_stopped<T: Send + 'static>(
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

/// Waits until somebody says stop; for ever when nobody is left who could.
pub(super) async fn told_to_stop(stop: &mut watch::Receiver<Option<Stop>>) -> Stop {
    let why = stop.wait_for(Option::is_some).await.ok().and_then(|why| *why);
    match why {
        Some(why) => why,
        None => std::future::pending().await,
    }
}
