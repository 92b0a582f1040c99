//! Watches a run from another process: what it is, then what happens, until it ends.
//!
//! ```console
//! cargo run --release -- run configs/blocksworld.toml --run demo &
//! cargo run --release --example watch_the_bus -- demo
//! ```

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "it is what the example is for")]

use std::process::ExitCode;

use groundloop::messages::Event;
use groundloop::transport::{Bus, BusConfig, EventReader, TransportError, join};

async fn watch(name: String) -> Result<(), TransportError> {
    // The same root and prefix as the run's: the defaults.
    let bus = Bus::open(&BusConfig::for_run(name))?;
    let mut events = EventReader::open(&bus)?;
    // With this context the scenes, plans and other topics can be read, too.
    let (run, _context) = join(&bus).await?;
    println!("run {}: domain {}, seed {}", run.run, run.domain, run.seed);
    loop {
        let message = events.next().await?;
        println!("#{:<5} {}", message.cause.cycle, message.event);
        if matches!(message.event, Event::End(_)) {
            return Ok(());
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
