//! Small drawn pictures, each with one thing that is not as labelled.

use std::sync::Arc;

use super::*;
use crate::geometry::PixelBox;
use crate::logic::Truth;
use crate::parts::{PartChoice, PartContext};
use crate::pddl::{Atom, Domain, Name, SourceText, Typed, parse_domain, parse_rules};
use crate::perception::Observation;
use crate::perception::detectors::{ColourDetector, DetectorError, Watchful};
use crate::perception::grounders::{
    Basis, Evidence, GROUNDERS, Grounder, GrounderError, GrounderInputs, Grounding, Judged,
};
use crate::perception::model::{Exemplars, Perception};

const RED: [u8; 3] = [200, 45, 40];
const BLUE: [u8; 3] = [40, 90, 200];
const YELLOW: [u8; 3] = [230, 195, 45];
const GREY: [u8; 3] = [128, 128, 126];
const WOOD: [u8; 3] = [205, 170, 125];
const CLOTH: [u8; 3] = [42, 43, 46];

/// A domain's files.
const BLOCKS: [&str; 3] = [
    include_str!("../../../domains/blocksworld/domain.pddl"),
    include_str!("../../../domains/blocksworld/perception.toml"),
    include_str!("../../../domains/blocksworld/completion.pddl"),
];
const HANOI: [&str; 3] = [
    include_str!("../../../domains/hanoi/domain.pddl"),
    include_str!("../../../domains/hanoi/perception.toml"),
    include_str!("../../../domains/hanoi/completion.pddl"),
];

/// Filled rectangles on cloth.
type Drawing<'a> = &'a [([usize; 4], [u8; 3])];
/// Name, type, box.
type Labels<'a> = &'a [(&'a str, &'a str, [f64; 4])];

/// A picture of 320 by 240 pixels.
fn drawn(drawing: Drawing<'_>) -> Vec<u8> {
    let mut rgb = CLOTH.repeat(320 * 240);
    for ([x1, y1, x2, y2], colour) in drawing {
        for (y, x) in (*y1..*y2).flat_map(|y| (*x1..*x2).map(move |x| (y, x))) {
            rgb[3 * (y * 320 + x)..][..3].copy_from_slice(colour);
        }
    }
    rgb
}

/// A red block on a blue one, and a yellow one beside them.
const DRAWN: [([usize; 4], [u8; 3]); 3] =
    [([60, 140, 90, 170], RED), ([60, 170, 90, 200], BLUE), ([220, 170, 250, 200], YELLOW)];
const LABELS: [(&str, &str, [f64; 4]); 3] = [
    ("red_block", "block", [60.0, 140.0, 90.0, 170.0]),
    ("blue_block", "block", [60.0, 170.0, 90.0, 200.0]),
    ("yellow_block", "block", [220.0, 170.0, 250.0, 200.0]),
];
const ON: [&str; 3] = ["on", "red_block", "blue_block"];

/// Judges `on` by where boxes are: true where they touch, else false, or unknown if `in_doubt`.
struct Touching {
    in_doubt: bool,
}

impl Grounder for Touching {
    fn ground(&self, observation: &Observation<'_>) -> Result<Grounding, GrounderError> {
        let mut judged = Vec::new();
        for above in observation.objects {
            for below in observation.objects.iter().filter(|below| below.name != above.name) {
                let [a, b] = [above, below].map(|object| object.pixel_box);
                let touches = (b.y1 - a.y2).abs() < 3.0 && (a.x1 - b.x1).abs() < 3.0;
                let truth = match (touches, self.in_doubt) {
                    (true, false) => Truth::True,
                    (true, true) => Truth::Unknown,
                    (false, _) => Truth::False,
                };
                let atom = Atom::new("on", &[above.name.as_str(), below.name.as_str()]);
                let evidence = Arc::new(Evidence { exemplar: String::new(), atom: atom.clone() });
                let (nearest_pos, nearest_neg) = (Arc::clone(&evidence), evidence);
                let (basis, d_pos, d_neg) = (Basis::Observed, 0.0, 0.0);
                judged.push(Judged { atom, truth, basis, d_pos, d_neg, nearest_pos, nearest_neg });
            }
        }
        Ok(Grounding { judged, anomalies: Vec::new() })
    }
}

struct Fixture {
    domain: Domain,
    perception: Perception,
    rgb: Vec<u8>,
    exemplar: Exemplar,
}

impl Fixture {
    fn new(files: [&str; 3], drawing: Drawing<'_>, labels: Labels<'_>, init: &[&[&str]]) -> Self {
        let domain = parse_domain(&SourceText::new("domain.pddl", files[0])).unwrap().value;
        let perception = Perception::parse("perception.toml", files[1]).unwrap();
        let boxes: Vec<(Name, PixelBox)> =
            labels.iter().map(|(name, _, edges)| ((*name).into(), (*edges).into())).collect();
        let objects: Vec<Typed> = labels.iter().map(|(n, t, _)| Typed::new(*n, *t)).collect();
        let init = init.iter().map(|atom| Atom::new(atom[0], &atom[1..])).collect();
        let exemplar = Exemplar::new("boxes.json", [320, 240], &boxes, (&objects, init)).unwrap();
        Self { domain, perception, rgb: drawn(drawing), exemplar }
    }

    fn findings(&self, files: [&str; 3], grounder: &dyn Grounder) -> Vec<ExemplarFinding> {
        let image = ImageView::new(320, 240, &self.rgb).unwrap();
        let colour = ColourDetector::new(&self.perception).unwrap();
        let mut detector = Watchful::new(Box::new(colour), &self.perception);
        detector.learn(&image, &self.exemplar.objects).unwrap();
        self.findings_by(files, grounder, &mut detector)
    }

    fn findings_by(
        &self,
        files: [&str; 3],
        grounder: &dyn Grounder,
        detector: &mut dyn Detector,
    ) -> Vec<ExemplarFinding> {
        let rules = parse_rules(&SourceText::new("completion.pddl", files[2]), &self.domain);
        let image = ImageView::new(320, 240, &self.rgb).unwrap();
        let mut check = SelfCheck {
            pipeline: Pipeline {
                domain: &self.domain,
                perception: &self.perception,
                rules: &rules.unwrap(),
                grounder,
            },
            detector: Some(detector),
            goes_by_colours: true,
            has_depth: false,
        };
        check.findings(&[LabelledImage { image, exemplar: &self.exemplar }]).unwrap()
    }

    fn grounder(&self, name: &str) -> Box<dyn Grounder> {
        let exemplars = Exemplars::new(vec![self.exemplar.clone()]).unwrap();
        let (domain, perception) = (&self.domain, &self.perception);
        let inputs = GrounderInputs { domain, perception, exemplars: &exemplars };
        let choice = PartChoice::new("perception.grounder", name);
        GROUNDERS.build(&PartContext { choice: &choice, inputs, environment: |_| None }).unwrap()
    }
}

/// What `s2s-joint` and the colour detector find in a picture of blocks.
fn of_blocks(drawing: Drawing<'_>, labels: Labels<'_>, init: &[&[&str]]) -> Vec<FindingKind> {
    let fixture = Fixture::new(BLOCKS, drawing, labels, init);
    let findings = fixture.findings(BLOCKS, &*fixture.grounder("s2s-joint"));
    findings.into_iter().map(|finding| finding.kind).collect()
}

/// The one finding in the usual picture with more drawn and labelled.
#[track_caller]
fn with_more(drawing: Drawing<'_>, labels: Labels<'_>) -> FindingKind {
    let (drawing, labels) = ([&DRAWN, drawing].concat(), [&LABELS, labels].concat());
    let found = of_blocks(&drawing, &labels, &[&ON]);
    let [finding] = &found[..] else { panic!("{found:#?}") };
    finding.clone()
}

#[track_caller]
fn check_reason(drawing: Drawing<'_>, labels: Labels<'_>, expect: &str) {
    let finding = with_more(drawing, labels);
    assert!(matches!(finding, FindingKind::NotFound { .. }), "{finding:#?}");
    assert!(finding.to_string().contains(expect), "{finding}");
}

#[test]
fn an_example_that_is_right_has_no_findings() {
    assert_eq!(of_blocks(&DRAWN, &LABELS, &[&ON]), []);
}

#[test]
fn a_label_beside_its_object_disagrees_with_the_picture() {
    let mut labels = LABELS;
    labels[2].2 = [240.0, 170.0, 270.0, 200.0];
    let found = of_blocks(&DRAWN, &labels, &[&ON]);
    let [finding @ FindingKind::OtherBox { label, found: at }] = &found[..] else {
        panic!("{found:#?}")
    };
    assert_eq!((label.object.as_str(), at.x1), ("yellow_block", 220.0));
    let expect = "yellow_block: the label disagrees with the picture: labelled 240 170 270 200, \
                  found 220 170 250 200; correct the box";
    assert_eq!(finding.to_string(), expect);
}

#[test]
fn an_object_of_another_colour_than_its_name_is_told() {
    let mut labels = LABELS;
    labels[2].0 = "green_block";
    let found = of_blocks(&DRAWN, &labels, &[&ON]);
    let [FindingKind::OtherColour { object, named, seen }] = &found[..] else {
        panic!("{found:#?}")
    };
    assert_eq!([object, named, seen].map(Name::as_str), ["green_block", "green", "yellow"]);
    // A name that speaks of no colour claims none.
    labels[2].0 = "the_last_one";
    assert_eq!(of_blocks(&DRAWN, &labels, &[&ON]), []);
}

#[test]
fn what_is_not_labelled_is_told() {
    let finding = with_more(&[([120, 170, 150, 200], RED)], &[]);
    let expect = "the picture shows a red block at 120 170 150 200 that is not labelled: label it";
    assert_eq!(finding.to_string(), expect);
}

#[test]
fn an_object_that_is_too_large_names_the_key_that_forbids_it() {
    let expect = "its box has 0.417, and type.block.appearance.width allows 0.025 to 0.3";
    let drawing = ([110, 100, 210, 160], RED);
    check_reason(&[drawing], &[("red_block2", "block", [110.0, 100.0, 210.0, 160.0])], expect);
    // The label is of a possible size, and the patch is not.
    let expect = "the red patch there, 143 150 147 158, has 0.017, and type.block.appearance.width";
    let label = ("red_block2", "block", [130.0, 140.0, 160.0, 170.0]);
    check_reason(&[([143, 150, 147, 158], RED)], &[label], expect);
}

#[test]
fn a_box_that_shows_another_colour_or_none_says_what_it_shows() {
    let label = [("red_block2", "block", [130.0, 140.0, 160.0, 170.0])];
    check_reason(
        &[([143, 150, 147, 158], BLUE)],
        &label,
        "its box shows no red but blue (14 % of the middle)",
    );
    check_reason(&[], &label, "its box shows no red (its middle is #2a2b2e)");
    check_reason(
        &[([130, 140, 170, 180], GREY)],
        &[("thing", "block", [130.0, 140.0, 170.0, 180.0])],
        "its box shows none of its type's colours (its middle is #80807e)",
    );
}

/// Finds what it is told to.
struct Fixed(Vec<Detection>);

impl Detector for Fixed {
    fn learn(&mut self, _: &ImageView<'_>, _: &[ObjectBox]) -> Result<(), DetectorError> {
        Ok(())
    }

    fn detect(&mut self, _: &ImageView<'_>, _: &[String]) -> Result<Detections, DetectorError> {
        Ok(Detections { objects: self.0.clone(), ..Detections::default() })
    }
}

#[test]
fn two_that_one_detection_covers_are_merged() {
    let drawing = [([120, 170, 150, 200], RED), ([150, 170, 180, 200], RED)];
    let labels = [
        ("red_block", "block", [120.0, 170.0, 150.0, 200.0]),
        ("red_block2", "block", [150.0, 170.0, 180.0, 200.0]),
    ];
    let fixture = Fixture::new(BLOCKS, &drawing, &labels, &[]);
    let of = |edges: [f64; 4]| {
        let mut fixed = Fixed(vec![Detection::new("block".into(), "red".into(), edges.into())]);
        fixture.findings_by(BLOCKS, &Touching { in_doubt: false }, &mut fixed)
    };
    let covered = |findings: &[ExemplarFinding]| {
        let merged = |finding: &ExemplarFinding| {
            let FindingKind::NotFound { label, reason } = &finding.kind else { return None };
            let NotFoundReason::Merged { with } = reason else { return None };
            Some(format!("{} with {with}", label.object))
        };
        findings.iter().filter_map(merged).collect::<Vec<_>>()
    };
    // One half each: the first is found, and the other one is not to be told from it.
    let findings = of([120.0, 170.0, 180.0, 200.0]);
    assert_eq!(covered(&findings), ["red_block2 with red_block"], "{findings:#?}");
    assert!(findings[0].to_string().contains("one detection covers it and red_block"));
    // Larger than both: neither is found, and the detection is no third object.
    let findings = of([110.0, 160.0, 190.0, 200.0]);
    let both = ["red_block with red_block2", "red_block2 with red_block"];
    assert_eq!(covered(&findings), both, "{findings:#?}");
    assert!(!findings.iter().any(|f| matches!(f.kind, FindingKind::Unlabelled { .. })));
}

/// Pegs on a board with a disk, and one beside them all.
#[test]
fn a_disk_beside_all_pegs_is_outside() {
    let mut drawing = vec![([80, 200, 280, 222], WOOD)];
    drawing.extend([126, 176, 226].map(|x| ([x, 60, x + 8, 200], WOOD)));
    drawing.extend([([110, 176, 150, 200], BLUE), ([10, 176, 60, 200], RED)]);
    let labels = [
        ("left_peg", "peg", [126.0, 60.0, 134.0, 176.0]),
        ("middle_peg", "peg", [176.0, 60.0, 184.0, 200.0]),
        ("right_peg", "peg", [226.0, 60.0, 234.0, 200.0]),
        ("blue_disk", "disk", [110.0, 176.0, 150.0, 200.0]),
        ("red_disk", "disk", [10.0, 176.0, 60.0, 200.0]),
    ];
    let init: [&[&str]; 2] =
        [&["on-peg", "blue_disk", "left_peg"], &["smaller", "blue_disk", "red_disk"]];
    let fixture = Fixture::new(HANOI, &drawing, &labels, &init);
    let findings = fixture.findings(HANOI, &*fixture.grounder("s2s-joint"));
    let outside = |finding: &ExemplarFinding| {
        let FindingKind::NotFound { label, reason } = &finding.kind else { return None };
        (*reason == NotFoundReason::Outside).then(|| label.object.to_string())
    };
    let outside: Vec<String> = findings.iter().filter_map(outside).collect();
    assert_eq!(outside, ["red_disk"], "{findings:#?}");
}

#[test]
fn a_type_without_a_look_says_so() {
    let finding = with_more(&[], &[("bot", "robot", [130.0, 140.0, 170.0, 180.0])]);
    assert!(finding.to_string().contains("does not say how objects of its type look"), "{finding}");
}

/// Both `on` and the one that skips a block cannot hold.
#[test]
fn a_labelled_state_that_contradicts_the_constraints_is_told() {
    let drawing = [&DRAWN[..], &[([60, 110, 90, 140], YELLOW)]].concat();
    let labels = [&LABELS[..], &[("yellow_block2", "block", [60.0, 110.0, 90.0, 140.0])]].concat();
    let right: [&[&str]; 2] = [&ON, &["on", "yellow_block2", "red_block"]];
    assert_eq!(of_blocks(&drawing, &labels, &right), []);
    let wrong = [&right[..], &[&["on", "yellow_block2", "blue_block"]]].concat();
    let found = of_blocks(&drawing, &labels, &wrong);
    assert!(!found.is_empty());
    for kind in &found {
        let FindingKind::OtherFact { boxes, .. } = kind else { panic!("{found:#?}") };
        assert_eq!(*boxes, BoxOrigin::Labelled, "{kind}");
    }
}

/// The labelled boxes touch and the drawn blocks do not; the other way round, nothing is doubted.
#[test]
fn facts_that_the_detected_boxes_do_not_show_are_told() {
    let mut drawing = DRAWN;
    drawing[0].0 = [60, 134, 90, 164];
    let fixture = Fixture::new(BLOCKS, &drawing, &LABELS, &[&ON]);
    let findings = fixture.findings(BLOCKS, &Touching { in_doubt: false });
    let [finding] = &findings[..] else { panic!("{findings:#?}") };
    let expect = "boxes.json: (on red_block blue_block): labelled to hold, and read as false from \
                  the detected boxes";
    assert!(finding.to_string().starts_with(expect) && finding.kind.is_grave(), "{finding}");
    let fixture = Fixture::new(BLOCKS, &DRAWN, &LABELS, &[&ON]);
    assert_eq!(fixture.findings(BLOCKS, &Touching { in_doubt: false }), []);
}

#[test]
fn an_unknown_fact_is_told_once_and_is_not_grave() {
    let fixture = Fixture::new(BLOCKS, &DRAWN, &LABELS, &[&ON]);
    let findings = fixture.findings(BLOCKS, &Touching { in_doubt: true });
    let [finding] = &findings[..] else { panic!("{findings:#?}") };
    assert!(finding.to_string().contains("read as unknown from the labelled boxes"), "{finding}");
    assert!(!finding.kind.is_grave());
}

/// A state that says of a block that it is clear, and of another one, on which nothing is, nothing.
#[test]
fn completed_facts_are_compared_where_the_state_speaks_of_them() {
    let init: [&[&str]; 3] = [&ON, &["clear", "red_block"], &["clear", "yellow_block"]];
    assert_eq!(of_blocks(&DRAWN, &LABELS, &init), []);
    let found = of_blocks(&DRAWN, &LABELS, &init[..2]);
    assert!(found[0].to_string().starts_with("(clear yellow_block): not labelled to hold"));
    assert_eq!(found.len(), 1, "{found:#?}");
    // What is held is not clear, whatever the rules say of an empty gripper.
    let held: [&[&str]; 3] = [&ON, &["clear", "red_block"], &["holding", "yellow_block"]];
    assert_eq!(of_blocks(&DRAWN, &LABELS, &held), []);
}

#[test]
fn predicates_without_an_example_of_both_kinds_are_told() {
    let (drawing, labels) = ([DRAWN[0], DRAWN[2]], [LABELS[0], LABELS[2]]);
    let text = |grounder: &str| {
        let fixture = Fixture::new(BLOCKS, &drawing, &labels, &[]);
        let findings = fixture.findings(BLOCKS, &*fixture.grounder(grounder));
        findings.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let joint = "no labelled example shows on to hold: where objects touch it is unknown; label a \
                 picture that does";
    assert_eq!(text("s2s-joint"), [joint]);
    let s2s =
        "no labelled example shows on to hold: it is not read at all; label a picture that does";
    assert_eq!(text("s2s"), [s2s]);
}
