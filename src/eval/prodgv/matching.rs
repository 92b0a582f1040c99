//! Which (exemplar, test) pairs are evaluated, which detection is which object of the truth, and the
//! same thing said with the other's names.

use std::collections::{BTreeMap, BTreeSet};

use super::Labelled;
use crate::pddl::{Atom, Condition, Literal, Name, Step, Term, Typed};
use crate::perception::model::{Implied, ObjectBox};

/// Whether the reference evaluates the pair: the same predicates occur in both true states, derived
/// ones included. An exemplar can teach nothing else.
pub fn is_evaluated(exemplar: &Labelled, test: &Labelled) -> bool {
    predicates(exemplar) == predicates(test)
}

fn predicates(problem: &Labelled) -> BTreeSet<&Name> {
    problem.init.iter().map(|atom| &atom.predicate).collect()
}

/// Detected names to true names; a detection that stands for nothing has no entry. No true name
/// occurs twice.
pub type Matching = BTreeMap<Name, Name>;

/// Matches as the reference does: each detection goes to the true box that it overlaps most (the
/// first box where it overlaps none), whatever the overlap and the types; of several detections
/// that go to one box the best stays (the first of equals), the others stand for nothing.
pub fn matched(detections: &[ObjectBox], truth: &[ObjectBox]) -> Matching {
    let mut best: BTreeMap<&Name, (f64, &Name)> = BTreeMap::new();
    for detection in detections {
        let Some((iou, object)) = nearest(detection, truth) else { continue };
        let kept = best.entry(&object.name).or_insert((iou, &detection.name));
        if iou > kept.0 {
            *kept = (iou, &detection.name);
        }
    }
    best.into_iter().map(|(object, (_, detection))| (detection.clone(), object.clone())).collect()
}

/// The box that overlaps most, with its overlap; the first of equals.
pub(super) fn nearest<'a>(
    detection: &ObjectBox,
    boxes: &'a [ObjectBox],
) -> Option<(f64, &'a ObjectBox)> {
    let overlaps = boxes.iter().map(|b| (detection.pixel_box.iou(&b.pixel_box), b));
    overlaps.reduce(|best, next| if next.0 > best.0 { next } else { best })
}

/// Matches objects that are always there and never seen: each to the one true object of its type
/// that has no box, where there is exactly one.
pub fn match_implied(
    matching: &mut Matching,
    implied: &[Implied],
    objects: &[Typed],
    truth: &[ObjectBox],
) {
    for implied in implied {
        let unseen = |object: &&Typed| {
            object.types.contains(&implied.type_name) && truth.iter().all(|b| b.name != object.name)
        };
        let mut fitting = objects.iter().filter(unseen);
        if let (Some(object), None) = (fitting.next(), fitting.next()) {
            matching.insert(implied.name.clone(), object.name.clone());
        }
    }
}

/// An object that has no counterpart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Nameless(pub Name);

type Renaming<'a> = &'a dyn Fn(&Name) -> Option<Name>;

fn all(names: &[Name], to: Renaming<'_>) -> Result<Vec<Name>, Nameless> {
    names.iter().map(|name| to(name).ok_or_else(|| Nameless(name.clone()))).collect()
}

/// An atom with other names.
///
/// # Errors
/// The first object that has none; likewise below.
pub(super) fn renamed_atom(atom: &Atom, to: Renaming<'_>) -> Result<Atom, Nameless> {
    Ok(Atom { predicate: atom.predicate.clone(), args: all(&atom.args, to)? })
}

/// A plan with other names.
pub(super) fn renamed_plan(steps: &[Step], to: Renaming<'_>) -> Result<Vec<Step>, Nameless> {
    let step = |step: &Step| Ok(Step { action: step.action.clone(), args: all(&step.args, to)? });
    steps.iter().map(step).collect()
}

/// A condition with other names.
pub(super) fn renamed_condition(
    condition: &Condition,
    to: Renaming<'_>,
) -> Result<Condition, Nameless> {
    let parts = |parts: &[Condition]| -> Result<Vec<Condition>, Nameless> {
        parts.iter().map(|part| renamed_condition(part, to)).collect()
    };
    let inner = |part: &Condition| renamed_condition(part, to).map(Box::new);
    Ok(match condition {
        Condition::True => Condition::True,
        Condition::False => Condition::False,
        Condition::Atom(Literal { predicate, args }) => {
            let args = args.iter().map(|arg| term(arg, to)).collect::<Result<_, _>>()?;
            Condition::Atom(Literal { predicate: predicate.clone(), args })
        }
        Condition::Equal(a, b) => Condition::Equal(term(a, to)?, term(b, to)?),
        Condition::Not(part) => Condition::Not(inner(part)?),
        Condition::And(list) => Condition::And(parts(list)?),
        Condition::Or(list) => Condition::Or(parts(list)?),
        Condition::Exists(variables, part) => Condition::Exists(variables.clone(), inner(part)?),
        Condition::Forall(variables, part) => Condition::Forall(variables.clone(), inner(part)?),
    })
}

fn term(term: &Term, to: Renaming<'_>) -> Result<Term, Nameless> {
    match term {
        Term::Var(name) => Ok(Term::Var(name.clone())),
        Term::Object(name) => to(name).map(Term::Object).ok_or_else(|| Nameless(name.clone())),
    }
}

/// True names to detected ones.
pub(super) fn inverse(matching: &Matching) -> Matching {
    matching.iter().map(|(detected, object)| (object.clone(), detected.clone())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PixelBox;

    fn boxes(list: &[(&str, [f64; 4])]) -> Vec<ObjectBox> {
        let object = |(name, edges): &(&str, [f64; 4])| {
            ObjectBox::new((*name).into(), "block".into(), PixelBox::from(*edges))
        };
        list.iter().map(object).collect()
    }

    #[track_caller]
    fn check(detections: &[(&str, [f64; 4])], expect: &[(&str, &str)]) {
        let truth = [("a", [0.0, 0.0, 10.0, 10.0]), ("b", [20.0, 0.0, 30.0, 10.0])];
        let matching = matched(&boxes(detections), &boxes(&truth));
        let found: Vec<_> = matching.iter().map(|(d, o)| (d.as_str(), o.as_str())).collect();
        assert_eq!(found, expect);
    }

    #[test]
    fn each_goes_where_it_overlaps_most() {
        check(
            &[("x", [21.0, 0.0, 31.0, 10.0]), ("y", [1.0, 1.0, 11.0, 11.0])],
            &[("x", "b"), ("y", "a")],
        );
    }

    #[test]
    fn of_two_for_one_box_the_better_stays_and_the_first_of_equals() {
        check(&[("x", [4.0, 0.0, 14.0, 10.0]), ("y", [1.0, 0.0, 11.0, 10.0])], &[("y", "a")]);
        check(&[("y", [1.0, 0.0, 11.0, 10.0]), ("x", [1.0, 0.0, 11.0, 10.0])], &[("y", "a")]);
    }

    #[test]
    fn what_overlaps_nothing_goes_to_the_first_box() {
        check(&[("x", [80.0, 80.0, 90.0, 90.0])], &[("x", "a")]);
        check(&[("x", [80.0, 80.0, 90.0, 90.0]), ("y", [0.0, 0.0, 10.0, 10.0])], &[("y", "a")]);
        check(&[], &[]);
    }

    #[test]
    fn an_implied_object_is_the_only_one_of_its_type_without_a_box() {
        let implied = [Implied { name: "arm".into(), type_name: "robot".into() }];
        let truth = boxes(&[("a", [0.0, 0.0, 10.0, 10.0])]);
        let check = |objects: &[(&str, &str)], expect: Option<&str>| {
            let objects: Vec<Typed> = objects.iter().map(|(n, t)| Typed::new(*n, *t)).collect();
            let mut matching = Matching::new();
            match_implied(&mut matching, &implied, &objects, &truth);
            assert_eq!(matching.get(&Name::new("arm")).map(Name::as_str), expect);
        };
        check(&[("a", "robot"), ("bot", "robot"), ("b", "block")], Some("bot"));
        check(&[("bot", "robot"), ("bot2", "robot")], None);
        check(&[("b", "block")], None);
    }
}
