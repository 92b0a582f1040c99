//! What happens while there is no plan in time, and on facts that cannot be.

use super::*;

const PICK: &str = "pick_up red_block arm";

fn planner_timeouts() -> PlanVerdict {
    PlanVerdict::OutOfBudget { limit: "deadline_ms = 20".to_owned() }
}

#[test]
fn a_running_step_goes_on_without_a_plan_in_time() {
    let mut episode = Episode::new();
    episode.start(PICK);
    episode.plan = planner_timeouts();
    for _ in 0..episode.config.limits.planner_timeouts_max {
        let decision = episode.cycle();
        assert_eq!((decision.command.kind, decision.verdict), (CommandKind::Continue, None));
        assert_eq!(episode.executive.running_step(), Some(&step(PICK)));
    }
    // A plan that comes in time ends the row.
    assert_eq!(episode.plan(&[PICK]).cycle().verdict, None);
    episode.plan = planner_timeouts();
    let decision = episode.cycle();
    assert_eq!((decision.command.kind, decision.verdict), (CommandKind::Continue, None));
    episode.move_object("red_block", 0.1);
    assert_eq!(episode.cycle().command.kind, CommandKind::Cancel, "its target is gone");
}

#[test]
fn without_a_running_step_the_robot_holds_and_after_a_while_gives_up() {
    let mut episode = Episode::new();
    episode.config.limits.planner_timeouts_max = 3;
    episode.plan = planner_timeouts();
    let first = episode.cycle();
    assert_eq!((&first.command.kind, &first.verdict), (&CommandKind::Hold, &None));
    assert_eq!(reasons(&first), ["no plan in time (deadline_ms = 20)"]);
    for _ in 0..2 {
        let decision = episode.cycle();
        assert_eq!(decision.events, []);
        assert_eq!((decision.command.kind, decision.verdict), (CommandKind::Hold, None));
    }
    let last = episode.cycle();
    let verdict = last.verdict.unwrap();
    let reason = "limits.planner_timeouts_max: no plan within deadline_ms = 20, 3 times in a row";
    assert_eq!((verdict.reason().as_str(), verdict.exit_code()), (reason, 4));
    assert_eq!(last.command.kind, CommandKind::Hold);
}

#[test]
fn a_late_plan_is_followed_by_the_next_one() {
    let mut episode = Episode::new();
    episode.plan = planner_timeouts();
    assert_eq!(episode.cycle().command.kind, CommandKind::Hold);
    episode.start(PICK);
}

#[test]
fn facts_that_exclude_each_other_are_looked_at_again_and_named_in_the_end() {
    let mut episode = Episode::new();
    episode.config.limits.observing_s_max = 0.8;
    let atoms = vec![atom("holding red_block"), atom("ontable red_block")];
    episode.plan = PlanVerdict::Inconsistent { atoms };
    let decision = episode.cycle();
    assert_eq!((decision.command.kind, decision.verdict), (CommandKind::Continue, None));
    let (n, verdict) = episode.run_out(9);
    assert_eq!(n, 8);
    let reason = "limits.observing_s_max: mutually exclusive facts: (holding red_block), (ontable red_block)";
    assert_eq!(verdict.reason(), reason);
    // Right again: the loop goes on.
    let mut repaired = Episode::new();
    repaired.plan = PlanVerdict::Inconsistent { atoms: Vec::new() };
    assert_eq!(repaired.cycle().verdict, None);
    repaired.start(PICK);
    repaired.plan = PlanVerdict::Inconsistent { atoms: Vec::new() };
    assert_eq!(repaired.cycle().command.kind, CommandKind::Continue, "the step goes on");
}
