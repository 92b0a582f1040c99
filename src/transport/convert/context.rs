//! What both ends of a topic must agree on.

use super::WireError;
use crate::pddl::{Domain, Name};
use crate::scene::FrameRef;
use crate::transport::wire::{SCHEMA, StreamHeader, TaskHeader};

/// What both ends must agree on: the run, the domain, and the order of its types and predicates.
#[derive(Debug, Clone)]
pub struct WireContext {
    /// Identity of the run.
    pub run_id: u64,
    /// Hash of the domain's files.
    pub domain_hash: u64,
    /// Whose predicates, actions and types are sent by number.
    pub domain: Domain,
    pub(super) types: Vec<Name>,
}

impl WireContext {
    /// The context of a domain.
    pub fn new(run_id: u64, domain_hash: u64, domain: Domain) -> Self {
        let mut types: Vec<Name> = domain.types.parents.keys().cloned().collect();
        types.push("object".into());
        types.sort_unstable();
        types.dedup();
        Self { run_id, domain_hash, domain, types }
    }

    pub(super) fn header(&self, cause: &FrameRef) -> TaskHeader {
        TaskHeader {
            schema: SCHEMA,
            run_id: self.run_id,
            domain_hash: self.domain_hash,
            cycle: cause.cycle,
            frame_sequence: cause.frame_sequence,
            capture_ns: cause.capture_ns,
            frame_send_ns: cause.frame_send_ns,
            ..TaskHeader::default()
        }
    }

    pub(super) fn check(&self, header: &TaskHeader) -> Result<FrameRef, WireError> {
        self.is_ours(header.run_id, header.domain_hash)?;
        Ok(FrameRef {
            cycle: header.cycle,
            frame_sequence: header.frame_sequence,
            capture_ns: header.capture_ns,
            frame_send_ns: header.frame_send_ns,
        })
    }

    pub(super) fn stream_header(&self, sequence: u64, cause: &FrameRef) -> StreamHeader {
        StreamHeader {
            schema: SCHEMA,
            run_id: self.run_id,
            domain_hash: self.domain_hash,
            sequence,
            cycle: cause.cycle,
            frame_sequence: cause.frame_sequence,
            capture_ns: cause.capture_ns,
            frame_send_ns: cause.frame_send_ns,
            ..StreamHeader::default()
        }
    }

    pub(super) fn check_stream(&self, header: &StreamHeader) -> Result<FrameRef, WireError> {
        self.is_ours(header.run_id, header.domain_hash)?;
        Ok(FrameRef {
            cycle: header.cycle,
            frame_sequence: header.frame_sequence,
            capture_ns: header.capture_ns,
            frame_send_ns: header.frame_send_ns,
        })
    }

    fn is_ours(&self, run_id: u64, domain_hash: u64) -> Result<(), WireError> {
        if domain_hash != self.domain_hash {
            let hex = |hash| format!("{hash:016x}");
            return Err(WireError::new("domain_hash", hex(self.domain_hash), hex(domain_hash)));
        }
        if run_id != self.run_id {
            return Err(WireError::new("run_id", self.run_id, run_id));
        }
        Ok(())
    }
}
