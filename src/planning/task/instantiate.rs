//! Finds the argument tuples of an action of which some preconditions hold.

use std::collections::{BTreeMap, BTreeSet};

use super::TaskError;
use super::ground::Grounder;
use super::lowering::{Lifted, SlotAtom, SlotCondition, SlotTerm};
use super::predicate_kind::PredicateKind;
use super::seeds::Seed;

/// The true tuples of one predicate.
#[derive(Debug, Default)]
pub(super) struct Relation {
    tuples: Vec<Vec<u32>>,
    /// Tuples by (place, object).
    by_arg: BTreeMap<(usize, u32), Vec<usize>>,
}

impl Relation {
    /// Adds a true tuple.
    pub(super) fn push(&mut self, tuple: Vec<u32>) {
        for (place, &object) in tuple.iter().enumerate() {
            self.by_arg.entry((place, object)).or_default().push(self.tuples.len());
        }
        self.tuples.push(tuple);
    }

    /// Tuples that may match an atom of which the given places are known: the shortest list.
    fn candidates(&self, known: &[Option<u32>]) -> Candidates<'_> {
        let lists = known.iter().enumerate().filter_map(|(place, object)| {
            object.map(|o| self.by_arg.get(&(place, o)).map_or(&[][..], Vec::as_slice))
        });
        lists.min_by_key(|l| l.len()).map_or(Candidates::All(self.tuples.len()), Candidates::Some)
    }
}

/// Which tuples of a relation to look at.
enum Candidates<'a> {
    All(usize),
    Some(&'a [usize]),
}

impl Candidates<'_> {
    fn len(&self) -> usize {
        match self {
            Self::All(n) => *n,
            Self::Some(list) => list.len(),
        }
    }

    fn get(&self, idx: usize) -> usize {
        match self {
            Self::All(_) => idx,
            Self::Some(list) => list[idx],
        }
    }
}

/// What a schema's arguments are joined by: made once, used for many seeds.
pub(super) struct Schema<'a> {
    params: &'a [Vec<u32>],
    /// Whether object `o` may stand for parameter `p`, at `[p][o]`.
    allowed: Vec<Vec<bool>>,
    /// The atoms among the top-level conjuncts of the precondition that are joined.
    atoms: Vec<&'a SlotAtom>,
}

/// A join of an action's parameters with the relations of what holds.
struct Join<'a, 'g, 'r> {
    schema: &'r Schema<'a>,
    relations: &'r [Relation],
    grounder: &'r mut Grounder<'g>,
    binding: Vec<Option<u32>>,
    tuples: Vec<Vec<u32>>,
}

impl<'a> Schema<'a> {
    /// Joins by the atoms of static predicates and, with `fluents`, those of predicates that actions
    /// change.
    pub(super) fn new<T>(lifted: &'a Lifted<T>, grounder: &Grounder<'_>, fluents: bool) -> Self {
        let mut atoms = Vec::new();
        let joins =
            |kind| kind == PredicateKind::Static || fluents && kind == PredicateKind::Fluent;
        conjuncts(&lifted.condition, &mut |atom| {
            if joins(grounder.kind(atom.predicate)) {
                atoms.push(atom);
            }
        });
        let n_objects = lifted.params.iter().flatten().max().map_or(0, |&o| o as usize + 1);
        let allowed = lifted.params.iter().map(|range| {
            let mut allowed = vec![false; n_objects];
            for &object in range {
                allowed[object as usize] = true;
            }
            allowed
        });
        Self { params: &lifted.params, allowed: allowed.collect(), atoms }
    }

    /// The atoms that are joined.
    pub(super) fn atoms(&self) -> &[&'a SlotAtom] {
        &self.atoms
    }

    /// Every argument tuple that extends the seed and under which the joined atoms hold.
    pub(super) fn extensions(
        &self,
        seed: &Seed,
        relations: &[Relation],
        grounder: &mut Grounder<'_>,
    ) -> Result<Vec<Vec<u32>>, TaskError> {
        let mut bound = seed.iter().enumerate().filter_map(|(slot, o)| o.map(|o| (slot, o)));
        if !bound.all(|(slot, object)| self.allows(slot, object)) {
            return Ok(Vec::new());
        }
        let (binding, tuples) = (seed.clone(), Vec::new());
        let mut join = Join { schema: self, relations, grounder, binding, tuples };
        join.extend(&mut self.atoms.clone())?;
        Ok(join.tuples)
    }

    /// Whether the object may stand for the parameter.
    fn allows(&self, param: usize, object: u32) -> bool {
        self.allowed[param].get(object as usize).is_some_and(|allowed| *allowed)
    }
}

/// Every argument tuple that extends one of the seeds and under which the conjunction of positive
/// static preconditions holds, in lexicographic order.
pub(super) fn instances<T>(
    lifted: &Lifted<T>,
    seeds: &BTreeSet<Seed>,
    relations: &[Relation],
    grounder: &mut Grounder<'_>,
) -> Result<Vec<Vec<u32>>, TaskError> {
    let schema = Schema::new(lifted, grounder, false);
    let mut tuples = Vec::new();
    for seed in seeds {
        tuples.extend(schema.extensions(seed, relations, grounder)?);
    }
    tuples.sort_unstable();
    tuples.dedup();
    Ok(tuples)
}

/// Visits the atoms among the top-level conjuncts.
fn conjuncts<'a>(condition: &'a SlotCondition, visit: &mut impl FnMut(&'a SlotAtom)) {
    if let SlotCondition::And(parts) = condition {
        for part in parts {
            conjuncts(part, visit);
        }
    } else if let SlotCondition::Atom(atom) = condition {
        visit(atom);
    }
}

impl<'a> Join<'a, '_, '_> {
    fn known(&self, atom: &SlotAtom) -> Vec<Option<u32>> {
        let known = atom.args.iter().map(|arg| match arg {
            SlotTerm::Slot(slot) => self.binding[*slot],
            SlotTerm::Object(object) => Some(*object),
        });
        known.collect()
    }

    /// Extends the binding by one joined atom, or by one parameter once no atom is left.
    fn extend(&mut self, open: &mut Vec<&'a SlotAtom>) -> Result<(), TaskError> {
        self.grounder.step()?;
        let relations = self.relations;
        let matches = |atom: &SlotAtom| {
            relations[atom.predicate as usize].candidates(&self.known(atom)).len()
        };
        let next = (0..open.len()).min_by_key(|&idx| matches(open[idx]));
        let Some(next) = next else { return self.extend_by_param() };
        let atom = open.remove(next);
        let relation = &relations[atom.predicate as usize];
        let known = self.known(atom);
        let candidates = relation.candidates(&known);
        for idx in 0..candidates.len() {
            self.grounder.step()?;
            let tuple = &relation.tuples[candidates.get(idx)];
            let before = self.binding.clone();
            if self.unify(atom, tuple) {
                self.extend(open)?;
            }
            self.binding = before;
        }
        open.insert(next, atom);
        Ok(())
    }

    fn unify(&mut self, atom: &SlotAtom, tuple: &[u32]) -> bool {
        atom.args.iter().zip(tuple).all(|(arg, &value)| match *arg {
            SlotTerm::Object(object) => object == value,
            SlotTerm::Slot(slot) => {
                let bound = *self.binding[slot].get_or_insert(value);
                bound == value && self.schema.allows(slot, value)
            }
        })
    }

    fn extend_by_param(&mut self) -> Result<(), TaskError> {
        let Some(param) = self.binding.iter().position(Option::is_none) else {
            self.tuples.push(self.binding.iter().map(|b| b.unwrap_or_default()).collect());
            return Ok(());
        };
        let params = self.schema.params;
        for &value in &params[param] {
            self.grounder.step()?;
            self.binding[param] = Some(value);
            self.extend_by_param()?;
        }
        self.binding[param] = None;
        Ok(())
    }
}

/// Binds the first slots to an argument tuple.
pub(super) fn binding_of(args: &[u32], n_slots: usize) -> Vec<u32> {
    let mut binding = vec![0; n_slots];
    binding[..args.len()].copy_from_slice(args);
    binding
}
