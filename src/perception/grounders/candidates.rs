//! Which tuples of objects a predicate may hold of.

use crate::mismatch::Mismatch;
use crate::pddl::{Domain, Name, Types};
use crate::perception::model::{ObjectBox, ObservedSpec, PerceptionError};

/// The types that each argument of a predicate may have.
pub type CandidateSlots = Vec<Vec<Name>>;

/// The argument types of an observed predicate: the domain's, unless the perception file gives
/// others.
///
/// # Errors
/// [`PerceptionError::Value`] when the domain has no such predicate.
pub fn slots(domain: &Domain, spec: &ObservedSpec) -> Result<CandidateSlots, PerceptionError> {
    if let Some(candidates) = &spec.candidates {
        return Ok(candidates.clone());
    }
    let Some(signature) = domain.predicate(spec.predicate.as_str()) else {
        let expected = "a predicate of the domain";
        return Err(Mismatch::new("observed.predicate", expected, &spec.predicate).into());
    };
    Ok(signature.params.iter().map(|p| p.types.clone()).collect())
}

/// Every ordered tuple of different objects whose types fit, as indices into `objects`.
///
/// Predicates of more than two objects give none: no feature takes them.
pub fn tuples(types: &Types, slots: &[Vec<Name>], objects: &[ObjectBox]) -> Vec<Vec<usize>> {
    let mut tuples = Vec::new();
    let order: Vec<usize> = (0..objects.len()).collect();
    for_tuples(types, slots, objects, &order, |tuple| tuples.push(tuple.to_vec()));
    tuples
}

/// Visits the tuples of [`tuples`] without keeping them, in the given order of objects: by the
/// first object, then by the second.
pub(super) fn for_tuples(
    types: &Types,
    slots: &[Vec<Name>],
    objects: &[ObjectBox],
    order: &[usize],
    mut visit: impl FnMut(&[usize]),
) {
    let fitting = |wanted: &[Name]| -> Vec<usize> {
        let fits = |o: &ObjectBox| types.fits(std::slice::from_ref(&o.type_name), wanted);
        order.iter().copied().filter(|&i| fits(&objects[i])).collect()
    };
    match slots {
        [only] => fitting(only).into_iter().for_each(|i| visit(&[i])),
        [first, second] => {
            let seconds = fitting(second);
            for i in fitting(first) {
                seconds.iter().filter(|&&j| i != j).for_each(|&j| visit(&[i, j]));
            }
        }
        _ => {}
    }
}
