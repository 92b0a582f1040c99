//! A model's outputs as boxes in its input.

use super::description::{Activation, BoxForm, Description, InputSpec, OutputSpec, YoloAxes};
use super::masks::Prototypes;
use super::tensor::Tensor;
use crate::mismatch::listed;

/// Most candidates of one frame, best scores first: what is beyond is noise, and bounds the search
/// for doubles.
const CANDIDATES_MAX: usize = 300;

/// A box that a model has found: its edges in the input, in pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Candidate {
    pub(super) class: usize,
    pub(super) score: f32,
    pub(super) edges: [f64; 4],
    /// How much of each prototype its mask has; empty without masks.
    pub(super) weights: Vec<f32>,
}

impl Candidate {
    fn new((class, score): (usize, f32), edges: [f64; 4]) -> Self {
        Self { class, score, edges, weights: Vec::new() }
    }
}

/// What a model has found.
#[derive(Debug, PartialEq)]
pub(super) struct Decoded<'a> {
    /// Boxes, best scores first.
    pub(super) candidates: Vec<Candidate>,
    /// What their masks are made of, where the model has masks.
    pub(super) prototypes: Option<Prototypes<'a>>,
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
            Self::Yolo { tensor, masks, .. } | Self::EndToEnd { tensor, masks, .. } => {
                [Some(tensor), masks.as_ref()].into_iter().flatten().map(String::as_str).collect()
            }
            Self::Centernet { keypoints, distances } => vec![keypoints, distances],
        }
    }
}

/// The boxes in `outputs`, which are the tensors of [`OutputSpec::tensors`] in that order.
///
/// # Errors
/// The tensor whose shape is not as described.
pub(super) fn decode<'a>(
    description: &Description,
    outputs: &'a [Tensor],
) -> Result<Decoded<'a>, String> {
    let Description { input, output, score_min, .. } = description;
    let prototypes = match (output, outputs) {
        (OutputSpec::Yolo { .. } | OutputSpec::EndToEnd { .. }, [_, masks]) => {
            Some(Prototypes::new(masks)?)
        }
        _ => None,
    };
    let n_weights = prototypes.as_ref().map_or(0, Prototypes::len);
    let scale_of = |normalised: bool| if normalised { sides(input) } else { [1.0; 2] };
    let mut candidates = match (output, outputs) {
        (OutputSpec::Boxes { form, normalised, activation, .. }, [boxes, scores, rest @ ..]) => {
            let boxes_of = List { name: "boxes", tensor: boxes }.rows(4)?;
            let scale = scale_of(*normalised);
            let scored = scored((scores, *activation), rest.first(), boxes_of.len())?;
            let edges = boxes_of.iter().map(|row| corners(*form, row, scale));
            scored
                .into_iter()
                .zip(edges)
                .map(|(scored, edges)| Candidate::new(scored, edges))
                .collect()
        }
        (OutputSpec::Yolo { axes, objectness, normalised, .. }, [tensor, ..]) => {
            yolo((tensor, n_weights), *axes, *objectness, scale_of(*normalised))?
        }
        (OutputSpec::EndToEnd { normalised, .. }, [tensor, ..]) => {
            end_to_end((tensor, n_weights), scale_of(*normalised))?
        }
        (OutputSpec::Centernet { .. }, [keypoints, distances]) => {
            centernet(keypoints, distances, input, *score_min)?
        }
        _ => return Err("the model has other outputs than described".to_owned()),
    };
    // Not a number is below every bound.
    candidates.retain(|candidate: &Candidate| candidate.score >= *score_min);
    candidates.sort_by(|a, b| b.score.total_cmp(&a.score));
    candidates.truncate(CANDIDATES_MAX);
    Ok(Decoded { candidates, prototypes })
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
    (scores, activation): (&Tensor, Activation),
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
        let numbers = classes.values.iter().map(|class| class_number(*class));
        let shares = scores.values.iter().map(|score| match activation {
            Activation::Sigmoid => sigmoid(*score),
            Activation::None | Activation::Softmax => *score,
        });
        return Ok(numbers.zip(shares).collect());
    }
    let n_classes = scores.shape.last().copied().unwrap_or(0);
    let rows = List { name: "scores", tensor: scores }.rows(n_classes)?;
    if rows.len() != n {
        return Err(format!(
            "scores: expected {n} rows, one per box, got {}",
            listed(&scores.shape)
        ));
    }
    let best_share = |row: &[f32]| match activation {
        Activation::None => best(row),
        Activation::Sigmoid => {
            let (class, score) = best(row);
            (class, sigmoid(score))
        }
        Activation::Softmax => {
            // The last class says that there is nothing.
            let (class, score) = best(row.split_last().map_or(row, |(_, classes)| classes));
            (class, 1.0 / row.iter().map(|other| (other - score).exp()).sum::<f32>())
        }
    };
    Ok(rows.into_iter().map(best_share).collect())
}

fn sigmoid(value: f32) -> f32 {
    1.0 / (1.0 + (-value).exp())
}

/// A class number that a model tells as a float.
fn class_number(value: f32) -> usize {
    value.max(0.0).round() as usize
}

/// The greatest of a row, and its place; the first of equals.
fn best(row: &[f32]) -> (usize, f32) {
    let pairs = row.iter().copied().enumerate();
    pairs.reduce(|a, b| if b.1 > a.1 { b } else { a }).unwrap_or((0, f32::NAN))
}

/// Candidates with `n_weights` weights of their masks each.
fn yolo(
    (tensor, n_weights): (&Tensor, usize),
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
    let n_others = first_class + n_weights;
    if n_values <= n_others || tensor.values.len() != n_values * n {
        let expected = format!("more than {n_others} values per box");
        return Err(format!("tensor: expected {expected}, got shape {}", listed(&tensor.shape)));
    }
    let candidate = |i: usize| {
        let value = |j: usize| match axes {
            YoloAxes::ValuesFirst => tensor.values[j * n + i],
            YoloAxes::BoxesFirst => tensor.values[i * n_values + j],
        };
        let row: Vec<f32> = (0..n_values).map(value).collect();
        let (classes, weights) = row[first_class..].split_at(n_values - n_others);
        let (class, score) = best(classes);
        let score = if objectness { score * row[4] } else { score };
        let edges = corners(BoxForm::CentreAndSize, &row[..4], scale);
        Candidate { class, score, edges, weights: weights.to_vec() }
    };
    Ok((0..n).map(candidate).collect())
}

/// Objects as they are, with `n_weights` weights of their masks each.
fn end_to_end(
    (tensor, n_weights): (&Tensor, usize),
    scale: [f64; 2],
) -> Result<Vec<Candidate>, String> {
    let rows = List { name: "tensor", tensor }.rows(6 + n_weights)?;
    let object = |row: &[f32]| {
        let [_, _, _, _, score, class, ref weights @ ..] = *row else { return None };
        let edges = corners(BoxForm::Corners, row, scale);
        Some(Candidate { class: class_number(class), score, edges, weights: weights.to_vec() })
    };
    Ok(rows.into_iter().filter_map(object).collect())
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
                found.push(Candidate::new((class, score), [px - l, py - t, px + r, py + b]));
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
        let found: Vec<_> = found.candidates.iter().map(|c| (c.class, c.score, c.edges)).collect();
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
    fn scores_that_are_no_shares_become_shares() {
        let output = "kind = \"boxes\"\nboxes = \"b\"\nscores = \"s\"\n\
                      form = \"centre_and_size\"\nnormalised = true\nactivation = ";
        let boxes = tensor(&[1, 2, 4], &[0.375, 0.25, 0.5, 0.25, 0.5, 0.5, 1.0, 1.0]);
        let logits = tensor(&[1, 2, 3], &[-9.0, 1.0, 0.0, -9.0, -1.0, -9.0]);
        let edges = [1.0, 1.0, 5.0, 3.0];
        let outputs = [boxes, logits];
        check(&format!("{output}\"sigmoid\""), &outputs, &[(1, sigmoid(1.0), edges)]);
        // Of the last class there is nothing, though its score is the greatest of the second box.
        let outputs = [outputs[0].clone(), tensor(&[1, 2, 3], &[0.0, 3.0, 0.0, 2.0, 0.0, 3.0])];
        let share = 1.0 / (1.0 + 2.0 * (-3.0_f32).exp());
        check(&format!("{output}\"softmax\""), &outputs, &[(1, share, edges)]);
        assert!((share - 0.91).abs() < 0.01);
    }

    #[test]
    fn weights_of_masks_follow_the_classes() {
        let prototypes = tensor(&[1, 2, 1, 1], &[1.0, 2.0]);
        let yolo = format!("{YOLO}\nmasks = \"m\"");
        let row = [3.0, 2.0, 4.0, 2.0, 0.1, 0.9, 7.0, -8.0];
        let end_to_end =
            "kind = \"end_to_end\"\ntensor = \"out\"\nnormalised = false\nmasks = \"m\"";
        let object = [1.0, 1.0, 5.0, 3.0, 0.9, 1.0, 7.0, -8.0];
        let nothing = [0.0; 8];
        for (output, tensor) in [
            (yolo.as_str(), tensor(&[1, 8, 1], &row)),
            (end_to_end, tensor(&[1, 2, 8], &[object, nothing].concat())),
        ] {
            let description = described(output);
            let outputs = [tensor, prototypes.clone()];
            let decoded = decode(&description, &outputs).unwrap();
            let edges = [1.0, 1.0, 5.0, 3.0];
            let weights = vec![7.0, -8.0];
            assert_eq!(decoded.candidates, [Candidate { class: 1, score: 0.9, edges, weights }]);
            assert_eq!(decoded.prototypes.map(|p| p.len()), Some(2));
        }
        let plain = end_to_end.replace("\nmasks = \"m\"", "");
        check(&plain, &[tensor(&[1, 1, 6], &object[..6])], &[(1, 0.9, [1.0, 1.0, 5.0, 3.0])]);
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
        let end_to_end = "kind = \"end_to_end\"\ntensor = \"out\"\nnormalised = false";
        let masked = format!("{YOLO}\nmasks = \"m\"");
        let flat = |n: usize| tensor(&[n], &vec![0.0; n]);
        for (output, outputs, expect) in [
            (YOLO, vec![tensor(&[2, 3], &[0.0; 6])], "tensor: expected shape [1, …, …]"),
            (YOLO, vec![tensor(&[1, 4, 1], &[0.0; 4])], "expected more than 4 values per box"),
            (YOLO, Vec::new(), "other outputs than described"),
            (
                &masked,
                vec![tensor(&[1, 7, 1], &[0.0; 7]), tensor(&[2, 2], &[0.0; 4])],
                "masks: expected shape [1, K, h, w], got [2, 2]",
            ),
            (
                &masked,
                vec![tensor(&[1, 7, 1], &[0.0; 7]), tensor(&[1, 3, 1, 1], &[0.0; 3])],
                "expected more than 7 values per box",
            ),
            (end_to_end, vec![tensor(&[1, 7, 1], &[0.0; 7])], "tensor: expected shape [N, 6]"),
            (boxes, vec![tensor(&[3, 5], &[0.0; 15]), flat(3), flat(3)], "boxes: expected shape"),
            (boxes, vec![tensor(&[1, 4], &[0.0; 4]), flat(3), flat(1)], "scores: expected 1"),
            (boxes, vec![tensor(&[1, 4], &[0.0; 4]), flat(1), flat(2)], "classes: expected 1"),
        ] {
            let message = decode(&described(output), &outputs).unwrap_err();
            assert!(message.contains(expect), "{message}");
        }
    }
}
