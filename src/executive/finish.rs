//! When the goal counts as reached: it is seen to hold, at rest, for a while.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::{Answer, Cycle, Executive};
use crate::messages::{CommandKind, Verdict};
use crate::pddl::Name;
use crate::scene::{Origin, Scene, Visibility};

/// What moves by less than this is at rest: more than a measurement differs from the next, in metres.
const AT_REST_M: f64 = 0.01;
/// Most facts that are named when nobody has seen them.
const NAMED_MAX: usize = 3;

/// The picture from which on the goal is seen to hold.
#[derive(Debug, Clone)]
pub(super) struct GoalSeen {
    since_ns: u64,
    /// Where everything in sight was then.
    places: BTreeMap<Name, Point3<f64>>,
}

impl GoalSeen {
    fn at(scene: &Scene) -> Self {
        let visible = scene.objects.iter().filter(|o| o.visibility == Visibility::Visible);
        let places = visible.filter_map(|o| Some((o.name.clone(), o.volume?.centre)));
        Self { since_ns: scene.cause.capture_ns, places: places.collect() }
    }

    /// An object that is elsewhere than it was.
    fn moved(&self, now: &Self) -> Option<Name> {
        let moved = now.places.iter().find(|(name, place)| {
            self.places.get(*name).is_some_and(|before| (*place - before).norm() > AT_REST_M)
        });
        moved.map(|(name, _)| name.clone())
    }
}

impl Executive {
    /// The goal holds in what is believed: it is reached once every fact of it has been seen, nothing is
    /// strange any more, and everything has stayed where it is for `limits.goal_rest_s`.
    pub(super) fn finish(&mut self, cycle: &mut Cycle<'_>) -> Answer {
        if let Some(answer) = self.re_observe_anomalies(cycle, &[]) {
            self.goal_seen = None;
            return answer;
        }
        if cycle.input.plan.is_predicted {
            self.goal_seen = None;
            return self.re_observe(cycle, &unseen(cycle.input.scene));
        }
        let now = GoalSeen::at(cycle.input.scene);
        let seen = self.goal_seen.get_or_insert_with(|| now.clone());
        if let Some(name) = seen.moved(&now) {
            self.goal_seen = Some(now);
            return self.look(cycle, format!("the goal holds, but {name} is moving"));
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
