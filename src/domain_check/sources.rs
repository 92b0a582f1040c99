//! Where types and predicates come from: what nobody sees, and what nobody ever says to hold.

use std::collections::BTreeSet;

use super::folder_files::FolderFiles;
use super::{DomainFinding, DomainFindingKind};
use crate::pddl::Name;
use crate::perception::model::Perception;

const FILE: &str = "perception.toml";

pub(super) fn check(files: &FolderFiles<'_>, findings: &mut Vec<DomainFinding>) {
    let Some(perception) = &files.perception else { return };
    types(files, perception, findings);
    predicates(files, perception, findings);
}

/// The types that objects have: those without another one below them.
fn leaf_types(files: &FolderFiles<'_>) -> Vec<Name> {
    let types = &files.domain.types;
    let is_parent = |name: &Name| types.parents.values().any(|parents| parents.contains(name));
    let known = files.domain.known_types().into_iter();
    known.filter(|name| *name != "object" && !is_parent(name)).collect()
}

fn types(files: &FolderFiles<'_>, perception: &Perception, findings: &mut Vec<DomainFinding>) {
    let implied = perception.implied.iter().map(|implied| &implied.type_name);
    let constants = files.domain.constants.iter().flat_map(|constant| &constant.types);
    let known: BTreeSet<&Name> =
        perception.types.iter().map(|spec| &spec.name).chain(implied).chain(constants).collect();
    for name in leaf_types(files).iter().filter(|name| !known.contains(name)) {
        findings.push(files.finding(
            DomainFindingKind::TypeWithoutLook,
            (FILE, "type"),
            format!(
                "nothing says how objects of the type {name} look, so none is ever seen: add a [[type]] with name = \
                 \"{name}\", or an [[implied]] object of it if it is always there and never seen"
            ),
        ));
    }
    for spec in perception.types.iter().filter(|spec| spec.appearance.is_none()) {
        if files.is_simulated {
            let name = &spec.name;
            findings.push(files.finding(
                DomainFindingKind::TypeWithoutLook,
                (FILE, format!("type.{name}.appearance")),
                format!(
                    "the colour detector does not look for objects of the type {name} without it: add \
                     [type.appearance] with shape and sizes"
                ),
            ));
        }
    }
}

fn predicates(files: &FolderFiles<'_>, perception: &Perception, findings: &mut Vec<DomainFinding>) {
    let axioms: BTreeSet<&Name> =
        files.domain.axioms.iter().map(|axiom| &axiom.head.name).collect();
    let rules: BTreeSet<&Name> = files.rules.iter().map(|rule| &rule.head.name).collect();
    let own = perception.proprioceptive.iter().map(|spec| &spec.predicate);
    let known = perception.observed_predicates().chain(own).chain(&perception.completed);
    let known: BTreeSet<&Name> = known.chain(axioms).collect();
    for name in files.domain.predicates.iter().map(|p| &p.name).filter(|name| !known.contains(name))
    {
        findings.push(files.finding(
            DomainFindingKind::PredicateWithoutSource,
            (FILE, "observed"),
            format!(
                "nobody ever says that {name} holds: add it to [[observed]] (judged from the image), \
                 [[proprioceptive]] (read off the gripper) or completed (a rule of completion.pddl)"
            ),
        ));
    }
    for name in perception.completed.iter().filter(|name| !rules.contains(name)) {
        findings.push(files.finding(
            DomainFindingKind::CompletedWithoutRule,
            ("completion.pddl", name.as_str()),
            format!(
                "{FILE} lists {name} as completed, and no rule completes it: add (:derived ({name} …) …), \
                 or take it out of the list"
            ),
        ));
    }
}
