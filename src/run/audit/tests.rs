//! What an episode is judged by, in histories made by hand.

use std::path::Path;

use super::*;
use crate::run::DomainFolder;
use crate::run::diary::Diary;

const PICK: &str = "pick_up";

/// A moment of three blocks: what stands on what, which of them are in sight, and which lean.
fn moment(frame: u64, on: &[[&str; 2]], seen: &[&str], leaning: &[&str]) -> TrueMoment {
    let names = |names: &[&str]| names.iter().map(Name::new).collect::<BTreeSet<Name>>();
    TrueMoment {
        frame_sequence: frame,
        truth: GroundTruth {
            facts: on.iter().map(|pair| Atom::new("on", pair)).collect(),
            objects: names(&["red", "blue", "green"]),
            unsettled: names(leaning),
            ..GroundTruth::default()
        },
        seen: names(seen),
    }
}

const ALL: [&str; 3] = ["red", "blue", "green"];

/// Judges `(pick_up red arm)`, started in answer to frame 20, at ten frames a second and 0.2 s to confirm.
fn judged(moments: Vec<TrueMoment>) -> DispatchAudit {
    let folder =
        DomainFolder::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("domains/blocksworld"));
    let folder = folder.unwrap();
    let step = Step::new(PICK, &["red", "arm"]);
    let history = TrueHistory {
        dispatches: vec![TrueDispatch { frame_sequence: 20, step }],
        moments,
        now: GroundTruth::default(),
    };
    let blocks = ALL.map(|name| Typed::new(name, "block"));
    let objects: Vec<Typed> = blocks.into_iter().chain([Typed::new("arm", "robot")]).collect();
    let DomainFolder { domain, perception, rules, .. } = &folder;
    let words = Words { domain, perception, rules, objects: &objects };
    let diary = &Diary::default();
    Audit { words, history: &history, diary, confirm_s: 0.2, rate_hz: 10.0 }.dispatches()
}

#[test]
fn a_step_whose_precondition_holds_is_right() {
    let audit = judged(vec![moment(0, &[["blue", "red"]], &ALL, &[]), moment(9, &[], &ALL, &[])]);
    assert_eq!(audit, DispatchAudit { n_dispatches: 1, ..DispatchAudit::default() });
}

/// Green has been put onto red: three frames make that known.
#[test]
fn what_has_been_in_sight_for_long_enough_could_be_known() {
    for (since, is_against_evidence) in [(18, true), (19, false)] {
        let moments =
            vec![moment(0, &[], &ALL, &[]), moment(since, &[["green", "red"]], &ALL, &[])];
        let audit = judged(moments);
        let [untrue] = &audit.against_truth[..] else { panic!("{audit:?}") };
        assert_eq!(untrue.step, "(pick_up red arm)");
        assert_eq!(untrue.unmet, ["(clear red) does not hold"]);
        assert_eq!((untrue.frame, untrue.untrue_for_frames), (20, 21 - since));
        assert_eq!(untrue.is_against_evidence, is_against_evidence, "since {since}");
        assert_eq!(audit.n_against_evidence, u64::from(is_against_evidence));
    }
}

#[test]
fn what_is_hidden_could_not_be_known() {
    let on = [["green", "red"]];
    // The one on top, or the one below it; in sight for two frames of three.
    for seen in [&["red", "blue"][..], &["green", "blue"]] {
        let audit = judged(vec![moment(0, &[], &ALL, &[]), moment(5, &on, seen, &[])]);
        assert_eq!((audit.against_truth.len(), audit.n_against_evidence), (1, 0));
        assert_eq!(audit.against_truth[0].untrue_for_frames, 16);
    }
    let blink = [moment(18, &on, &["red"], &[]), moment(19, &on, &ALL, &[])];
    let before = [moment(0, &[], &ALL, &[]), moment(5, &on, &ALL, &[])];
    let audit = judged(before.into_iter().chain(blink).collect());
    assert_eq!((audit.against_truth.len(), audit.n_against_evidence), (1, 0));
}

/// A block that leans against another neither stands on it nor on the table.
#[test]
fn of_what_leans_nothing_is_sure() {
    let audit = judged(vec![moment(0, &[["green", "red"]], &ALL, &["green"])]);
    assert_eq!(audit, DispatchAudit { n_dispatches: 1, ..DispatchAudit::default() });
}
