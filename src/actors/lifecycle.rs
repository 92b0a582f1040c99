//! The one ractor actor: it owns a data loop, and dies when the loop does.

use std::pin::Pin;

use ractor::{Actor, ActorProcessingErr, ActorRef};
use tokio::task::AbortHandle;

use super::ActorError;

/// A data loop: it ends only on an error, or when the actor's work is done.
pub type Serve = Pin<Box<dyn Future<Output = Result<(), ActorError>> + Send>>;

/// What the actor is told: its loop has ended.
#[derive(Debug)]
pub struct LoopEnded(Result<(), ActorError>);

/// The actor around a data loop.
#[derive(Debug, Clone, Copy)]
pub struct DataLoop;

/// The running loop; dropping it ends the loop.
#[derive(Debug)]
pub struct RunningLoop(AbortHandle);

impl Drop for RunningLoop {
    fn drop(&mut self) {
        self.0.abort();
    }
}

impl Actor for DataLoop {
    type Msg = LoopEnded;
    type State = RunningLoop;
    type Arguments = Serve;

    async fn pre_start(
        &self,
        myself: ActorRef<LoopEnded>,
        serve: Serve,
    ) -> Result<RunningLoop, ActorProcessingErr> {
        let data_loop = tokio::spawn(serve);
        let abort = data_loop.abort_handle();
        // Without this watcher a panic in the loop would go unnoticed.
        tokio::spawn(async move {
            let ended = match data_loop.await {
                Ok(ended) => ended,
                Err(error) if error.is_panic() => Err(panicked(&*error.into_panic())),
                Err(_) => return, // aborted: the actor is gone already
            };
            if myself.cast(LoopEnded(ended)).is_err() {
                tracing::debug!("an actor was stopped before its loop ended");
            }
        });
        Ok(RunningLoop(abort))
    }

    async fn handle(
        &self,
        myself: ActorRef<LoopEnded>,
        LoopEnded(ended): LoopEnded,
        _: &mut RunningLoop,
    ) -> Result<(), ActorProcessingErr> {
        match ended {
            Ok(()) => myself.stop(Some("done".to_owned())),
            Err(error) => return Err(Box::new(error)),
        }
        Ok(())
    }
}

fn panicked(payload: &(dyn std::any::Any + Send)) -> ActorError {
    let text = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    ActorError::Panicked { message: text.unwrap_or_else(|| "no message".to_owned()) }
}
