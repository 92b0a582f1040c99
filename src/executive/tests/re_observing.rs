//! Anomalies and unknown facts: more frames, then other views, and never an action on a guess.

use super::*;
use crate::scene::{Anomaly, Place};

const PICK: &str = "pick_up red_block arm";
const POSES: [[f64; 3]; 2] = [[-0.3, 0.0, 0.5], [0.3, 0.0, 0.5]];

fn anomaly(object: &str) -> Anomaly {
    Anomaly::about(vec![object.into()], "nothing under")
}

fn doubting(object: &str) -> Episode {
    let mut episode = Episode::new();
    episode.config.limits.observing_s_max = 0.8;
    episode.scene.anomalies = vec![anomaly(object)];
    episode.plan(&[PICK]);
    episode
}

/// Every fact of the red block's support is unknown.
fn unsure() -> Episode {
    let mut episode = doubting("red_block");
    for fact in &mut episode.scene.facts {
        if fact.atom == atom("ontable red_block") {
            fact.confirmed = Truth::Unknown;
        }
    }
    episode
}

fn goal_of(decision: &Decision) -> Option<[f64; 3]> {
    let CommandKind::Start(motion) = &decision.command.kind else { return None };
    Some(motion.waypoints.last()?.position.coords.into())
}

#[test]
fn an_anomaly_about_the_next_step_is_looked_into() {
    let mut episode = doubting("red_block");
    let decision = episode.cycle();
    assert_eq!(decision.command.kind, CommandKind::Continue);
    assert_eq!(reasons(&decision), ["nothing under red_block"]);
    episode.scene.anomalies.clear();
    assert!(started(&episode.cycle()).is_some(), "the anomaly has gone");
}

#[test]
fn an_anomaly_about_other_objects_holds_nothing_up() {
    assert!(started(&doubting("green_block").cycle()).is_some());
}

#[test]
fn an_anomaly_that_stays_is_told_and_accepted() {
    let mut episode = doubting("red_block");
    for _ in 0..8 {
        assert_eq!(episode.cycle().command.kind, CommandKind::Continue);
    }
    let decision = episode.cycle();
    assert_eq!(reasons(&decision), ["accepted after repeated looks: nothing under red_block"]);
    assert!(started(&decision).is_some());
    episode.hear(&[StatusKind::Accepted, StatusKind::Failed("it slipped".to_owned())]);
    assert!(started(&episode.cycle()).is_some(), "looked into already");
}

#[test]
fn the_goal_counts_as_reached_once_anomalies_are_looked_into() {
    let mut episode = doubting("green_block");
    episode.plan(&[]);
    let (n, verdict) = episode.run_out(12);
    assert_eq!((n, verdict), (11, Verdict::Reached));
}

/// What cannot be of an object of the goal is not got used to.
#[test]
fn a_goal_that_is_doubted_is_not_reached() {
    let mut episode = doubting("red_block");
    episode.is_doubted = true;
    let (n, verdict) = episode.plan(&[]).run_out(20);
    let why = "the goal seems to hold, but there is nothing under red_block";
    assert_eq!((n, verdict.reason()), (9, format!("limits.observing_s_max: {why}")));
}

/// "All disks are on the right peg" is not known while one may be behind a hand.
#[test]
fn a_goal_over_all_objects_waits_for_what_may_hide_one() {
    let hand = |may_hide| Anomaly {
        place: Some(Place { edges: [10, 20, 90, 80], may_hide }),
        ..Anomaly::about(Vec::new(), "something unknown")
    };
    let why = "the goal speaks of all objects, and one may be hidden: \
               something unknown at 10 20 90 80";
    let gave_up = format!("limits.observing_s_max: {why}");
    for (of_all, may_hide, steps) in
        [(true, true, &[][..]), (true, true, &[PICK]), (true, false, &[]), (false, true, &[])]
    {
        let mut episode = doubting("green_block");
        (episode.scene.anomalies, episode.of_all) = (vec![hand(may_hide)], of_all);
        let (_, verdict) = episode.plan(steps).run_out(12);
        if of_all && may_hide {
            assert_eq!(verdict.reason(), gave_up, "{steps:?}");
        } else {
            assert_eq!(verdict, Verdict::Reached, "{of_all} {may_hide}");
        }
    }
}

#[test]
fn unknown_facts_are_looked_at_from_every_view_and_then_given_up() {
    let mut episode = unsure();
    episode.config.motion.as_mut().unwrap().view_poses = POSES.to_vec();
    let mut goals = Vec::new();
    for n in 1..=14 {
        let decision = episode.cycle();
        if let Some(goal) = goal_of(&decision) {
            assert_eq!((&decision.command.step, &decision.dispatch), (&None, &None));
            let view = format!("look from view {}: ", goals.len() + 1);
            assert!(reasons(&decision).iter().any(|reason| reason.starts_with(&view)));
            goals.push(goal);
            let waiting = episode.hear(&[StatusKind::Accepted]);
            assert_eq!(waiting.command.kind, CommandKind::Continue, "until it is there");
            assert!(episode.executive.is_moving(), "somebody must watch it");
            episode.hear(&[StatusKind::Done]);
            assert!(!episode.executive.is_moving());
        }
        if let Some(verdict) = decision.verdict {
            let why = "the precondition of (pick_up red_block arm) is not known to hold: \
                       nothing under red_block";
            assert_eq!(verdict.reason(), format!("limits.observing_s_max: {why}"));
            assert_eq!(goals, POSES, "cycle {n}");
            return;
        }
    }
    panic!("the episode goes on");
}

#[test]
fn a_view_that_is_not_reached_is_broken_off() {
    let mut episode = unsure();
    episode.config.motion.as_mut().unwrap().view_poses = POSES.to_vec();
    episode.config.limits.skill_timeout_s = 0.25;
    while goal_of(&episode.cycle()).is_none() {}
    let kinds: Vec<CommandKind> = (0..4).map(|_| episode.cycle().command.kind).collect();
    let expected =
        [CommandKind::Continue, CommandKind::Continue, CommandKind::Cancel, CommandKind::Continue];
    assert_eq!(kinds, expected);
    episode.hear(&[StatusKind::Cancelled]);
    assert!(matches!(episode.executive.phase, Phase::Idle));
}
