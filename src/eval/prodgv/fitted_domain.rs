//! A shipped domain folder, put to use on the data set's own domain.

use std::collections::BTreeSet;

use super::EvalError;
use crate::pddl::{Domain, Name};
use crate::perception::Pipeline;
use crate::perception::grounders::Grounder;
use crate::perception::model::Perception;
use crate::run::DomainFolder;

/// What a domain's episodes are read with.
#[derive(Debug, Clone)]
pub struct FittedDomain {
    /// The shipped folder with the data set's domain in place of its own. What the data set does
    /// not declare is left out: predicates of `perception.toml`, rules of `completion.pddl`.
    pub folder: DomainFolder,
    /// The shipped domain: what `language.toml` is written for.
    pub shipped: Domain,
    /// The predicates that are scored: those that are judged from the image.
    pub observed: BTreeSet<Name>,
}

impl FittedDomain {
    /// Fits a shipped folder to the data set's domain.
    ///
    /// Completion uses the shipped rules, not the data set's `derived.pddl`: that file names types
    /// which its `domain.pddl` does not have in one of the domains, and its heads are effects of
    /// actions, which axioms may not be.
    ///
    /// # Errors
    /// [`EvalError`] naming the key of `perception.toml` that does not fit the domain.
    pub fn new(folder: DomainFolder, domain: &Domain) -> Result<Self, EvalError> {
        let declares = |name: &Name| domain.predicate(name.as_str()).is_some();
        let mut perception = folder.perception.clone();
        restrict(&mut perception, &declares);
        perception.check(domain).map_err(crate::run::ConfigError::from)?;
        let mut rules = folder.rules.clone();
        rules.retain(|rule| declares(&rule.head.name));
        let observed = perception.observed_predicates().cloned().collect();
        let shipped = folder.domain.clone();
        let folder = DomainFolder { domain: domain.clone(), perception, rules, ..folder };
        Ok(Self { folder, shipped, observed })
    }
}

impl FittedDomain {
    /// The way from detections to facts, with a grounder for this domain.
    pub fn pipeline<'a>(&'a self, grounder: &'a dyn Grounder) -> Pipeline<'a> {
        self.folder.pipeline(grounder)
    }
}

/// Leaves out what speaks of predicates that are not declared.
fn restrict(perception: &mut Perception, declares: &dyn Fn(&Name) -> bool) {
    perception.observed.retain(|spec| declares(&spec.predicate));
    perception.proprioceptive.retain(|spec| declares(&spec.predicate));
    perception.completed.retain(declares);
    perception.constraints.retain(declares);
}
