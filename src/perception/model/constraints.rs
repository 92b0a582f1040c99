//! `[constraints]` of `perception.toml`: what every consistent set of observed facts obeys.

use schemars::JsonSchema;
use serde::Deserialize;

use super::error::{PerceptionError, arity, value, with_hint};
use super::features::{FEATURES, feature_by_name};
use crate::pddl::{Domain, Name};

/// Properties that every consistent set of observed facts has.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Constraints {
    /// Binary predicates with at most one second argument per first.
    #[serde(default)]
    pub functional: Vec<Name>,
    /// Binary predicates with at most one first argument per second.
    #[serde(default)]
    pub inverse_functional: Vec<Name>,
    /// Binary predicates that are irreflexive, antisymmetric and transitive. Where every labelled
    /// example relates all its objects, so does every scene: the order is total.
    #[serde(default)]
    pub strict_order: Vec<Name>,
    /// Binary predicates with exactly one second argument per first. Where a labelled example shows
    /// a first argument without one, that may happen, and "at most one" is what is left.
    #[serde(default)]
    pub exactly_one: Vec<Name>,
    /// Binary predicates that no object has to itself.
    #[serde(default)]
    pub irreflexive: Vec<Name>,
    /// Binary predicates whose second argument stands upright in the middle of the first: seen from
    /// the side, its middle is within the first's width.
    #[serde(default)]
    pub aligned: Vec<Name>,
    /// Groups of predicates of which each object has exactly one atom.
    #[serde(default)]
    pub exactly_one_of: Vec<ExactlyOneOf>,
    /// Which predicates say what an object rests on.
    #[serde(default)]
    pub support: Vec<Support>,
    /// Further features that a predicate is judged by.
    #[serde(default)]
    pub second_opinion: Vec<FeatureVote>,
}

/// A group of predicates of which each object has exactly one atom ("at one place, or carried"). As
/// for `exactly_one`, labelled examples that show an object without any leave "at most one".
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExactlyOneOf {
    /// The places of the object, counted from 1, as in `["at.1", "carry.2"]`.
    pub arguments: Vec<PredicateArgument>,
}

/// An argument of a predicate, written as in `carry.2`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
pub struct PredicateArgument {
    /// One of the observed predicates.
    pub predicate: Name,
    /// The argument, counted from 0.
    pub argument: usize,
}

/// A predicate that says what an object rests on: its first argument lies directly on the second.
///
/// So the second is beneath the first, and no gap is between them: a gap, or an object over the
/// ground with nothing beneath it, is explained by no fact.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// One of the observed predicates.
    pub predicate: Name,
    /// A binary predicate whose second argument is a place for one stack: objects that share it lie
    /// on each other in the order of their heights.
    pub stack_at: Option<Name>,
    /// Orders that hold between what rests and what it rests on.
    #[serde(default)]
    pub agrees_with: Vec<Name>,
}

/// A further feature that a predicate is judged by; the opinions of all its features add up.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeatureVote {
    /// The predicate; an observed one.
    pub predicate: Name,
    /// A name from the table of features.
    pub feature: String,
    /// The feature used instead where objects have volumes; without one, there is no second opinion.
    pub feature_with_volumes: Option<String>,
}

impl TryFrom<String> for PredicateArgument {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let parts = text.rsplit_once('.').and_then(|(name, n)| Some((name, n.parse().ok()?)));
        match parts {
            Some((name, n @ 1..)) if !name.is_empty() => {
                Ok(Self { predicate: Name::new(name), argument: n - 1 })
            }
            _ => Err(format!(
                "expected a predicate and an argument such as \"at.1\", got \"{text}\""
            )),
        }
    }
}

impl Constraints {
    /// Leaves out what speaks of predicates for which `keep` is false.
    pub fn retain(&mut self, keep: &dyn Fn(&Name) -> bool) {
        let Self { functional, inverse_functional, strict_order, exactly_one, .. } = self;
        for names in [functional, inverse_functional, strict_order, exactly_one] {
            names.retain(keep);
        }
        for names in [&mut self.irreflexive, &mut self.aligned] {
            names.retain(keep);
        }
        self.exactly_one_of.retain(|group| group.arguments.iter().all(|p| keep(&p.predicate)));
        self.support.retain(|support| keep(&support.predicate));
        for support in &mut self.support {
            support.stack_at = support.stack_at.take().filter(|name| keep(name));
            support.agrees_with.retain(keep);
        }
        self.second_opinion.retain(|opinion| keep(&opinion.predicate));
    }

    pub(super) fn check(&self, domain: &Domain, observed: &[&Name]) -> Result<(), PerceptionError> {
        let lists = [
            ("constraints.functional", &self.functional),
            ("constraints.inverse_functional", &self.inverse_functional),
            ("constraints.strict_order", &self.strict_order),
            ("constraints.exactly_one", &self.exactly_one),
            ("constraints.irreflexive", &self.irreflexive),
            ("constraints.aligned", &self.aligned),
        ];
        for (field, names) in lists {
            names.iter().try_for_each(|name| binary(domain, field, name))?;
        }
        if self.exactly_one_of.iter().any(|group| group.arguments.is_empty()) {
            let field = "constraints.exactly_one_of.arguments";
            return Err(value(field, "at least one argument of a predicate", "none"));
        }
        for place in self.exactly_one_of.iter().flat_map(|group| &group.arguments) {
            let field = "constraints.exactly_one_of.arguments";
            let n = arity(domain, field, &place.predicate)?;
            if place.argument >= n {
                let expected = format!("an argument from 1 to {n} of {}", place.predicate);
                return Err(value(field, &expected, place.argument + 1));
            }
        }
        for support in &self.support {
            binary(domain, "constraints.support.predicate", &support.predicate)?;
            if let Some(name) = &support.stack_at
                && !self.exactly_one.contains(name)
                && !self.functional.contains(name)
            {
                let expected = "a predicate of constraints.exactly_one or constraints.functional";
                return Err(value("constraints.support.stack_at", expected, name));
            }
            for name in &support.agrees_with {
                if !self.strict_order.contains(name) {
                    let field = "constraints.support.agrees_with";
                    return Err(value(field, "a predicate of constraints.strict_order", name));
                }
            }
        }
        self.second_opinion.iter().try_for_each(|opinion| opinion.check(domain, observed))
    }
}

impl FeatureVote {
    fn check(&self, domain: &Domain, observed: &[&Name]) -> Result<(), PerceptionError> {
        let n = arity(domain, "constraints.second_opinion.predicate", &self.predicate)?;
        if !observed.contains(&&self.predicate) {
            let field = "constraints.second_opinion.predicate";
            return Err(value(field, "an observed predicate", &self.predicate));
        }
        for (key, name) in [
            ("feature", Some(&self.feature)),
            ("feature_with_volumes", self.feature_with_volumes.as_ref()),
        ] {
            let Some(name) = name else { continue };
            if feature_by_name(name).is_none_or(|feature| feature.arity != n) {
                let field = format!("constraints.second_opinion.{key}");
                let known = FEATURES.iter().filter(|feature| feature.arity == n);
                let got = with_hint(name, known.map(|feature| feature.name));
                return Err(value(field, format!("a feature of {n} objects"), got));
            }
        }
        Ok(())
    }
}

fn binary(domain: &Domain, field: &str, name: &Name) -> Result<(), PerceptionError> {
    if arity(domain, field, name)? == 2 {
        Ok(())
    } else {
        Err(value(field, "predicates of two objects", name))
    }
}
