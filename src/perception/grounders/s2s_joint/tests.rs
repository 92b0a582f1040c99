//! What holds of every answer, and scenes that single neighbours cannot judge.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;
use proptest::prelude::*;

use super::*;
use crate::geometry::{Aabb, PixelBox};
use crate::logic::Truth;
use crate::pddl::{Atom, SourceText, Typed, parse_domain};
use crate::perception::grounders::{Basis, Judged};
use crate::perception::model::Exemplar;

/// Side of the square test image, pixels.
const SIDE: u32 = 400;

fn domain() -> Domain {
    let text = include_str!("../../../../domains/hanoi/domain.pddl");
    parse_domain(&SourceText::new("domain.pddl", text)).unwrap().value
}

fn perception() -> Perception {
    let text = include_str!("../../../../domains/hanoi/perception.toml");
    Perception::parse("perception.toml", text).unwrap()
}

/// A disk of a width, the n-th from below on the peg at column `x`.
fn disk(name: &str, x: f64, level: usize, width: f64) -> (String, [f64; 4]) {
    let bottom = 300.0 - 20.0 * level as f64;
    (name.to_owned(), [x - width / 2.0, bottom - 20.0, x + width / 2.0, bottom])
}

/// The pegs at columns 100, 200 and 300; a peg is seen above what it carries.
fn pegs(heights: [usize; 3]) -> Vec<(String, [f64; 4])> {
    let peg = |(n, height): (usize, usize)| {
        let x = 100.0 * (n + 1) as f64;
        (format!("peg{}", n + 1), [x - 5.0, 180.0, x + 5.0, 300.0 - 20.0 * height as f64])
    };
    heights.into_iter().enumerate().map(peg).collect()
}

fn objects(list: &[(String, [f64; 4])]) -> Vec<ObjectBox> {
    let object = |(name, edges): &(String, [f64; 4])| {
        ObjectBox::new(
            Name::new(name),
            if name.starts_with("peg") { "peg".into() } else { "disk".into() },
            PixelBox::from(*edges),
        )
    };
    list.iter().map(object).collect()
}

/// One example: a small disk on a large one around the first peg, and nothing else.
fn two_disks() -> Exemplars {
    let mut list = vec![disk("small", 100.0, 1, 50.0), disk("large", 100.0, 0, 70.0)];
    list.extend(pegs([2, 0, 0]));
    let facts = [
        Atom::new("on", &["small", "large"]),
        Atom::new("on-peg", &["small", "peg1"]),
        Atom::new("on-peg", &["large", "peg1"]),
        Atom::new("smaller", &["small", "large"]),
    ];
    example(&list, &facts)
}

/// One example with these facts.
fn example(list: &[(String, [f64; 4])], facts: &[Atom]) -> Exemplars {
    let objects = objects(list);
    let typed: Vec<Typed> =
        objects.iter().map(|o| Typed::new(o.name.clone(), o.type_name.clone())).collect();
    let boxes: Vec<_> = objects.iter().map(|o| (o.name.clone(), o.pixel_box)).collect();
    let init = facts.iter().cloned().collect();
    let example = Exemplar::new("example", [SIDE, SIDE], &boxes, (&typed, init)).unwrap();
    Exemplars::new(vec![example]).unwrap()
}

fn joint() -> Joint {
    let (domain, perception) = (domain(), perception());
    perception.check(&domain).unwrap();
    Joint::new(&domain, &perception, &two_disks()).unwrap()
}

fn of(grounding: &Grounding, truth: Truth) -> Vec<String> {
    let judged = grounding.judged.iter().filter(|judged| judged.truth == truth);
    judged.map(|judged| judged.atom.to_string()).collect()
}

fn reasons(grounding: &Grounding) -> Vec<String> {
    grounding.anomalies.iter().map(ToString::to_string).collect()
}

#[track_caller]
fn check(list: &[(String, [f64; 4])], holds: &[&str], unknown: &[&str], anomalies: &[&str]) {
    let grounding = joint().judge(&objects(list));
    assert_eq!(of(&grounding, Truth::True), holds);
    assert_eq!(of(&grounding, Truth::Unknown), unknown);
    assert_eq!(reasons(&grounding), anomalies);
}

/// An example with a disk on each of two pegs shows no disk on another.
#[test]
fn a_predicate_that_no_example_shows_is_told_and_unknown_where_objects_touch() {
    let mut apart = vec![disk("small", 100.0, 0, 50.0), disk("large", 200.0, 0, 70.0)];
    apart.extend(pegs([1, 1, 0]));
    let facts = [
        Atom::new("on-peg", &["small", "peg1"]),
        Atom::new("on-peg", &["large", "peg2"]),
        Atom::new("smaller", &["small", "large"]),
    ];
    let joint = Joint::new(&domain(), &perception(), &example(&apart, &facts)).unwrap();
    assert_eq!(joint.untaught(), ["on"]);
    let unknown_on = |list: &[(String, [f64; 4])]| {
        let unknown = of(&joint.judge(&objects(list)), Truth::Unknown);
        unknown.into_iter().filter(|atom| atom.starts_with("(on ")).collect::<Vec<_>>()
    };
    assert_eq!(unknown_on(&apart), [""; 0]);
    let mut stacked = vec![disk("a", 100.0, 1, 50.0), disk("b", 100.0, 0, 70.0)];
    stacked.extend(pegs([2, 0, 0]));
    assert_eq!(unknown_on(&stacked), ["(on a b)", "(on b a)"]);
}

#[test]
fn one_pair_of_disks_teaches_disks_on_several_pegs() {
    let mut list = vec![
        disk("a", 200.0, 0, 40.0),
        disk("b", 300.0, 2, 50.0),
        disk("c", 300.0, 1, 60.0),
        disk("d", 300.0, 0, 80.0),
    ];
    list.extend(pegs([0, 1, 3]));
    let holds = [
        "(on b c)",
        "(on c d)",
        "(on-peg a peg2)",
        "(on-peg b peg3)",
        "(on-peg c peg3)",
        "(on-peg d peg3)",
        "(smaller a b)",
        "(smaller a c)",
        "(smaller a d)",
        "(smaller b c)",
        "(smaller b d)",
        "(smaller c d)",
    ];
    check(&list, &holds, &[], &[]);
}

#[test]
fn an_unseen_disk_in_a_stack_is_a_gap_not_a_fact() {
    let mut list = vec![disk("a", 100.0, 2, 40.0), disk("b", 100.0, 0, 80.0)];
    list.extend(pegs([3, 0, 0]));
    let holds = ["(on-peg a peg1)", "(on-peg b peg1)", "(smaller a b)"];
    check(&list, &holds, &["(on a b)"], &["a gap between a and b"]);
}

#[test]
fn a_disk_over_the_ground_hangs() {
    let mut list = vec![disk("a", 100.0, 1, 40.0)];
    list.extend(pegs([2, 0, 0]));
    check(&list, &["(on-peg a peg1)"], &[], &["nothing under a"]);
}

#[test]
fn a_disk_far_from_all_seen_pegs_is_not_forced_onto_one() {
    let mut list = vec![disk("a", 100.0, 0, 40.0)];
    list.extend(pegs([1, 0, 0]).into_iter().skip(1));
    let unknown = ["(on-peg a peg2)", "(on-peg a peg3)"];
    check(&list, &[], &unknown, &["no on-peg of a"]);
}

#[test]
fn what_a_constraint_decides_says_so() {
    let mut list: Vec<_> =
        (0..4).map(|n| disk(&format!("d{n}"), 100.0, n, 80.0 - 8.0 * n as f64)).collect();
    list.extend(pegs([4, 0, 0]));
    let grounding = joint().judge(&objects(&list));
    let of = |text: &str| grounding.judged.iter().find(|j| j.atom.to_string() == text).unwrap();
    // The one example has no disk between: alone, d3 would lie on d1 too.
    assert!(of("(on d3 d1)").d_pos < of("(on d3 d1)").d_neg);
    assert_eq!(of("(on d3 d1)").truth, Truth::False);
    assert_eq!(of("(on d3 d1)").basis, Basis::Constrained);
    assert_eq!((of("(on d3 d2)").truth, of("(on d3 d2)").basis), (Truth::True, Basis::Observed));
}

/// Two disks on a peg, and one that lies on no peg.
fn one_off_its_peg() -> (Vec<ObjectBox>, Exemplars) {
    let mut list = vec![disk("small", 100.0, 1, 50.0), disk("large", 100.0, 0, 70.0)];
    list.push(("off".to_owned(), [20.0, 320.0, 60.0, 340.0]));
    list.extend(pegs([2, 0, 0]));
    let facts: Vec<Atom> = two_disks().examples()[0].init.iter().cloned().collect();
    (objects(&list), example(&list, &facts))
}

#[test]
fn an_example_off_its_peg_makes_exactly_one_at_most_one() {
    let (objects, exemplars) = one_off_its_peg();
    let joint = Joint::new(&domain(), &perception(), &exemplars).unwrap();
    assert!(joint.required.predicates.is_empty() && joint.total.is_empty());
    let grounding = joint.judge(&objects);
    assert!(!of(&grounding, Truth::True).iter().any(|atom| atom.starts_with("(on-peg off")));
    assert!(reasons(&grounding).is_empty());
}

#[test]
fn a_disk_that_lies_beside_a_peg_on_its_disks_is_on_no_peg() {
    let joint = Joint::new(&domain(), &perception(), &one_off_its_peg().1).unwrap();
    let on_peg = |small_x: f64| {
        let mut list = vec![disk("small", small_x, 1, 50.0), disk("large", 100.0, 0, 70.0)];
        list.extend(pegs([1, 0, 0]));
        let holds = of(&joint.judge(&objects(&list)), Truth::True);
        holds.into_iter().filter(|atom| atom.starts_with("(on-peg small")).collect::<Vec<_>>()
    };
    assert_eq!(on_peg(95.0), ["(on-peg small peg1)"]);
    assert_eq!(on_peg(78.0), [""; 0], "the peg is at its edge");
}

/// A scene of disks and pegs anywhere, some in the same place.
fn scene() -> impl Strategy<Value = Vec<ObjectBox>> {
    let edges = (0_u32..12, 0_u32..12, 1_u32..5, 1_u32..5, any::<bool>(), any::<bool>());
    prop::collection::vec(edges, 0..14).prop_map(|list| {
        let object =
            |(n, (x, y, w, h, is_peg, deep)): (usize, (u32, u32, u32, u32, bool, bool))| {
                let [x, y, w, h] = [x, y, w, h].map(|v| f64::from(v) * 12.5);
                ObjectBox {
                    name: format!("o{n}").as_str().into(),
                    type_name: if is_peg { "peg".into() } else { "disk".into() },
                    pixel_box: PixelBox::from([x, y, x + w, y + h]),
                    volume: deep
                        .then(|| Aabb { centre: Point3::new(x, y, 0.0), extent: [w, h, w] }),
                    mask: None,
                }
            };
        list.into_iter().enumerate().map(object).collect()
    })
}

/// What of the constraints of hanoi is broken.
fn broken(judged: &[Judged]) -> Vec<String> {
    let holds = |predicate: &str| -> BTreeSet<(Name, Name)> {
        let true_ones = judged.iter().filter(|j| j.truth == Truth::True);
        let own = true_ones.filter(|j| j.atom.predicate == predicate);
        own.map(|j| (j.atom.args[0].clone(), j.atom.args[1].clone())).collect()
    };
    let mut faults = Vec::new();
    let mut count = |what: &str, names: Vec<Name>| {
        let mut counts: BTreeMap<Name, usize> = BTreeMap::new();
        for name in names {
            *counts.entry(name).or_default() += 1;
        }
        faults.extend(counts.iter().filter(|(_, n)| **n > 1).map(|(n, _)| format!("{what} {n}")));
    };
    count("lies on several", holds("on").into_iter().map(|(a, _)| a).collect());
    count("carries several", holds("on").into_iter().map(|(_, b)| b).collect());
    count("on several pegs", holds("on-peg").into_iter().map(|(a, _)| a).collect());
    let smaller = holds("smaller");
    for (a, b) in &smaller {
        if a == b || smaller.contains(&(b.clone(), a.clone())) {
            faults.push(format!("{a} and {b} are each smaller"));
        }
        for (_, c) in smaller.iter().filter(|(from, _)| from == b) {
            if !smaller.contains(&(a.clone(), c.clone())) {
                faults.push(format!("{a} < {b} < {c}"));
            }
        }
    }
    faults
}

proptest! {
    #[test]
    fn every_answer_keeps_the_constraints(objects in scene()) {
        let grounding = joint().judge(&objects);
        prop_assert_eq!(broken(&grounding.judged), Vec::<String>::new());
        let plain = joint().s2s.judge(&objects).judged;
        prop_assert_eq!(grounding.judged.len(), plain.len(), "every tuple is judged");
    }

    #[test]
    fn the_order_of_objects_does_not_matter(
        (objects, shuffled) in scene().prop_flat_map(|s| (Just(s.clone()), Just(s).prop_shuffle())),
    ) {
        prop_assert_eq!(joint().judge(&objects), joint().judge(&shuffled));
    }
}

#[test]
fn degenerate_scenes_are_answered() {
    let grounder = joint();
    assert_eq!(grounder.judge(&[]), Grounding::default());
    let same: Vec<_> = (0..60).map(|n| (format!("d{n}"), [10.0, 10.0, 20.0, 20.0])).collect();
    let mut same = objects(&same);
    assert!(broken(&grounder.judge(&same).judged).is_empty());
    same[0].name = same[1].name.clone();
    same[2].pixel_box = PixelBox::from([f64::NAN, 0.0, f64::INFINITY, -1.0]);
    assert!(broken(&grounder.judge(&same).judged).is_empty());
}
