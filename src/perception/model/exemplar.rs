//! Labelled examples: boxes in an image together with the facts that hold there.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize as _;
use thiserror::Error;

use super::{ObjectBox, json_entries};
use crate::geometry::{Aabb, PixelBox};
use crate::mismatch::{Mismatch, listed};
use crate::pddl::{Atom, Domain, Name, PddlError, SourceText, Typed, parse_problem};

/// One labelled example.
#[derive(Debug, Clone, PartialEq)]
pub struct Exemplar {
    /// What to call it in explanations: the file of its boxes.
    pub name: String,
    /// Width and height of its image, in pixels.
    pub image_size: [u32; 2],
    /// The labelled boxes, with the types the state declares.
    pub objects: Vec<ObjectBox>,
    /// The facts that hold; an atom over labelled objects that is absent does not hold.
    pub init: BTreeSet<Atom>,
}

/// The files of one labelled example, as text.
#[derive(Debug, Clone)]
pub struct ExemplarText {
    /// `{"name": [x1, y1, x2, y2], …}` in pixels of the image.
    pub boxes: SourceText,
    /// A PDDL problem whose objects and init describe the image; its goal is not used.
    pub state: SourceText,
    /// Width and height of the image, in pixels.
    pub image_size: [u32; 2],
    /// `{"name": {"centre": [x, y, z], "extent": [x, y, z]}, …}` in metres, for cameras with depth.
    pub volumes: Option<SourceText>,
    /// `{"name": [[y, x1, x2], …], …}`: the pixels x1..x2 of row y, from top to bottom.
    pub masks: Option<SourceText>,
}

/// A line of a state file that a person has not decided on: `;? (on a b)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UndecidedFact {
    /// Its line, from 1.
    pub line: usize,
    /// What may hold.
    pub fact: String,
}

/// What an undecided line begins with. To PDDL it is a comment.
pub const UNDECIDED: &str = ";?";

/// The facts of a state file that are not decided.
pub fn undecided_facts(state: &str) -> Vec<UndecidedFact> {
    let lines = state.lines().zip(1..);
    let undecided = lines.filter_map(|(text, line)| {
        let fact = text.trim().strip_prefix(UNDECIDED)?.trim().to_owned();
        Some(UndecidedFact { line, fact })
    });
    undecided.collect()
}

/// One or more labelled examples of one camera set-up, pooled.
#[derive(Debug, Clone, PartialEq)]
pub struct Exemplars {
    examples: Vec<Exemplar>,
}

/// A labelled example is not usable.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ExemplarError {
    /// The box file is not a JSON object of four-number lists.
    #[error("{file}: {message}")]
    Form {
        /// Whose form is wrong: boxes, masks or volumes.
        file: String,
        /// What the parser says, with line and column.
        message: String,
    },
    /// A box is not usable.
    #[error(transparent)]
    Box(#[from] Mismatch),
    /// The state file is not a problem of the domain.
    #[error("{0}")]
    State(#[from] PddlError),
    /// The state has facts that nobody has decided on: absent they would count as false.
    #[error("{file}:{}: undecided: {}{}; where a fact holds take \";?\" away, where not delete the line",
            .first.line, .first.fact, more(*.n))]
    Undecided {
        /// The state file.
        file: String,
        /// The first such fact.
        first: UndecidedFact,
        /// How many there are.
        n: usize,
    },
    /// There is no example.
    #[error("expected at least one labelled example, got none")]
    Empty,
    /// Examples of different image sizes: their pixels cannot be compared.
    #[error("{file}: expected an image of {}x{} pixels like the other exemplars, got {}x{}",
            .expected[0], .expected[1], .got[0], .got[1])]
    Size {
        /// The file of the differing example's boxes.
        file: String,
        /// Width and height of the first example.
        expected: [u32; 2],
        /// Width and height of this one.
        got: [u32; 2],
    },
}

fn more(n: usize) -> String {
    if n > 1 { format!(", and {} more", n - 1) } else { String::new() }
}

/// The entries of a file that says something of each object by its name.
pub(super) fn entries(file: &SourceText) -> Result<Vec<(Name, serde_json::Value)>, ExemplarError> {
    json_entries(&file.text)
        .map_err(|e| ExemplarError::Form { file: file.name.clone(), message: e.to_string() })
}

/// What is wrong with what a file says of an object: what was expected, and what is there.
pub(super) fn fault(file: &str, object: &Name) -> impl Fn(&str, String) -> ExemplarError {
    move |expected, got| Mismatch::new(format!("{file}: {object}"), expected, got).into()
}

impl Exemplar {
    /// Reads one labelled example.
    ///
    /// # Errors
    /// [`ExemplarError`] naming the file and the object whose box is empty, not finite, outside
    /// the image, there twice, or not an object of the state.
    pub fn parse(text: &ExemplarText, domain: &Domain) -> Result<Self, ExemplarError> {
        let undecided = undecided_facts(&text.state.text);
        if let Some(first) = undecided.first() {
            let (file, first, n) = (text.state.name.clone(), first.clone(), undecided.len());
            return Err(ExemplarError::Undecided { file, first, n });
        }
        Self::parse_draft(text, domain)
    }

    /// Reads one of which some facts may be undecided; they count as false.
    ///
    /// # Errors
    /// As [`Exemplar::parse`], but for [`ExemplarError::Undecided`].
    pub fn parse_draft(text: &ExemplarText, domain: &Domain) -> Result<Self, ExemplarError> {
        let state = parse_problem(&text.state, domain)?.value;
        let mut boxes = Vec::new();
        for (object, value) in entries(&text.boxes)? {
            let pixel_box = PixelBox::deserialize(&value).map_err(|e| {
                let fail = fault(&text.boxes.name, &object);
                fail("four numbers, x1 y1 x2 y2", format!("{value} ({e})"))
            })?;
            boxes.push((object, pixel_box));
        }
        let declared: Vec<Typed> = state.objects.iter().chain(&domain.constants).cloned().collect();
        let mut example =
            Self::new(&text.boxes.name, text.image_size, &boxes, (&declared, state.init))?;
        if let Some(volumes) = &text.volumes {
            example.add_volumes(volumes)?;
        }
        if let Some(masks) = &text.masks {
            example.add_masks(masks)?;
        }
        Ok(example)
    }

    /// Gives each object its volume.
    fn add_volumes(&mut self, text: &SourceText) -> Result<(), ExemplarError> {
        for (name, value) in entries(text)? {
            let fail = fault(&text.name, &name);
            let volume = Aabb::deserialize(&value)
                .map_err(|e| fail("a centre and an extent", format!("{value} ({e})")))?;
            if !volume.is_valid() {
                return Err(fail("finite numbers and positive extents", value.to_string()));
            }
            let Some(object) = self.objects.iter_mut().find(|object| object.name == name) else {
                return Err(fail("an object that has a box", "none".to_owned()));
            };
            if object.volume.replace(volume).is_some() {
                return Err(fail("one volume per object", "two".to_owned()));
            }
        }
        Ok(())
    }

    /// Makes a labelled example from boxes and a state: its declared objects and what holds.
    ///
    /// # Errors
    /// As [`Exemplar::parse`]; `name` stands for the file.
    pub fn new(
        name: &str,
        image_size: [u32; 2],
        boxes: &[(Name, PixelBox)],
        (declared, init): (&[Typed], BTreeSet<Atom>),
    ) -> Result<Self, ExemplarError> {
        let declared: BTreeMap<&Name, &Typed> = declared.iter().map(|t| (&t.name, t)).collect();
        let mut seen = BTreeSet::new();
        let mut objects = Vec::with_capacity(boxes.len());
        for (object, pixel_box) in boxes {
            let fail = fault(name, object);
            if !seen.insert(object) {
                return Err(fail("one box per object", "two".to_owned()));
            }
            let edges = <[f64; 4]>::from(*pixel_box);
            if !pixel_box.is_valid() {
                return Err(fail("finite x1 < x2 and y1 < y2", listed(edges)));
            }
            let [width, height] = image_size.map(f64::from);
            let inside = PixelBox::from([0.0, 0.0, width, height]).intersection(pixel_box);
            if inside != *pixel_box {
                return Err(fail(&format!("a box inside {width} x {height}"), listed(edges)));
            }
            let Some(type_name) = declared.get(object).map(|t| t.types.first()) else {
                return Err(fail("an object that the state declares", "none".to_owned()));
            };
            let type_name = type_name.cloned().unwrap_or_else(|| "object".into());
            let (name, pixel_box) = (object.clone(), *pixel_box);
            objects.push(ObjectBox::new(name, type_name, pixel_box));
        }
        Ok(Self { name: name.to_owned(), image_size, objects, init })
    }
}

impl Exemplars {
    /// Pools labelled examples of one camera set-up.
    ///
    /// # Errors
    /// [`ExemplarError::Empty`] without any, [`ExemplarError::Size`] when images differ in size.
    pub fn new(examples: Vec<Exemplar>) -> Result<Self, ExemplarError> {
        let Some(first) = examples.first() else { return Err(ExemplarError::Empty) };
        if let Some(other) = examples.iter().find(|e| e.image_size != first.image_size) {
            return Err(ExemplarError::Size {
                file: other.name.clone(),
                expected: first.image_size,
                got: other.image_size,
            });
        }
        Ok(Self { examples })
    }

    /// The examples, in the order given.
    pub fn examples(&self) -> &[Exemplar] {
        &self.examples
    }

    /// Whether every object of every example has a volume.
    pub fn have_volumes(&self) -> bool {
        self.examples.iter().flat_map(|e| &e.objects).all(|object| object.volume.is_some())
    }

    /// Whether every object of every example has a mask.
    pub fn have_masks(&self) -> bool {
        self.examples.iter().flat_map(|e| &e.objects).all(|object| object.mask.is_some())
    }

    /// Width and height of the images, in pixels. A frame of another size cannot be grounded.
    pub fn image_size(&self) -> [u32; 2] {
        self.examples[0].image_size // never empty: `new` sees to it
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::parse_domain;

    const STATE: &str = "(define (problem p) (:domain d) (:objects a b - block r - robot)
        (:init (on a b)) (:goal (on b a)))";

    fn parse(boxes: &str) -> Result<Exemplar, ExemplarError> {
        let domain = "(define (domain d) (:requirements :typing) (:types block robot)
            (:predicates (on ?x - block ?y - block)))";
        let domain = parse_domain(&SourceText::new("d.pddl", domain)).unwrap().value;
        let boxes = SourceText::new("boxes.json", boxes);
        let state = SourceText::new("state.pddl", STATE);
        Exemplar::parse(
            &ExemplarText { boxes, state, image_size: [64, 48], volumes: None, masks: None },
            &domain,
        )
    }

    #[track_caller]
    fn check(boxes: &str, expect: &str) {
        let message = parse(boxes).unwrap_err().to_string();
        assert!(message.contains(expect), "{message}");
    }

    #[test]
    fn boxes_get_the_types_of_the_state() {
        let exemplar = parse(r#"{"a": [1, 2, 3.5, 4], "b": [1, 4, 4, 48]}"#).unwrap();
        assert_eq!(exemplar.objects[0].type_name, "block");
        assert_eq!(exemplar.objects[0].pixel_box, PixelBox::from([1.0, 2.0, 3.5, 4.0]));
        assert!(exemplar.init.contains(&Atom::new("on", &["a", "b"])));
    }

    #[test]
    fn bad_boxes_name_the_file_and_the_object() {
        check(r#"{"a": [3, 2, 3, 4]}"#, "boxes.json: a: expected finite x1 < x2");
        check(r#"{"a": [3, 2, 1, 1]}"#, "boxes.json: a: expected finite x1 < x2");
        check(r#"{"a": [1, 2, 65, 4]}"#, "boxes.json: a: expected a box inside 64 x 48, got");
        check(r#"{"a": [-1, 2, 6, 4]}"#, "a: expected a box inside");
        check(r#"{"A": [1, 2, 3, 4], "a": [1, 2, 3, 4]}"#, "a: expected one box per object");
        check(r#"{"c": [1, 2, 3, 4]}"#, "c: expected an object that the state declares");
        check(
            r#"{"a": [1, 2, 3]}"#,
            "boxes.json: a: expected four numbers, x1 y1 x2 y2, got [1,2,3]",
        );
        check(r#"{"a": [1, 2, 3, null]}"#, "boxes.json: a: expected four numbers");
        check(r#"{"a": "left"}"#, "boxes.json: a: expected four numbers");
        check(r#"{"a": [1, 2, NaN, 4]}"#, "boxes.json: expected value at line 1");
        check(r#"{"a": [1, 2, 3, 4]} x"#, "trailing");
        check("[]", "an object whose keys are names");
        check("", "boxes.json: EOF");
    }

    #[test]
    fn undecided_facts_are_told_with_their_lines() {
        let undecided = undecided_facts("(:init (on a b)\n  ;? (on b c)\n; ?\n;?(on c a)\n)");
        let told: Vec<_> = undecided.iter().map(|u| (u.line, u.fact.as_str())).collect();
        assert_eq!(told, [(2, "(on b c)"), (4, "(on c a)")]);
        let (file, n) = ("s.pddl".to_owned(), 2);
        let error = ExemplarError::Undecided { file, first: undecided[0].clone(), n };
        let expected = "s.pddl:2: undecided: (on b c), and 1 more; where a fact holds";
        assert!(error.to_string().starts_with(expected), "{error}");
    }

    #[test]
    fn bad_volumes_name_the_file_and_the_object() {
        let volume = r#""a": {"centre": [0, 0, 0], "extent": [1, 1, 1]}"#;
        let none = r#"{"a": {"centre": [0, 0, 0], "extent": [1, 0, 1]}}"#;
        for (volumes, expect) in [
            (format!("{{{volume}, {volume}}}"), "v.json: a: expected one volume per object"),
            (none.to_owned(), "v.json: a: expected finite numbers and positive extents"),
            (r#"{"a": 3}"#.to_owned(), "v.json: a: expected a centre and an extent, got 3"),
            (volume.replace("\"a\"", "{\"b\"") + "}", "v.json: b: expected an object that has"),
        ] {
            let mut exemplar = parse(r#"{"a": [1, 2, 3, 4]}"#).unwrap();
            let error = exemplar.add_volumes(&SourceText::new("v.json", volumes)).unwrap_err();
            assert!(error.to_string().starts_with(expect), "{error}");
        }
    }

    #[test]
    fn pooled_examples_share_one_image_size() {
        assert_eq!(Exemplars::new(Vec::new()), Err(ExemplarError::Empty));
        let first = parse(r#"{"a": [1, 2, 3, 4]}"#).unwrap();
        let second = Exemplar { image_size: [32, 24], ..first.clone() };
        let error = Exemplars::new(vec![first, second]).unwrap_err();
        assert!(matches!(error, ExemplarError::Size { got: [32, 24], .. }), "{error}");
    }
}
