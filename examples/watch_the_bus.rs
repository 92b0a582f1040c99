//! Watches a run from another process: what it is, then what happens, until it ends. One that serves is watched over
//! all its goals.
//!
//! ```console
//! cargo run --release -- run configs/blocksworld.toml --run demo &
//! cargo run --release --example watch_the_bus -- demo
//! ```

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "it is what the example is for")]

use std::process::ExitCode;
use std::time::Duration;

use groundloop::messages::Event;
use groundloop::transport::topics::RUN;
use groundloop::transport::wire::DeviceHeader;
use groundloop::transport::{Bus, BusConfig, EventReader, TransportError, join};

/// How often is looked whether the run is still there.
const LOOK_EVERY: Duration = Duration::from_millis(500);

async fn watch(name: String) -> Result<(), TransportError> {
    // The same root and prefix as the run's: the defaults.
    let bus = Bus::open(&BusConfig::for_run(name))?;
    let mut events = EventReader::open(&bus)?;
    // With this context the scenes, plans and other topics can be read, too.
    let (run, _context) = join(&bus).await?;
    println!("run {}: domain {}, seed {}", run.run, run.domain, run.seed);
    loop {
        tokio::select! {
            biased;
            message = events.next() => {
                let message = message?;
                println!("#{:<5} {}", message.cause.cycle, message.event);
                if matches!(message.event, Event::End(_)) && !run.takes_tasks {
                    return Ok(());
                }
            }
            () = tokio::time::sleep(LOOK_EVERY), if run.takes_tasks => {
                let [n_writers, _] = bus.uses::<DeviceHeader, u8>(&RUN)?;
                if n_writers == 0 {
                    return Ok(());
                }
            }
        }
    }
}

#[tokio::main]
async fn main() -> ExitCode {
    let Some(name) = std::env::args().nth(1) else {
        eprintln!("usage: watch_the_bus NAME");
        return ExitCode::from(2);
    };
    let Err(error) = watch(name).await else { return ExitCode::SUCCESS };
    eprintln!("error: {error}");
    ExitCode::FAILURE
}
