//! What nothing explains, and what it makes unknown.
//!
//! Facts are read off what is seen, and completion rules take it that all is seen. A thing in front,
//! or fixtures fewer than the domain has, say that this is not so: what they touch is doubted.

use super::Unexplained;
use super::grounders::Grounding;
use super::model::{ObjectBox, Perception, TypeSpec};
use crate::logic::{Facts, Truth};
use crate::pddl::{Atom, Name};
use crate::scene::{Anomaly, Place};

/// What nothing explains, as anomalies about the objects that are next to it.
pub fn doubts(unexplained: &[Unexplained], objects: &[ObjectBox]) -> Vec<Anomaly> {
    let anomaly = |thing: &Unexplained| {
        let near = objects.iter().filter(|object| thing.is_near(&object.pixel_box));
        Anomaly {
            objects: near.map(|object| object.name.clone()).collect(),
            reason: "something unknown".to_owned(),
            place: Some(Place::new(&thing.place, thing.may_hide)),
        }
    };
    unexplained.iter().map(anomaly).collect()
}

/// Types whose names the domain lists, and of which not all are seen.
pub fn missing_fixtures<'a>(
    perception: &'a Perception,
    objects: &'a [ObjectBox],
) -> impl Iterator<Item = (&'a TypeSpec, Anomaly)> {
    perception.types.iter().filter_map(|spec| {
        let seen: Vec<Name> = objects
            .iter()
            .filter(|object| object.type_name == spec.name)
            .map(|object| object.name.clone())
            .collect();
        let (n_seen, n_known) = (seen.len(), spec.naming.list.len());
        let reason = format!("{n_seen} of {n_known} objects of type {} are seen", spec.name);
        (n_seen < n_known).then_some((spec, Anomaly { objects: Vec::new(), reason, place: None }))
    })
}

/// Makes unknown what was judged not to hold between objects that one unexplained thing touches: it
/// may hide just that.
pub fn weaken(grounding: &mut Grounding) {
    let Grounding { judged, anomalies } = grounding;
    for judged in judged.iter_mut().filter(|j| j.truth == Truth::False && j.atom.args.len() > 1) {
        let touches_all = |anomaly: &Anomaly| {
            anomaly.place.is_some() && judged.atom.args.iter().all(|a| anomaly.objects.contains(a))
        };
        if anomalies.iter().any(touches_all) {
            judged.truth = Truth::Unknown;
        }
    }
}

/// Makes unknown what was completed about objects next to a place that may hide another one.
pub fn doubt_completed(perception: &Perception, anomalies: &[Anomaly], facts: &mut Facts) {
    let hiding = anomalies.iter().filter(|anomaly| anomaly.may_hide());
    let near: Vec<&Name> = hiding.flat_map(|anomaly| &anomaly.objects).collect();
    let is_doubted = |atom: &&Atom| {
        perception.completed.contains(&atom.predicate)
            && atom.args.iter().any(|a| near.contains(&a))
    };
    let doubted: Vec<Atom> = facts.known.iter().filter(is_doubted).cloned().collect();
    for atom in doubted {
        facts.set(atom, Truth::Unknown);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::geometry::PixelBox;
    use crate::perception::grounders::{Basis, Evidence, Judged};

    const HANOI: &str = include_str!("../../domains/hanoi/perception.toml");
    const BLOCKS: &str = include_str!("../../domains/blocksworld/perception.toml");

    fn object(name: &str, type_name: &str, edges: [f64; 4]) -> ObjectBox {
        ObjectBox::new(name.into(), type_name.into(), PixelBox::from(edges))
    }

    fn blocks() -> [ObjectBox; 3] {
        [
            object("a", "block", [0.0, 0.0, 30.0, 30.0]),
            object("b", "block", [0.0, 30.0, 30.0, 60.0]),
            object("c", "block", [200.0, 30.0, 230.0, 60.0]),
        ]
    }

    fn thing(edges: [f64; 4], may_hide: bool) -> Unexplained {
        let place = PixelBox::from(edges);
        Unexplained { place, stripes: vec![place], may_hide }
    }

    fn judged(truth: Truth, args: [&str; 2]) -> Judged {
        let atom = Atom::new("on", &args);
        let evidence = Arc::new(Evidence { exemplar: "e".to_owned(), atom: atom.clone() });
        Judged {
            atom,
            truth,
            basis: Basis::Observed,
            d_pos: 1.0,
            d_neg: 1.0,
            nearest_pos: Arc::clone(&evidence),
            nearest_neg: evidence,
        }
    }

    #[test]
    fn a_thing_is_told_with_its_place_and_the_objects_beside_it() {
        let anomalies = doubts(&[thing([33.0, 10.0, 60.0, 50.0], true)], &blocks());
        let told: Vec<String> = anomalies.iter().map(ToString::to_string).collect();
        assert_eq!(told, ["something unknown at 33 10 60 50, next to a and b"]);
        let apart = doubts(&[thing([100.0, 10.0, 130.0, 50.0], false)], &blocks());
        assert_eq!(apart[0].to_string(), "something unknown at 100 10 130 50");
        assert!(anomalies[0].may_hide() && !apart[0].may_hide());
    }

    #[test]
    fn what_it_touches_is_not_denied_and_what_is_seen_stays() {
        let anomalies = doubts(&[thing([33.0, 10.0, 60.0, 50.0], true)], &blocks());
        let judged = vec![
            judged(Truth::True, ["a", "b"]),
            judged(Truth::False, ["b", "a"]),
            judged(Truth::False, ["a", "c"]),
        ];
        let mut grounding = Grounding { judged, anomalies };
        weaken(&mut grounding);
        let truths: Vec<Truth> = grounding.judged.iter().map(|j| j.truth).collect();
        assert_eq!(truths, [Truth::True, Truth::Unknown, Truth::False]);
    }

    #[test]
    fn only_completed_facts_beside_what_may_hide_an_object_are_doubted() {
        let perception = Perception::parse("perception.toml", BLOCKS).unwrap();
        let known =
            [Atom::new("clear", &["a"]), Atom::new("clear", &["c"]), Atom::new("on", &["a", "b"])];
        for (may_hide, unknown) in [(true, 1), (false, 0)] {
            let mut facts = Facts::new(known.iter().cloned().collect());
            let anomalies = doubts(&[thing([33.0, 10.0, 60.0, 50.0], may_hide)], &blocks());
            doubt_completed(&perception, &anomalies, &mut facts);
            assert_eq!(facts.unknown.len(), unknown);
            assert_eq!(facts.truth(&known[1]), Truth::True);
            assert_eq!(facts.truth(&known[2]), Truth::True);
        }
    }

    #[test]
    fn fewer_fixtures_than_the_domain_lists_are_told() {
        let perception = Perception::parse("perception.toml", HANOI).unwrap();
        let peg = |name: &str, x: f64| object(name, "peg", [x, 0.0, x + 8.0, 90.0]);
        let mut pegs = vec![peg("peg", 10.0), peg("peg2", 60.0)];
        let told: Vec<String> =
            missing_fixtures(&perception, &pegs).map(|(_, anomaly)| anomaly.to_string()).collect();
        assert_eq!(told, ["2 of 3 objects of type peg are seen"]);
        pegs.push(peg("peg3", 110.0));
        assert_eq!(missing_fixtures(&perception, &pegs).count(), 0);
    }
}
