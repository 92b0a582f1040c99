//! A checkout of the data set, whole or partial: `data/<domain>/` as it lies on disk.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use super::EvalError;
use super::forms::inside_of;
use crate::geometry::PixelBox;
use crate::mismatch::Mismatch;
use crate::pddl::{
    Atom, Domain, Name, Problem, SourceText, Step, Typed, parse_domain, parse_plan, parse_problem,
};
use crate::perception::model::{Exemplar, ObjectBox};
use crate::run::{read_image, read_pddl, read_text};

/// One domain of a checkout.
#[derive(Debug, Clone)]
pub struct DomainData {
    /// Its name: the folder's.
    pub name: String,
    /// Its own `domain.pddl`.
    pub domain: Domain,
    /// The problems that can be evaluated, by number.
    pub problems: Vec<Labelled>,
    /// Problems that cannot be, and why.
    pub left_out: Vec<String>,
    /// Where the recorded results lie, if there are any.
    pub(super) recorded: PathBuf,
}

/// One labelled problem: a photograph with its boxes, its state and its goal.
#[derive(Debug, Clone)]
pub struct Labelled {
    /// The number in its file's name.
    pub number: u32,
    /// Objects, facts and goal.
    pub problem: Problem,
    /// The facts as they are listed: one that is listed twice counts twice.
    pub init: Vec<Atom>,
    /// The annotated boxes with the types that the problem declares, in the order of the file.
    pub boxes: Vec<ObjectBox>,
    /// What the boxes are called in messages: their file.
    pub boxes_file: String,
    /// The photograph, where it is there.
    pub photo: Option<PathBuf>,
    /// Its width and height in pixels; without a photograph the least that holds all boxes.
    pub image_size: [u32; 2],
    /// The instruction, where it is there.
    pub instruction: Option<String>,
}

/// Reads the domains of a checkout: all, or those named.
///
/// # Errors
/// [`EvalError`] naming the file and field that is missing or malformed.
pub fn read(root: &Path, wanted: &[String]) -> Result<Vec<DomainData>, EvalError> {
    let folder = root.join("data");
    let mut names: BTreeSet<String> = BTreeSet::new();
    for entry in fs::read_dir(&folder).map_err(|e| fault(&folder, &e.to_string()))? {
        let path = entry.map_err(|e| fault(&folder, &e.to_string()))?.path();
        if path.join("domain.pddl").is_file() {
            names.extend(path.file_name().map(|name| name.to_string_lossy().into_owned()));
        }
    }
    if let Some(missing) = wanted.iter().find(|name| !names.contains(*name)) {
        let expected = names.into_iter().collect::<Vec<_>>().join(" or ");
        let at = format!("{}: domain", folder.display());
        return Err(Mismatch::new(at, expected, missing).into());
    }
    names.retain(|name| wanted.is_empty() || wanted.contains(name));
    if names.is_empty() {
        return Err(fault(&folder, "expected folders with a domain.pddl, found none"));
    }
    names.iter().map(|name| read_domain(root, name)).collect()
}

fn read_domain(root: &Path, name: &str) -> Result<DomainData, EvalError> {
    let folder = root.join("data").join(name);
    let domain = parse_domain(&source(&folder.join("domain.pddl"))?)?.value;
    let (mut problems, mut left_out) = (Vec::new(), Vec::new());
    for number in numbers(&folder.join("problems"))? {
        let boxes = folder.join(format!("annotated_bboxes/problem{number}.json"));
        if boxes.is_file() {
            problems.push(read_problem(&folder, number, &domain)?);
        } else {
            left_out.push(format!("problem {number} has no annotated boxes"));
        }
    }
    let recorded = root.join("results/reported_results").join(name);
    Ok(DomainData { name: name.to_owned(), domain, problems, left_out, recorded })
}

/// The numbers of the files that are called `problem<number>.pddl`, exactly.
fn numbers(folder: &Path) -> Result<BTreeSet<u32>, EvalError> {
    let mut found = BTreeSet::new();
    for entry in fs::read_dir(folder).map_err(|e| fault(folder, &e.to_string()))? {
        let name = entry.map_err(|e| fault(folder, &e.to_string()))?.file_name();
        found.extend(name.to_str().and_then(number_of));
    }
    Ok(found)
}

fn number_of(file: &str) -> Option<u32> {
    let digits = file.strip_prefix("problem")?.strip_suffix(".pddl")?;
    let number: u32 = digits.parse().ok()?;
    (number.to_string() == digits).then_some(number)
}

fn read_problem(folder: &Path, number: u32, domain: &Domain) -> Result<Labelled, EvalError> {
    let file = |kind: &str, end: &str| folder.join(format!("{kind}/problem{number}.{end}"));
    let text = source(&file("problems", "pddl"))?;
    let problem = parse_problem(&text, domain)?.value;
    let init = atoms_of(&text, ":init")?;
    let path = file("annotated_bboxes", "json");
    let declared: Vec<&Typed> = problem.objects.iter().chain(&domain.constants).collect();
    let boxes: Vec<ObjectBox> = read_boxes(&path)?
        .into_iter()
        .map(|(name, pixel_box)| {
            let typed = declared.iter().find(|typed| typed.name == name).ok_or_else(|| {
                field(&path, &name, "an object that the problem declares", "none")
            })?;
            Ok(ObjectBox::new(name, type_of(typed), pixel_box))
        })
        .collect::<Result<_, EvalError>>()?;
    let photo = Some(file("observations", "jpg")).filter(|path| path.is_file());
    let image_size = match &photo {
        Some(path) => {
            let (width, height) =
                image::image_dimensions(path).map_err(|e| fault(path, &e.to_string()))?;
            [width, height]
        }
        None => size_around(&boxes),
    };
    let path_of_text = file("instructions", "txt");
    let instruction = path_of_text.is_file().then(|| read_text(&path_of_text)).transpose()?;
    let boxes_file = path.display().to_string();
    Ok(Labelled { number, problem, init, boxes, boxes_file, photo, image_size, instruction })
}

/// The least image that holds all boxes.
fn size_around(boxes: &[ObjectBox]) -> [u32; 2] {
    let most = |edge: fn(&PixelBox) -> f64| {
        boxes.iter().map(|b| edge(&b.pixel_box)).fold(1.0, f64::max).ceil() as u32
    };
    [most(|b| b.x2), most(|b| b.y2)]
}

impl Labelled {
    /// The problem as a labelled example. Boxes are kept to the digit, also where they leave the
    /// image by a part of a pixel: features are compared with recorded ones.
    pub fn exemplar(&self) -> Exemplar {
        Exemplar {
            name: self.boxes_file.clone(),
            image_size: self.image_size,
            objects: self.boxes.clone(),
            init: self.problem.init.clone(),
        }
    }

    /// Reads the photograph.
    ///
    /// # Errors
    /// [`EvalError`] naming the file.
    pub fn picture(&self) -> Result<Option<image::RgbImage>, EvalError> {
        Ok(self.photo.as_deref().map(read_image).transpose()?)
    }
}

/// A text file, with its name for messages.
pub(super) fn source(path: &Path) -> Result<SourceText, EvalError> {
    Ok(read_pddl(path)?)
}

/// The ground atoms of a form, in order and as often as they are listed. Names are not checked.
pub(super) fn atoms_of(text: &SourceText, head: &str) -> Result<Vec<Atom>, EvalError> {
    let inside = inside_of(text, head).ok_or_else(|| EvalError::File {
        path: text.name.clone(),
        reason: format!("expected a form ({head} …), found none"),
    })?;
    // A list of facts has the form of a list of steps.
    let steps = parse_plan(&inside)?;
    Ok(steps.into_iter().map(|Step { action, args }| Atom { predicate: action, args }).collect())
}

/// A box file, `{"name": [x1, y1, x2, y2], …}`, in its order.
pub(super) fn read_boxes(path: &Path) -> Result<Vec<(Name, PixelBox)>, EvalError> {
    let text = read_text(path)?;
    let map: Map<String, Value> =
        serde_json::from_str(&text).map_err(|e| fault(path, &e.to_string()))?;
    let mut boxes: Vec<(Name, PixelBox)> = Vec::with_capacity(map.len());
    for (key, value) in map {
        let name = Name::new(&key);
        let pixel_box = serde_json::from_value::<PixelBox>(value.clone())
            .ok()
            .filter(PixelBox::is_valid)
            .ok_or_else(|| {
                let expected = "[x1, y1, x2, y2] with x1 < x2 and y1 < y2";
                field(path, &name, expected, &value.to_string())
            })?;
        if boxes.iter().any(|(other, _)| *other == name) {
            return Err(field(path, &name, "one box per object", "two"));
        }
        boxes.push((name, pixel_box));
    }
    Ok(boxes)
}

/// The first of an object's types; `object` where it has none.
pub(super) fn type_of(typed: &Typed) -> Name {
    typed.types.first().cloned().unwrap_or_else(|| "object".into())
}

pub(super) fn fault(path: &Path, reason: &str) -> EvalError {
    EvalError::File { path: path.display().to_string(), reason: reason.to_owned() }
}

pub(super) fn field(path: &Path, field: &Name, expected: &str, got: &str) -> EvalError {
    Mismatch::new(format!("{}: {field}", path.display()), expected, got).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plainly_numbered_problems_count() {
        for (file, expect) in [
            ("problem1.pddl", Some(1)),
            ("problem10.pddl", Some(10)),
            ("problem1_uplrefactor.pddl", None),
            ("problem01.pddl", None),
            ("problem+1.pddl", None),
            ("problem.pddl", None),
            ("problem1.pddl~", None),
            ("xproblem1.pddl", None),
        ] {
            assert_eq!(number_of(file), expect, "{file}");
        }
    }
}
