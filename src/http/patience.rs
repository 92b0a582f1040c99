//! How long a request may take and how often it is tried.

use schemars::JsonSchema;
use serde::Deserialize;

/// Bounds of one request, all attempts together. Every key may be left out.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Patience {
    /// Longest time to open a connection, milliseconds; 5000 without the key.
    pub connect_ms: u64,
    /// Longest silence of the server within one attempt, milliseconds; 60000 without the key,
    /// since a language model may think for long before its first byte.
    pub read_ms: u64,
    /// One deadline for everything: attempts, replies and pauses, milliseconds; 120000 without
    /// the key.
    pub total_ms: u64,
    /// Most attempts; 4 without the key.
    pub attempts_max: u32,
    /// Pause before the second attempt, milliseconds; doubles with each one; 250 without the key.
    pub backoff_ms_min: u64,
    /// Longest pause between attempts that the server did not ask for, milliseconds; 8000 without
    /// the key.
    pub backoff_ms_max: u64,
    /// Most bytes of a reply; 8388608 without the key.
    pub reply_bytes_max: usize,
    /// Seed of the pauses' jitter; 0 without the key. Clients of one server that should not knock
    /// at the same time get different ones.
    pub jitter_seed: u64,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            connect_ms: 5_000,
            read_ms: 60_000,
            total_ms: 120_000,
            attempts_max: 4,
            backoff_ms_min: 250,
            backoff_ms_max: 8_000,
            reply_bytes_max: 8 << 20,
            jitter_seed: 0,
        }
    }
}
