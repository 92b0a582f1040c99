//! Where messages lie: that it is there, is memory, and may be written.

use super::finding::{Judgement, in_words};
use super::{Check, RunNeeds};
use crate::transport::SharedMemory;

pub(super) const CHECK: Check = Check {
    name: "shared memory",
    look: |_: Option<&RunNeeds>| vec![judge(&SharedMemory::look())],
};

fn judge(memory: &SharedMemory) -> Judgement {
    let SharedMemory { path, is_memory, is_writable, total_bytes, free_bytes } = memory;
    let (Some(total), Some(free)) = (total_bytes, free_bytes) else {
        let remedy = format!("mount a memory file system there: mount -t tmpfs tmpfs {path}");
        return Judgement::fault(format!("{path} is not there"), remedy);
    };
    let size = format!("{path}: {} of {} free", in_words(*free), in_words(*total));
    if !is_writable {
        let remedy = format!("let this user write there: chmod 1777 {path}, as root");
        return Judgement::fault(format!("{size}; this user may not write there"), remedy);
    }
    if !is_memory {
        let remedy = format!("mount a memory file system there: mount -t tmpfs tmpfs {path}");
        return Judgement::warning(format!("{size}, on a disk: messages are slow"), remedy);
    }
    Judgement::ok(format!("{size}, a memory file system"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Health;

    #[test]
    fn shared_memory_is_there_is_memory_and_may_be_written() {
        let good = SharedMemory {
            path: "/dev/shm",
            is_memory: true,
            is_writable: true,
            total_bytes: Some(64 << 20),
            free_bytes: Some(20 << 20),
        };
        let said = judge(&good);
        assert_eq!(said, Judgement::ok("/dev/shm: 20 MB of 64 MB free, a memory file system"));
        let health = |memory: SharedMemory| judge(&memory).health;
        assert_eq!(health(SharedMemory { is_memory: false, ..good.clone() }), Health::Warning);
        assert_eq!(health(SharedMemory { is_writable: false, ..good.clone() }), Health::Fault);
        assert_eq!(health(SharedMemory { total_bytes: None, ..good }), Health::Fault);
    }
}
