//! Whether a goal really holds, for scoring an episode that has ended.
//!
//! Objects that look alike bear the names that the tracker has given them, and nobody can tell which
//! of the simulator's bodies those are. So the goal holds when it does under one of the ways to name
//! them.

use crate::hardware::GroundTruth;
use crate::logic::{Bindings, Facts, Universe, evaluate};
use crate::pddl::{Atom, Axiom, Condition, Domain, Name, Typed};
use crate::perception::model::Perception;
use crate::perception::{GripperContent, complete, merged, proprioception};

/// Most ways to name look-alikes that are tried: eight of one kind have 40 320.
const NAMINGS_MAX: u32 = 50_000;

/// What the truth is told in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Words<'a> {
    /// The domain.
    pub(super) domain: &'a Domain,
    /// Which of its predicates the robot tells of itself.
    pub(super) perception: &'a Perception,
    /// Its completion rules.
    pub(super) rules: &'a [Axiom],
    /// The objects that are spoken of.
    pub(super) objects: &'a [Typed],
}

impl Words<'_> {
    /// Everything that really holds, with bodies named by `named`: what is observed, what is held, and
    /// what follows.
    fn true_facts(&self, truth: &GroundTruth, named: &Naming<'_>) -> Facts {
        let renamed = |atom: &Atom| Atom {
            predicate: atom.predicate.clone(),
            args: atom.args.iter().map(named).collect(),
        };
        let observed = Facts::new(truth.facts.iter().map(renamed).collect());
        let held = truth.held.as_ref().map(named);
        let gripper = held.map_or(GripperContent::Empty, GripperContent::Holds);
        let told = proprioception(self.domain, self.perception, self.objects, &gripper);
        complete(self.rules, &self.domain.types, self.objects, &merged(observed, told))
    }

    /// Everything that really holds, by the simulator's own names.
    pub(super) fn facts(&self, truth: &GroundTruth) -> Facts {
        self.true_facts(truth, &Name::clone)
    }

    /// Whether a condition really holds, under one of the ways to name what looks alike. `None` when it
    /// holds under none of the first [`NAMINGS_MAX`].
    pub(super) fn really_holds(
        &self,
        condition: &Condition,
        bindings: &Bindings,
        truth: &GroundTruth,
    ) -> Option<bool> {
        let universe = Universe { types: &self.domain.types, objects: self.objects };
        let holds = |named: &Naming<'_>| {
            let facts = self.true_facts(truth, named);
            evaluate(condition, bindings, &universe, &|atom| facts.truth(atom)).is_true()
        };
        let bodies = &truth.look_alikes;
        Namings { bodies, names: bodies.clone(), n_left: NAMINGS_MAX }.any((0, 0), &holds)
    }
}

/// The objects that were seen, and those of the true facts that nobody has seen.
pub(super) fn with_unseen(
    mut objects: Vec<Typed>,
    domain: &Domain,
    truth: &GroundTruth,
) -> Vec<Typed> {
    for atom in &truth.facts {
        let Some(signature) = domain.predicate(atom.predicate.as_str()) else { continue };
        for (name, param) in atom.args.iter().zip(&signature.params) {
            if objects.iter().all(|object| object.name != *name) {
                objects.push(Typed { name: name.clone(), types: param.types.clone() });
            }
        }
    }
    objects
}

/// The name that a body bears.
type Naming<'a> = dyn Fn(&Name) -> Name + 'a;

/// The ways to name groups of look-alikes: each group's names, in every order.
struct Namings<'a> {
    bodies: &'a [Vec<Name>],
    /// The names that the bodies of each group bear now.
    names: Vec<Vec<Name>>,
    n_left: u32,
}

impl Namings<'_> {
    /// Whether one of them will do, with the names before a place in a group as they are: their own
    /// ones come first. `None` when too many have been tried.
    fn any(
        &mut self,
        (group, place): (usize, usize),
        will_do: &dyn Fn(&Naming<'_>) -> bool,
    ) -> Option<bool> {
        let Some(names) = self.names.get(group) else {
            self.n_left = self.n_left.checked_sub(1)?;
            return Some(will_do(&|body| self.name(body)));
        };
        if place == names.len() {
            return self.any((group + 1, 0), will_do);
        }
        for other in place..names.len() {
            self.names[group].swap(place, other);
            let found = self.any((group, place + 1), will_do)?;
            self.names[group].swap(place, other);
            if found {
                return Some(true);
            }
        }
        Some(false)
    }

    /// The name that a body bears now; its own where nothing looks like it.
    fn name(&self, body: &Name) -> Name {
        let mut pairs = self.bodies.iter().flatten().zip(self.names.iter().flatten());
        pairs.find(|(known, _)| *known == body).map_or(body, |(_, name)| name).clone()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::run::DomainFolder;

    /// Whether a goal of blocksworld holds, with `on` as given from the top down.
    fn holds(goal: &[[&str; 2]], on: &[[&str; 2]], look_alikes: &[&[&str]]) -> Option<bool> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let folder = DomainFolder::read(&root.join("domains/blocksworld")).unwrap();
        let atoms = |pairs: &[[&str; 2]]| pairs.iter().map(|pair| Atom::new("on", pair)).collect();
        let atoms: [Vec<Atom>; 2] = [atoms(goal), atoms(on)];
        let [goal, facts] = atoms;
        let names = ["red_block", "red_block2", "blue_block", "green_block"];
        let objects = names.map(|name| Typed::new(name, "block"));
        let named = |group: &&[&str]| group.iter().map(Name::new).collect();
        let truth = GroundTruth {
            facts: facts.into_iter().collect(),
            look_alikes: look_alikes.iter().map(named).collect(),
            ..GroundTruth::default()
        };
        let literal = |atom: Atom| {
            let args = atom.args.into_iter().map(crate::pddl::Term::Object).collect();
            Condition::Atom(crate::pddl::Literal { predicate: atom.predicate, args })
        };
        let goal = Condition::And(goal.into_iter().map(literal).collect());
        let DomainFolder { domain, perception, rules, .. } = &folder;
        let words = Words { domain, perception, rules, objects: &objects };
        words.really_holds(&goal, &Bindings::new(), &truth)
    }

    #[test]
    fn look_alikes_may_bear_each_others_names() {
        let alike: &[&str] = &["red_block", "red_block2"];
        let goal = [["red_block", "blue_block"]];
        let swapped = [["red_block2", "blue_block"]];
        assert_eq!(holds(&goal, &swapped, &[alike]), Some(true));
        assert_eq!(holds(&goal, &swapped, &[]), Some(false), "they can be told apart");
        assert_eq!(holds(&goal, &[["green_block", "blue_block"]], &[alike]), Some(false));
    }

    /// One way of naming must do for the whole goal.
    #[test]
    fn a_goal_about_both_holds_under_one_naming_or_not_at_all() {
        let alike: &[&str] = &["red_block", "red_block2"];
        let goal = [["red_block", "blue_block"], ["red_block2", "green_block"]];
        let swapped = [["red_block", "green_block"], ["red_block2", "blue_block"]];
        assert_eq!(holds(&goal, &swapped, &[alike]), Some(true));
        let tower = [["red_block", "red_block2"], ["red_block2", "blue_block"]];
        assert_eq!(holds(&goal, &tower, &[alike]), Some(false));
        assert_eq!(holds(&[["red_block2", "red_block"]], &tower, &[alike]), Some(true));
    }

    #[test]
    fn more_look_alikes_than_can_be_tried_are_not_judged() {
        let many: Vec<String> = (0..9).map(|i| format!("block{i}")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        let goal = [["red_block", "blue_block"]];
        assert_eq!(holds(&goal, &[], &[&many]), None);
        assert_eq!(holds(&goal, &goal, &[&many]), Some(true), "the first naming will do");
    }
}
