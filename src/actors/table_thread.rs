//! Builds distance tables beside the loop, on one thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

use crate::replanning::{TableBuilder, TableEnd, TableRequest};

/// A thread for the request that is carried out, if any. Dropped, it tells its thread to stop.
#[derive(Debug, Default)]
pub(super) struct TableThread {
    running: Option<Running>,
}

#[derive(Debug)]
struct Running {
    /// Number of the request that is carried out.
    number: u64,
    cancelled: Arc<AtomicBool>,
    result: Receiver<TableEnd>,
}

impl TableThread {
    fn cancel(&mut self) {
        if let Some(running) = self.running.take() {
            running.cancelled.store(true, Ordering::Relaxed);
        }
    }
}

impl TableBuilder for TableThread {
    fn start(&mut self, request: &TableRequest) {
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

    fn ready(&mut self, request: &TableRequest) -> Option<TableEnd> {
        self.start(request);
        let end = self.running.as_ref()?.result.try_recv().ok();
        if end.is_some() {
            self.running = None;
        }
        end
    }

    /// Without a thread the work is done here.
    fn wait(&mut self, request: &TableRequest) -> TableEnd {
        self.start(request);
        match self.running.take() {
            // A thread that died has said why; the same work would kill this one as well.
            Some(running) => running.result.recv().unwrap_or(TableEnd::Interrupted),
            None => request.job.run(&|| false),
        }
    }
}

impl Drop for TableThread {
    fn drop(&mut self) {
        self.cancel();
    }
}
