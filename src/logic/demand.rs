//! Derived atoms on demand: only what a question needs is computed.

use std::cell::RefCell;
use std::collections::BTreeMap;

use super::semantics::{Universe, evaluate};
use super::variables::Bindings;
use super::{Facts, Truth};
use crate::pddl::strata::stratify;
use crate::pddl::{Atom, Axiom, Name};

/// The truth of atoms in a state completed by rules, as [`derive()`](super::derive()) would give it, but
/// computed for the asked atoms and what they depend on alone.
#[derive(Debug)]
pub struct Demand<'a> {
    axioms: &'a [Axiom],
    universe: Universe<'a>,
    base: &'a Facts,
    /// Stratum of each head; heads of one stratum may depend on each other.
    strata: BTreeMap<&'a Name, usize>,
    known: RefCell<BTreeMap<Atom, Truth>>,
}

impl<'a> Demand<'a> {
    /// What `base` says of the rules' head predicates is not used. Rules that are not stratified
    /// count as one stratum; the parser refuses such rules.
    pub fn new(axioms: &'a [Axiom], universe: Universe<'a>, base: &'a Facts) -> Self {
        let heads = axioms.iter().map(|axiom| (&axiom.head.name, 0));
        let mut strata: BTreeMap<&Name, usize> = heads.collect();
        for (level, stratum) in stratify(axioms).unwrap_or_default().into_iter().enumerate() {
            for rule in stratum.rules {
                strata.insert(&axioms[rule].head.name, level);
            }
        }
        Self { axioms, universe, base, strata, known: RefCell::new(BTreeMap::new()) }
    }

    /// The truth value of any atom.
    pub fn truth(&self, atom: &Atom) -> Truth {
        if !self.strata.contains_key(&atom.predicate) {
            return self.base.truth(atom);
        }
        let known = self.known.borrow().get(atom).copied();
        known.unwrap_or_else(|| self.solve(atom))
    }

    /// Computes an atom with the atoms of its stratum that it depends on: all start as false and
    /// rise together until nothing changes. Lower strata are finished before they are looked at.
    fn solve(&self, atom: &Atom) -> Truth {
        let stratum = self.strata.get(&atom.predicate);
        let table = RefCell::new(BTreeMap::from([(atom.clone(), Truth::False)]));
        loop {
            let asked = table.borrow().len();
            let truth = |other: &Atom| {
                let open = self.strata.get(&other.predicate) == stratum
                    && !self.known.borrow().contains_key(other);
                if open {
                    *table.borrow_mut().entry(other.clone()).or_insert(Truth::False)
                } else {
                    self.truth(other)
                }
            };
            let mut changed = false;
            let before: Vec<(Atom, Truth)> =
                table.borrow().iter().map(|(atom, value)| (atom.clone(), *value)).collect();
            for (atom, value) in before.into_iter().filter(|(_, value)| !value.is_true()) {
                let risen = self.rules_say(&atom, &truth);
                if risen > value {
                    table.borrow_mut().insert(atom, risen);
                    changed = true;
                }
            }
            if !changed && table.borrow().len() == asked {
                break;
            }
        }
        let table = table.into_inner();
        let value = table.get(atom).copied().unwrap_or(Truth::False);
        self.known.borrow_mut().extend(table);
        value
    }

    /// The largest value that a rule gives to a head.
    fn rules_say(&self, atom: &Atom, truth: &dyn Fn(&Atom) -> Truth) -> Truth {
        let mut value = Truth::False;
        for axiom in self.axioms.iter().filter(|a| a.head.name == atom.predicate) {
            let params = &axiom.head.params;
            let fits = params.len() == atom.args.len()
                && params.iter().zip(&atom.args).all(|(p, arg)| self.universe.has(arg, &p.types));
            if fits && !value.is_true() {
                let names = params.iter().map(|p| p.name.clone());
                let bindings: Bindings = names.zip(atom.args.iter().cloned()).collect();
                value = value.max(evaluate(&axiom.body, &bindings, &self.universe, truth));
            }
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::logic::derive;
    use crate::pddl::{SourceText, Typed, parse_domain};

    const DOMAIN: &str = "(define (domain d) (:requirements :adl :derived-predicates) (:types node)
      (:predicates (edge ?x ?y - node) (path ?x ?y - node) (cut ?x - node) (odd ?x ?y - node)
        (even ?x ?y - node) (any))
      (:derived (path ?x ?y - node) (or (edge ?x ?y)
        (exists (?z - node) (and (edge ?x ?z) (path ?z ?y)))))
      (:derived (odd ?x ?y - node) (edge ?x ?y))
      (:derived (odd ?x ?y - node) (exists (?z - node) (and (even ?x ?z) (edge ?z ?y))))
      (:derived (even ?x ?y - node) (exists (?z - node) (and (odd ?x ?z) (edge ?z ?y))))
      (:derived (cut ?x - node) (forall (?y - node) (or (= ?x ?y) (not (path ?x ?y)))))
      (:derived (any) (exists (?x ?y - node) (and (odd ?x ?y) (not (cut ?y)) (not (= ?x ?y))))))";

    proptest! {
        #[test]
        fn one_atom_at_a_time_agrees_with_the_whole(
            values in prop::collection::vec(0..4_u8, 16), order in any::<bool>(),
        ) {
            let domain = parse_domain(&SourceText::new("d", DOMAIN)).unwrap().value;
            let names = ["a", "b", "c", "d"];
            let objects = names.map(|name| Typed::new(name, "node"));
            let universe = Universe { types: &domain.types, objects: &objects };
            let mut base = Facts::default();
            let pairs = names.iter().flat_map(|x| names.iter().map(move |y| [*x, *y]));
            let pairs: Vec<[&str; 2]> = pairs.collect();
            for (pair, value) in pairs.iter().zip(values) {
                let truth = [Truth::False, Truth::False, Truth::True, Truth::Unknown];
                base.set(Atom::new("edge", pair), truth[usize::from(value)]);
            }
            let whole = derive(&domain.axioms, &universe, &base);
            let demand = Demand::new(&domain.axioms, universe, &base);
            let mut atoms: Vec<Atom> = ["edge", "path", "odd", "even"]
                .iter()
                .flat_map(|p| pairs.iter().map(|pair| Atom::new(p, pair)))
                .chain(names.iter().map(|n| Atom::new("cut", &[n])))
                .chain([Atom::new("any", &[])])
                .collect();
            if order {
                atoms.reverse();
            }
            for atom in atoms {
                prop_assert_eq!(demand.truth(&atom), whole.truth(&atom), "{}", atom);
            }
        }
    }
}
