//! What leaves, what is kept, and what is cancelled.

use super::*;

const STACK_ON_BLUE: &str = "stack red_block blue_block arm";
const STACK_ON_GREEN: &str = "stack red_block green_block arm";
const PICK: &str = "pick_up red_block arm";

/// The red block is in the gripper and about to be put onto the blue one.
fn stacking() -> Episode {
    let mut episode = Episode::new();
    episode.start(PICK);
    episode.see(&blocks(&[], Some("red_block"))).plan(&[STACK_ON_BLUE]).hear(&[StatusKind::Done]);
    assert_eq!(episode.executive.running_step(), Some(&step(STACK_ON_BLUE)));
    episode
}

#[test]
fn the_first_step_of_a_confirmed_plan_leaves_with_its_motion() {
    let mut episode = Episode::new();
    let decision = episode.plan(&[PICK, STACK_ON_BLUE]).cycle();
    assert_eq!(started(&decision).as_deref(), Some("(pick_up red_block arm)"));
    assert_eq!((decision.command.id, decision.kind), (1, AnswerKind::Dispatch));
    assert_eq!(decision.command.frame_sequence, episode.scene.cause.frame_sequence);
    assert_eq!(episode.executive.running_step(), Some(&step(PICK)));
    let CommandKind::Start(motion) = decision.command.kind else { panic!("no motion") };
    assert_eq!(motion.waypoints[3].position.x, -0.15, "goes to where the red block is seen");
}

#[test]
fn a_step_whose_precondition_is_not_known_to_hold_never_leaves() {
    let cases = [
        (Truth::False, "does not hold: (clear red_block)"),
        (Truth::Unknown, "is not known to hold"),
    ];
    for (truth, expect) in cases {
        let mut episode = Episode::new();
        for fact in episode.scene.facts.iter_mut().filter(|f| f.atom == atom("clear red_block")) {
            // What this frame alone says does not count.
            (fact.raw, fact.confirmed) = (Truth::True, truth);
        }
        let decision = episode.plan(&[PICK]).cycle();
        assert_eq!(decision.command.kind, CommandKind::Continue);
        assert!(reasons(&decision)[0].contains(expect), "{:?}", reasons(&decision));
    }
}

#[test]
fn nothing_leaves_on_a_scene_that_is_too_old() {
    let mut episode = Episode::new();
    let limit = episode.config.limits.state_age_ms_max;
    episode.age_ms = limit + 1;
    let decision = episode.plan(&[PICK]).cycle();
    assert_eq!(decision.command.kind, CommandKind::Continue);
    let expect =
        format!("the newest scene is {} ms old (limits.state_age_ms_max = {limit})", limit + 1);
    assert_eq!(reasons(&decision), [expect]);
    episode.age_ms = limit;
    assert!(started(&episode.cycle()).is_some());

    let mut episode = Episode::new();
    episode.robot_age_ms = limit + 1;
    let said = reasons(&episode.plan(&[PICK]).cycle()).join("");
    assert!(said.starts_with("the newest robot state is 501 ms old"), "{said}");
    episode.robot_age_ms = limit;
    assert!(started(&episode.cycle()).is_some());
}

#[test]
fn nothing_leaves_on_a_scene_that_is_not_settled() {
    let mut episode = Episode::new();
    episode.scene.unsettled = 1;
    let decision = episode.plan(&[PICK]).cycle();
    assert_eq!(decision.command.kind, CommandKind::Continue);
    assert_eq!(reasons(&decision), ["scene not settled: 1 unconfirmed fact"]);
    episode.scene.unsettled = 0;
    assert!(started(&episode.cycle()).is_some());
}

#[test]
fn a_new_plan_that_begins_with_the_running_step_keeps_it_running() {
    let mut episode = stacking();
    let decision = episode.plan(&[STACK_ON_BLUE, "pick_up green_block arm"]).cycle();
    assert_eq!(decision.command.kind, CommandKind::Continue);
    assert_eq!(decision.command.id, 2);
    assert_eq!(episode.executive.running_step(), Some(&step(STACK_ON_BLUE)));
}

#[test]
fn another_first_step_breaks_the_running_one_off_as_long_as_it_can_go_back() {
    // Waypoints of `place`: up, across, down, the last bit; open; up again.
    for (phase, expect) in [
        (0, CommandKind::Cancel),
        (3, CommandKind::Cancel),
        (4, CommandKind::Continue),
        (5, CommandKind::Continue),
    ] {
        let mut episode = stacking();
        episode.robot_mut().phase = phase;
        let decision = episode.plan(&[STACK_ON_GREEN]).cycle();
        assert_eq!(decision.command.kind, expect, "in phase {phase}");
        if expect == CommandKind::Cancel {
            assert_eq!(
                reasons(&decision),
                ["the plan now starts with (stack red_block green_block arm)"]
            );
            let again = episode.cycle();
            assert_eq!(again.command.kind, CommandKind::Continue, "said once");
        }
    }
}

#[test]
fn the_new_step_starts_once_the_old_one_is_broken_off() {
    let mut episode = stacking();
    episode.plan(&[STACK_ON_GREEN]).cycle();
    let decision = episode.hear(&[StatusKind::Cancelled]);
    assert_eq!(started(&decision).as_deref(), Some("(stack red_block green_block arm)"));
    assert_eq!(decision.command.id, 3);
    assert_eq!(episode.executive.counts.skills_failed, 0, "breaking off is no failure");
}

#[test]
fn a_switch_waits_while_the_scene_is_not_settled() {
    let mut episode = stacking();
    episode.scene.unsettled = 2;
    assert_eq!(episode.plan(&[STACK_ON_GREEN]).cycle().command.kind, CommandKind::Continue);
    episode.scene.unsettled = 0;
    assert_eq!(episode.cycle().command.kind, CommandKind::Cancel);
}

/// One disk on the left peg, on its way to the middle one.
fn moving_disk() -> Episode {
    let mut episode = Episode::new();
    episode.config = config("hanoi");
    let pegs = [("left_peg", -0.2), ("middle_peg", 0.0), ("right_peg", 0.2)];
    episode.scene.objects = pegs.map(|(name, x)| object(name, "peg", x)).to_vec();
    episode.scene.objects.push(object("red_disk", "disk", -0.2));
    episode.see(&[atom("on-peg red_disk left_peg"), atom("clear red_disk")]);
    episode.start("move red_disk left_peg middle_peg");
    episode
}

#[test]
fn a_domain_that_cannot_say_holding_finishes_once_something_is_held() {
    // The first waypoints of `place`, whose motion alone could be cancelled.
    for (phase, holding, expect) in [
        (2, false, CommandKind::Cancel),
        (2, true, CommandKind::Continue),
        (7, true, CommandKind::Continue),
    ] {
        let mut episode = moving_disk();
        (episode.robot_mut().phase, episode.robot_mut().holding) = (phase, holding);
        let decision = episode.plan(&["move red_disk left_peg right_peg"]).cycle();
        assert_eq!(decision.command.kind, expect, "in phase {phase}");
    }
}

#[test]
fn a_target_that_has_moved_too_far_breaks_off() {
    let mut episode = stacking();
    let limit = episode.config.limits.target_moved_m_max;
    episode.move_object("blue_block", limit * 0.9);
    assert_eq!(episode.cycle().command.kind, CommandKind::Continue);
    episode.move_object("blue_block", limit * 0.2);
    let decision = episode.cycle();
    assert_eq!(decision.command.kind, CommandKind::Cancel);
    assert_eq!(
        reasons(&decision),
        ["blue_block has moved by 0.03 m (limits.target_moved_m_max = 0.03)"]
    );
}

#[test]
fn what_is_held_or_has_nothing_to_do_with_a_step_may_move() {
    let mut episode = stacking();
    episode.move_object("red_block", 0.3);
    episode.move_object("green_block", 0.3);
    assert_eq!(episode.cycle().command.kind, CommandKind::Continue);
}

#[test]
fn a_step_that_is_done_is_seen_to_be_done() {
    let mut episode = stacking();
    let decision = episode
        .see(&blocks(&[["red_block", "blue_block"]], None))
        .plan(&["pick_up green_block arm"])
        .hear(&[StatusKind::Done]);
    let done =
        |event: &Event| matches!(event, Event::Done { step: s, .. } if *s == step(STACK_ON_BLUE));
    assert!(decision.events.iter().any(done), "{:?}", decision.events);
    let outcome =
        StepOutcome { sequence: 1, step: step(STACK_ON_BLUE), succeeded: true, failures: 0 };
    assert_eq!(decision.outcomes, [outcome]);
    assert_eq!(started(&decision).as_deref(), Some("(pick_up green_block arm)"));
    assert_eq!((episode.executive.counts.skills_done, episode.executive.counts.replans), (2, 0));
}

#[test]
fn a_step_that_is_done_without_effect_has_failed() {
    let cases: [(&[[&str; 2]], _, _); 2] = [
        (&[], Some("red_block"), "done, but (clear red_block) is not observed"),
        (
            &[["red_block", "green_block"]],
            None,
            "done, but (on red_block blue_block) is not observed",
        ),
    ];
    for (on, held, expect) in cases {
        let mut episode = stacking();
        let decision = episode.see(&blocks(on, held)).hear(&[StatusKind::Done]);
        assert_eq!(reasons(&decision)[0], expect);
        assert!(!decision.outcomes[0].succeeded);
        assert_eq!(episode.executive.counts.skills_failed, 1);
    }
}

#[test]
fn effects_are_looked_for_until_the_scene_has_settled() {
    let mut episode = stacking();
    episode.scene.unsettled = 1;
    let waiting = episode.hear(&[StatusKind::Done]);
    assert_eq!((waiting.outcomes.len(), waiting.command.kind), (0, CommandKind::Continue));
    episode.scene.unsettled = 0;
    let decision = episode.see(&blocks(&[["red_block", "blue_block"]], None)).cycle();
    assert!(decision.outcomes[0].succeeded);
}

#[test]
fn failures_of_the_same_step_are_counted_and_told() {
    let mut episode = Episode::new();
    for n in 1..=3 {
        episode.start(PICK);
        let decision =
            episode.hear(&[StatusKind::Accepted, StatusKind::Failed("it slipped".to_owned())]);
        let outcome = &decision.outcomes[0];
        assert_eq!((outcome.sequence, outcome.failures), (u64::from(n) - 1, n));
        assert_eq!((&outcome.step, outcome.succeeded), (&step(PICK), false));
        assert_eq!(reasons(&decision), ["it slipped"]);
    }
    assert_eq!(episode.executive.counts.skills_failed, 3);
}

#[test]
fn a_plan_that_was_made_before_a_failure_is_not_followed() {
    let mut episode = Episode::new();
    episode.start(PICK);
    let decision =
        episode.hear(&[StatusKind::Accepted, StatusKind::Failed("it slipped".to_owned())]);
    assert_eq!(decision.command.kind, CommandKind::Continue, "the planner has not heard of it");
    assert_eq!(
        started(&episode.cycle()).as_deref(),
        Some("(pick_up red_block arm)"),
        "it wants it again"
    );
}

#[test]
fn a_step_that_perception_does_not_allow_fails_without_a_motion() {
    let mut episode = Episode::new();
    episode.scene.objects[0].volume = None;
    let decision = episode.plan(&[PICK]).cycle();
    assert_eq!(decision.command.kind, CommandKind::Continue);
    assert!(reasons(&decision)[0].starts_with("the place of red_block"), "{decision:?}");
    assert_eq!(decision.outcomes[0].failures, 1);
}

/// What a robot refuses is not asked of it again until things stand otherwise.
#[test]
fn a_step_that_the_robot_refuses_waits_until_things_stand_otherwise() {
    let mut episode = Episode::new();
    episode.start(PICK);
    if let Some(robot) = &mut episode.robot {
        robot.command_id = None; // it has not moved
    }
    let refused = episode.hear(&[StatusKind::Failed("unreachable".to_owned())]);
    assert_eq!(refused.outcomes[0].failures, 1, "the planner hears of it");
    let waits = format!("{} cannot be carried out: unreachable", step(PICK));
    let said = [episode.cycle(), episode.cycle()].map(|decision| reasons(&decision).join(""));
    assert_eq!(said.concat(), waits, "told once");
    let mut other = episode.clone();
    assert!(started(&other.plan(&["pick_up green_block arm"]).cycle()).is_some(), "another step");
    let mut moved = episode.clone();
    moved.move_object("red_block", 0.1);
    assert_eq!(started(&moved.cycle()), Some(step(PICK).to_string()));
    let (_, verdict) = episode.run_out(50);
    assert_eq!(verdict.reason(), format!("limits.observing_s_max: {waits}"));
}

/// Nothing is tried twice on the same evidence: there is one failure until things stand otherwise, and in the
/// end a reason with the object and the bound.
#[test]
fn a_step_that_cannot_be_carried_out_waits_until_things_stand_otherwise() {
    let mut episode = Episode::new();
    episode.move_object("red_block", 0.4);
    let why = "red_block at (-0.15, 0.40) m is outside the workspace: \
               robot.motion.reach_y_m = [-0.3, 0.25]";
    assert_eq!(reasons(&episode.plan(&[PICK]).cycle()), [why]);
    let waits = format!("{} cannot be carried out: {why}", step(PICK));
    assert_eq!(reasons(&episode.cycle()), [waits.as_str()]);
    for _ in 0..9 {
        assert_eq!(episode.cycle().outcomes, [], "no second failure");
    }
    let mut back = episode.clone();
    back.move_object("red_block", -0.3);
    assert_eq!(started(&back.cycle()), Some(step(PICK).to_string()));
    let mut elsewhere = episode.clone();
    elsewhere.move_object("red_block", 0.1);
    assert_eq!(elsewhere.cycle().outcomes[0].failures, 2, "other evidence");
    let (_, verdict) = episode.run_out(50);
    assert_eq!(verdict.reason(), format!("limits.observing_s_max: {waits}"));
}

#[test]
fn statuses_of_other_commands_end_nothing() {
    let mut episode = stacking();
    episode.executive.last_command_id = 7; // what the test says next is about command 7
    assert!(episode.hear(&[StatusKind::Done]).outcomes.is_empty());
    assert_eq!(episode.executive.running_step(), Some(&step(STACK_ON_BLUE)));
}

#[test]
fn a_change_from_outside_is_told_as_expected_and_seen() {
    let mut episode = Episode::new();
    episode.see(&blocks(&[["red_block", "blue_block"]], None));
    episode.start("pick_up green_block arm");
    let decision = episode.see(&blocks(&[], None)).plan(&["pick_up blue_block arm"]).cycle();
    let told: Vec<String> = decision
        .events
        .iter()
        .filter_map(|event| {
            let Event::Deviation(deviation) = event else { return None };
            Some(deviation.to_string())
        })
        .collect();
    assert_eq!(told, ["expected (on red_block blue_block), observed (ontable red_block)"]);
    let cause = ReplanCause::Deviation(Deviation {
        missing: vec![atom("on red_block blue_block")],
        seen: vec![atom("ontable red_block")],
        unknown: Vec::new(),
    });
    let old = Some(step("pick_up green_block arm"));
    assert!(decision.events.contains(&Event::Replan { causes: vec![cause], old }));
    assert_eq!((decision.kind, episode.executive.counts.replans), (AnswerKind::Replan, 1));
}

#[test]
fn a_plan_that_changes_without_a_cause_is_no_replan() {
    let mut episode = stacking();
    let decision = episode.plan(&[STACK_ON_BLUE, PICK]).cycle();
    assert!(decision.events.iter().any(|n| matches!(n, Event::Plan { .. })));
    assert_eq!((decision.kind, episode.executive.counts.replans), (AnswerKind::Continue, 0));
}

#[test]
fn a_failure_is_a_cause_of_the_next_plan_switch() {
    let mut episode = Episode::new();
    episode.start(PICK);
    episode.hear(&[StatusKind::Accepted, StatusKind::Failed("it slipped".to_owned())]);
    let decision = episode.plan(&["pick_up green_block arm"]).cycle();
    let cause = ReplanCause::Failure { step: step(PICK), reason: "it slipped".to_owned() };
    let old = Some(step(PICK));
    assert!(decision.events.contains(&Event::Replan { causes: vec![cause], old }), "{decision:?}");
    assert_eq!(episode.executive.counts.replans, 1);
}
