//! The annotated detector: boxes from a file, for pictures that somebody has labelled or that a
//! detector was run on before.
//!
//! The file is a JSON object: `{"name": [x1, y1, x2, y2]}` in pixels, or
//! `{"name": {"type": "block", "box": [x1, y1, x2, y2], "score": 0.9}}`. Names are taken as they
//! stand. The picture is not looked at: every picture of the same size shows the same objects.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use super::boxes::is_inside;
use super::{Detector, DetectorError};
use crate::geometry::PixelBox;
use crate::mismatch::listed;
use crate::parts::{Part, PartContext, PartError, options_of};
use crate::pddl::Name;
use crate::perception::model::{ObjectBox, Perception, TypeSpec, json_entries};
use crate::perception::phrases::{answer, words};
use crate::perception::{Detection, Detections, ImageView};

/// `[perception.options]`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Options {
    /// The file with the boxes: JSON, `{"name": [x1, y1, x2, y2]}` in pixels, or
    /// `{"name": {"type": "block", "box": [x1, y1, x2, y2], "score": 0.9}}`.
    boxes: String,
    /// Types of objects whose entry does not say one and whose name does not tell it.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, String>")]
    types: BTreeMap<Name, Name>,
}

/// One entry of the file in its long form.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LongEntry {
    #[serde(rename = "type")]
    type_name: Option<Name>,
    #[serde(rename = "box")]
    pixel_box: PixelBox,
    score: Option<f64>,
}

/// Says what a file says.
#[derive(Debug, Clone)]
struct AnnotatedDetector {
    file: String,
    perception: Perception,
    objects: Vec<Detection>,
}

/// The entry of the table of detectors.
pub(super) const PART: Part<dyn Detector> = Part {
    name: "annotated",
    help: "boxes from a JSON file: labelled by hand, or found by another program",
    options: options_of::<Options>(),
    build,
};

fn build(context: &PartContext<'_, dyn Detector>) -> Result<Box<dyn Detector>, PartError> {
    let options: Options = context.options()?;
    let known_types = context.inputs.domain.known_types();
    if let Some((name, unknown)) = options.types.iter().find(|(_, t)| !known_types.contains(*t)) {
        let option = format!("types.{name}");
        return Err(context.bad_option(&option, one_of(&known_types), unknown));
    }
    let perception = context.inputs.perception;
    let text = context.read(&options.boxes)?;
    let file = context.path(&options.boxes).display().to_string();
    let objects = read(&text, &file, &options.types, (perception, &known_types))?;
    Ok(Box::new(AnnotatedDetector { file, perception: perception.clone(), objects }))
}

/// The objects of a file.
fn read(
    text: &str,
    file: &str,
    types: &BTreeMap<Name, Name>,
    (perception, known_types): (&Perception, &BTreeSet<Name>),
) -> Result<Vec<Detection>, PartError> {
    let fault = |message: String| PartError::file(file, message);
    let entries = json_entries(text).map_err(|e| fault(e.to_string()))?;
    let mut seen: BTreeSet<&Name> = BTreeSet::new();
    let mut objects = Vec::with_capacity(entries.len());
    for (name, value) in &entries {
        let wrong =
            |field: &str, expected: &str, got: &dyn std::fmt::Display| -> Result<_, PartError> {
                let message = format!("{name}{field}: expected {expected}, got {got}");
                Err(fault(message))
            };
        if !is_name(name) {
            return wrong("", "a name without blanks, brackets, quotes and semicolons", name);
        }
        if !seen.insert(name) {
            return wrong("", "one box per object", &"two");
        }
        let LongEntry { type_name, pixel_box, score } =
            read_entry(value).map_err(|message| fault(format!("{name}: {message}")))?;
        if !pixel_box.is_valid() {
            let got = listed(<[f64; 4]>::from(pixel_box));
            return wrong(".box", "finite x1 < x2 and y1 < y2", &got);
        }
        let score = score.unwrap_or(1.0);
        if !(0.0..=1.0).contains(&score) {
            return wrong(".score", "a share in 0..=1", &score);
        }
        let said = type_name.or_else(|| types.get(name).cloned());
        let type_name = match said.or_else(|| type_of(perception, name)) {
            Some(known) if known_types.contains(&known) => known,
            Some(unknown) => return wrong(".type", &one_of(known_types), &unknown),
            None => {
                let expected = "a name that tells the type, or one in perception.options.types";
                return wrong(".type", expected, &"neither");
            }
        };
        objects.push(Detection {
            name: Some(name.clone()),
            score: score as f32,
            // What tells it from others: it is itself in every frame.
            ..Detection::new(type_name, name.clone(), pixel_box)
        });
    }
    Ok(objects)
}

/// One entry, in its short or long form.
fn read_entry(value: &Value) -> Result<LongEntry, String> {
    let expected = "expected [x1, y1, x2, y2] or {\"type\", \"box\", \"score\"}";
    let fault = |e: serde_json::Error| format!("{expected}, got {value} ({e})");
    if value.is_object() {
        return LongEntry::deserialize(value).map_err(fault);
    }
    let pixel_box = PixelBox::deserialize(value).map_err(fault)?;
    Ok(LongEntry { type_name: None, pixel_box, score: None })
}

/// Whether a text can be an object's name in PDDL.
fn is_name(name: &Name) -> bool {
    let text = name.as_str();
    let separates = |c: char| c.is_whitespace() || c.is_control() || "()\"';?".contains(c);
    !text.is_empty() && !text.contains(separates)
}

/// The one type that a name tells: the name has all words of the type's prompt, or the type's name,
/// or the last word of the prompt; what more words tell counts more.
fn type_of(perception: &Perception, name: &Name) -> Option<Name> {
    let without_number = name.as_str().trim_end_matches(|c: char| c.is_ascii_digit());
    let own: BTreeSet<String> = words(without_number).collect();
    let told = |spec: &TypeSpec| -> usize {
        let prompt: Vec<String> = words(spec.prompt.as_deref().unwrap_or_default()).collect();
        let type_words: Vec<String> = words(spec.name.as_str()).collect();
        let has_all = |wanted: &[String]| {
            let all = !wanted.is_empty() && wanted.iter().all(|word| own.contains(word));
            if all { wanted.len() } else { 0 }
        };
        let last = prompt.last().map(std::slice::from_ref).unwrap_or_default();
        has_all(&prompt).max(has_all(&type_words)).max(has_all(last))
    };
    let best = perception.types.iter().map(told).max().filter(|n| *n > 0)?;
    let mut best_types = perception.types.iter().filter(|spec| told(spec) == best);
    let found = best_types.next()?;
    best_types.next().is_none().then(|| found.name.clone())
}

fn one_of(types: &BTreeSet<Name>) -> String {
    let list: Vec<&str> = types.iter().map(Name::as_str).collect();
    format!("a type of the domain ({})", list.join(", "))
}

impl Detector for AnnotatedDetector {
    fn learn(&mut self, _: &ImageView<'_>, _: &[ObjectBox]) -> Result<(), DetectorError> {
        Ok(())
    }

    fn detect(
        &mut self,
        image: &ImageView<'_>,
        phrases: &[String],
    ) -> Result<Detections, DetectorError> {
        if let Some(outside) = self.objects.iter().find(|o| !is_inside(&o.pixel_box, image)) {
            let (width, height) = (image.width(), image.height());
            let got = listed(<[f64; 4]>::from(outside.pixel_box));
            let name = &outside.label;
            let message =
                format!("{name}.box: expected a box inside {width} x {height}, got {got}");
            return Err(PartError::file(&self.file, message).into());
        }
        let names: Vec<Name> = self.objects.iter().map(|o| o.label.clone()).collect();
        let phrases = answer(&self.perception, (&names, &self.objects), phrases);
        Ok(Detections { objects: self.objects.clone(), phrases, ..Detections::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::name_detections;

    const HANOI: &str = include_str!("../../../domains/hanoi/perception.toml");

    fn parsed(text: &str, types: &[(&str, &str)]) -> Result<Vec<Detection>, PartError> {
        let perception = Perception::parse("perception.toml", HANOI).unwrap();
        let known_types = ["disk", "peg"].map(Name::new).into_iter().collect();
        let types = types.iter().map(|(n, t)| (Name::new(n), Name::new(t))).collect();
        read(text, "boxes.json", &types, (&perception, &known_types))
    }

    #[track_caller]
    fn check(text: &str, expect: &str) {
        let message = parsed(text, &[("it", "disk")]).unwrap_err().to_string();
        assert!(message.starts_with("boxes.json: ") && message.contains(expect), "{message}");
    }

    #[test]
    fn names_come_out_as_they_stand_with_the_types_that_they_tell() {
        let text = r#"{"pink_disk2": [1, 2, 3, 4], "Left_Peg": [5, 2, 7, 4],
            "wooden_stick": {"box": [8, 2, 9, 4], "score": 0.5}, "it": [1, 1, 2, 2],
            "that": {"type": "peg", "box": [1, 1, 2, 2]}}"#;
        let objects = parsed(text, &[("it", "disk")]).unwrap();
        let perception = Perception::parse("perception.toml", HANOI).unwrap();
        let names = name_detections(&perception, &objects);
        assert_eq!(names, ["pink_disk2", "left_peg", "wooden_stick", "it", "that"]);
        let types: Vec<&str> = objects.iter().map(|o| o.type_name.as_str()).collect();
        assert_eq!(types, ["disk", "peg", "peg", "disk", "peg"]);
        assert_eq!(objects[2].score, 0.5);
    }

    #[test]
    fn bad_entries_name_the_file_and_the_field() {
        check(r#"{"it": [1, 2, 3, 4], "IT": [5, 6, 7, 8]}"#, "it: expected one box per object");
        check(
            r#"{"it": [3, 2, 3, 4]}"#,
            "it.box: expected finite x1 < x2 and y1 < y2, got [3, 2, ",
        );
        check(r#"{"it": [3, 5, 4, 4]}"#, "it.box: expected finite");
        check(r#"{"it": [1, 2, null, 4]}"#, "it: expected [x1, y1, x2, y2] or");
        check(r#"{"it": [1, 2, 3]}"#, "it: expected [x1, y1, x2, y2] or");
        check(r#"{"it": {"box": [1, 2, 3, 4], "colour": 1}}"#, "unknown field `colour`");
        check(r#"{"it": {"box": [1, 2, 3, 4], "score": 1.5}}"#, "it.score: expected a share");
        check(r#"{"it": {"box": [1, 2, 3, 4], "type": "cup"}}"#, "it.type: expected a type of");
        check(r#"{"mug": [1, 2, 3, 4]}"#, "mug.type: expected a name that tells the type");
        check(r#"{"peg_disk": [1, 2, 3, 4]}"#, "peg_disk.type: expected a name that tells");
        check(r#"{"a b": [1, 2, 3, 4]}"#, "expected a name without blanks");
        check(r#"{"it": [1, NaN, 3, 4]}"#, "line 1");
        check("", "EOF");
        check("[]", "expected an object whose keys are names");
    }

    #[test]
    fn a_box_outside_the_picture_is_told() {
        let objects = parsed(r#"{"left_peg": [5, 2, 17, 4]}"#, &[]).unwrap();
        let perception = Perception::parse("perception.toml", HANOI).unwrap();
        let mut detector = AnnotatedDetector { file: "b.json".to_owned(), perception, objects };
        let rgb = [0; 3 * 16 * 8];
        let image = ImageView::new(16, 8, &rgb).unwrap();
        let message = detector.warm_up(&image).unwrap_err().to_string();
        assert!(message.starts_with("b.json: left_peg.box: expected a box inside 16 x 8"));
    }
}
