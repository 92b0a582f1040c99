//! The TOML file beside a model: what goes in, what comes out, what the classes are.

use std::collections::BTreeSet;

use serde::Deserialize;

use crate::mismatch::listed;
use crate::pddl::Name;

/// Longest side of a model's input, pixels: bounds memory.
const SIDE_MAX: usize = 4_096;

/// A model described.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Description {
    pub(super) input: InputSpec,
    pub(super) output: OutputSpec,
    /// Least score of a box.
    pub(super) score_min: f32,
    /// Boxes of one type that overlap more (intersection over union) are one object.
    pub(super) duplicate_iou: f64,
    /// The model's classes that are objects of the domain.
    pub(super) class: Vec<ClassSpec>,
}

/// `[input]`: a value is `(channel * scale - mean) / std`, with the channel in 0..=255.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InputSpec {
    /// Its name; without one, the model's only input.
    pub(super) name: Option<String>,
    /// The input that is told the size of the picture that boxes are in, `[1, 2]` whole numbers, width
    /// and height: `orig_target_sizes`. It is told the size of the model's input.
    pub(super) sizes: Option<String>,
    /// Pixels.
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) layout: Layout,
    pub(super) channels: Channels,
    pub(super) resize: Resize,
    pub(super) scale: f32,
    pub(super) mean: [f32; 3],
    pub(super) std: [f32; 3],
}

/// The order of the input's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Layout {
    /// Batch, channel, row, column.
    Nchw,
    /// Batch, row, column, channel.
    Nhwc,
}

/// The order of the colour channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Channels {
    Rgb,
    Bgr,
}

/// How a frame is brought to the input's size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Resize {
    /// Each side by its own factor.
    Plain,
    /// Both sides by one factor, with grey bars of equal width on the two sides that are short.
    Letterbox,
}

/// `[output]`: which tensors there are and how boxes stand in them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind", deny_unknown_fields)]
pub(super) enum OutputSpec {
    /// A list of boxes with scores and, where scores are not given per class, class numbers.
    Boxes {
        /// `[N, 4]`, with or without a batch axis.
        boxes: String,
        /// `[N]`, or `[N, C]` without `classes`; with or without a batch axis.
        scores: String,
        /// `[N]`, with or without a batch axis.
        classes: Option<String>,
        form: BoxForm,
        /// Whether coordinates are shares of the input's sides instead of its pixels.
        normalised: bool,
        /// What makes shares of scores that are none.
        #[serde(default)]
        activation: Activation,
    },
    /// One tensor of candidates: middle and size of the box, then perhaps how sure it is that there
    /// is anything, then a score per class, then perhaps the weights of the box's mask.
    Yolo {
        tensor: String,
        axes: YoloAxes,
        /// Whether a value before the classes says how sure it is that there is anything.
        objectness: bool,
        normalised: bool,
        /// The prototypes of masks, `[1, K, h, w]` over the input; `K` weights follow the classes.
        masks: Option<String>,
    },
    /// One tensor of objects without doubles, `[1, N, 6 + K]`: left, top, right and bottom edge, score,
    /// class number, then perhaps the weights of the object's mask.
    EndToEnd {
        tensor: String,
        normalised: bool,
        /// The prototypes of masks, `[1, K, h, w]` over the input.
        masks: Option<String>,
    },
    /// Maps over the image: per class how much each point is the middle of one, and how far the four
    /// edges are from there, in pixels of the input.
    Centernet {
        /// `[1, C, h, w]`.
        keypoints: String,
        /// `[1, 4, h, w]`: to the left, top, right and bottom edge.
        distances: String,
    },
}

/// What makes shares of a model's scores.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Activation {
    /// They are shares.
    #[default]
    None,
    /// Each by itself.
    Sigmoid,
    /// All of a box together; the last class is "no object".
    Softmax,
}

/// What the four numbers of a box mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum BoxForm {
    /// Left, top, right and bottom edge.
    Corners,
    /// Top, left, bottom and right edge.
    CornersRowFirst,
    /// Middle column, middle row, width, height.
    CentreAndSize,
}

/// The order of a YOLO tensor's axes after the batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum YoloAxes {
    /// `[1, 4 + C, N]`.
    ValuesFirst,
    /// `[1, N, 4 + C]`.
    BoxesFirst,
}

/// `[[class]]`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ClassSpec {
    /// Its number in the model.
    pub(super) number: usize,
    /// The PDDL type of such objects.
    #[serde(rename = "type")]
    pub(super) type_name: Name,
}

impl Description {
    /// Reads and checks a description; the types must be among `seen_types`.
    ///
    /// # Errors
    /// What is wrong: line and column, or the field with what was expected.
    pub(super) fn parse(text: &str, seen_types: &BTreeSet<Name>) -> Result<Self, String> {
        let description: Self = toml::from_str(text).map_err(|e| e.to_string())?;
        let wrong = |field: &str, expected: &str, got: &dyn std::fmt::Display| {
            Err(format!("{field}: expected {expected}, got {got}"))
        };
        let Self { input, score_min, duplicate_iou, class, .. } = &description;
        for (field, side) in [("input.width", input.width), ("input.height", input.height)] {
            if !(1..=SIDE_MAX).contains(&side) {
                return wrong(field, &format!("1..={SIDE_MAX}"), &side);
            }
        }
        let numbers = input.mean.iter().chain([&input.scale]);
        if !numbers.chain(&input.std).all(|v| v.is_finite()) || input.std.contains(&0.0) {
            let (mean, std) = (listed(input.mean), listed(input.std));
            let got = format!("scale {}, mean {mean}, std {std}", input.scale);
            return wrong("input", "finite scale, mean and std, and std not 0", &got);
        }
        if !(0.0..=1.0).contains(score_min) {
            return wrong("score_min", "a share in 0..=1", score_min);
        }
        if !(0.0..=1.0).contains(duplicate_iou) {
            return wrong("duplicate_iou", "a share in 0..=1", duplicate_iou);
        }
        if let OutputSpec::Boxes { classes: Some(classes), activation, .. } = &description.output
            && *activation == Activation::Softmax
        {
            let expected = "none or sigmoid where class numbers are given (output.classes)";
            return wrong("output.activation", expected, &format!("softmax beside {classes}"));
        }
        let mut numbers = BTreeSet::new();
        for ClassSpec { number, type_name } in class {
            if !numbers.insert(number) {
                return wrong("class.number", "each number once", number);
            }
            if !seen_types.contains(type_name) {
                let known: Vec<&str> = seen_types.iter().map(Name::as_str).collect();
                let expected = format!("a type of perception.toml ({})", known.join(", "));
                return wrong(&format!("class {number}: type"), &expected, type_name);
            }
        }
        Ok(description)
    }

    /// The PDDL type of a class of the model.
    pub(super) fn type_of(&self, number: usize) -> Option<&Name> {
        self.class.iter().find(|class| class.number == number).map(|class| &class.type_name)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A description of a small model.
    pub(crate) const SMALL: &str = r#"
        score_min = 0.5
        duplicate_iou = 0.6

        [input]
        width = 8
        height = 8
        layout = "nchw"
        channels = "rgb"
        resize = "letterbox"
        scale = 0.00392156862745098
        mean = [0.0, 0.0, 0.0]
        std = [1.0, 1.0, 1.0]

        [output]
        kind = "yolo"
        tensor = "out"
        axes = "values_first"
        objectness = false
        normalised = false

        [[class]]
        number = 1
        type = "block"
    "#;

    fn parsed(text: &str) -> Result<Description, String> {
        Description::parse(text, &BTreeSet::from([Name::new("block")]))
    }

    #[test]
    fn faults_are_named_with_their_field() {
        assert_eq!(parsed(SMALL).unwrap().type_of(1), Some(&Name::new("block")));
        for (old, new, expect) in [
            ("width = 8", "width = 0", "input.width: expected 1..=4096, got 0"),
            ("std = [1.0", "std = [0.0", "input: expected finite scale, mean and std"),
            ("scale = 0.00392156862745098", "scale = nan", "input: expected finite scale"),
            ("score_min = 0.5", "score_min = 5.0", "score_min: expected a share in 0..=1"),
            ("duplicate_iou = 0.6", "duplicate_iou = -1.0", "duplicate_iou: expected a share"),
            ("type = \"block\"", "type = \"cup\"", "class 1: type: expected a type of perception"),
            ("kind = \"yolo\"", "kind = \"magic\"", "unknown variant `magic`"),
            ("layout = \"nchw\"", "layout = \"chw\"", "unknown variant `chw`"),
            ("tensor = \"out\"", "tensr = \"out\"", "tensr"),
            ("objectness = false", "objectness = false\nmask = \"m\"", "unknown field `mask`"),
            (
                "kind = \"yolo\"\n        tensor = \"out\"\n        axes = \"values_first\"\n        \
                 objectness = false",
                "kind = \"boxes\"\nboxes = \"b\"\nscores = \"s\"\nclasses = \"c\"\n\
                 form = \"corners\"\nactivation = \"softmax\"",
                "output.activation: expected none or sigmoid",
            ),
            ("[[class]]", "[[class]]\nnumber = 1\ntype = \"block\"\n[[class]]", "each number once"),
        ] {
            assert!(SMALL.contains(old));
            let message = parsed(&SMALL.replacen(old, new, 1)).unwrap_err();
            assert!(message.contains(expect), "{expect:?} is not in {message}");
        }
    }
}
