//! The photographs of a checkout of the paper's data set, in the pairs that the paper evaluates.

use std::collections::BTreeSet;

use super::{Conditions, LabelledPicture, Taught, Test, Tried};
use crate::eval::prodgv::evaluate::{detector, grounder, read_pictures};
use crate::eval::prodgv::matching::is_evaluated;
use crate::eval::prodgv::{DomainData, EvalError, FittedDomain};
use crate::pddl::Atom;

/// Tries every evaluated pair of a domain under every condition.
///
/// # Errors
/// [`EvalError`] naming the file or part that is not usable.
pub fn on_photographs(
    data: &DomainData,
    fitted: &FittedDomain,
    conditions: &Conditions<'_>,
    tried: &mut dyn FnMut(&Tried<'_>),
) -> Result<(), EvalError> {
    let pictures = read_pictures(data)?;
    for exemplar in &data.problems {
        let grounder = grounder(conditions.grounder, fitted, exemplar)?;
        let detector = detector(conditions.detector, fitted, (exemplar, &pictures))?;
        let mut taught = Taught { pipeline: fitted.pipeline(&*grounder), detector };
        for test in &data.problems {
            if test.number == exemplar.number || !is_evaluated(exemplar, test) {
                continue;
            }
            let facts: BTreeSet<Atom> = test.init.iter().cloned().collect();
            let observed = facts.into_iter().filter(|a| fitted.observed.contains(&a.predicate));
            let case = format!("{} {} by example {}", data.name, test.number, exemplar.number);
            let picture = LabelledPicture {
                image: pictures[&test.number].clone(),
                objects: test.boxes.clone(),
            };
            let seed = u64::from(exemplar.number) << 32 | u64::from(test.number);
            let test = Test { case: &case, picture: &picture, facts: &observed.collect() };
            taught.try_all(conditions, &test, seed, tried)?;
        }
    }
    Ok(())
}
