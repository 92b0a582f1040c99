//! Detections to named objects.

use std::collections::BTreeMap;

use super::Detection;
use crate::grounding::{Order, Perception, TypeSpec};
use crate::pddl::Name;

/// The colour that a labelled object's name speaks of: the longest of the type's colours that is a
/// part of the name between underscores (`light_blue_disk2` is `light_blue`), or the type's only
/// colour.
pub fn label_of<'a>(spec: &'a TypeSpec, object: &Name) -> Option<&'a Name> {
    if let [only] = spec.colours.as_slice() {
        return Some(only);
    }
    let padded = format!("_{object}_");
    let spoken = spec.colours.iter().filter(|c| padded.contains(&format!("_{c}_")));
    spoken.max_by_key(|c| c.as_str().len())
}

/// Names detections by the rules of their type, in the order that the type declares. The result
/// has the name of each detection, in the order of `detections`.
///
/// A name that is taken gets a number: `red_block`, `red_block2`, `red_block3`. A detection of a
/// type that the perception file does not describe is called by its type.
pub fn name_detections(perception: &Perception, detections: &[Detection]) -> Vec<Name> {
    let mut used: BTreeMap<Name, usize> = BTreeMap::new();
    let mut names: Vec<Name> = detections.iter().map(|d| d.type_name.clone()).collect();
    for spec in &perception.types {
        let mut of_type: Vec<(usize, &Detection)> =
            detections.iter().enumerate().filter(|(_, d)| d.type_name == spec.name).collect();
        of_type.sort_by(|(_, a), (_, b)| {
            let (a, b) = (sort_keys(spec.naming.order, a), sort_keys(spec.naming.order, b));
            a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
        });
        let listed = spec.naming.list.len() == of_type.len();
        for (i, (detection_idx, detection)) in of_type.into_iter().enumerate() {
            let stem = if listed { spec.naming.list[i].clone() } else { stem(spec, detection) };
            let n = used.entry(stem.clone()).or_insert(0);
            *n += 1;
            let numbered = || Name::new(format!("{stem}{n}"));
            names[detection_idx] = if *n == 1 { stem.clone() } else { numbered() };
        }
    }
    names
}

fn stem(spec: &TypeSpec, detection: &Detection) -> Name {
    let template = &spec.naming.template;
    let filled = template.replace("{colour}", detection.label.as_str());
    Name::new(filled.replace("{type}", spec.name.as_str()))
}

/// The declared order first, then position, so that equals are ordered too.
fn sort_keys(order: Order, detection: &Detection) -> [f64; 3] {
    let (x, y) = detection.pixel_box.centre();
    match order {
        Order::LeftToRight => [x, y, 0.0],
        Order::NarrowFirst => [detection.pixel_box.width(), y, x],
        Order::TopToBottom => [y, x, 0.0],
    }
}
