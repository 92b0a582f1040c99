//! The open loop: one plan, whatever comes of it.

use super::*;
use crate::executive::ExecutiveMode;

const PICK: &str = "pick_up red_block arm";
const STACK: &str = "stack red_block blue_block arm";

fn blind() -> Episode {
    let mut episode = Episode::new();
    episode.config.mode = ExecutiveMode::OpenLoop;
    episode.plan(&[PICK, STACK]);
    episode
}

#[test]
fn the_first_plan_is_carried_out_whatever_is_seen() {
    let mut episode = blind();
    episode.scene.unsettled = 1;
    assert_eq!(started(&episode.cycle()), None, "nothing is confirmed");
    episode.scene.unsettled = 0;
    assert_eq!(started(&episode.cycle()), Some(step(PICK).to_string()));
    // Another block is in the gripper, and the planner would do otherwise.
    episode.plan(&["put_down green_block arm"]).see(&blocks(&[], Some("green_block")));
    assert_eq!(started(&episode.hear(&[StatusKind::Accepted])), None);
    let decision = episode.hear(&[StatusKind::Done]);
    assert_eq!(started(&decision), Some(step(STACK).to_string()));
    assert_eq!(episode.executive.remaining(), [step(STACK)]);
    let decision =
        episode.hear(&[StatusKind::Accepted, StatusKind::Failed("it slipped".to_owned())]);
    assert_eq!(decision.verdict, Some(Verdict::Executed));
    assert_eq!(episode.executive.counts.skills_failed, 2);
    assert_eq!(Verdict::Executed.exit_code(), 0);
}

#[test]
fn a_step_without_a_motion_is_left_out() {
    let mut episode = blind();
    episode.move_object("red_block", 0.5);
    let decision = episode.cycle();
    assert_eq!(started(&decision), None);
    assert_eq!(decision.outcomes[0].step, step(PICK));
    let decision = episode.cycle();
    assert_eq!(decision.outcomes[0].step, step(STACK), "nothing is held that could be stacked");
    assert_eq!(episode.cycle().verdict, Some(Verdict::Executed));
}

#[test]
fn a_step_that_takes_too_long_is_cancelled() {
    let mut episode = blind();
    episode.cycle();
    let limit_s = episode.config.limits.skill_timeout_s;
    let frames = (limit_s * 1e9) as u64 / FRAME_NS + 1;
    let cancelled = (0..=frames).any(|_| episode.cycle().command.kind == CommandKind::Cancel);
    assert!(cancelled);
    episode.see(&blocks(&[], Some("red_block")));
    assert_eq!(started(&episode.hear(&[StatusKind::Cancelled])), Some(step(STACK).to_string()));
}
