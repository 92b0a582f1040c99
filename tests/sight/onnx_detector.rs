//! An exported detector: a model made here, byte by byte, runs on a picture.
//!
//! `cargo test --features onnx --test sight onnx_detector`
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::path::Path;

use crate::common::project;
use groundloop::parts::{PartChoice, PartContext, PartError};
use groundloop::perception::detectors::{DETECTORS, Detector, DetectorInputs};
use groundloop::run::DomainFolder;

fn build(folder: &Path) -> Result<Box<dyn Detector>, PartError> {
    let domain = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    let options: toml::Table =
        "model = \"tiny.onnx\"\ndescription = \"tiny.toml\"".parse().unwrap();
    let choice = PartChoice::new("test", "onnx").with_options(Some(&options), folder.join("run"));
    let inputs = DetectorInputs { domain: &domain.domain, perception: &domain.perception };
    DETECTORS.build(&PartContext { choice: &choice, inputs, environment: |_| None })
}

/// Without the runtime, the program says what to build; with it, that a file is missing.
#[test]
fn what_is_missing_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let error = build(folder.path()).map(drop).unwrap_err();
    if cfg!(feature = "onnx") {
        assert!(error.to_string().contains("tiny.toml: No such file"), "{error}");
    } else {
        assert!(error.is_missing(), "{error}");
        assert!(error.to_string().contains("cargo build --features onnx"), "{error}");
        let args = ["run", "configs/photo_blocksworld.toml", "--set", "perception.detector=onnx"];
        let example = ["--set", "perception.exemplar={folder=\"sim_640x480\"}"];
        let files = [
            ["--set", "perception.options.model=tiny.onnx"],
            ["--set", "perception.options.description=tiny.toml"],
        ];
        let args = [args.as_slice(), &example, files.as_flattened()].concat();
        let ended = crate::common::Process::start(&args).end();
        assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
        println!(
            "skipped: a model that runs: cargo test --features onnx --test sight onnx_detector"
        );
    }
}

#[cfg(feature = "onnx")]
mod with_runtime {
    use std::fs;

    use groundloop::geometry::PixelBox;
    use groundloop::perception::{Detection, ImageView, name_detections};

    use super::*;

    /// A field of a protobuf message: a length and bytes.
    fn bytes(field: u8, content: &[u8]) -> Vec<u8> {
        let mut message = vec![field << 3 | 2];
        let mut length = content.len();
        while length >= 0x80 {
            message.push((length & 0x7f) as u8 | 0x80);
            length >>= 7;
        }
        message.push(length as u8);
        [message.as_slice(), content].concat()
    }

    /// A field of a protobuf message: a number below 128.
    fn number(field: u8, value: u8) -> Vec<u8> {
        assert!(value < 0x80);
        vec![field << 3, value]
    }

    /// `NodeProto`: inputs, outputs, operator, attributes.
    fn node(inputs: &[&str], output: &str, operator: &str, attributes: &[u8]) -> Vec<u8> {
        let inputs: Vec<u8> = inputs.iter().flat_map(|name| bytes(1, name.as_bytes())).collect();
        let rest = [bytes(2, output.as_bytes()), bytes(4, operator.as_bytes())].concat();
        bytes(1, &[inputs, rest, attributes.to_vec()].concat())
    }

    /// `TensorProto` among a graph's initializers.
    fn constant(name: &str, shape: &[u8], data_type: u8, raw: &[u8]) -> Vec<u8> {
        let dims: Vec<u8> = shape.iter().flat_map(|n| number(1, *n)).collect();
        let rest = [number(2, data_type), bytes(8, name.as_bytes()), bytes(9, raw)].concat();
        bytes(5, &[dims, rest].concat())
    }

    /// The same of floats.
    fn floats(name: &str, shape: &[u8], values: &[f32]) -> Vec<u8> {
        let raw: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        constant(name, shape, FLOAT, &raw)
    }

    /// The same of whole numbers: a shape.
    fn shape(name: &str, sides: &[i64]) -> Vec<u8> {
        let raw: Vec<u8> = sides.iter().flat_map(|side| side.to_le_bytes()).collect();
        constant(name, &[sides.len() as u8], INT64, &raw)
    }

    const FLOAT: u8 = 1;
    const INT64: u8 = 7;

    /// `ValueInfoProto` of a type of element.
    fn value(name: &str, data_type: u8, shape: &[u8]) -> Vec<u8> {
        let dims: Vec<u8> = shape.iter().flat_map(|n| bytes(1, &number(1, *n))).collect();
        let tensor = [number(1, data_type), bytes(2, &dims)].concat();
        [bytes(1, name.as_bytes()), bytes(2, &bytes(1, &tensor))].concat()
    }

    /// `AttributeProto` of a node: a name and a whole number.
    fn attribute(name: &str, value: u8) -> Vec<u8> {
        bytes(5, &[bytes(1, name.as_bytes()), number(3, value), vec![0xa0, 0x01, 2]].concat())
    }

    /// The same with several numbers.
    fn attributes(name: &str, values: &[u8]) -> Vec<u8> {
        let numbers: Vec<u8> = values.iter().flat_map(|value| number(8, *value)).collect();
        bytes(5, &[bytes(1, name.as_bytes()), numbers, vec![0xa0, 0x01, 7]].concat())
    }

    /// `ModelProto` of a graph with an image of 8 x 8 pixels, whose means of the channels are
    /// `[1, 1, 3]` values called `means`.
    fn model(inputs: &[Vec<u8>], graph: &[Vec<u8>], outputs: &[Vec<u8>]) -> Vec<u8> {
        let means = [
            bytes(11, &value("images", FLOAT, &[1, 3, 8, 8])),
            node(&["images"], "pooled", "GlobalAveragePool", &[]),
            shape("three", &[1, 1, 3]),
            node(&["pooled", "three"], "means", "Reshape", &[]),
        ];
        let inputs: Vec<u8> = inputs.iter().flat_map(|input| bytes(11, input)).collect();
        let outputs: Vec<u8> = outputs.iter().flat_map(|output| bytes(12, output)).collect();
        let graph = [means.concat(), graph.concat(), bytes(2, b"tiny"), inputs, outputs].concat();
        let opset = bytes(8, &[bytes(1, b""), number(2, 13)].concat());
        [number(1, 8), opset, bytes(7, &graph)].concat()
    }

    /// A model that always sees one box, of the class of the picture's strongest channel: the scores
    /// are the means of the channels.
    fn tiny_model() -> Vec<u8> {
        let graph = [
            shape("column", &[1, 3, 1]),
            floats("box", &[1, 4, 1], &[4.0, 3.0, 4.0, 2.0]),
            node(&["means", "column"], "scores", "Reshape", &[]),
            node(&["box", "scores"], "out", "Concat", &attribute("axis", 1)),
        ];
        model(&[], &graph, &[value("out", FLOAT, &[1, 7, 1])])
    }

    /// As YOLO segmentation is exported: candidates with weights, and prototypes. The prototypes are
    /// the picture's channels at half its size; the mask is where blue is stronger than red.
    fn segmentation() -> Vec<u8> {
        let graph = [
            shape("column", &[1, 3, 1]),
            floats("box", &[1, 4, 1], &[3.0, 3.0, 6.0, 2.0]),
            floats("weights", &[1, 3, 1], &[-1.0, 0.0, 1.0]),
            node(&["means", "column"], "scores", "Reshape", &[]),
            node(&["box", "scores", "weights"], "output0", "Concat", &attribute("axis", 1)),
            prototypes(),
        ];
        let outputs =
            [value("output0", FLOAT, &[1, 10, 1]), value("output1", FLOAT, &[1, 3, 4, 4])];
        model(&[], &graph, &outputs)
    }

    fn prototypes() -> Vec<u8> {
        let halves = [attributes("kernel_shape", &[2, 2]), attributes("strides", &[2, 2])].concat();
        node(&["images"], "output1", "AveragePool", &halves)
    }

    /// The same exported with its suppression of doubles: an object of class 2, and an empty row.
    fn end_to_end() -> Vec<u8> {
        let graph = [
            floats("blue", &[3, 1], &[0.0, 0.0, 1.0]),
            node(&["means", "blue"], "score", "MatMul", &[]),
            floats("box", &[1, 1, 4], &[0.0, 2.0, 6.0, 4.0]),
            floats("class", &[1, 1, 1], &[2.0]),
            floats("weights", &[1, 1, 3], &[-1.0, 0.0, 1.0]),
            floats("nothing", &[1, 1, 9], &[0.0; 9]),
            node(&["box", "score", "class", "weights"], "row", "Concat", &attribute("axis", 2)),
            node(&["row", "nothing"], "output0", "Concat", &attribute("axis", 1)),
            prototypes(),
        ];
        let outputs = [value("output0", FLOAT, &[1, 2, 9]), value("output1", FLOAT, &[1, 3, 4, 4])];
        model(&[], &graph, &outputs)
    }

    /// As RT-DETR and D-FINE are exported with what follows them: boxes in the picture whose size the
    /// second input tells.
    fn detr() -> Vec<u8> {
        let last = [attributes("axes", &[2]), attribute("keepdims", 0)].concat();
        let place = [attribute("axis", 2), attribute("keepdims", 0)].concat();
        let graph = [
            node(&["means"], "labels", "ArgMax", &place),
            node(&["means"], "scores", "ReduceMax", &last),
            node(&["orig_target_sizes"], "sides", "Cast", &attribute("to", FLOAT)),
            node(&["sides", "sides"], "four", "Concat", &attribute("axis", 1)),
            floats("shares", &[1, 1, 4], &[0.25, 0.25, 0.75, 0.5]),
            node(&["shares", "four"], "boxes", "Mul", &[]),
        ];
        let outputs = [
            value("labels", INT64, &[1, 1]),
            value("boxes", FLOAT, &[1, 1, 4]),
            value("scores", FLOAT, &[1, 1]),
        ];
        model(&[value("orig_target_sizes", INT64, &[1, 2])], &graph, &outputs)
    }

    /// As they are exported without: logits, and boxes as shares.
    fn detr_logits() -> Vec<u8> {
        let graph = [
            floats("eight", &[1], &[8.0]),
            floats("four", &[1], &[4.0]),
            node(&["means", "eight"], "scaled", "Mul", &[]),
            node(&["scaled", "four"], "logits", "Sub", &[]),
            floats("middle", &[1, 1, 4], &[0.5, 0.375, 0.5, 0.25]),
            node(&["middle"], "pred_boxes", "Identity", &[]),
        ];
        let outputs = [value("logits", FLOAT, &[1, 1, 3]), value("pred_boxes", FLOAT, &[1, 1, 4])];
        model(&[], &graph, &outputs)
    }

    const DESCRIPTION: &str = r#"
        score_min = 0.5
        duplicate_iou = 0.5

        [input]
        width = 8
        height = 8
        layout = "nchw"
        channels = "rgb"
        resize = "plain"
        scale = 0.0039215686
        mean = [0.0, 0.0, 0.0]
        std = [1.0, 1.0, 1.0]

        [output]
        kind = "yolo"
        tensor = "out"
        axes = "values_first"
        objectness = false
        normalised = false

        [[class]]
        number = 2
        type = "block"
    "#;

    fn detector(description: &str, model: &[u8]) -> Result<Box<dyn Detector>, PartError> {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("tiny.toml"), description).unwrap();
        fs::write(folder.path().join("tiny.onnx"), model).unwrap();
        build(folder.path())
    }

    /// What is seen in a picture of one colour.
    fn seen(description: &str, rgb: [u8; 3]) -> Vec<(String, PixelBox, f32)> {
        let picture = rgb.repeat(16 * 32);
        let image = ImageView::new(16, 32, &picture).unwrap();
        let mut detector = detector(description, &tiny_model()).unwrap();
        assert!(detector.is_slow());
        let detections = detector.detect(&image, &["the blue one".to_owned()]).unwrap();
        assert!(detections.phrases.is_empty());
        let folder = DomainFolder::read(&project("domains/blocksworld")).unwrap();
        let names = name_detections(&folder.perception, &detections.objects);
        let objects = names.iter().zip(&detections.objects);
        objects.map(|(name, d)| (name.to_string(), d.pixel_box, d.score)).collect()
    }

    #[test]
    fn a_model_sees_what_its_description_says() {
        let expect = PixelBox::from([4.0, 8.0, 12.0, 16.0]);
        let found = seen(DESCRIPTION, [0, 0, 255]);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].0.as_str(), found[0].1), ("blue_block", expect));
        assert!((found[0].2 - 1.0).abs() < 1e-5, "{found:?}");
        // Red is class 0, which is no object; blue is not strong enough when dark.
        assert!(seen(DESCRIPTION, [255, 0, 0]).is_empty());
        assert!(seen(DESCRIPTION, [0, 0, 100]).is_empty());
        // With the channels the other way round, red is the last one.
        let bgr = DESCRIPTION.replace("\"rgb\"", "\"bgr\"");
        assert_eq!(seen(&bgr, [255, 0, 0])[0].0, "red_block");
        assert!(seen(&bgr, [0, 0, 255]).is_empty());
    }

    /// The description with another output.
    fn described(output: &str) -> String {
        let (start, rest) = DESCRIPTION.split_once("[output]").unwrap();
        let (_, end) = rest.split_once("[[class]]").unwrap();
        format!("{start}[output]\n{output}\n[[class]]{end}")
    }

    /// What is seen in a picture of 16 x 32 pixels that is red in its first columns, else blue.
    fn seen_beside_red(description: &str, model: &[u8], n_red: usize) -> Vec<Detection> {
        let row = [[255, 0, 0].repeat(n_red), [0, 0, 255].repeat(16 - n_red)].concat();
        let picture = row.repeat(32);
        let image = ImageView::new(16, 32, &picture).unwrap();
        let mut detector = detector(description, model).unwrap();
        detector.detect(&image, &[]).unwrap().objects
    }

    #[test]
    fn masks_of_yolo_models_are_rows_of_pixels() {
        let yolo = "kind = \"yolo\"\ntensor = \"output0\"\naxes = \"values_first\"\n\
                    objectness = false\nnormalised = false\nmasks = \"output1\"";
        let rows = "kind = \"end_to_end\"\ntensor = \"output0\"\nnormalised = false\n\
                    masks = \"output1\"";
        for (output, model) in [(yolo, segmentation()), (rows, end_to_end())] {
            let description = described(output);
            for (n_red, score) in [(0, 1.0), (4, 0.75)] {
                let found = seen_beside_red(&description, &model, n_red);
                assert_eq!(found.len(), 1, "{output}");
                assert_eq!(found[0].pixel_box, PixelBox::from([0.0, 8.0, 12.0, 16.0]), "{output}");
                assert!((found[0].score - score).abs() < 1e-5, "{output}: {found:?}");
                let runs: Vec<_> =
                    found[0].mask.iter().map(|r| (r.y, r.x_start, r.x_end)).collect();
                let expect: Vec<_> = (8..16).map(|y| (y, n_red as u32, 12)).collect();
                assert_eq!(runs, expect, "{output}: {n_red} red columns");
            }
            assert!(seen_beside_red(&description, &model, 16).is_empty(), "{output}");
            // Without the prototypes, what the weights are for is not known.
            let bare = description.replace("masks = \"output1\"", "");
            let mut detector = detector(&bare, &model).unwrap();
            let picture = [0, 0, 255].repeat(16);
            let found = detector.detect(&ImageView::new(4, 4, &picture).unwrap(), &[]);
            let is_yolo = output == yolo;
            assert_eq!(found.is_ok(), is_yolo, "weights of YOLO pass for classes: {output}");
        }
    }

    #[test]
    fn models_of_the_detr_family_are_read_with_and_without_what_follows_them() {
        let decoded = "kind = \"boxes\"\nboxes = \"boxes\"\nscores = \"scores\"\n\
                       classes = \"labels\"\nform = \"corners\"\nnormalised = false";
        let logits = "kind = \"boxes\"\nboxes = \"pred_boxes\"\nscores = \"logits\"\n\
                      form = \"centre_and_size\"\nnormalised = true\nactivation = \"sigmoid\"";
        let sizes = "[input]\nsizes = \"orig_target_sizes\"";
        let told = described(decoded).replace("[input]", sizes);
        let of_logits = 1.0 / (1.0 + (-4.0_f32).exp());
        for (description, model, score) in
            [(&told, detr(), 1.0), (&described(logits), detr_logits(), of_logits)]
        {
            let found = seen_beside_red(description, &model, 0);
            assert_eq!(found.len(), 1, "{description}");
            assert_eq!(found[0].pixel_box, PixelBox::from([4.0, 8.0, 12.0, 16.0]), "{description}");
            assert!((found[0].score - score).abs() < 1e-5, "{found:?}");
            assert!(found[0].mask.is_empty());
            assert!(seen_beside_red(description, &model, 16).is_empty(), "red is class 0");
            let boxed = description.replace("\"plain\"", "\"letterbox\"");
            let found = seen_beside_red(&boxed, &model, 0);
            assert_eq!(found[0].pixel_box, PixelBox::from([0.0, 8.0, 16.0, 16.0]), "{boxed}");
        }
        // The second input must be described, and be there.
        for (description, model, expect) in [
            (described(decoded), detr(), "expected one input for the image"),
            (
                described(decoded).replace("[input]", "[input]\nname = \"images\""),
                detr(),
                "or orig_target_sizes as input.sizes",
            ),
            (told, detr_logits(), "expected a tensor orig_target_sizes"),
        ] {
            let error = detector(&description, &model).map(drop).unwrap_err();
            assert!(error.to_string().contains(expect), "{error}");
        }
    }

    #[test]
    fn files_that_do_not_go_together_are_named() {
        let model = tiny_model();
        for (description, model, expect) in [
            (DESCRIPTION.to_owned(), b"no model".to_vec(), "tiny.onnx: "),
            (DESCRIPTION.to_owned(), model[..40].to_vec(), "tiny.onnx: "),
            (DESCRIPTION.replace("\"out\"", "\"boxes\""), model.clone(), "expected a tensor boxes"),
            (DESCRIPTION.replace("score_min", "scoremin"), model, "tiny.toml: "),
        ] {
            let error = detector(&description, &model).map(drop).unwrap_err();
            assert!(error.to_string().contains(expect), "{error}");
        }
        let small = DESCRIPTION.replace("width = 8", "width = 4");
        let mut detector = detector(&small, &tiny_model()).unwrap();
        let image = ImageView::new(1, 1, &[0; 3]).unwrap();
        let error = detector.detect(&image, &[]).unwrap_err();
        assert!(error.to_string().contains("tiny.onnx: "), "{error}");
    }
}
