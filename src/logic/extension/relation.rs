//! The tuples of one predicate, by number of the object.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use hashbrown::HashTable;

use crate::logic::Truth;

/// The tuples of one predicate that are true or unknown. A tuple's row never changes.
#[derive(Debug, Clone, Default)]
pub(super) struct Relation {
    arity: usize,
    /// Row by row.
    args: Vec<u32>,
    truths: Vec<Truth>,
    /// Every row by its tuple; made when first asked for. Looked up, never iterated.
    rows: OnceCell<HashTable<u32>>,
    /// Rows by what stands at some places; see [`Relation::group`].
    groups: BTreeMap<Vec<usize>, Groups>,
}

/// Rows that have the same objects at certain places.
#[derive(Debug, Clone, Default)]
struct Groups {
    table: HashTable<Vec<u32>>,
    /// How many rows have been sorted in.
    n_rows: usize,
}

impl Relation {
    pub(super) fn new(arity: usize) -> Self {
        Self { arity, ..Self::default() }
    }

    /// How many rows there are.
    pub(super) fn len(&self) -> usize {
        self.truths.len()
    }

    /// The tuple of a row.
    pub(super) fn tuple(&self, row: usize) -> &[u32] {
        &self.args[row * self.arity..(row + 1) * self.arity]
    }

    /// The truth value of a row.
    pub(super) fn truth_of_row(&self, row: usize) -> Truth {
        self.truths[row]
    }

    /// The truth value of a tuple.
    pub(super) fn truth(&self, tuple: &[u32]) -> Truth {
        let rows = self.rows.get_or_init(|| self.sorted_rows());
        let row = rows.find(hash(tuple.iter()), |&row| self.tuple(row as usize) == tuple);
        row.map_or(Truth::False, |&row| self.truths[row as usize])
    }

    fn sorted_rows(&self) -> HashTable<u32> {
        let hash_of = |row: &u32| hash(self.tuple(*row as usize).iter());
        let mut rows = HashTable::with_capacity(self.len());
        for row in 0..self.len() as u32 {
            rows.insert_unique(hash_of(&row), row, hash_of);
        }
        rows
    }

    /// Adds a tuple that is not there yet.
    pub(super) fn push_new(&mut self, tuple: &[u32], truth: Truth) {
        let row = self.len() as u32;
        self.args.extend_from_slice(tuple);
        self.truths.push(truth);
        let (args, arity) = (&self.args, self.arity);
        let of_row = |row: &u32| hash(args[*row as usize * arity..][..arity].iter());
        if let Some(rows) = self.rows.get_mut() {
            rows.insert_unique(hash(tuple.iter()), row, of_row);
        }
    }

    /// Gives a tuple at least a truth value; returns whether that is news.
    pub(super) fn raise(&mut self, tuple: &[u32], truth: Truth) -> bool {
        let rows = self.rows.get_or_init(|| self.sorted_rows());
        let row = rows.find(hash(tuple.iter()), |&row| self.tuple(row as usize) == tuple).copied();
        match row {
            None => {
                self.push_new(tuple, truth);
                true
            }
            Some(row) if self.truths[row as usize] < truth => {
                self.truths[row as usize] = truth;
                true
            }
            Some(_) => false,
        }
    }

    /// Prepares [`Relation::group`] for some places.
    pub(super) fn index(&mut self, places: &[usize]) {
        let (args, arity, n_rows) = (&self.args, self.arity, self.truths.len());
        let at = |row: usize, place: usize| &args[row * arity + place];
        let groups = self.groups.entry(places.to_vec()).or_default();
        for row in groups.n_rows..n_rows {
            let key = hash(places.iter().map(|&place| at(row, place)));
            let same = |rows: &Vec<u32>| {
                places.iter().all(|&place| at(rows[0] as usize, place) == at(row, place))
            };
            let hash_of =
                |rows: &Vec<u32>| hash(places.iter().map(|&place| at(rows[0] as usize, place)));
            match groups.table.find_mut(key, same) {
                Some(rows) => rows.push(row as u32),
                None => {
                    groups.table.insert_unique(key, vec![row as u32], hash_of);
                }
            }
        }
        groups.n_rows = n_rows;
    }

    /// The rows with the given objects at the given places; [`Relation::index`] comes first.
    pub(super) fn group(&self, places: &[usize], objects: &[u32]) -> &[u32] {
        let same = |rows: &Vec<u32>| {
            let tuple = self.tuple(rows[0] as usize);
            places.iter().zip(objects).all(|(&place, object)| tuple[place] == *object)
        };
        let groups = self.groups.get(places);
        let rows = groups.and_then(|g| g.table.find(hash(objects.iter()), same));
        rows.map_or(&[], Vec::as_slice)
    }
}

/// The same on every run: `DefaultHasher::new` has fixed keys.
fn hash<'a>(objects: impl Iterator<Item = &'a u32>) -> u64 {
    let mut hasher = DefaultHasher::new();
    objects.for_each(|object| object.hash(&mut hasher));
    hasher.finish()
}
