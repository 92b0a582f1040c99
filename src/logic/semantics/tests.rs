//! What conditions and effects mean, by example.

use super::*;
use crate::pddl::{Domain, SourceText, parse_domain, parse_goal};

const DOMAIN: &str = "(define (domain d) (:requirements :adl)
  (:types block robot)
  (:predicates (on ?x ?y - block) (clear ?x - block) (red ?x - block) (idle))
  (:action paint :parameters (?x - block) :precondition (clear ?x)
    :effect (and (red ?x) (not (idle))
      (forall (?y - block) (when (on ?y ?x)
        (when (not (red ?y)) (and (clear ?y) (not (on ?y ?x)))))))))";

fn domain() -> Domain {
    parse_domain(&SourceText::new("d", DOMAIN)).unwrap().value
}

fn objects() -> Vec<Typed> {
    let either = Typed { name: "x".into(), types: vec!["block".into(), "robot".into()] };
    vec![Typed::new("a", "block"), Typed::new("b", "block"), Typed::new("r", "robot"), either]
}

fn atoms(list: &[&str]) -> BTreeSet<Atom> {
    let split = |text: &&str| {
        let words: Vec<&str> = text.split(' ').collect();
        Atom::new(words[0], &words[1..])
    };
    list.iter().map(split).collect()
}

fn facts(known: &[&str], unknown: &[&str]) -> Facts {
    Facts { known: atoms(known), unknown: atoms(unknown) }
}

/// Runs `check` on a condition, in the state of these facts.
fn with<T>(
    condition: &str,
    facts: &Facts,
    check: impl Fn(&Condition, &Universe<'_>, &dyn Fn(&Atom) -> Truth) -> T,
) -> T {
    let (domain, objects) = (domain(), objects());
    let source = SourceText::new("goal", condition);
    let condition =
        parse_goal(&source, &domain, &objects).unwrap_or_else(|e| panic!("{}", e.render()));
    let universe = Universe { types: &domain.types, objects: &objects };
    check(&condition, &universe, &|atom: &Atom| facts.truth(atom))
}

fn truth(condition: &str, facts: &Facts) -> Truth {
    with(condition, facts, |c, universe, truth| evaluate(c, &Bindings::new(), universe, truth))
}

#[test]
fn unknown_facts_make_a_condition_unknown_only_where_they_decide() {
    let state = facts(&["clear a"], &["clear b"]);
    for (condition, expected) in [
        ("(clear a)", Truth::True),
        ("(clear b)", Truth::Unknown),
        ("(not (clear b))", Truth::Unknown),
        ("(and (clear a) (clear b))", Truth::Unknown),
        ("(and (red a) (clear b))", Truth::False),
        ("(or (clear a) (clear b))", Truth::True),
        ("(or (red a) (clear b))", Truth::Unknown),
        ("(imply (clear b) (clear a))", Truth::True),
        ("(exists (?y - block) (clear ?y))", Truth::True),
        ("(exists (?y - block) (and (clear ?y) (not (= ?y a))))", Truth::Unknown),
        ("(forall (?y - block) (clear ?y))", Truth::False),
        ("(forall (?y - block) (or (clear ?y) (= ?y x)))", Truth::Unknown),
        ("(exists (?y - robot) (= ?y x))", Truth::True),
        ("(forall (?y - robot) (or (= ?y r) (= ?y x)))", Truth::True),
        ("(exists () (clear a))", Truth::True),
        ("(idle)", Truth::False),
        ("(= a a)", Truth::True),
        ("(and)", Truth::True),
        ("(or)", Truth::False),
    ] {
        assert_eq!(truth(condition, &state), expected, "{condition}");
    }
}

#[test]
fn an_inner_variable_hides_an_outer_one() {
    let state = facts(&["clear a", "red b"], &[]);
    let condition = "(exists (?y - block) (and (clear ?y) (exists (?y - block) (red ?y))))";
    assert_eq!(truth(condition, &state), Truth::True);
    assert_eq!(
        truth(&condition.replace("?y - block) (red", "?z - block) (red"), &state),
        Truth::False
    );
}

#[test]
fn the_unknown_atoms_that_matter_are_named() {
    let state = facts(&["clear a"], &["clear b", "red a"]);
    let unknowns = |condition: &str| {
        with(condition, &state, |c, universe, truth| {
            mentioned_unknowns(c, &Bindings::new(), universe, truth)
        })
    };
    assert_eq!(unknowns("(and (clear b) (clear a))"), atoms(&["clear b"]));
    assert_eq!(unknowns("(or (clear a) (clear b))"), atoms(&[]));
    assert_eq!(unknowns("(and (idle) (clear b))"), atoms(&[]));
    let quantified = "(exists (?y - block) (and (not (clear ?y)) (not (= ?y x))))";
    assert_eq!(unknowns(quantified), atoms(&["clear b"]));
}

#[test]
fn failing_parts_are_named_with_their_objects() {
    let state = facts(&["clear a", "on b a"], &["red a"]);
    let reasons = |condition: &str| {
        with(condition, &state, |c, universe, truth| {
            unsatisfied(c, &Bindings::new(), universe, truth)
        })
    };
    assert_eq!(reasons("(and (clear a) (clear b))"), ["(clear b) does not hold"]);
    assert_eq!(reasons("(not (on b a))"), ["(on b a) holds"]);
    assert_eq!(reasons("(red a)"), ["(red a) is not known to hold"]);
    assert_eq!(
        reasons("(forall (?y - block) (or (clear ?y) (= ?y x)))"),
        ["(or (clear b) (= b x)) does not hold"]
    );
    assert_eq!(
        reasons("(exists (?y - block) (on ?y b))"),
        ["(exists (?y - block) (on ?y b)) does not hold"]
    );
    assert!(reasons("(on b a)").is_empty());
}

fn painted(known: &[&str], unknown: &[&str]) -> Changes {
    let (domain, objects, facts) = (domain(), objects(), facts(known, unknown));
    let universe = Universe { types: &domain.types, objects: &objects };
    let action = domain.action("paint").unwrap();
    let bindings = bind(action, &["a".into()]).unwrap();
    effects(action, &bindings, &universe, &|atom: &Atom| facts.truth(atom))
}

#[test]
fn nested_conditional_effects_fire_when_all_their_conditions_hold() {
    let changes = painted(&["on b a", "on x a", "red x"], &[]);
    assert_eq!(changes.add, atoms(&["red a", "clear b"]));
    assert_eq!(changes.delete, atoms(&["idle", "on b a"]));
    assert_eq!(changes.unknown, atoms(&[]));
}

#[test]
fn an_effect_that_may_fire_makes_its_atoms_unknown() {
    let changes = painted(&["on b a", "clear b"], &["red b"]);
    assert_eq!(changes.unknown, atoms(&["on b a"]), "(clear b) holds either way");
    let changes = painted(&[], &["on b a"]);
    assert_eq!(changes.unknown, atoms(&["on b a", "clear b"]));
    let after = changes.apply(&facts(&["idle"], &["on b a"]));
    assert_eq!(after, facts(&["red a"], &["on b a", "clear b"]));
}

#[test]
fn adding_wins_over_deleting() {
    let text = DOMAIN.replace("(red ?x) (not (idle))", "(not (red ?x)) (red ?x) (idle)");
    let domain = parse_domain(&SourceText::new("d", text)).unwrap().value;
    let universe = Universe { types: &domain.types, objects: &objects() };
    let bindings = bind(&domain.actions[0], &["a".into()]).unwrap();
    let changes = effects(&domain.actions[0], &bindings, &universe, &|_| Truth::False);
    assert_eq!((changes.add, changes.delete), (atoms(&["red a", "idle"]), atoms(&[])));
}

#[test]
fn binding_needs_as_many_objects_as_parameters() {
    let domain = domain();
    assert!(bind(&domain.actions[0], &[]).is_none());
    assert!(bind(&domain.actions[0], &["a".into(), "b".into()]).is_none());
}
