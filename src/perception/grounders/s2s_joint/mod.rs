//! `s2s-joint`: S2S's distances, judged together under the constraints of `perception.toml`.
//!
//! Each tuple's evidence is how much nearer it is to an example that holds than to one that does not.
//! Accepted is the set of atoms with the most evidence that keeps every constraint; where the evidence
//! does not decide, an atom is unknown, and what no set of facts explains is an anomaly. Stages:
//!
//! 1. `cardinality`: predicates that constrain by number (`exactly_one`, `functional`, …), by branch and
//!    bound (`branch_and_bound`);
//! 2. `support`: what rests on what, from the same evidence and from where the boxes are (`extent`);
//! 3. `order`: strict orders;
//! 4. `untaught`: predicates that no example shows, which are unknown where objects touch.
//!
//! What the examples do not bear out is not assumed: an `exactly_one` that an example violates is
//! "at most one", and an order is total only where the examples relate all objects.

mod extent;
mod alignment;
mod assignment;
mod branch_and_bound;
mod cardinality;
mod support;
mod order;
mod exemplar_evidence;
mod untaught;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use super::candidates::slots;
use super::{CandidateSlots, Grounder, GrounderError, GrounderInputs, Grounding, S2s};
use crate::parts::{Part, PartContext, PartError, no_options};
use crate::pddl::{Domain, Name, Types};
use crate::perception::Observation;
use crate::perception::model::constraints::{Constraints, FeatureVote, Support};
use crate::perception::model::{Exemplars, ObjectBox, ObservedSpec, Perception, PerceptionError};
use alignment::Alignment;
use assignment::Assignment;
use cardinality::Required;
use exemplar_evidence::ExemplarEvidence;
use support::SupportModel;
use untaught::Untaught;

/// The joint grounder.
#[derive(Debug, Clone)]
struct Joint {
    s2s: S2s,
    /// The same tuples by further features.
    feature_votes: Option<S2s>,
    constraints: Constraints,
    /// The observed predicates that only numbers constrain.
    numbered: Vec<Name>,
    required: Required,
    types: Types,
    /// For each `support`: the types of the objects that may rest on each other.
    parts: Vec<Vec<Name>>,
    /// What the examples show in the image.
    flat: Shown,
    /// The same in the world, where the examples have volumes.
    deep: Option<Shown>,
    /// The strict orders that the examples show to be total.
    total: Vec<Name>,
    /// Predicates that no example shows.
    untaught: Vec<Untaught>,
}

/// How objects stand to each other in the examples.
#[derive(Debug, Clone)]
struct Shown {
    /// For each `support`.
    supports: Vec<Option<SupportModel>>,
    alignment: Alignment,
}

/// The entry of the table of grounders.
pub(super) const PART: Part<dyn Grounder> = Part {
    name: "s2s-joint",
    help: "S2S's distances, judged together under the domain's constraints",
    options: no_options,
    build,
};

fn build(context: &PartContext<'_, dyn Grounder>) -> Result<Box<dyn Grounder>, PartError> {
    let GrounderInputs { domain, perception, exemplars } = context.inputs;
    Ok(Box::new(Joint::new(domain, perception, exemplars)?))
}

impl Joint {
    fn new(
        domain: &Domain,
        perception: &Perception,
        exemplars: &Exemplars,
    ) -> Result<Self, PerceptionError> {
        let constraints = perception.constraints.clone();
        let s2s = S2s::new(domain, &perception.observed, exemplars)?;
        let own_slots = |spec: &ObservedSpec| Ok((spec.predicate.clone(), slots(domain, spec)?));
        let slots: BTreeMap<Name, CandidateSlots> =
            perception.observed.iter().map(own_slots).collect::<Result<_, PerceptionError>>()?;
        let supports = constraints.support.iter();
        let types_of = |support: &Support| match slots.get(&support.predicate) {
            Some(slots) => slots.concat(),
            None => Vec::new(),
        };
        let parts: Vec<Vec<Name>> = supports.clone().map(types_of).collect();
        let shown = |deep: bool| {
            let model = |(support, types): (&Support, &Vec<Name>)| {
                let is_part = |object: &ObjectBox| is_of(&domain.types, object, types);
                SupportModel::learn(&support.predicate, exemplars, deep, is_part)
            };
            let supports = supports.clone().zip(&parts).map(model).collect();
            let alignment = Alignment::learn(&constraints.aligned, exemplars, deep);
            Shown { supports, alignment }
        };
        let judged = s2s.judged_predicates().collect();
        let evidence = ExemplarEvidence { types: &domain.types, exemplars, slots: &slots, judged };
        let is_judged = |name: &&Name| s2s.judged_predicates().any(|judged| judged == *name);
        let untaught = slots.iter().filter(|(predicate, _)| !is_judged(predicate));
        let untaught = untaught.filter_map(|(predicate, slots)| {
            Untaught::learn(predicate, slots, &domain.types, exemplars)
        });
        let untaught = untaught.collect();
        let (required, total) = (evidence.required(&constraints), evidence.total(&constraints));
        let is_numbered = |name: &&Name| {
            let supports = constraints.support.iter().any(|support| support.predicate == **name);
            !supports && !constraints.strict_order.contains(name)
        };
        Ok(Self {
            feature_votes: feature_votes(domain, perception, exemplars)?,
            numbered: perception.observed_predicates().filter(is_numbered).cloned().collect(),
            required,
            flat: shown(false),
            deep: exemplars.have_volumes().then(|| shown(true)),
            types: domain.types.clone(),
            parts,
            total,
            untaught,
            s2s,
            constraints,
        })
    }
}

impl Grounder for Joint {
    fn ground(&self, observation: &Observation<'_>) -> Result<Grounding, GrounderError> {
        Ok(self.judge(observation.objects))
    }

    fn untaught(&self) -> Vec<&Name> {
        self.untaught.iter().map(Untaught::predicate).collect()
    }
}

impl Joint {
    fn judge(&self, objects: &[ObjectBox]) -> Grounding {
        let with_depth = objects.iter().any(|object| object.volume.is_some());
        let shown = self.deep.as_ref().filter(|_| with_depth);
        let (deep, shown) = (shown.is_some(), shown.unwrap_or(&self.flat));
        let mut assignment = Assignment::new(objects, deep, self.s2s.judge(objects).judged);
        if let Some(feature_votes) = &self.feature_votes {
            assignment.add_feature_votes(&feature_votes.judge(objects).judged);
        }
        let numbered: Vec<&Name> = self.numbered.iter().filter(|p| assignment.judges(p)).collect();
        let learned = (&self.required, &shown.alignment);
        cardinality::decide(&mut assignment, &numbered, &self.constraints, learned);
        for (n, support) in self.constraints.support.iter().enumerate() {
            if let Some(model) = shown.supports[n] {
                let in_sight = objects.iter().filter(|o| !deep || o.volume.is_some());
                let parts = in_sight.filter(|o| is_of(&self.types, o, &self.parts[n]));
                let parts = assignment.numbers(parts.map(|object| &object.name));
                support::decide(&mut assignment, parts, (support, model), &self.constraints);
            }
        }
        for order in self.constraints.strict_order.iter().filter(|o| self.s2s_judges(o)) {
            let supports = self.constraints.support.iter();
            let agreeing: Vec<&Name> =
                supports.filter(|s| s.agrees_with.contains(order)).map(|s| &s.predicate).collect();
            order::decide(&mut assignment, order, self.total.contains(order), &agreeing);
        }
        let mut grounding = assignment.finish();
        if !self.untaught.is_empty() {
            let untaught = self.untaught.iter();
            grounding.judged.extend(untaught.flat_map(|u| u.judge(&self.types, objects)));
            grounding.judged.sort_by(|a, b| a.atom.cmp(&b.atom));
        }
        grounding
    }
}

impl Joint {
    fn s2s_judges(&self, predicate: &Name) -> bool {
        self.s2s.judged_predicates().any(|judged| judged == predicate)
    }
}

/// The grounder by the further features, where the domain names any.
fn feature_votes(
    domain: &Domain,
    perception: &Perception,
    exemplars: &Exemplars,
) -> Result<Option<S2s>, PerceptionError> {
    let spec = |vote: &FeatureVote| {
        let own = perception.observed.iter().find(|spec| spec.predicate == vote.predicate);
        ObservedSpec {
            predicate: vote.predicate.clone(),
            feature: Some(vote.feature.clone()),
            feature_with_masks: None,
            feature_with_volumes: vote.feature_with_volumes.clone(),
            candidates: own.and_then(|spec| spec.candidates.clone()),
        }
    };
    let specs: Vec<ObservedSpec> = perception.constraints.second_opinion.iter().map(spec).collect();
    if specs.is_empty() {
        return Ok(None);
    }
    S2s::new(domain, &specs, exemplars).map(Some)
}

fn is_of(types: &Types, object: &ObjectBox, wanted: &[Name]) -> bool {
    types.fits(std::slice::from_ref(&object.type_name), wanted)
}
