//! The model itself, run by rten.

use std::collections::BTreeSet;

use rten::{Model, NodeId, Value};
use rten_tensor::{AsView as _, Layout as _};

use super::Options;
use super::decode::{Tensor, decode};
use super::description::Description;
use super::input::{Fit, values};
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
    let input = match (&description.input.name, model.input_ids()) {
        (Some(name), _) => node(name)?,
        (None, [only]) => *only,
        (None, several) => {
            let n = several.len();
            return Err(wrong(format!("expected one input, or input.name, got {n} inputs")));
        }
    };
    let outputs = description.output.tensors().into_iter().map(node);
    let outputs = outputs.collect::<Result<Vec<NodeId>, PartError>>()?;
    let colour_namer = ColourNamer::new(context.inputs.perception)?;
    let file = context.path(&options.model).display().to_string();
    Ok(Box::new(OnnxDetector { file, model, input, outputs, description, colour_namer }))
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
        let (shape, values) = values(&self.description.input, image);
        let wrong = |message: String| DetectorError::from(PartError::file(&self.file, message));
        let input = Value::from_shape(shape, values).map_err(|e| wrong(e.to_string()))?;
        let outputs = self
            .model
            .run(vec![(self.input, input.into())], &self.outputs, None)
            .map_err(|e| wrong(e.to_string()))?;
        let outputs = outputs.into_iter().map(tensor).collect::<Result<Vec<Tensor>, String>>();
        let found = outputs.and_then(|outputs| decode(&self.description, &outputs));
        let fit = Fit::new(&self.description.input, image);
        let mut objects: Vec<Detection> = Vec::new();
        for candidate in found.map_err(wrong)? {
            let perception = self.colour_namer.perception();
            let type_name = self.description.type_of(candidate.class);
            let Some(spec) = type_name.and_then(|name| perception.type_spec(name)) else {
                continue;
            };
            match clipped(fit.to_frame(candidate.edges), image) {
                Ok(pixel_box) => {
                    let score = candidate.score.min(1.0);
                    objects.push(self.colour_namer.detection(image, spec, (pixel_box, score)));
                }
                Err(reason) => tracing::debug!(reason, ?candidate, "a box is not used"),
            }
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
