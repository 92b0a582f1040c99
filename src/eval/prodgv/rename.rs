//! The same thing with other objects' names, all changed at once.

use super::matching::Matching;
use crate::pddl::{Atom, Condition, Literal, Name, Step, Term};

/// An object that has no counterpart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Nameless(pub Name);

type Renaming<'a> = &'a dyn Fn(&Name) -> Option<Name>;

fn all(names: &[Name], to: Renaming<'_>) -> Result<Vec<Name>, Nameless> {
    names.iter().map(|name| to(name).ok_or_else(|| Nameless(name.clone()))).collect()
}

/// An atom with other names; fails with the first object that has none.
pub(super) fn atom(atom: &Atom, to: Renaming<'_>) -> Result<Atom, Nameless> {
    Ok(Atom { predicate: atom.predicate.clone(), args: all(&atom.args, to)? })
}

/// A plan with other names.
pub(super) fn plan(steps: &[Step], to: Renaming<'_>) -> Result<Vec<Step>, Nameless> {
    let step = |step: &Step| Ok(Step { action: step.action.clone(), args: all(&step.args, to)? });
    steps.iter().map(step).collect()
}

/// A condition with other names.
pub(super) fn condition(condition: &Condition, to: Renaming<'_>) -> Result<Condition, Nameless> {
    let parts = |parts: &[Condition]| -> Result<Vec<Condition>, Nameless> {
        parts.iter().map(|part| self::condition(part, to)).collect()
    };
    let inner = |part: &Condition| self::condition(part, to).map(Box::new);
    Ok(match condition {
        Condition::True => Condition::True,
        Condition::False => Condition::False,
        Condition::Atom(Literal { predicate, args }) => {
            let args = args.iter().map(|arg| term(arg, to)).collect::<Result<_, _>>()?;
            Condition::Atom(Literal { predicate: predicate.clone(), args })
        }
        Condition::Equal(a, b) => Condition::Equal(term(a, to)?, term(b, to)?),
        Condition::Not(part) => Condition::Not(inner(part)?),
        Condition::And(list) => Condition::And(parts(list)?),
        Condition::Or(list) => Condition::Or(parts(list)?),
        Condition::Exists(variables, part) => Condition::Exists(variables.clone(), inner(part)?),
        Condition::Forall(variables, part) => Condition::Forall(variables.clone(), inner(part)?),
    })
}

fn term(term: &Term, to: Renaming<'_>) -> Result<Term, Nameless> {
    match term {
        Term::Var(name) => Ok(Term::Var(name.clone())),
        Term::Object(name) => to(name).map(Term::Object).ok_or_else(|| Nameless(name.clone())),
    }
}

/// True names to detected ones.
pub(super) fn inverse(matching: &Matching) -> Matching {
    matching.iter().map(|(detected, object)| (object.clone(), detected.clone())).collect()
}
