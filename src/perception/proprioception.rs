//! What the robot knows of itself, as facts.

use super::model::perception::HELD;
use super::model::{Perception, When};
use crate::logic::{Facts, Truth};
use crate::pddl::{Atom, Domain, Name, Typed};

/// What the gripper holds, as far as is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GripperContent {
    /// Nothing.
    Empty,
    /// This object.
    Holds(Name),
    /// Something; which object is not known.
    HoldsSomething,
}

/// The facts of every proprioceptive predicate.
///
/// When something unknown is held, predicates about the held object are unknown for every object
/// of the fitting type, rather than false.
pub fn proprioception(
    domain: &Domain,
    perception: &Perception,
    objects: &[Typed],
    gripper: &GripperContent,
) -> Facts {
    let mut facts = Facts::default();
    for spec in &perception.proprioceptive {
        let holds = match spec.when {
            When::Empty => *gripper == GripperContent::Empty,
            When::Holding => *gripper != GripperContent::Empty,
        };
        if !holds {
            continue;
        }
        let atom = |held: Option<&Name>| {
            let fill = |arg: &Name| if *arg == HELD { held.cloned() } else { Some(arg.clone()) };
            let args: Option<Vec<Name>> = spec.args.iter().map(fill).collect();
            args.map(|args| Atom { predicate: spec.predicate.clone(), args })
        };
        match (spec.args.iter().position(|a| *a == HELD), gripper) {
            (Some(i), GripperContent::HoldsSomething) => {
                let signature = domain.predicate(spec.predicate.as_str());
                let Some(param) = signature.and_then(|s| s.params.get(i)) else { continue };
                let fitting = objects.iter().filter(|o| domain.types.fits(&o.types, &param.types));
                for unknown in fitting.filter_map(|o| atom(Some(&o.name))) {
                    facts.set(unknown, Truth::Unknown);
                }
            }
            (Some(_), GripperContent::Holds(name)) => facts.known.extend(atom(Some(name))),
            (Some(_), GripperContent::Empty) => {}
            (None, _) => facts.known.extend(atom(None)),
        }
    }
    facts
}
