//! The results that the authors recorded of one (exemplar, test) pair.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::data_set::{atoms_of, field, read_boxes, source, type_of};
use super::forms::form_of;
use super::{DomainData, EvalError};
use crate::pddl::{Atom, SourceText, Typed, parse_problem};
use crate::perception::model::ObjectBox;

/// An exemplar's and a test's number.
pub type Pair = (u32, u32);

impl DomainData {
    fn recorded_file(&self, folder: &str, stem: &str, (e, t): Pair, end: &str) -> Option<PathBuf> {
        let path = self.recorded.join(folder).join(format!("{stem}_ex{e}_test{t}.{end}"));
        path.is_file().then_some(path)
    }

    /// The recorded boxes with the recorded types, in the order of the box file; `None` when one of
    /// the two files is not there.
    ///
    /// # Errors
    /// [`EvalError`] naming file and object.
    pub fn recorded_detections(&self, pair: Pair) -> Result<Option<Vec<ObjectBox>>, EvalError> {
        let boxes = self.recorded_file("objdet", "objdet", pair, "json");
        let stub = self.recorded_file("object_stubs", "objects_stub", pair, "pddl");
        let (Some(boxes), Some(stub)) = (boxes, stub) else { return Ok(None) };
        let objects = self.stub_objects(&source(&stub)?)?;
        let boxes = read_boxes(&boxes)?.into_iter().map(|(name, pixel_box)| {
            let typed = objects.iter().find(|typed| typed.name == name);
            let typed =
                typed.ok_or_else(|| field(&stub, &name, "an object with a type", "none"))?;
            Ok(ObjectBox::new(name, type_of(typed), pixel_box))
        });
        boxes.collect::<Result<_, _>>().map(Some)
    }

    /// The objects of a stub, which is `(:objects …)` and nothing else.
    fn stub_objects(&self, stub: &SourceText) -> Result<Vec<Typed>, EvalError> {
        let form = form_of(stub, ":objects").text;
        let name = &self.domain.name;
        // In one line with the stub's first, so that lines in messages are the stub's.
        let text =
            format!("(define (problem stub) (:domain {name}) (:init) (:goal (and)) {form}\n)");
        let problem = parse_problem(&SourceText { name: stub.name.clone(), text }, &self.domain)?;
        Ok(problem.value.objects)
    }

    /// The recorded observed facts, with the recorded names. Types are not checked: the reference
    /// did not either.
    ///
    /// # Errors
    /// [`EvalError`] naming the file.
    pub fn recorded_facts(&self, pair: Pair) -> Result<Option<BTreeSet<Atom>>, EvalError> {
        let path = self.recorded_file("init_stubs", "initstate", pair, "pddl");
        let facts = path.map(|path| atoms_of(&source(&path)?, ":init")).transpose()?;
        Ok(facts.map(|facts| facts.into_iter().collect()))
    }

    /// The recorded goal: the first goal form of the language model's answer.
    ///
    /// # Errors
    /// [`EvalError`] naming the file.
    pub fn recorded_goal(&self, pair: Pair) -> Result<Option<SourceText>, EvalError> {
        let path = self.recorded_file("goal_stubs", "goal_stub", pair, "pddl");
        path.map(|path| Ok(form_of(&source(&path)?, ":goal"))).transpose()
    }
}
