//! `perception.toml`: everything about seeing that belongs to one domain.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::appearance::{Srgb, TypeSpec};
use super::constraints::Constraints;
use super::error::{PerceptionError, arity, value, with_hint};
use super::features::{FEATURES, Needs, feature_by_name};
use crate::pddl::{Domain, Name};
use crate::settings::TomlFile;

/// The perception file of a domain, as written and checked.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Perception {
    /// Colour names and the shades people call so.
    #[serde(default)]
    pub colours: BTreeMap<Name, Vec<Srgb>>,
    /// How objects of each visible type look.
    #[serde(default, rename = "type")]
    pub types: Vec<TypeSpec>,
    /// Objects that are always there and never seen.
    #[serde(default)]
    pub implied: Vec<Implied>,
    /// Predicates judged from the image.
    #[serde(default)]
    pub observed: Vec<ObservedSpec>,
    /// Predicates read off the robot's own state.
    #[serde(default)]
    pub proprioceptive: Vec<Proprioceptive>,
    /// Predicates computed by the rules of `completion.pddl`.
    #[serde(default)]
    pub completed: Vec<Name>,
    /// What any consistent set of observed facts obeys.
    #[serde(default)]
    pub constraints: Constraints,
}

/// An object that is always there and never seen.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Implied {
    /// How plans and facts call it, such as `arm`.
    pub name: Name,
    /// One of the domain's types.
    #[serde(rename = "type")]
    pub type_name: Name,
}

/// A predicate judged from the image.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObservedSpec {
    /// One of the domain's, of one or two arguments.
    pub predicate: Name,
    /// The feature of boxes it is judged by; without one, the default of its arity.
    pub feature: Option<String>,
    /// The feature used instead where every example and object has its mask.
    pub feature_with_masks: Option<String>,
    /// The feature used instead where depth gives every example and object its volume.
    pub feature_with_volumes: Option<String>,
    /// Types per argument where they differ from the domain's declaration.
    pub candidates: Option<Vec<Vec<Name>>>,
}

/// A predicate read off the robot's own state.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Proprioceptive {
    /// One of the domain's, of one or two arguments.
    pub predicate: Name,
    /// Its arguments: `held` stands for the object in the gripper, anything else is an implied
    /// object's name.
    pub args: Vec<Name>,
    /// When it holds.
    pub when: When,
}

/// The state of the gripper in which a proprioceptive predicate holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum When {
    /// Nothing is held.
    Empty,
    /// Something is held.
    Holding,
}

impl Perception {
    /// Reads a perception file and checks it by itself; `file` is named in errors.
    ///
    /// # Errors
    /// [`PerceptionError::File`]: every unknown key and wrong value, with line and column.
    pub fn parse(file: &str, text: &str) -> Result<Self, PerceptionError> {
        let toml = TomlFile::parse(file, text).map_err(PerceptionError::File)?;
        let perception: Self = toml.read().map_err(PerceptionError::File)?;
        let checked = perception.types.iter().try_for_each(|t| t.check(&perception.colours));
        checked.map_err(|error| error.in_file(file, text))?;
        Ok(perception)
    }

    /// Checks the file against the domain it is for.
    ///
    /// # Errors
    /// [`PerceptionError::Value`] naming the key whose predicate, arity, type, feature or object
    /// is not the domain's.
    pub fn check(&self, domain: &Domain) -> Result<(), PerceptionError> {
        let known = domain.known_types();
        let want_type = |field: String, name: &Name| {
            let words = || known.iter().map(Name::as_str);
            let fault = || value(field, "a type", with_hint(name.as_str(), words()));
            known.contains(name).then_some(()).ok_or_else(fault)
        };
        for spec in &self.types {
            want_type(format!("type.{}.name", spec.name), &spec.name)?;
        }
        for implied in &self.implied {
            want_type(format!("implied.{}.type", implied.name), &implied.type_name)?;
        }
        for spec in &self.observed {
            spec.check(domain)?;
            for name in spec.candidates.iter().flatten().flatten() {
                want_type(format!("observed.{}.candidates", spec.predicate), name)?;
            }
        }
        for spec in &self.proprioceptive {
            spec.check(domain, &self.implied)?;
        }
        for name in &self.completed {
            arity(domain, "completed", name)?;
        }
        let observed: Vec<&Name> = self.observed_predicates().collect();
        self.constraints.check(domain, &observed)
    }

    /// How objects of a type look.
    pub fn type_spec(&self, type_name: &Name) -> Option<&TypeSpec> {
        self.types.iter().find(|t| t.name == *type_name)
    }

    /// The names of the observed predicates.
    pub fn observed_predicates(&self) -> impl Iterator<Item = &Name> {
        self.observed.iter().map(|o| &o.predicate)
    }
}

impl ObservedSpec {
    fn check(&self, domain: &Domain) -> Result<(), PerceptionError> {
        let field = format!("observed.{}", self.predicate);
        let n = arity(domain, &format!("{field}.predicate"), &self.predicate)?;
        if n != 1 && n != 2 {
            return Err(value(field, "a predicate of one or two objects", format!("{n}")));
        }
        for (key, name, needs, expected) in [
            ("feature", &self.feature, Needs::Boxes, "a feature of boxes"),
            (
                "feature_with_masks",
                &self.feature_with_masks,
                Needs::Masks,
                "a feature of masks or boxes",
            ),
            (
                "feature_with_volumes",
                &self.feature_with_volumes,
                Needs::Volumes,
                "a feature of volumes or boxes",
            ),
        ] {
            let Some(name) = name else { continue };
            let Some(feature) = feature_by_name(name) else {
                let known = FEATURES.iter().map(|feature| feature.name);
                let got = with_hint(name, known.clone());
                let expected = known.collect::<Vec<_>>().join(" or ");
                return Err(value(format!("{field}.{key}"), expected, got));
            };
            if feature.arity != n {
                let expected = format!("a feature of {n} objects");
                return Err(value(format!("{field}.{key}"), &expected, name));
            }
            if feature.needs != Needs::Boxes && feature.needs != needs {
                return Err(value(format!("{field}.{key}"), expected, name));
            }
        }
        match &self.candidates {
            Some(candidates) if candidates.len() != n => {
                let expected = format!("{n} lists of types");
                Err(value(format!("{field}.candidates"), &expected, candidates.len()))
            }
            Some(_) | None => Ok(()),
        }
    }
}

impl Proprioceptive {
    fn check(&self, domain: &Domain, implied: &[Implied]) -> Result<(), PerceptionError> {
        let field = format!("proprioceptive.{}.args", self.predicate);
        let at = format!("proprioceptive.{}.predicate", self.predicate);
        let n = arity(domain, &at, &self.predicate)?;
        if self.args.len() != n {
            return Err(value(field, format!("{n} arguments"), self.args.len()));
        }
        for arg in &self.args {
            let held = *arg == HELD && self.when == When::Holding;
            if !held && implied.iter().all(|i| i.name != *arg) {
                return Err(value(field, "an implied object, or `held` when holding", arg));
            }
        }
        Ok(())
    }
}

/// The argument that stands for the object in the gripper.
pub(in crate::perception) const HELD: &str = "held";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::{SourceText, parse_domain};

    const BLOCKS: &str = include_str!("../../../domains/blocksworld/perception.toml");

    fn domain(text: &str) -> Domain {
        parse_domain(&SourceText::new("domain.pddl", text)).unwrap().value
    }

    fn blocks() -> Domain {
        domain(include_str!("../../../domains/blocksworld/domain.pddl"))
    }

    /// The error of the blocksworld file with one text replaced by another.
    #[track_caller]
    fn check(from: &str, to: &str, expect: &str) {
        assert!(BLOCKS.contains(from), "{from}");
        let text = BLOCKS.replacen(from, to, 1);
        let result = Perception::parse("p.toml", &text).and_then(|p| p.check(&blocks()));
        let message = result.unwrap_err().to_string();
        assert!(message.contains(expect), "{message}");
    }

    #[test]
    fn shipped_files_fit_their_domains() {
        Perception::parse("p.toml", BLOCKS).unwrap().check(&blocks()).unwrap();
        let hanoi = domain(include_str!("../../../domains/hanoi/domain.pddl"));
        let text = include_str!("../../../domains/hanoi/perception.toml");
        Perception::parse("p.toml", text).unwrap().check(&hanoi).unwrap();
    }

    #[test]
    fn a_misspelt_key_is_refused_with_its_line() {
        let expect = "p.toml:53:1: error: type[0].appearance.fil_min: unknown key; did you mean \
                      fill_min?";
        check("fill_min", "fil_min", expect);
        check("[[observed]]", "[[observd]]", "observd: unknown key; did you mean observed?");
        check("template", "templat", "type[0].naming.templat: unknown key; did you mean template?");
        check("[[constraints.support]]", "[[constraints.suport]]", "did you mean support?");
        check(
            "order = \"left_to_right\"",
            "order = \"left_to_rigt\"",
            "did you mean \"left_to_right\"?",
        );
    }

    #[test]
    fn values_out_of_range_name_their_key() {
        check("#e50000", "#e5000", "expected a colour such as \"#e50000\", got \"#e5000\"");
        check(
            "aspect = [0.45, 2.0]",
            "aspect = [2.0, 0.45]",
            "type.block.appearance.aspect: expected [least",
        );
        check("\"red\",", "\"mauve\",", "type.block.colours: expected colours that [colours]");
    }

    #[test]
    fn what_the_domain_does_not_have_is_refused() {
        check("predicate = \"on\"", "predicate = \"under\"", "got under");
        check("predicate = \"on\"", "predicate = \"on\"\nfeature = \"unary6\"", "feature of 2");
        check(
            "feature_with_masks = \"mask_relation\"",
            "feature_with_masks = \"volume_relation\"",
            "observed.on.feature_with_masks: expected a feature of masks or boxes",
        );
        check(
            "feature_with_masks = \"mask_relation\"",
            "feature = \"mask_relation\"",
            "observed.on.feature: expected a feature of boxes, got mask_relation",
        );
        check(
            "type = \"robot\"",
            "type = \"droid\"",
            "implied.arm.type: expected a type, got droid",
        );
        check("args = [\"arm\"]", "args = [\"leg\"]", "expected an implied object");
        check("functional = [\"on\"]", "functional = [\"clear\"]", "predicates of two objects");
    }

    #[test]
    fn constraints_that_do_not_fit_are_refused_by_their_key() {
        let support = "[[constraints.support]]\npredicate = \"on\"";
        let with = |text: &str, expect: &str| check(support, text, expect);
        with(
            "[[constraints.support]]\npredicate = \"clear\"",
            "constraints.support.predicate: expected predicates of two objects, got clear",
        );
        with(
            &format!("{support}\nstack_at = \"holding\""),
            "constraints.support.stack_at: expected a predicate of constraints.exactly_one or",
        );
        with(
            &format!("{support}\nagrees_with = [\"on\"]"),
            "constraints.support.agrees_with: expected a predicate of constraints.strict_order",
        );
        let group = "[[constraints.exactly_one_of]]\narguments = ";
        with(&format!("{group}[]"), "constraints.exactly_one_of.arguments: expected at least one");
        with(&format!("{group}[\"on.3\"]"), "expected an argument from 1 to 2 of on, got 3");
        with(&format!("{group}[\"on\"]"), "expected a predicate and an argument such as \"at.1\"");
        let opinion = "[[constraints.second_opinion]]\nfeature = ";
        with(
            &format!("{opinion}\"size\"\npredicate = \"clear\""),
            "constraints.second_opinion.predicate: expected an observed predicate, got clear",
        );
        with(
            &format!("{opinion}\"unary6\"\npredicate = \"on\""),
            "constraints.second_opinion.feature: expected a feature of 2 objects, got unary6",
        );
    }
}
