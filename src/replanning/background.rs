//! Builds distance tables beside the loop, on one thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

use super::TableEnd;
use super::replanner::TableRequest;

/// Builds one table at a time. Dropped, it tells its thread to stop.
#[derive(Debug, Default)]
pub struct TableBuilder {
    running: Option<Running>,
}

#[derive(Debug)]
struct Running {
    /// The request that is carried out.
    number: u64,
    cancelled: Arc<AtomicBool>,
    result: Receiver<TableEnd>,
}

impl TableBuilder {
    /// Starts to carry out a request, unless that is under way already.
    pub fn start(&mut self, request: &TableRequest) {
        if self.running.as_ref().is_some_and(|running| running.number == request.number) {
            return;
        }
        self.cancel();
        let cancelled = Arc::new(AtomicBool::new(false));
        let (sender, result) = sync_channel(1);
        let (job, stop) = (Arc::clone(&request.job), Arc::clone(&cancelled));
        let work = move || {
            let end = job.run(&|| stop.load(Ordering::Relaxed));
            if sender.send(end).is_err() {
                tracing::debug!("nobody wants the distance table any more");
            }
        };
        let thread = std::thread::Builder::new().name("distance table".to_owned()).spawn(work);
        match thread {
            Ok(_) => self.running = Some(Running { number: request.number, cancelled, result }),
            Err(error) => tracing::warn!(%error, "no thread for the distance table"),
        }
    }

    /// The result of a request; with `wait`, whenever it comes. Without a thread the work is done
    /// here, if it is waited for.
    pub fn result(&mut self, request: &TableRequest, wait: bool) -> Option<TableEnd> {
        self.start(request);
        let Some(running) = &self.running else {
            return wait.then(|| request.job.run(&|| false));
        };
        let result = if wait { running.result.recv().ok() } else { running.result.try_recv().ok() };
        // A thread that died has said why; the same work would kill this one as well.
        let result = if wait { Some(result.unwrap_or(TableEnd::Interrupted)) } else { result };
        if result.is_some() {
            self.running = None;
        }
        result
    }

    fn cancel(&mut self) {
        if let Some(running) = self.running.take() {
            running.cancelled.store(true, Ordering::Relaxed);
        }
    }
}

impl Drop for TableBuilder {
    fn drop(&mut self) {
        self.cancel();
    }
}
