//! The part of a camera's image in which objects can be, as people say it.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::sync::Arc;

use crate::common::{Process, project, schema};
use groundloop::parts::PartChoice;
use groundloop::perception::{GroundedImage, ImageRegion, OutsideReason};
use groundloop::run::{DomainFolder, ExemplarConfig, PreparedRun, StillImageParts, load_run};

/// Reads a labelled picture of 320 x 240 pixels.
fn read(domain: &str, name: &str, region: Option<[f64; 4]>) -> GroundedImage {
    let folder = Arc::new(DomainFolder::read(&project("domains").join(domain)).unwrap());
    let examples = ExemplarConfig::in_folder("sim_320x240").read(&folder, None).unwrap();
    let region = region.map(|edges| ImageRegion::new(edges).unwrap());
    let parts = StillImageParts {
        folder,
        examples: Arc::new(examples),
        detector: PartChoice::new("perception.detector", "colour"),
        grounder: PartChoice::new("perception.grounder", "s2s-joint"),
        region,
    };
    let file = format!("domains/{domain}/exemplar/sim_320x240/{name}.png");
    parts.reader().unwrap().read(&project(&file), &[]).unwrap()
}

fn names(seen: &GroundedImage) -> Vec<String> {
    seen.named.boxes.iter().map(|object| object.name.to_string()).collect()
}

fn labels_left_out(seen: &GroundedImage) -> Vec<String> {
    let outside = seen.named.detections.outside.iter();
    let by_hand = outside.filter(|thing| thing.reason == OutsideReason::Region);
    by_hand.map(|thing| thing.detection.label.to_string()).collect()
}

#[test]
fn what_has_its_middle_outside_the_region_is_no_object() {
    let whole = read("blocksworld", "b_high_tower", None);
    let all = read("blocksworld", "b_high_tower", Some([0.0, 0.0, 1.0, 1.0]));
    assert_eq!(names(&whole), names(&all));
    assert_eq!(whole.state.facts, all.state.facts);
    // The cyan block is alone at the left, at columns 71 to 94: its middle is at 82.5.
    for (x1, is_object) in [(82.0 / 320.0, true), (83.0 / 320.0, false)] {
        let seen = read("blocksworld", "b_high_tower", Some([x1, 0.0, 1.0, 1.0]));
        assert_eq!(names(&seen).contains(&"cyan_block".to_owned()), is_object);
        assert_eq!(labels_left_out(&seen), if is_object { vec![] } else { vec!["cyan"] });
        assert_eq!(names(&seen).len(), 7 + usize::from(is_object));
        let says = seen.state.facts.known.iter().any(|atom| atom.to_string().contains("cyan"));
        assert_eq!(says, is_object);
        let mut all = seen.named.detections;
        all.take_back_outside();
        assert_eq!(all.objects.len(), 7 + usize::from(is_object), "it stays out in the loop");
    }
}

#[test]
fn a_fixture_outside_the_region_is_missing() {
    let told = |region| -> Vec<String> {
        let seen = read("hanoi", "a_tower_left", region);
        seen.state.grounding.anomalies.iter().map(ToString::to_string).collect()
    };
    assert_eq!(told(None), Vec::<String>::new());
    let right = told(Some([0.6, 0.0, 1.0, 1.0]));
    assert!(right.iter().any(|text| text == "1 of 3 objects of type peg are seen"), "{right:?}");
}

fn ground(more: &[&str]) -> crate::common::Ended {
    let stem = "domains/blocksworld/exemplar/sim_320x240/b_high_tower";
    let [image, boxes, state] = ["png", "json", "pddl"].map(|ending| format!("{stem}.{ending}"));
    let args = ["ground", "--domain", "blocksworld", "--image", &image, "--exemplar-image", &image];
    let rest = ["--exemplar-boxes", &boxes, "--exemplar-state", &state];
    Process::start(&[&args[..], &rest, more].concat()).end()
}

#[test]
fn ground_takes_a_region_and_says_why() {
    let answer = ground(&["--region", "0.3,0,1,1", "--json"]).json();
    schema::obeys("ground", &answer);
    assert_eq!(answer["outside"][0]["label"], "cyan");
    assert_eq!(answer["outside"][0]["reason"], "outside the region");
    let said = ground(&["--region", "0.3,0,1,1"]).stdout;
    let line = said.lines().find(|line| line.starts_with("outside cyan")).unwrap();
    assert!(line.ends_with(": outside the region"), "{line}");
    for (region, got) in [("0.3,0,1", "[0.3, 0, 1]"), ("0.3,0,-1,1", "[0.3, 0, -1, 1]")] {
        let ended = ground(&["--region", region]);
        assert_eq!(ended.status.code(), Some(2));
        let expected = format!(
            "--region: expected [x1, y1, x2, y2], shares of width and height from 0 to 1 with x1 < x2 \
             and y1 < y2, got {got}"
        );
        assert!(ended.stderr.contains(&expected), "{}", ended.stderr);
    }
}

#[test]
fn a_region_that_is_none_is_named_with_its_key() {
    for (config, key) in
        [("blocksworld", "camera.region"), ("blocksworld_two_views", "cameras.back.region")]
    {
        let path = project("configs").join(format!("{config}.toml"));
        let said = load_run(&path, &[format!("{key}=[0.5, 0, 0.5, 1]")]).unwrap_err().to_string();
        assert!(said.contains(&format!("{key}: expected [x1, y1, x2, y2], shares")), "{said}");
        assert!(said.contains("got [0.5, 0, 0.5, 1]"), "{said}");
    }
}

/// A camera that may look for objects in an empty corner finds none: the goal's are not there.
#[test]
fn the_loop_keeps_to_the_region_of_its_camera() {
    let end = |region: &str| {
        let set = format!("camera.region={region}");
        crate::common::episode(crate::common::small("blocksworld.toml", &[&set])).report
    };
    let whole = end("[0, 0, 1, 1]");
    assert_eq!(whole.verdict, "reached", "{}", whole.reason);
    let corner = end("[0, 0, 0.1, 0.1]");
    assert_eq!(corner.verdict, "gave-up", "{}", corner.reason);
    assert!(corner.reason.contains("no object confirmed"), "{}", corner.reason);
}

/// Labels that the region leaves out are told by the check of the examples.
#[test]
fn a_labelled_object_outside_the_region_is_told() {
    let config = crate::common::small("blocksworld.toml", &["camera.region=[0.3, 0, 1, 1]"]);
    assert!(PreparedRun::read(config.clone(), None).is_ok(), "it is no error");
    let checks = config.check_examples(None).unwrap();
    let told: Vec<String> = checks[0].findings.iter().map(ToString::to_string).collect();
    let is_told =
        |text: &String| text.contains("cyan_block") && text.contains("outside the region");
    assert!(told.iter().any(is_told), "{told:#?}");
}
