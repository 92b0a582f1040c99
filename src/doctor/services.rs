//! The services that a run asks: language models and detectors behind HTTP.

use std::time::Duration;

use super::finding::Judgement;
use super::{Check, RunNeeds};
use crate::http::{reachable, shown_url};

pub(super) const CHECK: Check = Check {
    name: "services",
    look: |needs: Option<&RunNeeds>| {
        let Some(needs) = needs else { return Vec::new() };
        let judged = needs.services.iter().map(|(key, url)| {
            let answer = if needs.asks_services { Some(reachable(url, WAIT)) } else { None };
            judge(key, &shown_url(url), answer)
        });
        judged.collect()
    },
};

/// How long is waited for a connection.
const WAIT: Duration = Duration::from_secs(3);

/// `answer` is none where the run asks nobody.
fn judge(key: &str, url: &str, answer: Option<Result<(), String>>) -> Judgement {
    match answer {
        None => Judgement::ok(format!("{url} ({key}) is not asked: services.offline")),
        Some(Ok(())) => Judgement::ok(format!("{url} ({key}) takes connections")),
        Some(Err(reason)) => {
            let remedy = format!("start the server, or write its address into {key}");
            Judgement::fault(format!("{url} ({key}) does not answer: {reason}"), remedy)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Health;

    #[test]
    fn a_service_that_is_asked_must_answer() {
        let (key, url) = ("goal.options.url", "http://127.0.0.1:8080/v1");
        let said = judge(key, url, Some(Err("refused".to_owned())));
        assert_eq!(said.health, Health::Fault);
        assert_eq!(
            said.measured,
            "http://127.0.0.1:8080/v1 (goal.options.url) does not answer: refused"
        );
        assert_eq!(judge(key, url, Some(Ok(()))).health, Health::Ok);
        assert_eq!(judge(key, url, None).health, Health::Ok);
    }
}
