//! Completion by rules, small and by another way of computing it.

use std::collections::BTreeSet;

use proptest::prelude::*;

use super::*;
use crate::logic::{Bindings, evaluate};
use crate::pddl::{Domain, SourceText, Typed, parse_domain};

/// The derived atoms of `(edge …)` facts over the objects a b c, as text.
fn derived(rules: &str, known: &[[&str; 2]], unknown: &[[&str; 2]]) -> (String, String) {
    let text = format!(
        "(define (domain d) (:requirements :adl :derived-predicates) (:types node)
          (:predicates (edge ?x ?y - node) (path ?x ?y - node) (cut ?x - node) (any))
          {rules})"
    );
    let domain = parse_domain(&SourceText::new("d", text));
    let domain = domain.unwrap_or_else(|e| panic!("{}", e.render())).value;
    let objects = ["a", "b", "c"].map(|name| Typed::new(name, "node"));
    let universe = Universe { types: &domain.types, objects: &objects };
    let edges = |list: &[[&str; 2]]| list.iter().map(|e| Atom::new("edge", e)).collect();
    let mut base = Facts { known: edges(known), unknown: edges(unknown) };
    // What was believed of a head before is of no interest.
    base.known.insert(Atom::new("path", &["c", "c"]));
    base.unknown.insert(Atom::new("cut", &["a"]));
    let facts = derive(&domain.axioms, &universe, &base);
    let show = |atoms: &BTreeSet<Atom>| {
        let heads = atoms.iter().filter(|a| a.predicate != "edge");
        heads.map(ToString::to_string).collect::<String>()
    };
    (show(&facts.known), show(&facts.unknown))
}

const PATH: &str = "(:derived (path ?x ?y - node) (or (edge ?x ?y)
    (exists (?z - node) (and (edge ?x ?z) (path ?z ?y)))))";
const PATH_IN_TWO: &str = "(:derived (path ?x ?y - node) (edge ?x ?y))
    (:derived (path ?x ?y - node) (exists (?z - node) (and (path ?x ?z) (path ?z ?y))))";
const CUT: &str = "(:derived (cut ?x - node) (not (exists (?y - node) (path ?x ?y))))";

#[test]
fn recursive_rules_reach_their_fixpoint() {
    for rules in [PATH, PATH_IN_TWO] {
        let (known, unknown) = derived(rules, &[["a", "b"], ["b", "c"]], &[]);
        assert_eq!(known, "(path a b)(path a c)(path b c)");
        assert_eq!(unknown, "(cut a)", "no rule for it");
        let (known, _) = derived(rules, &[["a", "b"], ["b", "a"]], &[]);
        assert_eq!(known, "(path a a)(path a b)(path b a)(path b b)");
    }
}

#[test]
fn negation_sees_the_finished_stratum_below() {
    let rules = format!("{CUT}{PATH}");
    let (known, unknown) = derived(&rules, &[["a", "b"]], &[]);
    assert_eq!((known.as_str(), unknown.as_str()), ("(cut b)(cut c)(path a b)", ""));
}

#[test]
fn what_hangs_on_an_unknown_fact_is_unknown() {
    for rules in [PATH, PATH_IN_TWO] {
        let rules = format!("{rules}{CUT}");
        let (known, unknown) = derived(&rules, &[["a", "b"]], &[["b", "c"]]);
        assert_eq!(known, "(cut c)(path a b)");
        assert_eq!(unknown, "(cut b)(path a c)(path b c)");
    }
}

#[test]
fn a_quantifier_may_hide_a_parameter() {
    let rules = "(:derived (cut ?x - node) (and (edge ?x ?x)
        (exists (?x ?y - node) (and (edge ?x ?y) (not (= ?x ?y))))))";
    // No rule says anything of `path`, so it stays as it was.
    assert_eq!(derived(rules, &[["a", "a"]], &[]).0, "(path c c)");
    assert_eq!(derived(rules, &[["a", "a"], ["b", "c"]], &[]).0, "(cut a)(path c c)");
}

#[test]
fn zero_arity_heads_and_unbound_parameters_work() {
    let rules = "(:derived (any) (exists (?x ?y - node) (edge ?x ?y)))
        (:derived (path ?x ?y - node) (and (any) (not (edge ?x ?y)) (not (edge ?y ?x))))";
    let (known, _) = derived(rules, &[["a", "b"]], &[]);
    let pairs = "(path a a)(path a c)(path b b)(path b c)(path c a)(path c b)(path c c)";
    assert_eq!(known, format!("(any){pairs}"));
}

/// The fixpoint by its definition: every head is asked for under every binding, until nothing rises.
fn by_definition(axioms: &[Axiom], universe: &Universe<'_>, base: &Facts) -> Facts {
    let heads: BTreeSet<&Name> = axioms.iter().map(|a| &a.head.name).collect();
    let mut facts = base.clone();
    facts.known.retain(|atom| !heads.contains(&atom.predicate));
    facts.unknown.retain(|atom| !heads.contains(&atom.predicate));
    for stratum in stratify(axioms).unwrap() {
        let rules: Vec<&Axiom> = stratum.rules.iter().map(|&idx| &axioms[idx]).collect();
        loop {
            let risen = risen(&rules, universe, &facts);
            if risen.is_empty() {
                break;
            }
            for (atom, truth) in risen {
                let truth = truth.max(facts.truth(&atom));
                facts.set(atom, truth);
            }
        }
    }
    facts
}

/// The heads whose rules give them more than the facts do.
fn risen(rules: &[&Axiom], universe: &Universe<'_>, facts: &Facts) -> Vec<(Atom, Truth)> {
    let mut risen = Vec::new();
    for Axiom { head, body } in rules {
        for args in tuples(&head.params, universe) {
            let names = head.params.iter().map(|p| p.name.clone());
            let bindings: Bindings = names.zip(args.iter().cloned()).collect();
            let truth = evaluate(body, &bindings, universe, &|atom| facts.truth(atom));
            let atom = Atom { predicate: head.name.clone(), args };
            if truth > facts.truth(&atom) {
                risen.push((atom, truth));
            }
        }
    }
    risen
}

/// Every way to fill in the parameters.
fn tuples(params: &[Typed], universe: &Universe<'_>) -> Vec<Vec<Name>> {
    params.iter().fold(vec![Vec::new()], |tuples, param| {
        let longer = |tuple: &Vec<Name>| {
            let objects = universe.of(&param.types).cloned();
            objects.map(|o| tuple.iter().cloned().chain([o]).collect()).collect::<Vec<_>>()
        };
        tuples.iter().flat_map(longer).collect()
    })
}

/// Rules over two types, with all that a body may hold.
const RULES: &[&str] = &[
    "(:derived (path ?x ?y - node) (or (edge ?x ?y) (exists (?z - node)
        (and (path ?x ?z) (path ?z ?y)))))",
    "(:derived (path ?x ?y - node) (and (edge ?x ?y) (edge ?y ?x)))",
    "(:derived (path ?x ?y - node) (and (not (edge ?x ?y)) (edge ?y ?y) (edge ?x ?x)))",
    "(:derived (cut ?x - node) (not (exists (?y - node) (path ?x ?y))))",
    "(:derived (cut ?x - node) (forall (?y - leaf) (or (path ?y ?x) (= ?x ?y))))",
    "(:derived (cut ?x - leaf) (and (any) (exists (?x ?y - node) (path ?x ?y))))",
    "(:derived (any) (exists (?x - leaf ?y - node) (and (edge ?x ?y) (not (= ?x a)))))",
    "(:derived (any) (edge a b))",
    "(:derived (far ?x ?y ?z - node) (and (cut ?y) (path ?x ?z)))",
    "(:derived (far ?x ?y ?z - node) (and (path ?x ?x) (imply (path ?y ?z) (any))))",
];

fn domain_with(rules: &str) -> Domain {
    let text = format!(
        "(define (domain d) (:requirements :adl :derived-predicates) (:types leaf - node node)
          (:constants a b - node)
          (:predicates (edge ?x ?y - node) (path ?x ?y - node) (cut ?x - node) (any)
            (far ?x ?y ?z - node))
          {rules})"
    );
    parse_domain(&SourceText::new("d", text)).unwrap_or_else(|e| panic!("{}", e.render())).value
}

proptest! {
    #[test]
    fn joins_compute_what_the_definition_says(
        chosen in proptest::collection::vec(any::<bool>(), RULES.len()),
        edges in proptest::collection::vec(0..4_u8, 16),
    ) {
        let rules = RULES.iter().zip(&chosen).filter(|(_, c)| **c).map(|(r, _)| *r);
        let domain = domain_with(&rules.collect::<String>());
        let leaves = ["c", "d"].map(|name| Typed::new(name, "leaf"));
        let objects: Vec<Typed> = domain.constants.iter().cloned().chain(leaves).collect();
        let universe = Universe { types: &domain.types, objects: &objects };
        let mut base = Facts::default();
        for (idx, truth) in edges.iter().enumerate() {
            let ends = [objects[idx / 4].name.clone(), objects[idx % 4].name.clone()];
            let truth = [Truth::False, Truth::False, Truth::Unknown, Truth::True][*truth as usize];
            base.set(Atom { predicate: "edge".into(), args: ends.to_vec() }, truth);
        }
        let extension = Extension::new(&domain.axioms, &universe, &base);
        let expected = by_definition(&domain.axioms, &universe, &base);
        prop_assert_eq!(&extension.facts(), &expected);
        for atom in expected.known.iter().chain(&expected.unknown) {
            prop_assert_eq!(extension.truth(atom), expected.truth(atom));
        }
    }
}
