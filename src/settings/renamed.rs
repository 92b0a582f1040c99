//! Keys that have a new name: the old one is still read, with a warning that names the new one.

use toml::Spanned;

use super::problem::SettingsProblem;
use super::sources::Sources;
use super::tree::{Entry, Node, Tree, Value};

/// A key that was called otherwise.
struct Renamed {
    old: &'static str,
    new: &'static str,
    /// What a value of the old key is under the new one.
    value: fn(&Node) -> Option<Node>,
}

/// Every renamed key, in the order of the old names.
const RENAMED: &[Renamed] = &[
    Renamed::same("goal.options.cache", "services.answers"),
    Renamed::same("goal.options.patience", "goal.options.retry"),
    Renamed::same("limits.late_plans_max", "limits.planner_timeouts_max"),
    Renamed::same("limits.looks_max", "limits.observations_max"),
    Renamed {
        old: "perception.beside",
        new: "perception.detector_mode",
        value: |node| match node {
            Node::Leaf(toml::Value::Boolean(is_beside)) => {
                let mode = if *is_beside { "async" } else { "sync" };
                Some(Node::Leaf(toml::Value::String(mode.to_owned())))
            }
            Node::Leaf(_) | Node::Array(_) | Node::Table(_) => None,
        },
    },
    Renamed::same("perception.options.patience", "perception.options.retry"),
    Renamed::same("robot.hull", "robot.self_filter"),
    Renamed::same("robot.motion.look_poses", "robot.motion.view_poses"),
];

impl Renamed {
    const fn same(old: &'static str, new: &'static str) -> Self {
        Self { old, new, value: |node| Some(node.clone()) }
    }
}

/// Gives every key of a layer its present name. `within` is the table that the layer is of, with a
/// point behind it; empty for a whole file.
pub(super) fn rename(
    tree: &mut Tree,
    within: &str,
    sources: &Sources,
    problems: &mut Vec<SettingsProblem>,
) {
    let here = |key: &'static str| key.strip_prefix(within);
    for Renamed { old, new, value } in RENAMED {
        let Some(old_here) = here(old) else { continue };
        let Some(Entry { key, value: found }) = tree.remove(old_here) else { continue };
        let Some(new_here) = here(new) else {
            let message = format!("renamed, and not of this table any more: write {new}");
            problems.push(SettingsProblem::at(sources, &key, old, message));
            continue;
        };
        if tree.get(new_here).is_some() {
            let message = format!("this is the old name of {new}, which is here too");
            problems.push(SettingsProblem::at(sources, &key, old, message));
            continue;
        }
        let Some(node) = value(found.get_ref()) else {
            let message = format!("expected true or false (its new name is {new})");
            problems.push(SettingsProblem::at(sources, &found.span(), old, message));
            continue;
        };
        let message = match shown(&node) {
            Some(text) if node != *found.get_ref() => format!("renamed: write {new} = {text}"),
            Some(_) | None => format!("renamed: write {new}"),
        };
        problems.push(SettingsProblem::at(sources, &key, old, message).warning());
        let value: Value = Spanned::new(found.span(), node);
        tree.insert(new_here, Entry { key, value });
    }
}

fn shown(node: &Node) -> Option<String> {
    match node {
        Node::Leaf(value) => Some(value.to_string()),
        Node::Array(_) | Node::Table(_) => None,
    }
}
