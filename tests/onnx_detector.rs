//! An exported detector: a model made here, byte by byte, runs on a picture.
//!
//! `cargo test --features onnx --test onnx_detector`
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

mod common;

use std::path::Path;

use common::project;
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
        let ended = common::Process::start(&args).end();
        assert_eq!(ended.status.code(), Some(5), "{}", ended.stderr);
        println!("skipped: a model that runs: cargo test --features onnx --test onnx_detector");
    }
}

#[cfg(feature = "onnx")]
mod with_runtime {
    use std::fs;

    use groundloop::geometry::PixelBox;
    use groundloop::perception::{ImageView, name_detections};

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

    /// `ValueInfoProto` of floats.
    fn value(name: &str, shape: &[u8]) -> Vec<u8> {
        let dims: Vec<u8> = shape.iter().flat_map(|n| bytes(1, &number(1, *n))).collect();
        let tensor = [number(1, 1), bytes(2, &dims)].concat();
        [bytes(1, name.as_bytes()), bytes(2, &bytes(1, &tensor))].concat()
    }

    /// A model that always sees one box, of the class of the picture's strongest channel: the scores
    /// are the means of the channels.
    fn tiny_model() -> Vec<u8> {
        let floats = [4.0_f32, 3.0, 4.0, 2.0].map(f32::to_le_bytes).concat();
        let shape = [1_i64, 3, 1].map(i64::to_le_bytes).concat();
        // AttributeProto: name, a whole number, its type.
        let axis = bytes(5, &[bytes(1, b"axis"), number(3, 1), vec![0xa0, 0x01, 2]].concat());
        let graph = [
            node(&["image"], "means", "GlobalAveragePool", &[]),
            node(&["means", "shape"], "scores", "Reshape", &[]),
            node(&["box", "scores"], "out", "Concat", &axis),
            bytes(2, b"tiny"),
            constant("shape", &[3], 7, &shape),
            constant("box", &[1, 4, 1], 1, &floats),
            bytes(11, &value("image", &[1, 3, 8, 8])),
            bytes(12, &value("out", &[1, 7, 1])),
        ];
        let opset = bytes(8, &[bytes(1, b""), number(2, 13)].concat());
        [number(1, 8), opset, bytes(7, &graph.concat())].concat()
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
