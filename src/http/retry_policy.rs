//! How long a request may take and how often it is tried.

use schemars::JsonSchema;
use serde::Deserialize;

/// Bounds of one request, all attempts together.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RetryPolicy {
    /// Longest time to open a connection, milliseconds.
    pub connect_ms: u64,
    /// Longest silence of the server within one attempt, milliseconds. A language model may think for
    /// long before its first byte.
    pub read_ms: u64,
    /// One deadline for everything: attempts, replies and pauses, milliseconds.
    pub total_ms: u64,
    /// Most attempts.
    pub attempts_max: u32,
    /// Pause before the second attempt, milliseconds; doubles with each one.
    pub backoff_ms_min: u64,
    /// Longest pause between attempts that the server did not ask for, milliseconds.
    pub backoff_ms_max: u64,
    /// Most bytes of a reply.
    pub reply_bytes_max: usize,
    /// Seed of the pauses' jitter. Clients of one server that should not knock at the same time get
    /// different ones.
    pub jitter_seed: u64,
}

#[cfg(test)]
impl Default for RetryPolicy {
    /// What `configs/defaults.toml` says.
    fn default() -> Self {
        let defaults: toml::Table = crate::settings::DEFAULTS.parse().unwrap();
        defaults["options"]["retry"].clone().try_into().unwrap()
    }
}
