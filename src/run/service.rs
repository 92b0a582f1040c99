//! Goals one after another: the hardware lives on, each goal has an episode of its own.

use std::pin::pin;

use tokio::sync::{mpsc, watch};

use super::episode::{Description, Play, Started, Station, stop_all};
use super::task_queue::{Answer, TaskQueue};
use super::wiring::PreparedRun;
use super::{Episode, RunError};
use crate::actors::{Fatal, Supervision, supervise};
use crate::messages::{Control, Stop, Submission, TaskResult, TaskState, TaskStatus, Verdict};
use crate::metrics::EpisodeReport;
use crate::transport::convert::{
    control_to_wire, device_header, task_request_from_wire, task_status_to_wire,
};
use crate::transport::topics::{CONTROL, RELIABLE_DEPTH, TASK, TASK_STATUS};
use crate::transport::wire::{ControlRecord, DeviceHeader};
use crate::transport::{Bus, Depth, Publisher, Subscriber, TransportError};

/// How a long-lived run is run.
#[derive(Debug)]
pub struct ServeOptions {
    /// The bus: goals come on its topic `task`, and what becomes of them goes out on `task/status`.
    pub bus: Bus,
    /// Ends the run, once somebody says so.
    pub stop: watch::Receiver<Option<Stop>>,
    /// Where news goes; what does not fit is left out.
    pub news: mpsc::Sender<ServeNews>,
}

/// What a long-lived run tells the process that it runs in.
#[derive(Debug)]
pub enum ServeNews {
    /// Goals may come.
    Ready,
    /// Something has become of a goal; with the report of its episode, where that has come to a verdict.
    Status(Box<TaskStatus>, Option<Box<EpisodeReport>>),
}

/// Takes goals from the bus, and carries them out one after another, until it is stopped.
///
/// A simulated world starts once, and is for each goal as the one before has left it. Between two goals the robot
/// is told to hold. What ends a goal does not end the run. Returns who stopped the run, and whether a goal was
/// stopped with it.
///
/// # Errors
/// [`RunError`]: hardware that this process plays, or the bus, has failed.
pub async fn serve(
    prepared: &PreparedRun,
    options: ServeOptions,
) -> Result<(Stop, bool), RunError> {
    let ServeOptions { bus, mut stop, news } = options;
    prepared.check_room()?;
    let description = Description::open(&bus)?;
    let context = prepared.new_context();
    let controls = bus.publisher(&CONTROL)?;
    let station = Station::open(prepared, bus.clone(), &context)?;
    let desk = Desk::open(&bus, TaskQueue::new(prepared.config.serve.clone()), news)?;
    let restarts = prepared.config.supervisor.clone();
    let actors = station.hardware_actors();
    let names = actors.iter().map(|actor| actor.name).collect();
    let hardware = supervise(actors, restarts, station.health.clone()).await?;
    let mut service =
        Service { prepared, bus, station, description, controls, desk, names, hardware };
    service.description.tell(prepared, (service.bus.run(), context.run_id), true)?;
    service.desk.tell(ServeNews::Ready);
    let ended = Box::pin(service.take_goals(&mut stop)).await;
    let reason = match &ended {
        Ok((why, _)) => Verdict::Stopped(*why).reason(),
        Err(error) => error.to_string(),
    };
    let Service { station, mut desk, hardware, .. } = service;
    let closed = desk.close(&reason);
    stop_all(hardware, station.line()).await;
    closed?;
    ended
}

/// A long-lived run.
struct Service<'a> {
    prepared: &'a PreparedRun,
    bus: Bus,
    station: Station,
    description: Description,
    controls: Publisher<DeviceHeader, ControlRecord>,
    desk: Desk,
    /// The actors that play the hardware.
    names: Vec<&'static str>,
    hardware: Supervision,
}

impl Service<'_> {
    /// Carries out one goal after another until somebody stops it; whether a goal was stopped with it.
    async fn take_goals(
        &mut self,
        stop: &mut watch::Receiver<Option<Stop>>,
    ) -> Result<(Stop, bool), RunError> {
        loop {
            tokio::select! {
                biased;
                why = told_to_stop(stop) => return Ok((why, false)),
                fatal = self.hardware.failed() => return Err(fatal.into()),
                task = self.desk.next_goal() => {
                    if let Some(why) = self.carry_out(&task?, stop).await? {
                        return Ok((why, true));
                    }
                }
            }
        }
    }

    /// Carries out one goal, and answers requests meanwhile; who has stopped the run, if somebody has.
    async fn carry_out(
        &mut self,
        task: &Submission,
        stop: &mut watch::Receiver<Option<Stop>>,
    ) -> Result<Option<Stop>, RunError> {
        let Self { prepared, bus, station, description, controls, desk, names, hardware } = self;
        hardware.forgive();
        let mut episode = pin!(attempt((prepared, task), station, (description, bus.run()), names));
        let (mut stopped, mut failed) = (None, None);
        let stop_episode =
            |why| controls.publish(device_header(0, 0), &[control_to_wire(Control::Stop(why))]);
        let ended = loop {
            tokio::select! {
                biased;
                ended = &mut episode => break ended,
                why = told_to_stop(stop), if stopped.is_none() => {
                    stopped = Some(why);
                    stop_episode(why)?;
                }
                fatal = hardware.failed(), if failed.is_none() => {
                    failed = Some(fatal);
                    stop_episode(Stop::Request)?;
                }
                stops = desk.answer_next() => {
                    if stops? {
                        stop_episode(Stop::Request)?;
                    }
                }
            }
        };
        if let Some(line) = station.line() {
            line.hold();
        }
        let failure = failed.map(RunError::from);
        let (state, report, broken) = outcome(ended, failure.as_ref());
        desk.end(state, report)?;
        if let Some(error) = failure.or(broken) {
            return Err(error);
        }
        if stopped.is_none() {
            let prepared = prepared.clone();
            // Nobody waits for it: a goal that comes at once makes its own.
            tokio::task::spawn_blocking(move || {
                if let Err(error) = prepared.make_ready() {
                    tracing::warn!(%error, "the next goal makes its detector itself");
                }
            });
        }
        Ok(stopped)
    }
}

/// One episode for a goal.
async fn attempt(
    (prepared, task): (&PreparedRun, &Submission),
    station: &Station,
    (description, run): (&mut Description, &str),
    kept: &[&str],
) -> Result<Episode, RunError> {
    let started = Started::now();
    let prepared = tokio::task::block_in_place(|| prepared.with_goal(task))?;
    let context = prepared.new_context();
    // Whoever hears of the goal has heard what it is.
    description.tell(&prepared, (run, context.run_id), true)?;
    let before = Some(station.go_on_in(&context, kept));
    let play = Play { context, started, before, more: Vec::new() };
    Box::pin(station.play(&prepared, play)).await
}

/// What an episode came to for whoever asked for it, with its report; and what ends the run, if that does. The
/// hardware may have failed meanwhile.
fn outcome(
    ended: Result<Episode, RunError>,
    failed: Option<&RunError>,
) -> (TaskState, Option<EpisodeReport>, Option<RunError>) {
    let failure = |error: &RunError| TaskState::Failed { reason: error.to_string() };
    match ended {
        Ok(Episode { report, end, .. }) => {
            let state = match (end.verdict, failed) {
                (Verdict::Stopped(_), Some(error)) => failure(error),
                (verdict @ Verdict::Stopped(_), None) => {
                    TaskState::Cancelled { reason: verdict.reason() }
                }
                (verdict, _) => TaskState::Done(TaskResult {
                    end: verdict,
                    goal: report.goal.clone(),
                    counts: end.counts,
                    run_s: report.sim_seconds,
                    goal_in_simulator: report.goal_in_simulator,
                }),
            };
            (state, Some(report), None)
        }
        Err(RunError::Config(error)) => (TaskState::Refused { reason: error.render() }, None, None),
        Err(RunError::Fatal(Fatal::Goal { why })) => {
            (TaskState::Refused { reason: why.to_string() }, None, None)
        }
        Err(error @ RunError::Transport(_)) => (failure(&error), None, Some(error)),
        Err(error) => (failure(&error), None, None),
    }
}

/// Waits until somebody says stop; for ever when nobody is left who could.
pub async fn told_to_stop(stop: &mut watch::Receiver<Option<Stop>>) -> Stop {
    let why = stop.wait_for(Option::is_some).await.ok().and_then(|why| *why);
    match why {
        Some(why) => why,
        None => std::future::pending().await,
    }
}

/// Where goals come in, and where it is said what becomes of them.
struct Desk {
    requests: Subscriber<DeviceHeader, u8>,
    statuses: Publisher<DeviceHeader, u8>,
    n_said: u64,
    queue: TaskQueue,
    news: mpsc::Sender<ServeNews>,
}

impl Desk {
    fn open(
        bus: &Bus,
        queue: TaskQueue,
        news: mpsc::Sender<ServeNews>,
    ) -> Result<Self, TransportError> {
        let requests = bus.subscriber(&TASK, Depth::all(RELIABLE_DEPTH))?;
        Ok(Self { requests, statuses: bus.publisher(&TASK_STATUS)?, n_said: 0, queue, news })
    }

    /// Waits for a goal, answers what is asked meanwhile, and begins it. Cancel-safe.
    async fn next_goal(&mut self) -> Result<Submission, TransportError> {
        loop {
            if let Some(status) = self.queue.begin() {
                let task = status.task.clone();
                self.say(status, None)?;
                return Ok(task);
            }
            self.answer_next().await?;
        }
    }

    /// Waits for a request and answers it; whether the running goal is to be stopped. Cancel-safe.
    async fn answer_next(&mut self) -> Result<bool, TransportError> {
        let message = self.requests.next().await?;
        let request = match task_request_from_wire(message.records()) {
            Ok(request) => request,
            Err(error) => {
                tracing::warn!(topic = TASK.name, %error, "rejected");
                return Ok(false);
            }
        };
        let Answer { status, is_news, stops_running } = self.queue.take(request);
        if is_news {
            self.say(status, None)?;
        } else {
            self.publish(&status)?;
        }
        Ok(stops_running)
    }

    /// The running goal has ended.
    fn end(
        &mut self,
        state: TaskState,
        report: Option<EpisodeReport>,
    ) -> Result<(), TransportError> {
        let status = self.queue.end(state);
        status.map_or(Ok(()), |status| self.say(status, report))
    }

    /// Nothing more is begun.
    fn close(&mut self, reason: &str) -> Result<(), TransportError> {
        self.queue.close(reason).into_iter().try_for_each(|status| self.say(status, None))
    }

    /// Says what has become of a goal, on the bus and in this process.
    fn say(
        &mut self,
        status: TaskStatus,
        report: Option<EpisodeReport>,
    ) -> Result<(), TransportError> {
        self.publish(&status)?;
        self.tell(ServeNews::Status(Box::new(status), report.map(Box::new)));
        Ok(())
    }

    fn publish(&mut self, status: &TaskStatus) -> Result<(), TransportError> {
        let (header, text) = match task_status_to_wire(self.n_said, status) {
            Ok(written) => written,
            Err(error) => {
                tracing::warn!(topic = TASK_STATUS.name, %error, "not said");
                return Ok(());
            }
        };
        self.n_said += 1;
        self.statuses.publish(header, &text)
    }

    fn tell(&self, news: ServeNews) {
        // Who does not listen misses it; the bus has it, too.
        if let Err(error) = self.news.try_send(news) {
            tracing::debug!(%error, "news");
        }
    }
}
