//! Keys that choose a kind or a part, and the tables that belong to what they choose.
//!
//! What a file says in such a table is said of the kind that is chosen there: `[robot.motion]` of a
//! simulated gripper says nothing of another robot, and the options of one detector are not those of
//! the next. So a layer that chooses another kind starts its tables anew, from the defaults of that
//! kind; a later layer that goes back to the first finds them as they were. A table of a kind that
//! has none is an error, since it would do nothing.

use std::collections::BTreeMap;

use super::tree::{Entry, Tree};

/// A key that chooses, and the tables that belong to its choice.
pub(super) struct Choice {
    /// The key.
    pub(super) key: &'static str,
    /// The table with the options of the chosen part.
    pub(super) options: &'static str,
    /// Below `[options]` of the defaults: where the defaults of these options stand.
    pub(super) role: &'static str,
    /// Other tables.
    others: &'static [&'static str],
}

impl Choice {
    fn tables(&self) -> impl Iterator<Item = &'static str> {
        self.others.iter().copied().chain([self.options])
    }
}

/// Every choice.
pub(super) const CHOICES: &[Choice] = &[
    Choice {
        key: "camera.kind",
        options: "camera.options",
        role: "camera",
        others: &["sim", "fault"],
    },
    Choice { key: "goal.kind", options: "goal.options", role: "goal", others: &[] },
    Choice {
        key: "perception.detector",
        options: "perception.options",
        role: "detector",
        others: &[],
    },
    Choice {
        key: "perception.grounder",
        options: "perception.grounder_options",
        role: "grounder",
        others: &[],
    },
    Choice { key: "planner.name", options: "planner.options", role: "planner", others: &[] },
    Choice {
        key: "robot.kind",
        options: "robot.options",
        role: "robot",
        others: &["robot.motion", "robot.self_filter"],
    },
];

/// Keys of a table of which one group or another is there: a layer that has one of a group takes the
/// place of the others.
const EITHER: &[(&str, &[&[&str]])] =
    &[("perception.exemplar", &[&["folder"], &["image", "boxes", "state", "number"]])];

/// Takes the groups of keys out that a layer above has an alternative for.
pub(super) fn replace_alternatives(tree: &mut Tree, upper: &Tree) {
    for (table, groups) in EITHER {
        let is_there = |key: &&str| upper.get(&format!("{table}.{key}")).is_some();
        let (above, below): (Vec<&[&str]>, Vec<&[&str]>) =
            groups.iter().partition(|group| group.iter().any(is_there));
        if !above.is_empty() {
            for key in below.concat() {
                tree.remove(&format!("{table}.{key}"));
            }
        }
    }
}

/// Tables of kinds that are not chosen at present, by choice, kind and table.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Shelf(BTreeMap<(&'static str, String, &'static str), Entry>);

impl Shelf {
    /// Puts a table away for the time when its kind is chosen.
    pub(super) fn keep(&mut self, choice: &Choice, kind: &str, table: &'static str, entry: Entry) {
        self.0.insert((choice.key, kind.to_owned(), table), entry);
    }

    /// Takes a table that was put away.
    pub(super) fn take(
        &mut self,
        choice: &Choice,
        kind: &str,
        table: &'static str,
    ) -> Option<Entry> {
        self.0.remove(&(choice.key, kind.to_owned(), table))
    }

    /// Changes the tables of a tree for those of the kinds that a layer above it chooses.
    pub(super) fn change(&mut self, tree: &mut Tree, upper: &Tree) {
        for choice in CHOICES {
            let Some(chosen) = upper.string(choice.key).map(str::to_owned) else { continue };
            let before = tree.string(choice.key).unwrap_or_default().to_owned();
            if before == chosen {
                continue;
            }
            for table in choice.tables() {
                if let Some(entry) = tree.remove(table) {
                    self.keep(choice, &before, table, entry);
                }
                if let Some(entry) = self.take(choice, &chosen, table) {
                    tree.insert(table, entry);
                }
            }
        }
    }
}
