//! Why a topic is silent, as far as the bus can tell.

use std::fmt;

use super::services::Record;
use super::topics::Topic;
use super::wire::{SCHEMA, WireHeader};
use super::{Bus, Drops, Subscriber, TransportError};

/// Nothing that can be read has come on a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicSilence {
    /// Its name below the run.
    pub topic: &'static str,
    /// Run and place that are looked at.
    pub place: String,
    /// Why, as far as it can be told.
    pub cause: SilenceCause,
}

/// Why nothing that can be read has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SilenceCause {
    /// Nobody writes the topic.
    NoWriter,
    /// Somebody does, and has sent nothing.
    NothingSent,
    /// What came has another version.
    OtherSchema {
        /// Messages of another version.
        n: u64,
        /// The version of the last of them.
        got: u32,
    },
    /// What came was not sent later than what had come before.
    NotLater {
        /// Messages.
        n: u64,
    },
    /// Messages wait, and nobody has been woken for them.
    NotWoken {
        /// Messages that wait; a reader of the newest keeps few.
        n: u64,
    },
}

impl SilenceCause {
    /// Whether there is nobody to hear; otherwise somebody says what cannot be read.
    pub fn is_absence(self) -> bool {
        matches!(self, Self::NoWriter | Self::NothingSent)
    }

    /// The cause, given what a reader counts of what has come since it last heard something, how many
    /// messages lie there without a wake-up, and how many writers there are.
    fn of(since: Drops, now: Drops, n_unwoken: u64, n_writers: usize) -> Self {
        let foreign = now.foreign.saturating_sub(since.foreign);
        let late = now.late.saturating_sub(since.late);
        match now.foreign_schema {
            Some(got) if foreign > 0 => Self::OtherSchema { n: foreign, got },
            _ if n_unwoken > 0 => Self::NotWoken { n: n_unwoken },
            _ if late > 0 => Self::NotLater { n: late },
            _ if n_writers == 0 => Self::NoWriter,
            _ => Self::NothingSent,
        }
    }
}

impl fmt::Display for TopicSilence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { topic, place, cause } = self;
        match cause {
            SilenceCause::NoWriter => write!(
                f,
                "nobody writes {topic} of {place}; a process that should must have the same run name and \
                 user"
            ),
            SilenceCause::NothingSent => write!(
                f,
                "the writer of {topic} is connected and sends nothing: does its device deliver, or is \
                 its process stopped?"
            ),
            SilenceCause::OtherSchema { n, got } => write!(
                f,
                "{topic}: {n} messages of schema {got}, and this program reads schema {SCHEMA}: take \
                 writer and reader of one version of groundloop"
            ),
            SilenceCause::NotLater { n } => write!(
                f,
                "{topic}: {n} messages whose send_ns and sequence are not later than those of messages \
                 before: stamp send_ns with CLOCK_MONOTONIC when sending, and let sequence grow"
            ),
            SilenceCause::NotWoken { n } => write!(
                f,
                "{topic}: {n} messages wait and nobody was woken for them: the writer must notify event 4 \
                 (EVENT_SENT) after each, on the event service of the topic's name"
            ),
        }
    }
}

impl Bus {
    /// Why a reader has heard nothing since it had counted `since`. What waits there is dropped.
    ///
    /// # Errors
    /// [`TransportError::Open`], [`TransportError::Receive`].
    pub fn silence<H: WireHeader, R: Record>(
        &self,
        topic: &Topic,
        reader: &mut Subscriber<H, R>,
        since: Drops,
    ) -> Result<TopicSilence, TransportError> {
        self.clean_up_dead_nodes();
        let n_unwoken = reader.drain_unwoken()?;
        let [n_writers, _] = self.uses::<H, R>(topic)?;
        let cause = SilenceCause::of(since, reader.drops(), n_unwoken, n_writers);
        Ok(TopicSilence { topic: topic.name, place: self.place(), cause })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_came_tells_more_than_who_is_there() {
        let since = Drops { missed: 3, late: 1, foreign: 2, foreign_schema: Some(2) };
        let of = |now, n_unwoken, n_writers| SilenceCause::of(since, now, n_unwoken, n_writers);
        assert_eq!(of(since, 0, 0), SilenceCause::NoWriter);
        assert_eq!(of(since, 0, 1), SilenceCause::NothingSent);
        let foreign = Drops { foreign: 9, foreign_schema: Some(4), ..since };
        assert_eq!(of(foreign, 2, 0), SilenceCause::OtherSchema { n: 7, got: 4 });
        assert_eq!(of(since, 2, 1), SilenceCause::NotWoken { n: 2 });
        assert_eq!(of(Drops { late: 6, ..since }, 0, 1), SilenceCause::NotLater { n: 5 });
    }
}
