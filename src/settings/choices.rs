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
    /// The tables.
    pub(super) tables: &'static [&'static str],
    /// Below `[options]` of the defaults: where the defaults of the chosen part's options stand.
    pub(super) role: Option<&'static str>,
}

/// Every choice.
pub(super) const CHOICES: &[Choice] = &[
    Choice { key: "camera.kind", tables: &["sim", "fault", "camera.options"], role: None },
    Choice { key: "goal.kind", tables: &["goal.options"], role: Some("goal") },
    Choice { key: "perception.detector", tables: &["perception.options"], role: Some("detector") },
    Choice {
        key: "perception.grounder",
        tables: &["perception.grounder_options"],
        role: Some("grounder"),
    },
    Choice { key: "planner.name", tables: &["planner.options"], role: Some("planner") },
    Choice {
        key: "robot.kind",
        tables: &["robot.motion", "robot.self_filter", "robot.options"],
        role: None,
    },
];

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
            for table in choice.tables {
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
