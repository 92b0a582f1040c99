//! Everything that rules derive from some facts: joins over tuples of numbers.
//!
//! Source: Ullman: Principles of Database and Knowledge-Base Systems, 1988, chapter 3 (bottom-up
//! evaluation); Thiébaux, Hoffmann, Nebel: In defense of PDDL axioms, 2005 (strata).

mod join;
mod relation;
mod rule;

use std::collections::BTreeMap;

use super::{Facts, Truth, Universe};
use crate::pddl::strata::{Stratum, stratify};
use crate::pddl::{Atom, Axiom, Name};
use join::{Heads, heads, known_places};
use relation::Relation;
use rule::{Rule, Step};

/// Facts completed by rules.
///
/// Whatever the facts say of a head predicate is dropped. The rules may be recursive; a head holds
/// only where the rules make it so (least fixpoint, stratum by stratum), and is unknown where that
/// depends on unknown facts. Rules that are not stratified are computed as one stratum; the parser
/// refuses such rules.
#[derive(Debug)]
pub struct Extension {
    symbols: Symbols,
    relations: Vec<Relation>,
}

/// Numbers for objects and relations.
#[derive(Debug, Default)]
struct Symbols {
    /// By number.
    objects: Vec<Name>,
    object_ids: BTreeMap<Name, u32>,
    /// Predicate and number of arguments of each relation.
    relations: Vec<(Name, usize)>,
    /// Relations of each predicate, by number of arguments.
    relation_ids: BTreeMap<Name, BTreeMap<usize, usize>>,
}

impl Symbols {
    fn object(&mut self, name: &Name) -> u32 {
        if let Some(&id) = self.object_ids.get(name) {
            return id;
        }
        let id = self.objects.len() as u32;
        self.objects.push(name.clone());
        self.object_ids.insert(name.clone(), id);
        id
    }

    fn known_object(&self, name: &Name) -> Option<u32> {
        self.object_ids.get(name).copied()
    }

    fn relation(&mut self, predicate: &Name, arity: usize) -> usize {
        if let Some(id) = self.known_relation(predicate, arity) {
            return id;
        }
        let id = self.relations.len();
        self.relations.push((predicate.clone(), arity));
        self.relation_ids.entry(predicate.clone()).or_default().insert(arity, id);
        id
    }

    fn known_relation(&self, predicate: &Name, arity: usize) -> Option<usize> {
        self.relation_ids.get(predicate)?.get(&arity).copied()
    }
}

impl Extension {
    /// Completes `base`.
    pub fn new(axioms: &[Axiom], universe: &Universe<'_>, base: &Facts) -> Self {
        let mut symbols = Symbols::default();
        for object in universe.objects {
            symbols.object(&object.name);
        }
        let rules: Vec<Rule> = axioms.iter().map(|axiom| Rule::new(axiom, &mut symbols)).collect();
        let mut extension = Self { symbols, relations: Vec::new() };
        let is_head = |predicate: &Name| axioms.iter().any(|axiom| axiom.head.name == *predicate);
        let known = base.known.iter().map(|atom| (atom, Truth::True));
        let unknown = base.unknown.iter().map(|atom| (atom, Truth::Unknown));
        for (atom, truth) in known.chain(unknown) {
            if !is_head(&atom.predicate) {
                extension.insert(atom, truth);
            }
        }
        extension.fit();
        let one_stratum = |_| vec![Stratum { rules: (0..axioms.len()).collect(), recursive: true }];
        for stratum in stratify(axioms).unwrap_or_else(one_stratum) {
            let rules: Vec<&Rule> = stratum.rules.iter().map(|&idx| &rules[idx]).collect();
            // Values only rise, from false over unknown to true, so this comes to an end.
            while extension.pass(&rules, universe) && stratum.recursive {}
        }
        extension
    }

    fn insert(&mut self, atom: &Atom, truth: Truth) {
        let relation = self.symbols.relation(&atom.predicate, atom.args.len());
        let tuple: Vec<u32> = atom.args.iter().map(|arg| self.symbols.object(arg)).collect();
        self.fit();
        self.relations[relation].push_new(&tuple, truth);
    }

    /// Makes the relations that have been named.
    fn fit(&mut self) {
        let missing = self.symbols.relations.iter().skip(self.relations.len());
        self.relations.extend(missing.map(|(_, arity)| Relation::new(*arity)));
    }

    /// Applies each rule once to the facts as they are; returns whether anything rose.
    fn pass(&mut self, rules: &[&Rule], universe: &Universe<'_>) -> bool {
        for step in rules.iter().flat_map(|rule| &rule.steps) {
            if let Step::Match(pattern) = step {
                let places = known_places(step);
                if !places.is_empty() {
                    self.relations[pattern.relation].index(&places);
                }
            }
        }
        let given: Vec<Heads> = rules.iter().map(|rule| heads(rule, self, universe)).collect();
        let mut risen = false;
        for (rule, heads) in rules.iter().zip(&given) {
            let head = &mut self.relations[rule.head];
            let is_new = head.len() == 0 && rule.is_injective();
            for (idx, &truth) in heads.truths.iter().enumerate() {
                let tuple = &heads.args[idx * rule.n_params..(idx + 1) * rule.n_params];
                if is_new {
                    head.push_new(tuple, truth);
                    risen = true;
                } else {
                    risen |= head.raise(tuple, truth);
                }
            }
        }
        risen
    }

    /// The truth value of an atom.
    pub fn truth(&self, atom: &Atom) -> Truth {
        let Some(relation) = self.symbols.known_relation(&atom.predicate, atom.args.len()) else {
            return Truth::False;
        };
        let tuple = atom.args.iter().map(|arg| self.symbols.known_object(arg));
        let tuple: Option<Vec<u32>> = tuple.collect();
        tuple.map_or(Truth::False, |tuple| self.relations[relation].truth(&tuple))
    }

    /// How many atoms of a predicate are true or unknown.
    pub fn len_of(&self, predicate: &Name) -> usize {
        let relations = self.symbols.relation_ids.get(predicate).into_iter();
        relations.flat_map(BTreeMap::values).map(|&id| self.relations[id].len()).sum()
    }

    /// The completed facts.
    pub fn facts(&self) -> Facts {
        let (mut known, mut unknown) = (Vec::new(), Vec::new());
        for (relation, (predicate, _)) in self.relations.iter().zip(&self.symbols.relations) {
            for row in 0..relation.len() {
                let object = |&id: &u32| self.symbols.objects[id as usize].clone();
                let args = relation.tuple(row).iter().map(object).collect();
                let atom = Atom { predicate: predicate.clone(), args };
                match relation.truth_of_row(row) {
                    Truth::True => known.push(atom),
                    Truth::Unknown => unknown.push(atom),
                    Truth::False => {}
                }
            }
        }
        Facts { known: known.into_iter().collect(), unknown: unknown.into_iter().collect() }
    }
}

/// The facts with every head predicate of `axioms` recomputed from the rest; see [`Extension`].
pub fn derive(axioms: &[Axiom], universe: &Universe<'_>, base: &Facts) -> Facts {
    if axioms.is_empty() {
        return base.clone();
    }
    Extension::new(axioms, universe, base).facts()
}

#[cfg(test)]
mod tests;
