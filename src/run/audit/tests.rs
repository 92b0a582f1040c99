//! What an episode is judged by, in histories made by hand.

use std::path::Path;

use super::*;
use crate::logic::Truth;
use crate::messages::{PlanMessage, PlanVerdict};
use crate::run::DomainFolder;
use crate::run::diary::Diary;
use crate::scene::{FrameRef, Origin, Scene, SceneFact, SceneObject, Visibility};

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

fn blocksworld() -> DomainFolder {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    DomainFolder::read(&root.join("domains/blocksworld")).unwrap()
}

fn objects() -> Vec<Typed> {
    let blocks = ALL.map(|name| Typed::new(name, "block"));
    blocks.into_iter().chain([Typed::new("arm", "robot")]).collect()
}

/// Judges `(pick_up red arm)`, started in answer to frame 20, at ten frames a second and 0.2 s to confirm.
fn judged(moments: Vec<TrueMoment>) -> DispatchAudit {
    let folder = blocksworld();
    let step = Step::new(PICK, &["red", "arm"]);
    let history = TrueHistory {
        dispatches: vec![TrueDispatch { frame_sequence: 20, step }],
        moments,
        now: GroundTruth::default(),
    };
    let objects = objects();
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

/// A scene in which everything that really holds at a moment is believed.
fn believed(frame: u64, facts: &Facts) -> Scene {
    let fact = |atom: &Atom| SceneFact {
        atom: atom.clone(),
        raw: Truth::True,
        confirmed: Truth::True,
        origin: Origin::Observed,
        confidence: 1.0,
    };
    let object = |typed: &Typed| SceneObject {
        name: typed.name.clone(),
        type_name: typed.types[0].clone(),
        pixel_box: None,
        volume: None,
        score: 1.0,
        visibility: Visibility::Visible,
        seen_ns: 0,
    };
    Scene {
        cause: FrameRef { frame_sequence: frame, ..FrameRef::default() },
        objects: objects().iter().map(object).collect(),
        facts: facts.known.iter().map(fact).collect(),
        ..Scene::default()
    }
}

/// Green is taken off red in frame 10, which is believed in frame 13; in frame 30 the plan is shorter than ever.
#[test]
fn a_fault_is_followed_until_it_is_noticed_and_made_good() {
    let folder = blocksworld();
    let objects = objects();
    let DomainFolder { domain, perception, rules, .. } = &folder;
    let words = Words { domain, perception, rules, objects: &objects };
    let [before, after] = [moment(0, &[["green", "red"]], &ALL, &[]), moment(10, &[], &ALL, &[])];
    let [old, new] = [&before, &after].map(|moment| words.facts(&moment.truth));
    let mut diary = Diary::default();
    for (frame, facts, n_steps) in [(0, &old, 3), (13, &new, 4), (20, &new, 3), (30, &new, 2)] {
        let steps = vec![Step::new(PICK, &["red", "arm"]); n_steps];
        let verdict = PlanVerdict::Plan { cost: n_steps as u64, steps };
        let scene = believed(frame, facts);
        diary.write(&scene, &PlanMessage::new(scene.cause, verdict));
    }
    let history = TrueHistory { moments: vec![before, after], ..TrueHistory::default() };
    let audit = Audit { words, history: &history, diary: &diary, confirm_s: 0.2, rate_hz: 10.0 };
    let record = |frame| FaultRecord { frame, happened: true, ..FaultRecord::default() };
    // The second one changes nothing, the third one did not happen.
    let idle = FaultRecord { happened: false, ..record(10) };
    let mut records = [record(10), record(16), idle];
    audit.follow(&mut records);
    let told = records.map(|r| (r.noticed_after_frames, r.recovered_after_frames));
    assert_eq!(told, [(Some(3), Some(20)), (None, Some(4)), (None, None)]);
}
