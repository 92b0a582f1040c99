//! Quantifiers that range over more than is meant.

use crate::pddl::{Condition, Domain, Name, Term, Typed};

/// What is wrong with the first variable whose type is wider than its places in predicates allow:
/// `(forall (?x) (ontable ?x))` speaks of the robot, too.
pub(super) fn too_wide(goal: &Condition, domain: &Domain) -> Option<String> {
    match goal {
        Condition::Forall(variables, body) | Condition::Exists(variables, body) => {
            let wide = variables.iter().find_map(|variable| of_variable(variable, body, domain));
            wide.or_else(|| too_wide(body, domain))
        }
        Condition::Not(inner) => too_wide(inner, domain),
        Condition::And(parts) | Condition::Or(parts) => {
            parts.iter().find_map(|part| too_wide(part, domain))
        }
        Condition::True | Condition::False | Condition::Atom(_) | Condition::Equal(..) => None,
    }
}

fn of_variable(variable: &Typed, body: &Condition, domain: &Domain) -> Option<String> {
    let mut wanted: Vec<&[Name]> = Vec::new();
    places(variable, body, domain, &mut wanted);
    let object = [Name::new("object")];
    let types = if variable.types.is_empty() { object.as_slice() } else { &variable.types };
    let narrow = wanted
        .into_iter()
        .find(|types_wanted| !types_wanted.is_empty() && !domain.types.fits(types, types_wanted))?;
    let of = |types: &[Name]| types.iter().map(Name::as_str).collect::<Vec<_>>().join(" or ");
    Some(format!(
        "?{} ranges over every {}, and what is said of it holds of {} only: write (?{} - {})",
        variable.name,
        of(types),
        of(narrow),
        variable.name,
        narrow.first().map(Name::as_str).unwrap_or_default()
    ))
}

/// The types that predicates take where a variable stands.
fn places<'a>(
    variable: &Typed,
    condition: &Condition,
    domain: &'a Domain,
    found: &mut Vec<&'a [Name]>,
) {
    match condition {
        Condition::Atom(literal) => {
            let Some(signature) = domain.predicate(literal.predicate.as_str()) else { return };
            for (arg, param) in literal.args.iter().zip(&signature.params) {
                if matches!(arg, Term::Var(name) if *name == variable.name) {
                    found.push(&param.types);
                }
            }
        }
        Condition::Forall(variables, body) | Condition::Exists(variables, body) => {
            if variables.iter().all(|inner| inner.name != variable.name) {
                places(variable, body, domain, found);
            }
        }
        Condition::Not(inner) => places(variable, inner, domain, found),
        Condition::And(parts) | Condition::Or(parts) => {
            for part in parts {
                places(variable, part, domain, found);
            }
        }
        Condition::True | Condition::False | Condition::Equal(..) => {}
    }
}
