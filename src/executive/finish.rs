//! When the goal counts as reached: it is seen to hold, at rest, for a while.

use super::places::Places;
use super::{Answer, Cycle, Executive};
use crate::messages::{CommandKind, Verdict};
use crate::scene::{Origin, Scene};

/// Most facts that are named when nobody has seen them.
const NAMED_MAX: usize = 3;

/// The picture from which on the goal is seen to hold.
#[derive(Debug, Clone)]
pub(super) struct GoalSeen {
    since_ns: u64,
    /// Where everything in sight was then.
    places: Places,
}

impl Executive {
    /// The goal holds in what is believed: it is reached once every fact of it has been seen, nothing is
    /// strange any more, and everything has stayed where it is for `limits.goal_rest_s`.
    pub(super) fn finish(&mut self, cycle: &mut Cycle<'_>) -> Answer {
        if cycle.input.plan.is_doubted {
            self.goal_seen = None;
            let anomalies = &cycle.input.scene.anomalies;
            let what: Vec<String> = anomalies.iter().map(ToString::to_string).collect();
            let reason = format!("the goal seems to hold, but there is {}", what.join(", "));
            return self.re_observe(cycle, &reason);
        }
        if let Some(answer) = self.re_observe_anomalies(cycle, &[]) {
            self.goal_seen = None;
            return answer;
        }
        if cycle.input.plan.is_predicted {
            self.goal_seen = None;
            return self.re_observe(cycle, &unseen(cycle.input.scene));
        }
        let now = GoalSeen {
            since_ns: cycle.input.scene.cause.capture_ns,
            places: Places::in_sight(cycle.input.scene),
        };
        let seen = self.goal_seen.get_or_insert_with(|| now.clone());
        if let Some(name) = seen.places.moved(&now.places) {
            let reason = format!("the goal holds, but {name} is moving");
            self.goal_seen = Some(now);
            return self.look(cycle, reason);
        }
        let seconds = now.since_ns.saturating_sub(seen.since_ns) as f64 / 1e9;
        if seconds >= cycle.config.limits.goal_rest_s {
            return Answer::End(Verdict::Reached);
        }
        Answer::Command(CommandKind::Continue)
    }
}

/// Which facts were predicted and have not been seen.
fn unseen(scene: &Scene) -> String {
    let predicted = scene.facts.iter().filter(|fact| fact.origin == Origin::Predicted);
    let atoms: Vec<String> = predicted.map(|fact| fact.atom.to_string()).collect();
    let more = atoms.len().saturating_sub(NAMED_MAX);
    let named = atoms.iter().take(NAMED_MAX).cloned().collect::<Vec<_>>().join(", ");
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!(
        "the goal holds if the last steps did what they should, and nobody has seen it: {named}{more}"
    )
}
