//! `groundloop topics`: who says what in a run, and what does not arrive.

use std::collections::BTreeMap;
use std::time::Duration;

use comfy_table::Cell;

use super::out::Stream;
use super::table::{self, right};
use super::{Failure, exit, out};
use crate::clock::monotonic_ns;
use crate::messages::ActorHealth;
use crate::transport::convert::{WireContext, health_from_wire, run_from_wire};
use crate::transport::topics::{HEALTH, RUN};
use crate::transport::wire::{DeviceHeader, HealthRecord, StreamHeader};
use crate::transport::{Bus, BusConfig, Depth, Received, Subscriber, Tap, TappedMessage};

/// How often topics are looked at.
const LOOK_EVERY: Duration = Duration::from_millis(5);
const NS_PER_S: f64 = 1e9;
const NS_PER_MS: f64 = 1e6;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// List the topics of a run: who writes and reads them, how often, what was lost and refused
    List(ListArgs),
    /// Print what is said on a topic, a line a message
    Echo(EchoArgs),
    /// Measure how often messages come on a topic
    Hz(HzArgs),
}

#[derive(Debug, clap::Args)]
pub(super) struct ListArgs {
    /// The name of the run.
    #[arg(long, value_name = "NAME")]
    run: String,
    /// For how long messages are counted, seconds.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    for_s: f64,
}

#[derive(Debug, clap::Args)]
pub(super) struct EchoArgs {
    /// The topic, such as `robot/command`.
    topic: String,
    /// The name of the run.
    #[arg(long, value_name = "NAME")]
    run: String,
    /// Ends after so many messages.
    #[arg(long, value_name = "N")]
    count: Option<u64>,
}

#[derive(Debug, clap::Args)]
pub(super) struct HzArgs {
    /// The topic, such as `camera/main/rgb`.
    topic: String,
    /// The name of the run.
    #[arg(long, value_name = "NAME")]
    run: String,
    /// For how long, seconds.
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = seconds)]
    for_s: f64,
}

/// Seconds that a person may wait.
fn seconds(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_not| "expected seconds".to_owned())?;
    if seconds > 0.0 && seconds <= 86_400.0 {
        return Ok(seconds);
    }
    Err(format!("expected seconds from 0 to 86400, got {text}"))
}

/// Carries a verb out.
pub(super) fn run(verb: &Verb) -> Result<u8, Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(Failure::internal)?;
    match verb {
        Verb::List(args) => runtime.block_on(list(args)),
        Verb::Echo(args) => runtime.block_on(echo(args)),
        Verb::Hz(args) => runtime.block_on(hz(args)),
    }
}

/// The bus of a run that is there, with the names of its topics.
fn opened(run: &str) -> Result<(Bus, Vec<String>), Failure> {
    let bus = Bus::open(&BusConfig::for_run(run))?;
    let names = bus.topics()?;
    if names.is_empty() {
        let message =
            format!("no run of the name {run}: it has no topics; start it with --run {run}");
        return Err(Failure { message, code: exit::MISSING });
    }
    Ok((bus, names))
}

fn tapped(bus: &Bus, names: &[String], name: &str) -> Result<Box<dyn Tap>, Failure> {
    let there = names.iter().any(|known| known == name);
    let tap = if there { bus.tap(name)? } else { None };
    tap.ok_or_else(|| {
        Failure::bad_input(format!("topic: expected one of {}, got {name}", names.join(", ")))
    })
}

/// What has come on a topic.
#[derive(Default)]
struct Count {
    n: u64,
    n_bytes: u64,
    last: Option<u64>,
    gaps_ns: Vec<u64>,
}

impl Count {
    fn add(&mut self, message: &TappedMessage) {
        self.n += 1;
        self.n_bytes += message.n_bytes as u64;
        let before = self.last.replace(message.send_ns);
        self.gaps_ns.extend(before.map(|before| message.send_ns.saturating_sub(before)));
    }

    /// Messages a second between the first and the last one.
    fn rate_hz(&self) -> Option<f64> {
        let all_ns: u64 = self.gaps_ns.iter().sum();
        (all_ns > 0).then(|| self.gaps_ns.len() as f64 * NS_PER_S / all_ns as f64)
    }

    fn age_ms(&self) -> Option<f64> {
        Some(monotonic_ns().saturating_sub(self.last?) as f64 / NS_PER_MS)
    }
}

async fn list(args: &ListArgs) -> Result<u8, Failure> {
    let (bus, names) = opened(&args.run)?;
    let mut taps: Vec<(String, Box<dyn Tap>, Count)> = Vec::new();
    for name in names {
        if let Some(tap) = bus.tap(&name)? {
            taps.push((name, tap, Count::default()));
        }
    }
    let mut actors = Actors::open(&bus)?;
    let end_ns = monotonic_ns() + (args.for_s * NS_PER_S) as u64;
    while monotonic_ns() < end_ns {
        tokio::time::sleep(LOOK_EVERY).await;
        for (_, tap, count) in &mut taps {
            tap.poll()?.iter().for_each(|message| count.add(message));
        }
        actors.poll()?;
    }
    let mut listed = table::plain();
    listed.set_header([
        "topic",
        "writers",
        "readers",
        "a second",
        "age (ms)",
        "missed",
        "late",
        "other schema",
    ]);
    for (name, tap, count) in &taps {
        let [writers, readers] = tap.uses()?;
        let drops = tap.drops();
        let number = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:.1}"));
        listed.add_row([
            Cell::new(name),
            right(writers),
            right(readers.saturating_sub(1)),
            right(number(count.rate_hz())),
            right(number(count.age_ms())),
            right(drops.missed),
            right(drops.late),
            right(drops.foreign),
        ]);
    }
    Stream::Output.table(listed);
    actors.refused().for_each(|line| out::line(&line));
    Ok(0)
}

/// How the run's actors fare.
struct Actors {
    descriptions: Subscriber<DeviceHeader, u8>,
    reports: Subscriber<StreamHeader, HealthRecord>,
    context: Option<WireContext>,
    known: BTreeMap<String, ActorHealth>,
}

impl Actors {
    fn open(bus: &Bus) -> Result<Self, Failure> {
        let (descriptions, reports) =
            (bus.subscriber(&RUN, Depth::newest())?, bus.subscriber(&HEALTH, Depth::newest())?);
        Ok(Self { descriptions, reports, context: None, known: BTreeMap::new() })
    }

    fn poll(&mut self) -> Result<(), Failure> {
        // A run that takes goals describes itself anew for each.
        let read = |message: Received<_, _>| run_from_wire(message.records());
        let described = self.descriptions.drain_newest_of(read)?.map(|(_, context)| context);
        self.context = described.or(self.context.take());
        let Some(context) = &self.context else { return Ok(()) };
        let read = |m: Received<_, _>| health_from_wire(m.header(), m.records(), context);
        for health in self.reports.drain_newest_of(read)?.into_iter().flatten() {
            self.known.insert(health.actor.clone(), health);
        }
        Ok(())
    }

    /// What each actor could not use.
    fn refused(&self) -> impl Iterator<Item = String> {
        let refused = self.known.values().filter(|health| health.n_rejected > 0);
        refused.map(|health| {
            let ActorHealth { actor, n_rejected, faults, last_rejection, .. } = health;
            let kinds = match faults.to_string() {
                none if none.is_empty() => none,
                kinds => format!(" ({kinds})"),
            };
            format!("{actor}: {n_rejected} messages refused{kinds}, the last: {last_rejection}")
        })
    }
}

async fn echo(args: &EchoArgs) -> Result<u8, Failure> {
    let (bus, names) = opened(&args.run)?;
    let mut tap = tapped(&bus, &names, &args.topic)?;
    let mut n = 0;
    loop {
        for message in tap.poll()? {
            out::line(&format!("#{} {}", message.sequence, message.text));
            n += 1;
            if args.count.is_some_and(|count| n >= count) {
                return Ok(0);
            }
        }
        tokio::time::sleep(LOOK_EVERY).await;
    }
}

async fn hz(args: &HzArgs) -> Result<u8, Failure> {
    let (bus, names) = opened(&args.run)?;
    let mut tap = tapped(&bus, &names, &args.topic)?;
    let mut count = Count::default();
    let end_ns = monotonic_ns() + (args.for_s * NS_PER_S) as u64;
    while monotonic_ns() < end_ns {
        tokio::time::sleep(LOOK_EVERY).await;
        tap.poll()?.iter().for_each(|message| count.add(message));
    }
    let Some(rate) = count.rate_hz() else {
        let for_s = args.for_s;
        return Err(Failure {
            message: format!("{}: {} messages in {for_s} s, too few to tell", args.topic, count.n),
            code: exit::MISSING,
        });
    };
    let mut gaps = count.gaps_ns.clone();
    gaps.sort_unstable();
    let at = |share: f64| {
        let idx = (share * (gaps.len() - 1) as f64).round() as usize;
        gaps.get(idx).map_or(0.0, |ns| *ns as f64 / NS_PER_MS)
    };
    out::line(&format!(
        "{}: {rate:.1} a second, {} messages of {} bytes; between two {:.1} ms (median), {:.1} (95 %), {:.1} (most)",
        args.topic,
        count.n,
        count.n_bytes / count.n.max(1),
        at(0.5),
        at(0.95),
        at(1.0)
    ));
    Ok(0)
}
