//! `groundloop serve`: goals from the bus, one after another.

use std::path::PathBuf;

use tokio::sync::mpsc;

use super::begin::{join_bus, listen, on_runtime, read_run};
use super::out::Stream;
use super::reports::ServeReport;
use super::run::Teller;
use super::services::ServiceArgs;
use super::task::told;
use super::{Failure, out};
use crate::messages::{TaskState, TaskStatus, Verdict};
use crate::metrics::EpisodeReport;
use crate::run::{PreparedRun, RunConfig, ServeNews, ServeOptions, load_run, serve};
use crate::transport::EventReader;

/// News that wait to be told, at most.
const NEWS_MAX: usize = 1024;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The run file, or the name of a shipped one: all but the text of its goal.
    config: PathBuf,
    /// Overrides a key of the run file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// The seed; without it, the run file's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// The name of the run on the bus; without it, the run file's.
    #[arg(long, value_name = "NAME")]
    run: Option<String>,
    /// What `$data` stands for in the run file.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    #[command(flatten)]
    services: ServiceArgs,
    /// Shows every fact of a state and every step of a plan, over several lines.
    #[arg(short, long)]
    verbose: bool,
    /// Writes one JSON object for each goal that is over, a line each, to standard output, and nothing
    /// else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let sets = [args.sets.clone(), args.services.sets()].concat();
    let mut config = load_run(&args.config, &sets)?;
    config.seed = args.seed.unwrap_or(config.seed);
    config.run = args.run.clone().or(config.run);
    on_runtime(served(args, config))
}

async fn served(args: &Args, config: RunConfig) -> Result<u8, Failure> {
    let mut stop = listen().map_err(Failure::internal)?;
    let prepared = read_run(config, args.data.clone(), &mut stop).await?;
    let bus = join_bus(&prepared, &mut stop).await?;
    let mut events = EventReader::open(&bus)?;
    let mut desk = Newsroom::new(args, &prepared, bus.run());
    let (news, mut heard) = mpsc::channel(NEWS_MAX);
    let mut serving = Box::pin(serve(&prepared, ServeOptions { bus, stop, news }));
    let ended = loop {
        tokio::select! {
            biased;
            event = events.next() => desk.teller.tell(&event?),
            Some(news) = heard.recv() => desk.tell(&mut events, &news)?,
            ended = &mut serving => break ended,
        }
    };
    while let Ok(news) = heard.try_recv() {
        desk.tell(&mut events, &news)?;
    }
    let (why, was_at_work) = ended?;
    Ok(if was_at_work { Verdict::Stopped(why).exit_code() } else { 0 })
}

/// Tells people and programs what becomes of goals.
struct Newsroom<'a> {
    args: &'a Args,
    prepared: &'a PreparedRun,
    run: String,
    stream: Stream,
    teller: Teller,
}

impl<'a> Newsroom<'a> {
    fn new(args: &'a Args, prepared: &'a PreparedRun, run: &str) -> Self {
        let stream = Stream::beside(args.json);
        let teller = Teller::new(prepared, stream, args.verbose);
        Self { args, prepared, run: run.to_owned(), stream, teller }
    }

    fn tell(&mut self, events: &mut EventReader, news: &ServeNews) -> Result<(), Failure> {
        // What happened before is told before.
        while let Some(event) = events.poll()? {
            self.teller.tell(&event);
        }
        match news {
            ServeNews::Ready => {
                let run = &self.run;
                self.stream.line(&format!(
                    "serving run \"{run}\": groundloop task submit --run {run} \"…\"; Ctrl-C ends it"
                ));
                Ok(())
            }
            ServeNews::Status(status, episode) => self.status(status, episode.as_deref()),
        }
    }

    fn status(
        &mut self,
        status: &TaskStatus,
        episode: Option<&EpisodeReport>,
    ) -> Result<(), Failure> {
        let TaskStatus { task, state } = status;
        self.stream.line(&told(status));
        if *state == TaskState::Running {
            self.teller = Teller::new(self.prepared, self.stream, self.args.verbose);
        }
        if self.args.json && state.is_over() {
            let (id, text, word) = (task.id.as_str(), task.text.as_str(), state.word());
            out::json(&ServeReport { id, text, state: word, reason: state.reason(), episode })?;
        }
        Ok(())
    }
}
