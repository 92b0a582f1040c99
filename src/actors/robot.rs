//! Robot actor: commands in; time passes; statuses and state out.

use std::time::Duration;

use tokio::time::Instant;

use super::{ActorError, Monitor};
use crate::hardware::Robot;
use crate::messages::{Command, CommandKind};
use crate::transport::convert::{
    command_from_wire, device_header, robot_state_to_wire, status_to_wire,
};
use crate::transport::topics::{RELIABLE_DEPTH, ROBOT_COMMAND, ROBOT_STATE, ROBOT_STATUS};
use crate::transport::wire::{CommandRecord, DeviceHeader, RobotStateRecord, StatusRecord};
use crate::transport::{Bus, Depth, Publisher, Received, Subscriber};

/// How long a robot that moves may go without a command where no run file says it.
pub const COMMAND_AGE_MAX: Duration = Duration::from_secs(1);

struct Ports {
    commands: Subscriber<DeviceHeader, CommandRecord>,
    states: Publisher<DeviceHeader, RobotStateRecord>,
    statuses: Publisher<DeviceHeader, StatusRecord>,
}

/// Hosts a robot.
///
/// A robot that moves holds by itself when no command has come for `command_age_max`: whoever has started the
/// motion is gone.
///
/// What it has to say goes out before the next frame may be captured, so that whoever sees the
/// frame has heard it.
///
/// # Errors
/// [`ActorError`] when the bus fails.
pub async fn serve(
    bus: Bus,
    mut robot: Box<dyn Robot>,
    monitor: Monitor,
    command_age_max: Duration,
) -> Result<(), ActorError> {
    let mut ports = Ports {
        commands: bus.subscriber(&ROBOT_COMMAND, Depth::all(RELIABLE_DEPTH))?,
        states: bus.publisher(&ROBOT_STATE)?,
        statuses: bus.publisher(&ROBOT_STATUS)?,
    };
    let mut ticks = robot.period().map(tokio::time::interval);
    if let Some(ticks) = &mut ticks {
        ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
    }
    publish(&ports, &mut *robot)?;
    let mut heard = Instant::now();
    loop {
        let command = match &mut ticks {
            // What has come while this process stood still is heard first.
            Some(ticks) => tokio::select! {
                biased;
                command = ports.commands.next() => Some(command?),
                _ = ticks.tick() => None,
            },
            None => Some(ports.commands.next().await?),
        };
        match command.as_ref().map(read) {
            Some(Ok(command)) => {
                monitor.message("robot").await;
                heard = Instant::now();
                tokio::task::block_in_place(|| robot.accept(&command));
            }
            Some(Err((id, reason))) => robot.refuse(id, reason),
            None => tokio::task::block_in_place(|| {
                if heard.elapsed() > command_age_max {
                    stand(&mut *robot, command_age_max);
                }
                robot.tick();
            }),
        }
        publish(&ports, &mut *robot)?;
    }
}

/// Holds, where a motion runs.
fn stand(robot: &mut dyn Robot, command_age_max: Duration) {
    let (frame_sequence, state) = robot.state();
    let Some(id) = state.command_id else { return };
    tracing::warn!(
        "the robot holds: no command for {} ms (robot.command_age_ms_max)",
        command_age_max.as_millis()
    );
    let (capture_ns, kind) = (state.capture_ns, CommandKind::Hold);
    robot.accept(&Command { id, frame_sequence, capture_ns, kind, step: None });
}

/// A command; or which motion cannot be read, and why: the executor is not to wait for it.
fn read(received: &Received<DeviceHeader, CommandRecord>) -> Result<Command, (u64, String)> {
    command_from_wire(received.header(), received.records()).map_err(|error| {
        tracing::warn!(%error, "robot/command");
        let id = received.records().first().map_or(0, |record| record.command_id);
        (id, format!("the command cannot be read: {error}"))
    })
}

fn publish(ports: &Ports, robot: &mut dyn Robot) -> Result<(), ActorError> {
    for status in robot.pending() {
        let header = device_header(status.sequence, status.capture_ns);
        ports.statuses.publish(header, &[status_to_wire(&status)])?;
    }
    let (sequence, state) = robot.state();
    let header = device_header(sequence, state.capture_ns);
    ports.states.publish(header, &[robot_state_to_wire(&state)])?;
    robot.published();
    Ok(())
}
