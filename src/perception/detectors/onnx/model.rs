//! The model itself, run by rten.

use std::collections::BTreeSet;

use rten::{Model, NodeId, Value};
use rten_tensor::{AsView as _, Layout as _};

use super::Options;
use super::decode::decode;
use super::description::Description;
use super::input::{Fit, values};
use super::tensor::Tensor;
use crate::parts::{PartContext, PartError};
use crate::pddl::Name;
use crate::perception::detectors::boxes::clipped;
use crate::perception::detectors::colour_namer::ColourNamer;
use crate::perception::detectors::{Detector, DetectorError};
use crate::perception::model::ObjectBox;
use crate::perception::phrases::answer;
use crate::perception::{Detection, Detections, ImageView, name_detections};

/// Runs a model.
struct OnnxDetector {
    file: String,
    model: Model,
    input: NodeId,
    /// The input that is told the size of the model's input.
    sizes: Option<NodeId>,
    outputs: Vec<NodeId>,
    description: Description,
    colour_namer: ColourNamer,
}

pub(super) fn build(
    context: &PartContext<'_, dyn Detector>,
) -> Result<Box<dyn Detector>, PartError> {
    let options: Options = context.options()?;
    let of_file = |path: &str, message: String| {
        PartError::file(context.path(path).display().to_string(), message)
    };
    let text = context.read(&options.description)?;
    let types: BTreeSet<Name> =
        context.inputs.perception.types.iter().map(|t| t.name.clone()).collect();
    let description = Description::parse(&text, &types)
        .map_err(|message| of_file(&options.description, message))?;
    let wrong = |message: String| of_file(&options.model, message);
    let model = Model::load_file(context.path(&options.model)).map_err(|e| wrong(e.to_string()))?;
    let node = |name: &str| {
        model.find_node(name).ok_or_else(|| {
            let ids = model.input_ids().iter().chain(model.output_ids());
            let names: Vec<String> =
                ids.filter_map(|id| model.node_info(*id)?.name().map(str::to_owned)).collect();
            wrong(format!("expected a tensor {name}, got {}", names.join(", ")))
        })
    };
    let sizes = description.input.sizes.as_deref().map(node).transpose()?;
    let others: Vec<NodeId> =
        model.input_ids().iter().copied().filter(|id| Some(*id) != sizes).collect();
    let input = match (&description.input.name, others.as_slice()) {
        (Some(name), _) => node(name)?,
        (None, [only]) => *only,
        (None, several) => {
            let got = format!("{} inputs", several.len());
            let expected = "one input for the image, or its name as input.name";
            return Err(wrong(format!("expected {expected}, got {got}")));
        }
    };
    if let Some(id) = others.iter().find(|id| **id != input) {
        let name = model.node_info(*id).and_then(|info| info.name().map(str::to_owned));
        let name = name.unwrap_or_default();
        return Err(wrong(format!(
            "expected no input beside the image, or {name} as input.sizes if it is told the image's \
             size, got {name}"
        )));
    }
    let outputs = description.output.tensors().into_iter().map(node);
    let outputs = outputs.collect::<Result<Vec<NodeId>, PartError>>()?;
    let colour_namer = ColourNamer::new(context.inputs.perception)?;
    let file = context.path(&options.model).display().to_string();
    Ok(Box::new(OnnxDetector { file, model, input, sizes, outputs, description, colour_namer }))
}

impl Detector for OnnxDetector {
    fn learn(&mut self, image: &ImageView<'_>, objects: &[ObjectBox]) -> Result<(), DetectorError> {
        self.colour_namer.learn(image, objects);
        Ok(())
    }

    fn detect(
        &mut self,
        image: &ImageView<'_>,
        phrases: &[String],
    ) -> Result<Detections, DetectorError> {
        let wrong = |message: String| DetectorError::from(PartError::file(&self.file, message));
        let outputs = self.run(image).map_err(wrong)?;
        let decoded = decode(&self.description, &outputs).map_err(wrong)?;
        let input = &self.description.input;
        let fit = Fit::new(input, image);
        let mut objects: Vec<Detection> = Vec::new();
        for candidate in decoded.candidates {
            let perception = self.colour_namer.perception();
            let type_name = self.description.type_of(candidate.class);
            let Some(spec) = type_name.and_then(|name| perception.type_spec(name)) else {
                continue;
            };
            let pixel_box = match clipped(fit.to_frame(candidate.edges), image) {
                Ok(pixel_box) => pixel_box,
                Err(reason) => {
                    tracing::debug!(reason, ?candidate, "a box is not used");
                    continue;
                }
            };
            let scored = (pixel_box, candidate.score.min(1.0));
            let mut detection = self.colour_namer.detection(image, spec, scored);
            if let Some(prototypes) = &decoded.prototypes {
                detection.mask = prototypes.mask(&candidate.weights, &pixel_box, (fit, input));
            }
            objects.push(detection);
        }
        let objects = self.colour_namer.sorted(objects, self.description.duplicate_iou);
        let perception = self.colour_namer.perception();
        let names = name_detections(perception, &objects);
        let phrases = answer(perception, (&names, &objects), phrases);
        Ok(Detections { objects, phrases, ..Detections::default() })
    }

    fn is_slow(&self) -> bool {
        true
    }
}

impl OnnxDetector {
    /// What the model gives for a frame, in the order of its outputs.
    fn run(&self, image: &ImageView<'_>) -> Result<Vec<Tensor>, String> {
        let spec = &self.description.input;
        let (shape, values) = values(spec, image);
        let picture = Value::from_shape(shape, values).map_err(|e| e.to_string())?;
        let mut inputs = vec![(self.input, picture.into())];
        if let Some(sizes) = self.sizes {
            let side = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
            let sides = vec![side(spec.width), side(spec.height)];
            let sides = Value::from_shape([1, 2], sides).map_err(|e| e.to_string())?;
            inputs.push((sizes, sides.into()));
        }
        let outputs = self.model.run(inputs, &self.outputs, None).map_err(|e| e.to_string())?;
        outputs.into_iter().map(tensor).collect()
    }
}

/// An output as numbers.
fn tensor(value: Value) -> Result<Tensor, String> {
    if let Value::FloatTensor(t) = value {
        Ok(Tensor { shape: t.shape().to_vec(), values: t.to_vec() })
    } else if let Value::Int32Tensor(t) = value {
        let values = t.to_vec().into_iter().map(|v| v as f32).collect();
        Ok(Tensor { shape: t.shape().to_vec(), values })
    } else {
        Err("expected outputs of floats or whole numbers, got something else".to_owned())
    }
}
