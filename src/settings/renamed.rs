//! Keys that have a new name: the old one is still read, with a warning that names the new one. And keys that
//! there are no more.

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
    Renamed::seconds("limits.looks_max", "limits.observing_s_max"),
    Renamed::seconds("limits.observations_max", "limits.observing_s_max"),
    Renamed::seconds("limits.unseen_frames_max", "limits.unseen_s_max"),
    Renamed {
        old: "perception.belief.confirm_frames",
        new: "perception.belief.confirm_s",
        // The first frame of several counts for no time.
        value: |node| seconds_of(node, 1.0),
    },
    Renamed::seconds("perception.belief.hidden_frames_max", "perception.belief.hidden_s_max"),
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

/// Keys that there are no more: what is written instead.
const REMOVED: &[(&str, &str)] = &[(
    "panic",
    "there is no such table any more: write [[fault]] with message = \"planner\", nth = 40, and \
     action = { kind = \"panic\" }",
)];

impl Renamed {
    const fn same(old: &'static str, new: &'static str) -> Self {
        Self { old, new, value: |node| Some(node.clone()) }
    }

    /// A number of frames that is a time now.
    const fn seconds(old: &'static str, new: &'static str) -> Self {
        Self { old, new, value: |node| seconds_of(node, 0.0) }
    }
}

/// Numbers of frames are times at this rate, which is that of the shipped run files.
const FRAMES_HZ: f64 = 10.0;

/// The time of a number of frames, of which some count for none.
fn seconds_of(node: &Node, n_free: f64) -> Option<Node> {
    match node {
        Node::Leaf(toml::Value::Integer(frames)) => {
            let frames = (*frames as f64 - n_free).max(0.0);
            Some(Node::Leaf(toml::Value::Float(frames / FRAMES_HZ)))
        }
        Node::Leaf(_) | Node::Array(_) | Node::Table(_) => None,
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
    for (old, message) in REMOVED {
        let Some(Entry { key, .. }) = here(old).and_then(|old| tree.remove(old)) else { continue };
        problems.push(SettingsProblem::at(sources, &key, old, (*message).to_owned()));
    }
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
