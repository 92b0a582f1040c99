//! A model's outputs as boxes in its input.

use super::description::{BoxForm, Description, InputSpec, OutputSpec, YoloAxes};
use crate::mismatch::listed;

/// Most candidates of one frame, best scores first: what is beyond is noise, and bounds the search
/// for doubles.
const CANDIDATES_MAX: usize = 300;

/// One output as numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tensor {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f32>,
}

/// A box that a model has found: its edges in the input, in pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub(super) class: usize,
    pub(super) score: f32,
    pub(super) edges: [f64; 4],
}

impl OutputSpec {
    /// The tensors that it is read from.
    pub(super) fn tensors(&self) -> Vec<&str> {
        match self {
            Self::Boxes { boxes, scores, classes, .. } => {
                [Some(boxes), Some(scores), classes.as_ref()]
                    .into_iter()
                    .flatten()
                    .map(String::as_str)
                    .collect()
            }
            Self::Yolo { tensor, .. } => vec![tensor],
            Self::Centernet { keypoints, distances } => vec![keypoints, distances],
        }
    }
}

/// The boxes in `outputs`, which are the tensors of [`OutputSpec::tensors`] in that order.
///
/// # Errors
/// The tensor whose shape is not as described.
pub(super) fn decode(
    description: &Description,
    outputs: &[Tensor],
) -> Result<Vec<Candidate>, String> {
    let Description { input, output, score_min, .. } = description;
    let mut found = match (output, outputs) {
        (OutputSpec::Boxes { form, normalised, .. }, [boxes, scores, rest @ ..]) => {
            let boxes_of = List { name: "boxes", tensor: boxes }.rows(4)?;
            let scale = if *normalised { sides(input) } else { [1.0; 2] };
            let scored = scored(scores, rest.first(), boxes_of.len())?;
            let edges = boxes_of.iter().map(|row| corners(*form, row, scale));
            let pairs = edges.zip(scored);
            pairs.map(|(edges, (class, score))| Candidate { class, score, edges }).collect()
        }
        (OutputSpec::Yolo { axes, objectness, normalised, .. }, [tensor]) => {
            let scale = if *normalised { sides(input) } else { [1.0; 2] };
            yolo(tensor, *axes, *objectness, scale)?
        }
        (OutputSpec::Centernet { .. }, [keypoints, distances]) => {
            centernet(keypoints, distances, input, *score_min)?
        }
        _ => return Err("the model has other outputs than described".to_owned()),
    };
    // Not a number is below every bound.
    found.retain(|candidate: &Candidate| candidate.score >= *score_min);
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    found.truncate(CANDIDATES_MAX);
    Ok(found)
}

fn sides(input: &InputSpec) -> [f64; 2] {
    [input.width as f64, input.height as f64]
}

fn corners(form: BoxForm, row: &[f32], scale: [f64; 2]) -> [f64; 4] {
    let value = |i: usize| row.get(i).copied().map_or(f64::NAN, f64::from);
    let [a, b, c, d] = [value(0), value(1), value(2), value(3)];
    let [x1, y1, x2, y2] = match form {
        BoxForm::Corners => [a, b, c, d],
        BoxForm::CornersRowFirst => [b, a, d, c],
        BoxForm::CentreAndSize => [a - c / 2.0, b - d / 2.0, a + c / 2.0, b + d / 2.0],
    };
    [x1 * scale[0], y1 * scale[1], x2 * scale[0], y2 * scale[1]]
}

/// A tensor that is a list of rows, perhaps in a batch of one.
struct List<'a> {
    name: &'static str,
    tensor: &'a Tensor,
}

impl<'a> List<'a> {
    /// The rows of `n_values` numbers.
    fn rows(&self, n_values: usize) -> Result<Vec<&'a [f32]>, String> {
        let Tensor { shape, values } = self.tensor;
        let unbatched = if shape.len() == 3 && shape[0] == 1 { &shape[1..] } else { &shape[..] };
        match unbatched {
            [_, n] if *n == n_values && n_values > 0 => Ok(values.chunks_exact(n_values).collect()),
            _ => {
                Err(format!("{}: expected shape [N, {n_values}], got {}", self.name, listed(shape)))
            }
        }
    }
}

/// Class and score of each of `n` boxes.
fn scored(
    scores: &Tensor,
    classes: Option<&Tensor>,
    n: usize,
) -> Result<Vec<(usize, f32)>, String> {
    if let Some(classes) = classes {
        for (name, tensor) in [("scores", scores), ("classes", classes)] {
            if tensor.values.len() != n {
                let shape = &tensor.shape;
                return Err(format!(
                    "{name}: expected {n} values, one per box, got {}",
                    listed(shape)
                ));
            }
        }
        let numbers = classes.values.iter().map(|class| class.max(0.0).round() as usize);
        return Ok(numbers.zip(scores.values.iter().copied()).collect());
    }
    let n_classes = scores.shape.last().copied().unwrap_or(0);
    let rows = List { name: "scores", tensor: scores }.rows(n_classes)?;
    if rows.len() != n {
        return Err(format!(
            "scores: expected {n} rows, one per box, got {}",
            listed(&scores.shape)
        ));
    }
    Ok(rows.into_iter().map(best).collect())
}

/// The greatest of a row, and its place; the first of equals.
fn best(row: &[f32]) -> (usize, f32) {
    let pairs = row.iter().copied().enumerate();
    pairs.reduce(|a, b| if b.1 > a.1 { b } else { a }).unwrap_or((0, f32::NAN))
}

fn yolo(
    tensor: &Tensor,
    axes: YoloAxes,
    objectness: bool,
    scale: [f64; 2],
) -> Result<Vec<Candidate>, String> {
    let [1, first, second] = *tensor.shape.as_slice() else {
        return Err(format!("tensor: expected shape [1, …, …], got {}", listed(&tensor.shape)));
    };
    let (n_values, n) = match axes {
        YoloAxes::ValuesFirst => (first, second),
        YoloAxes::BoxesFirst => (second, first),
    };
    let first_class = 4 + usize::from(objectness);
    if n_values <= first_class || tensor.values.len() != n_values * n {
        let expected = format!("more than {first_class} values per box");
        return Err(format!("tensor: expected {expected}, got shape {}", listed(&tensor.shape)));
    }
    let candidate = |i: usize| {
        let value = |j: usize| match axes {
            YoloAxes::ValuesFirst => tensor.values[j * n + i],
            YoloAxes::BoxesFirst => tensor.values[i * n_values + j],
        };
        let row: Vec<f32> = (0..n_values).map(value).collect();
        let (class, score) = best(&row[first_class..]);
        let score = if objectness { score * row[4] } else { score };
        Candidate { class, score, edges: corners(BoxForm::CentreAndSize, &row[..4], scale) }
    };
    Ok((0..n).map(candidate).collect())
}

/// Points that are the greatest among their neighbours in the map of their class.
fn centernet(
    keypoints: &Tensor,
    distances: &Tensor,
    input: &InputSpec,
    score_min: f32,
) -> Result<Vec<Candidate>, String> {
    let [1, n_classes, h, w] = *keypoints.shape.as_slice() else {
        return Err(format!(
            "keypoints: expected shape [1, C, h, w], got {}",
            listed(&keypoints.shape)
        ));
    };
    if distances.shape != [1, 4, h, w] || h == 0 || w == 0 {
        let got = listed(&distances.shape);
        return Err(format!("distances: expected shape [1, 4, {h}, {w}], got {got}"));
    }
    let stride = [input.width as f64 / w as f64, input.height as f64 / h as f64];
    let at = |tensor: &Tensor, plane: usize, y: usize, x: usize| {
        tensor.values.get((plane * h + y) * w + x).copied().unwrap_or(f32::NAN)
    };
    let mut found = Vec::new();
    for class in 0..n_classes {
        for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
            let score = at(keypoints, class, y, x);
            let neighbours = (y.saturating_sub(1)..h.min(y + 2))
                .flat_map(|y| (x.saturating_sub(1)..w.min(x + 2)).map(move |x| (y, x)));
            let is_peak =
                || neighbours.into_iter().all(|(y, x)| at(keypoints, class, y, x) <= score);
            if score >= score_min && is_peak() {
                let [l, t, r, b] = [0, 1, 2, 3].map(|side| f64::from(at(distances, side, y, x)));
                let (px, py) = (stride[0] * x as f64, stride[1] * y as f64);
                found.push(Candidate { class, score, edges: [px - l, py - t, px + r, py + b] });
            }
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::pddl::Name;
    use crate::perception::detectors::onnx::description::tests::SMALL;

    /// The small description with another output.
    fn described(output: &str) -> Description {
        let start = SMALL.find("[output]").unwrap();
        let end = SMALL.find("[[class]]").unwrap();
        let text = format!("{}[output]\n{output}\n{}", &SMALL[..start], &SMALL[end..]);
        Description::parse(&text, &BTreeSet::from([Name::new("block")])).unwrap()
    }

    fn tensor(shape: &[usize], values: &[f32]) -> Tensor {
        assert_eq!(shape.iter().product::<usize>(), values.len());
        Tensor { shape: shape.to_vec(), values: values.to_vec() }
    }

    #[track_caller]
    fn check(output: &str, outputs: &[Tensor], expect: &[(usize, f32, [f64; 4])]) {
        let description = described(output);
        assert_eq!(description.output.tensors().len(), outputs.len());
        let found = decode(&description, outputs).unwrap();
        let found: Vec<_> = found.iter().map(|c| (c.class, c.score, c.edges)).collect();
        assert_eq!(found, expect);
    }

    const YOLO: &str = "kind = \"yolo\"\ntensor = \"out\"\naxes = \"values_first\"\n\
                        objectness = false\nnormalised = false";

    /// Two candidates of two classes, the second with too low a score.
    #[test]
    fn yolo_tensors_are_read_along_either_axis() {
        let [a, b] = [[3.0, 2.0, 4.0, 2.0, 0.1, 0.9], [1.0, 1.0, 1.0, 1.0, 0.4, f32::NAN]];
        let expect = [(1, 0.9, [1.0, 1.0, 5.0, 3.0])];
        let values: Vec<f32> = (0..6).flat_map(|i| [a[i], b[i]]).collect();
        check(YOLO, &[tensor(&[1, 6, 2], &values)], &expect);
        let boxes_first = YOLO.replace("values_first", "boxes_first");
        check(&boxes_first, &[tensor(&[1, 2, 6], &[a, b].concat())], &expect);
        let sure = boxes_first.replace("objectness = false", "objectness = true");
        let sure = sure.replace("normalised = false", "normalised = true");
        let row = [0.375, 0.25, 0.5, 0.25, 0.75, 0.0, 1.0];
        check(&sure, &[tensor(&[1, 1, 7], &row)], &[(1, 0.75, [1.0, 1.0, 5.0, 3.0])]);
    }

    #[test]
    fn box_lists_have_class_numbers_or_a_score_per_class() {
        let output = "kind = \"boxes\"\nboxes = \"b\"\nscores = \"s\"\nclasses = \"c\"\n\
                      form = \"corners_row_first\"\nnormalised = true";
        let boxes = tensor(&[1, 2, 4], &[0.125, 0.25, 0.5, 0.75, 0.0, 0.0, 1.0, 1.0]);
        let scores = tensor(&[1, 2], &[0.6, 0.2]);
        let classes = tensor(&[1, 2], &[1.0, 0.0]);
        let expect = [(1, 0.6, [2.0, 1.0, 6.0, 4.0])];
        check(output, &[boxes.clone(), scores, classes], &expect);
        let per_class = output.replace("classes = \"c\"\n", "");
        let scores = tensor(&[2, 2], &[0.1, 0.6, 0.2, 0.2]);
        check(&per_class, &[boxes, scores], &expect);
    }

    #[test]
    fn centernet_peaks_are_boxes() {
        let output = "kind = \"centernet\"\nkeypoints = \"k\"\ndistances = \"d\"";
        // Two classes on a map of 4 x 4: a stride of two pixels.
        let mut keypoints = vec![0.0; 32];
        keypoints[16 + 4 + 2] = 0.9;
        keypoints[16 + 4 + 3] = 0.8; // a neighbour of the peak
        keypoints[12] = 0.55;
        let mut distances = vec![0.0; 64];
        for (side, distance) in [3.0, 1.0, 2.0, 1.5].into_iter().enumerate() {
            distances[16 * side + 4 + 2] = distance;
        }
        let maps = [tensor(&[1, 2, 4, 4], &keypoints), tensor(&[1, 4, 4, 4], &distances)];
        let expect = [(1, 0.9, [1.0, 1.0, 6.0, 3.5]), (0, 0.55, [0.0, 6.0, 0.0, 6.0])];
        check(output, &maps, &expect);
    }

    #[test]
    fn other_shapes_are_told_with_the_tensor() {
        let boxes = "kind = \"boxes\"\nboxes = \"b\"\nscores = \"s\"\nclasses = \"c\"\n\
                     form = \"corners\"\nnormalised = false";
        let flat = |n: usize| tensor(&[n], &vec![0.0; n]);
        for (output, outputs, expect) in [
            (YOLO, vec![tensor(&[2, 3], &[0.0; 6])], "tensor: expected shape [1, …, …]"),
            (YOLO, vec![tensor(&[1, 4, 1], &[0.0; 4])], "expected more than 4 values per box"),
            (YOLO, Vec::new(), "other outputs than described"),
            (boxes, vec![tensor(&[3, 5], &[0.0; 15]), flat(3), flat(3)], "boxes: expected shape"),
            (boxes, vec![tensor(&[1, 4], &[0.0; 4]), flat(3), flat(1)], "scores: expected 1"),
            (boxes, vec![tensor(&[1, 4], &[0.0; 4]), flat(1), flat(2)], "classes: expected 1"),
        ] {
            let message = decode(&described(output), &outputs).unwrap_err();
            assert!(message.contains(expect), "{message}");
        }
    }
}
