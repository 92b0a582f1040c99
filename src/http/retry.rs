//! Which failures are worth another attempt, and when.
//!
//! 429, 503, failed connections and silence may pass: they are tried again after a growing pause
//! with jitter, or after what `Retry-After` asks for. Other 5xx may be permanent (a server without
//! a vision model answers a picture with 500), so they are tried twice more only. Any other status
//! says that the request is wrong: never again.

use super::RetryPolicy;

/// Most further attempts after a 5xx other than 503.
pub(super) const SERVER_FAULT_RETRIES_MAX: u32 = 2;

/// How one attempt failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Fault {
    /// No connection, or it broke.
    Broken { reason: String },
    /// The server was silent for too long.
    Silent,
    /// A status that is no success.
    Status { status: u16, message: String, retry_after_ms: Option<u64> },
    /// A reply that is no JSON.
    NotJson { reason: String, message: String },
    /// A reply that is too long.
    TooLong,
}

/// The pause before the next attempt, milliseconds; `None` when there is none to be made.
/// `attempts` have been made, `n_server_faults` of them ended with a 5xx other than 503.
pub(super) fn pause_ms(
    policy: &RetryPolicy,
    fault: &Fault,
    attempts: u32,
    n_server_faults: u32,
) -> Option<u64> {
    if attempts >= policy.attempts_max {
        return None;
    }
    let backoff_ms = backoff_ms(policy, attempts);
    match fault {
        Fault::Broken { .. } | Fault::Silent => Some(backoff_ms),
        Fault::Status { status: 429 | 503, retry_after_ms, .. } => {
            Some(retry_after_ms.unwrap_or(backoff_ms))
        }
        Fault::Status { status: 500.., .. } => {
            (n_server_faults <= SERVER_FAULT_RETRIES_MAX).then_some(backoff_ms)
        }
        Fault::Status { .. } | Fault::NotJson { .. } | Fault::TooLong => None,
    }
}

/// Doubles with each attempt; between half of that and all of it.
fn backoff_ms(policy: &RetryPolicy, attempts: u32) -> u64 {
    let doublings = attempts.saturating_sub(1).min(32);
    let full = policy.backoff_ms_min.saturating_mul(1 << doublings).min(policy.backoff_ms_max);
    let half = full / 2;
    half + mix(policy.jitter_seed ^ u64::from(attempts)) % (full - half + 1)
}

/// A well mixed number of another (splitmix64, public domain).
fn mix(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// `Retry-After` in milliseconds: seconds, or a date, which is compared with the reply's own `Date`
/// so that the two machines' clocks need not agree.
pub(super) fn retry_after_ms(retry_after: &str, date: Option<&str>) -> Option<u64> {
    let text = retry_after.trim();
    if let Ok(seconds) = text.parse::<u64>() {
        return Some(seconds.saturating_mul(1000));
    }
    let until = httpdate::parse_http_date(text).ok()?;
    let now = httpdate::parse_http_date(date?.trim()).ok()?;
    let wait = until.duration_since(now).unwrap_or_default();
    Some(u64::try_from(wait.as_millis()).unwrap_or(u64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(status: u16, retry_after_ms: Option<u64>) -> Fault {
        Fault::Status { status, message: String::new(), retry_after_ms }
    }

    #[test]
    fn what_may_pass_is_tried_again_and_nothing_else() {
        let policy = RetryPolicy::default();
        let again = |fault: &Fault| pause_ms(&policy, fault, 1, 1).is_some();
        for fault in [Fault::Silent, status(429, None), status(503, None), status(500, None)] {
            assert!(again(&fault), "{fault:?}");
            assert_eq!(pause_ms(&policy, &fault, policy.attempts_max, 1), None);
        }
        for code in [301, 400, 401, 403, 404, 422] {
            assert!(!again(&status(code, None)), "{code}");
        }
        assert!(!again(&Fault::TooLong));
        assert_eq!(pause_ms(&policy, &status(502, None), 3, 3), None, "a third 5xx is the last");
        assert!(pause_ms(&policy, &status(503, None), 3, 0).is_some());
        assert_eq!(pause_ms(&policy, &status(429, Some(7000)), 1, 0), Some(7000));
    }

    #[test]
    fn pauses_grow_to_their_bound_and_depend_on_the_seed() {
        let of_seed = |jitter_seed: u64| {
            let policy = RetryPolicy { jitter_seed, ..RetryPolicy::default() };
            (1..40).map(|attempts| backoff_ms(&policy, attempts)).collect::<Vec<_>>()
        };
        let pauses = of_seed(1);
        assert!((125..=250).contains(&pauses[0]) && (250..=500).contains(&pauses[1]));
        assert!(pauses[6..].iter().all(|pause| (4000..=8000).contains(pause)), "{pauses:?}");
        assert_eq!(pauses, of_seed(1));
        assert_ne!(pauses, of_seed(2));
    }

    #[test]
    fn retry_after_is_seconds_or_a_date() {
        let date = Some("Wed, 21 Oct 2015 07:28:00 GMT");
        assert_eq!(retry_after_ms(" 3 ", None), Some(3000));
        assert_eq!(retry_after_ms("Wed, 21 Oct 2015 07:28:05 GMT", date), Some(5000));
        assert_eq!(retry_after_ms("Wed, 21 Oct 2015 07:00:00 GMT", date), Some(0));
        assert_eq!(retry_after_ms("Wed, 21 Oct 2015 07:28:05 GMT", None), None);
        assert_eq!(retry_after_ms("soon", date), None);
    }
}
