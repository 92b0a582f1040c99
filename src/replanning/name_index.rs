//! Finds atoms and steps by their names without walking a tree of names.

use crate::pddl::Name;

/// An index of things that have a name and a list of names: open addressing over their numbers.
///
/// The names stay with their owner, who tells by number whether they are the ones looked for.
#[derive(Debug, Clone)]
pub(super) struct NameIndex {
    /// A number plus one, 0 when free; a power of two long. Only looked up, never iterated.
    slots: Vec<u32>,
}

impl NameIndex {
    /// An index of the things with the given names, numbered from 0.
    pub(super) fn new<'a>(names: impl ExactSizeIterator<Item = (&'a Name, &'a [Name])>) -> Self {
        let mut slots = vec![0_u32; (names.len() * 2).next_power_of_two().max(2)];
        let mask = slots.len() - 1;
        for (number, (head, args)) in (1..).zip(names) {
            let mut slot = hash(head, args) as usize & mask;
            while slots[slot] != 0 {
                slot = (slot + 1) & mask;
            }
            slots[slot] = number;
        }
        Self { slots }
    }

    /// The number under which `is_it` says yes.
    pub(super) fn find(
        &self,
        head: &Name,
        args: &[Name],
        is_it: impl Fn(u32) -> bool,
    ) -> Option<u32> {
        let mask = self.slots.len() - 1;
        let mut slot = hash(head, args) as usize & mask;
        loop {
            match self.slots[slot] {
                0 => return None,
                entry if is_it(entry - 1) => return Some(entry - 1),
                _ => slot = (slot + 1) & mask,
            }
        }
    }
}

/// Multiply-and-fold over the texts, eight bytes at a time.
fn hash(head: &Name, args: &[Name]) -> u64 {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    let fold = |hash: u64, word: u64| {
        let product = u128::from(hash ^ word) * u128::from(FACTOR);
        (product as u64) ^ (product >> 64) as u64
    };
    let text = |hash: u64, name: &Name| {
        let (words, suffix) = name.as_str().as_bytes().as_chunks::<8>();
        let hash = words.iter().fold(hash, |hash, word| fold(hash, u64::from_le_bytes(*word)));
        let suffix = suffix.iter().fold(1_u64, |word, byte| word << 8 | u64::from(*byte));
        fold(hash, suffix)
    };
    args.iter().fold(text(FACTOR, head), text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::Atom;

    #[test]
    fn what_is_in_is_found_and_nothing_else() {
        let name = |i: usize| format!("a_rather_long_object_name_{i}");
        let atoms: Vec<Atom> = (0..400)
            .map(|i| Atom::new("on", &[name(i / 20).as_str(), name(i % 20).as_str()]))
            .chain([Atom::new("on", &[]), Atom::new("o", &["n"]), Atom::new("", &["on"])])
            .collect();
        let index = NameIndex::new(atoms.iter().map(|a| (&a.predicate, a.args.as_slice())));
        let find =
            |a: &Atom| index.find(&a.predicate, &a.args, |number| atoms[number as usize] == *a);
        for (number, atom) in (0..).zip(&atoms) {
            assert_eq!(find(atom), Some(number));
        }
        assert_eq!(find(&Atom::new("on", &["a"])), None);
    }
}
