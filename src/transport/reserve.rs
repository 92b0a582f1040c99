//! Pages of shared memory, taken before anything is written to them.
//!
//! A memory file system gives a page when it is first written, and a process that writes where none is left is
//! killed without a word (SIGBUS). So a writer asks for the pages of a message before it writes it, and for those
//! of the message after it: iceoryx2 hands out fresh slots one behind the other, and writes a slot's head itself.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rustix::io::Errno;
use rustix::mm::{Advice, madvise};

use super::place::free_bytes;

/// Pages that a topic has from the start, in bytes: all slots of topics with small messages, so that a robot
/// is told to hold when nothing is left.
const START_BYTES: usize = 128 << 10;
/// What iceoryx2 keeps in front of a message, in bytes, and more.
const HEAD_BYTES_MAX: usize = 512;
/// What iceoryx2 writes to manage the slots of a new segment, in bytes, and more.
const SEGMENT_BYTES: usize = 64 << 10;
/// Pages begin at multiples of this, or of a multiple of it.
const PAGE_BYTES: usize = 4096;

/// Room that a message lacks, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LackingRoom {
    pub(super) needed_bytes: u64,
    pub(super) free_bytes: u64,
}

/// The pages that one writer has taken.
#[derive(Debug, Default)]
pub(super) struct Reserve(Mutex<Taken>);

#[derive(Debug, Default)]
struct Taken {
    /// Longest message so far, in bytes.
    message_bytes: usize,
    /// The segment that messages are written to.
    segment: Range<usize>,
    /// Its pages are taken up to here.
    to: usize,
    /// They shall be up to here.
    due: usize,
}

impl Taken {
    /// Notes where a message is to be written; what lies in front of the next fresh slot's end is due.
    fn note(&mut self, payload: &Range<usize>, find: impl Fn(usize) -> Option<Range<usize>>) {
        if !self.segment.contains(&payload.start) {
            self.segment = find(payload.start).unwrap_or_else(|| payload.clone());
            self.to = self.segment.start;
            self.due = self.to;
        }
        let ahead = (2 * self.slot_bytes()).max(START_BYTES);
        let due = payload.start.saturating_add(ahead).min(self.segment.end);
        self.due = self.due.max(due);
    }

    /// A slot is no larger than this: iceoryx2 grows to the next power of two.
    fn slot_bytes(&self) -> usize {
        (HEAD_BYTES_MAX + self.message_bytes).next_power_of_two()
    }

    fn missing(&self) -> Range<usize> {
        let page = self.to - self.to % PAGE_BYTES;
        page..self.due.max(page)
    }

    fn take(&mut self) -> Result<(), LackingRoom> {
        let missing = self.missing();
        if self.to >= self.due {
            return Ok(());
        }
        has_room(&missing)?;
        self.to = self.due;
        Ok(())
    }
}

impl Reserve {
    /// Before a slot is asked for, for a message of so many bytes.
    ///
    /// # Errors
    /// [`LackingRoom`] when the next slot may not be there.
    pub(super) fn before(&self, message_bytes: usize) -> Result<(), LackingRoom> {
        let mut taken = self.lock();
        if message_bytes > taken.message_bytes {
            taken.message_bytes = message_bytes;
            // A new segment is likely: its pages are asked for once it is there.
            let needed_bytes = (SEGMENT_BYTES + taken.slot_bytes()) as u64;
            let free_bytes = free_bytes().unwrap_or(u64::MAX);
            if needed_bytes > free_bytes {
                taken.message_bytes = 0;
                return Err(LackingRoom { needed_bytes, free_bytes });
            }
        }
        taken.take()
    }

    /// Once the slot is there, and before it is written.
    ///
    /// # Errors
    /// [`LackingRoom`] when it may not be written.
    pub(super) fn take(&self, payload: &Range<usize>) -> Result<(), LackingRoom> {
        let mut taken = self.lock();
        taken.note(payload, |address| {
            mapping_of(&std::fs::read_to_string("/proc/self/maps").unwrap_or_default(), address)
        });
        taken.take()
    }

    fn lock(&self) -> MutexGuard<'_, Taken> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Asks for pages that are mapped here.
#[expect(unsafe_code, reason = "the system takes an address")]
fn has_room(pages: &Range<usize>) -> Result<(), LackingRoom> {
    let needed_bytes = pages.len() as u64;
    let lacking = |free_bytes| LackingRoom { needed_bytes, free_bytes };
    let start = std::ptr::with_exposed_provenance_mut(pages.start);
    // SAFETY: the range lies within one mapping of this process, which its caller has found there; the advice
    // changes no byte of it.
    match unsafe { madvise(start, pages.len(), Advice::LinuxPopulateWrite) } {
        Ok(()) => Ok(()),
        // A system that does not know the advice (Linux before 5.14): what is free may be gone when it is written,
        // which is rare.
        Err(Errno::INVAL) => {
            let free_bytes = free_bytes().unwrap_or(u64::MAX);
            if free_bytes < needed_bytes { Err(lacking(free_bytes)) } else { Ok(()) }
        }
        Err(_) => Err(lacking(free_bytes().unwrap_or(0))),
    }
}

/// Where the mapping begins and ends that an address lies in, by a text as of `/proc/self/maps`.
fn mapping_of(maps: &str, address: usize) -> Option<Range<usize>> {
    let ranges = maps.lines().filter_map(|line| {
        let (start, end) = line.split_once(' ')?.0.split_once('-')?;
        Some(usize::from_str_radix(start, 16).ok()?..usize::from_str_radix(end, 16).ok()?)
    });
    ranges.into_iter().find(|range| range.contains(&address))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAPS: &str = "\
7f0000000000-7f0000400000 rw-s 00000000 00:1b 12 /dev/shm/groundloop_0_a.data
7f0000400000-7f0000500000 rw-s 00000000 00:1b 13 /dev/shm/groundloop_0_b.data
";

    #[test]
    fn a_mapping_is_found_by_an_address_in_it() {
        let found = mapping_of(MAPS, 0x7f00_0040_0000);
        assert_eq!(found, Some(0x7f00_0040_0000..0x7f00_0050_0000));
        assert_eq!(mapping_of(MAPS, 0x7f00_0050_0000), None);
        assert_eq!(mapping_of("rubbish\n-\nx-y z", 1), None);
    }

    /// Whoever writes a message has the pages of it and of the next one, and asks for none twice.
    #[test]
    fn pages_are_due_up_to_the_end_of_the_next_slot() {
        let find = |address: usize| mapping_of(MAPS, address);
        let start = 0x7f00_0000_0000_usize;
        let mut taken = Taken { message_bytes: 300_000, ..Taken::default() };
        taken.note(&(start + 5000..start + 305_000), find);
        assert_eq!(taken.missing(), start..start + 5000 + 2 * 524_288);
        taken.to = taken.due;
        taken.note(&(start + 5000..start + 305_000), find);
        assert!(taken.to >= taken.due, "the same slot again");
        taken.note(&(start + 3_900_000..start + 4_100_000), find);
        assert_eq!(taken.due, start + 0x40_0000, "no further than the segment");
        taken.note(&(start + 0x40_2000..start + 0x40_2000), find);
        assert_eq!(taken.missing().start, start + 0x40_0000, "another segment");
    }
}
