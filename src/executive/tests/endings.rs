//! How episodes end, and which bound ended them.

use super::*;

const PICK: &str = "pick_up red_block arm";
const DOWN: &str = "put_down red_block arm";

#[track_caller]
fn check(verdict: &Verdict, key: &str, detail: &str) {
    assert_eq!((verdict.word(), verdict.exit_code()), ("gave-up", 4));
    assert_eq!(verdict.reason(), format!("{key}: {detail}"));
}

fn slipped() -> [StatusKind; 2] {
    [StatusKind::Accepted, StatusKind::Failed("it slipped".to_owned())]
}

#[test]
fn the_goal_is_reached_only_in_a_settled_scene_of_an_idle_robot() {
    let mut episode = Episode::new();
    episode.start(PICK);
    assert_eq!(episode.plan(&[]).cycle().verdict, None, "a step is running");
    episode.see(&blocks(&[], Some("red_block"))).scene.unsettled = 1;
    assert_eq!(episode.hear(&[StatusKind::Done]).verdict, None, "its effects are looked for");
    let mut idle = Episode::new();
    idle.scene.unsettled = 1;
    assert_eq!(idle.plan(&[]).cycle().verdict, None, "not settled");
    for episode in [&mut episode, &mut idle] {
        episode.scene.unsettled = 0;
        assert_eq!(episode.cycle().verdict, None, "seen once");
        assert_eq!(episode.cycle().verdict, None, "seen twice");
        let decision = episode.cycle();
        assert_eq!(decision.verdict, Some(Verdict::Reached));
        assert_eq!(decision.command.kind, CommandKind::Hold);
        assert_eq!(decision.events.last(), Some(&Event::End(Verdict::Reached)));
    }
    assert_eq!(Verdict::Reached.exit_code(), 0);
}

/// A tower that topples is no goal reached, however its blocks touch while they fall.
#[test]
fn the_goal_is_reached_once_everything_is_at_rest() {
    let mut episode = Episode::new();
    for n in 0..5 {
        episode.move_object("red_block", 0.02);
        let decision = episode.cycle();
        assert_eq!(decision.verdict, None);
        let why = ["the goal holds, but red_block is moving"];
        assert_eq!(reasons(&decision), &why[..usize::from(n == 1)], "said once");
    }
    assert_eq!(episode.run_out(3), (2, Verdict::Reached));
    let mut episode = Episode::new();
    // The first frame shows where it is; four seconds of looks follow.
    for _ in 0..=40 {
        episode.move_object("red_block", 0.02);
        assert_eq!(episode.cycle().verdict, None);
    }
    episode.move_object("red_block", 0.02);
    let verdict = episode.cycle().verdict.unwrap();
    check(&verdict, "limits.observing_s_max", "the goal holds, but red_block is moving");
}

/// What a step should have done is not what it has done.
#[test]
fn a_goal_that_nobody_has_seen_is_not_reached() {
    let mut episode = Episode::new();
    let predicted = atom("on red_block blue_block");
    let fact = SceneFact { origin: Origin::Predicted, ..fact(predicted, Truth::True) };
    episode.scene.facts.push(fact);
    episode.is_predicted = true;
    let why = "the goal holds if the last steps did what they should, and nobody has seen it: \
               (on red_block blue_block)";
    assert_eq!(reasons(&episode.cycle()), [why]);
    let mut seen = episode.clone();
    seen.is_predicted = false;
    assert_eq!(seen.run_out(3), (3, Verdict::Reached));
    let (_, verdict) = episode.run_out(50);
    check(&verdict, "limits.observing_s_max", why);
}

#[test]
fn without_a_robot_a_confirmed_plan_is_the_result() {
    let mut episode = Episode::new();
    (episode.config.motion, episode.robot) = (None, None);
    episode.scene.unsettled = 1;
    assert_eq!(episode.plan(&[PICK]).cycle().verdict, None);
    episode.scene.unsettled = 0;
    assert_eq!(episode.cycle().verdict, Some(Verdict::Planned));
    assert_eq!(episode.executive.remaining(), [step(PICK)]);
}

#[test]
fn no_plan_is_final_only_where_everything_is_known() {
    let proof = "no action adds it".to_owned();
    let mut episode = Episode::new();
    episode.plan = PlanVerdict::Unsolvable { proof: proof.clone(), unknowns: false };
    episode.scene.unsettled = 1;
    assert_eq!(episode.cycle().verdict, None, "not settled");
    episode.scene.unsettled = 0;
    let verdict = episode.cycle().verdict.unwrap();
    assert_eq!(verdict, Verdict::Unsolvable { proof: proof.clone() });
    assert_eq!(verdict.exit_code(), 3);

    let mut unsure = Episode::new();
    unsure.plan = PlanVerdict::Unsolvable { proof, unknowns: true };
    let (n, verdict) = unsure.run_out(50);
    assert_eq!(n, 41, "four seconds");
    let detail = "no plan from the known facts alone (no action adds it)";
    check(&verdict, "limits.observing_s_max", detail);
}

#[test]
fn cycles_seconds_and_looks_are_bounded() {
    let mut episode = Episode::new();
    episode.start(PICK);
    episode.config.limits.cycles_max = 5;
    let (n, verdict) = episode.run_out(9);
    assert_eq!(n, 5, "one cycle has gone before");
    check(&verdict, "limits.cycles_max", "5 cycles");

    let mut episode = Episode::new();
    episode.start(PICK);
    episode.config.limits.seconds_max = 0.55;
    let (n, verdict) = episode.run_out(9);
    assert_eq!(n, 6, "ten frames a second");
    check(&verdict, "limits.seconds_max", "0.55 s");

    let mut episode = Episode::new();
    episode.config.limits.observing_s_max = 1.2;
    episode.scene.unsettled = 1;
    let (n, verdict) = episode.plan(&[PICK]).run_out(20);
    assert_eq!(n, 13);
    check(&verdict, "limits.observing_s_max", "scene not settled: 1 unconfirmed fact");
}

#[test]
fn looks_count_from_the_last_dispatch() {
    let mut episode = Episode::new();
    episode.config.limits.observing_s_max = 0.8;
    for _ in 0..3 {
        episode.scene.unsettled = 1;
        for _ in 0..8 {
            assert_eq!(episode.plan(&[PICK]).cycle().verdict, None);
        }
        episode.scene.unsettled = 0;
        episode.start(PICK);
        episode.plan = PlanVerdict::Missing { objects: Vec::new() }; // nothing new is started
        episode.hear(&[StatusKind::Cancelled]);
    }
}

#[test]
fn an_object_that_is_never_seen_is_named() {
    let mut episode = Episode::new();
    episode.config.limits.unseen_s_max = 0.8;
    episode.plan = PlanVerdict::Missing { objects: vec!["pink_block".into(), "cup".into()] };
    let first = episode.cycle();
    let text = "waiting for objects of the goal: pink_block, cup (3 objects confirmed)";
    assert_eq!(reasons(&first), [text]);
    let (n, verdict) = episode.run_out(9);
    assert_eq!(n, 8);
    check(&verdict, "limits.unseen_s_max", &format!("after 0.8 s still {text}"));
}

/// However few frames a second there are, eight are looked at.
#[test]
fn a_slow_camera_has_as_many_looks() {
    let mut episode = Episode::new();
    episode.config.limits.observing_s_max = 0.1;
    episode.scene.unsettled = 1;
    let (n, _) = episode.plan(&[PICK]).run_out(20);
    assert_eq!(n, 9, "the first frame comes after no time");
}

/// Before there is a plan, what is missing is told, and told again when something else is missing.
#[test]
fn what_the_first_plan_waits_for_is_told() {
    let mut episode = Episode::new();
    episode.plan = PlanVerdict::Missing { objects: Vec::new() };
    let objects = std::mem::take(&mut episode.scene.objects);
    let mut next = |objects: &[SceneObject], unsettled: u32| {
        episode.scene.objects = objects.to_vec();
        episode.scene.unsettled = unsettled;
        reasons(&episode.cycle()).concat()
    };
    assert_eq!(next(&[], 0), "waiting for a settled scene: no object confirmed");
    assert_eq!(next(&objects, 4), "waiting for a settled scene: 4 facts unconfirmed");
    assert_eq!(next(&objects, 3), "", "told once");
    assert_eq!(next(&objects, 0), "waiting for the goal: not resolved with 3 objects confirmed");
    assert_eq!(next(&objects, 1), "", "no step back is told");
}

/// Why a running step is cancelled is told in words, whatever the planner has answered.
#[test]
fn a_plan_that_is_gone_is_told_in_words() {
    let proof = || "dead end".to_owned();
    for (verdict, words) in [
        (PlanVerdict::Unsolvable { proof: proof(), unknowns: false }, "unsolvable: dead end"),
        (
            PlanVerdict::Unsolvable { proof: proof(), unknowns: true },
            "unsolvable while facts are unknown: dead end",
        ),
        (PlanVerdict::Unsupported { feature: "axioms".to_owned() }, "unsupported: axioms"),
        (PlanVerdict::Missing { objects: Vec::new() }, "no goal yet"),
        (
            PlanVerdict::Missing { objects: vec!["cup".into()] },
            "objects of the goal have not been seen: cup",
        ),
    ] {
        let mut episode = Episode::new();
        episode.start(PICK);
        episode.plan = verdict;
        let told = format!("no plan from the present state: {words}");
        assert_eq!(reasons(&episode.cycle()), [told.as_str()]);
    }
}

/// While a slow detector works beside the loop, its last scene is carried over many frames.
#[test]
fn a_scene_that_is_carried_forward_is_not_another_look() {
    let mut episode = Episode::new();
    episode.config.limits.observing_s_max = 0.8;
    episode.scene.unsettled = 1;
    episode.plan(&[PICK]);
    for _ in 0..8 {
        assert_eq!(episode.cycle().verdict, None);
        for _ in 0..9 {
            let decision = episode.carry(&[]);
            assert_eq!((decision.verdict, decision.events), (None, Vec::new()));
        }
    }
    check(
        &episode.cycle().verdict.unwrap(),
        "limits.observing_s_max",
        "scene not settled: 1 unconfirmed fact",
    );
}

#[test]
fn what_was_seen_before_a_step_ended_does_not_judge_it() {
    let mut episode = Episode::new();
    episode.start(PICK);
    let early = episode.carry(&[StatusKind::Done]);
    assert!(early.verdict.is_none() && reasons(&early).is_empty());
    assert_eq!(episode.executive.counts.skills_failed, 0);
    episode.see(&blocks(&[], Some("red_block")));
    episode.cycle();
    let counts = episode.executive.counts;
    assert_eq!((counts.skills_done, counts.skills_failed), (1, 0));
}

#[test]
fn failures_are_bounded_and_the_worst_step_is_named() {
    let mut episode = Episode::new();
    episode.config.limits.failures_max = 2;
    for text in [PICK, "pick_up blue_block arm", PICK] {
        assert_eq!(
            started(&episode.plan(&[text]).cycle()).as_deref(),
            Some(step(text).to_string().as_str())
        );
        episode.plan = PlanVerdict::Missing { objects: Vec::new() }; // nothing new is started
        let ended = episode.hear(&slipped()).verdict;
        assert_eq!(ended.is_some(), episode.executive.counts.skills_failed == 3);
        if let Some(verdict) = ended {
            let detail = "3 failed skills, (pick_up red_block arm) 2 times";
            check(&verdict, "limits.failures_max", detail);
        }
    }
    assert_eq!(episode.executive.counts.skills_failed, 3);
}

#[test]
fn going_in_circles_ends() {
    let mut episode = Episode::new();
    episode.config.limits.revisits_max = 2;
    let mut n_picks = 0;
    let verdict = loop {
        if let Some(verdict) =
            episode.see(&blocks(&[], None)).plan(&[PICK]).hear(&[StatusKind::Done]).verdict
        {
            break verdict;
        }
        n_picks += 1;
        assert!(n_picks < 9, "it goes on and on");
        episode.see(&blocks(&[], Some("red_block"))).plan(&[DOWN]).hear(&[StatusKind::Done]);
    };
    assert_eq!(n_picks, 3, "once, and two returns");
    check(&verdict, "limits.revisits_max", "livelock: the same state was left 3 times before");
}

#[test]
fn trying_again_in_the_same_state_is_no_circle() {
    let mut episode = Episode::new();
    episode.config.limits.revisits_max = 0;
    for _ in 0..5 {
        episode.start(PICK);
        episode.hear(&slipped());
    }
}

#[test]
fn a_step_that_takes_too_long_is_broken_off_and_a_dead_robot_ends_the_episode() {
    let mut episode = Episode::new();
    episode.start(PICK);
    let timeout_s = episode.config.limits.skill_timeout_s;
    let n_frames = (timeout_s * 10.0) as u32;
    for _ in 0..n_frames {
        assert_eq!(episode.cycle().command.kind, CommandKind::Continue);
    }
    let decision = episode.cycle();
    assert_eq!(decision.command.kind, CommandKind::Cancel);
    assert_eq!(reasons(&decision), [format!("longer than limits.skill_timeout_s = {timeout_s}")]);
    let (n, verdict) = episode.run_out(n_frames * 2);
    assert_eq!(n, n_frames + 1);
    check(&verdict, "limits.skill_timeout_s", "cancel not confirmed within 15 s");
}

/// Also where the motion may not be cancelled otherwise, in a scene that does not settle; and it
/// counts as a failure, or it would be tried for ever.
#[test]
fn a_step_that_takes_too_long_is_broken_off_anywhere_and_has_failed() {
    let mut episode = Episode::new();
    episode.start(PICK);
    episode.scene.unsettled = 1;
    episode.robot_mut().phase = 5;
    let n_frames = (episode.config.limits.skill_timeout_s * 10.0) as u32;
    for _ in 0..n_frames {
        assert_eq!(episode.cycle().command.kind, CommandKind::Continue);
    }
    assert_eq!(episode.cycle().command.kind, CommandKind::Cancel);
    episode.scene.unsettled = 0;
    let decision = episode.hear(&[StatusKind::Cancelled]);
    let outcomes: Vec<_> = decision.outcomes.iter().map(|o| (o.succeeded, o.failures)).collect();
    assert_eq!(outcomes, [(false, 1)]);
    assert_eq!(episode.executive.counts.skills_failed, 1);
}

#[test]
fn what_the_planner_does_not_understand_is_named() {
    let mut episode = Episode::new();
    episode.plan = PlanVerdict::Unsupported { feature: "durations".to_owned() };
    check(&episode.cycle().verdict.unwrap(), "planner", "unsupported: durations");
}

#[test]
fn a_stop_from_outside_holds_the_robot_and_says_so() {
    for (stop, code, reason) in [
        (Stop::Interrupt, 130, "interrupted (SIGINT); the robot was told to hold"),
        (Stop::Terminate, 143, "terminated (SIGTERM); the robot was told to hold"),
    ] {
        let mut episode = Episode::new();
        episode.start(PICK);
        let decision = episode.executive.stop(9, 77, stop);
        assert_eq!(decision.command.kind, CommandKind::Hold);
        assert_eq!((decision.command.id, decision.command.frame_sequence), (1, 9));
        assert_eq!(
            (decision.command.capture_ns, decision.command.step.unwrap().to_string()),
            (77, "(pick_up red_block arm)".to_owned())
        );
        let verdict = decision.verdict.unwrap();
        assert_eq!((verdict.word(), verdict.exit_code()), ("stopped", code));
        assert_eq!(verdict.reason(), reason);
    }
}

/// The status that ends a step is lost: the robot's states show that it has ended, and the scene what came of it.
#[test]
fn a_step_that_ends_without_a_word_is_judged_by_what_is_seen() {
    for (seen, outcome) in [(blocks(&[], Some("red_block")), true), (blocks(&[], None), false)] {
        let mut episode = Episode::new();
        episode.start(PICK);
        let command_id = episode.executive.last_command_id;
        episode.robot_mut().command_id = Some(command_id);
        episode.cycle();
        assert_eq!(episode.executive.running_step(), Some(&step(PICK)));
        let capture_ns = episode.scene.cause.capture_ns + FRAME_NS;
        *episode.robot_mut() = RobotState { command_id: None, capture_ns, ..*episode.robot_mut() };
        let decision = episode.see(&seen).cycle();
        assert_eq!(decision.outcomes.len(), 1, "{decision:?}");
        assert_eq!(decision.outcomes[0].succeeded, outcome);
        let says = |event: &Event| matches!(event, Event::Failed { reason, .. } if reason.starts_with("ended without a word"));
        assert_eq!(decision.events.iter().any(says), !outcome, "{decision:?}");
    }
    let mut untold = Episode::new();
    untold.start(PICK);
    untold.cycle();
    assert!(
        untold.executive.running_step().is_some(),
        "this robot does not tell what it carries out"
    );
}
