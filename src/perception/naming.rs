//! Detections to named objects.

use std::collections::BTreeSet;

use super::Detection;
use super::model::{Order, Perception, TypeSpec};
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
/// type that the perception file does not describe is called by its type. A name that the detector
/// dictates stays as it is.
pub fn name_detections(perception: &Perception, detections: &[Detection]) -> Vec<Name> {
    let mut used: BTreeSet<Name> = detections.iter().filter_map(|d| d.name.clone()).collect();
    let own_or_type = |d: &Detection| d.name.clone().unwrap_or_else(|| d.type_name.clone());
    let mut names: Vec<Name> = detections.iter().map(own_or_type).collect();
    for spec in &perception.types {
        let unnamed = detections.iter().enumerate().filter(|(_, d)| d.name.is_none());
        let mut of_type: Vec<(usize, &Detection)> =
            unnamed.filter(|(_, d)| d.type_name == spec.name).collect();
        of_type.sort_by(|(_, a), (_, b)| {
            let (a, b) = (sort_keys(spec.naming.order, a), sort_keys(spec.naming.order, b));
            a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
        });
        let listed = spec.naming.list.len() == of_type.len();
        for (i, (detection_idx, detection)) in of_type.into_iter().enumerate() {
            let stem = if listed { spec.naming.list[i].clone() } else { stem(spec, detection) };
            let name = unused_name(&stem, &|name| used.contains(name));
            used.insert(name.clone());
            names[detection_idx] = name;
        }
    }
    names
}

/// The name, with the first number from 2 on where it is taken.
pub fn unused_name(name: &Name, taken: &dyn Fn(&Name) -> bool) -> Name {
    if !taken(name) {
        return name.clone();
    }
    let numbered = (2_u32..).map(|i| Name::new(format!("{name}{i}")));
    numbered.into_iter().find(|n| !taken(n)).unwrap_or_else(|| name.clone())
}

fn stem(spec: &TypeSpec, detection: &Detection) -> Name {
    let template = if detection.label == spec.name {
        // The detector tells no colour: the type is name enough.
        &spec.naming.template.replace("{colour}_", "").replace("_{colour}", "")
    } else {
        &spec.naming.template
    };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PixelBox;

    #[track_caller]
    fn check(perception: &str, detections: &[(&str, &str, [f64; 4])], expect: &[&str]) {
        let perception = Perception::parse("perception.toml", perception).unwrap();
        let detection = |(type_name, label, edges): &(&str, &str, [f64; 4])| {
            Detection::new((*type_name).into(), (*label).into(), PixelBox::from(*edges))
        };
        let detections: Vec<_> = detections.iter().map(detection).collect();
        assert_eq!(name_detections(&perception, &detections), expect);
    }

    /// A dictated name is nobody else's.
    #[test]
    fn a_dictated_name_stays() {
        let perception = Perception::parse("perception.toml", BLOCKS).unwrap();
        let mut detections = [10.0, 30.0].map(|x| {
            Detection::new("block".into(), "red".into(), PixelBox::from([x, 0.0, x + 5.0, 5.0]))
        });
        detections[1].name = Some("red_block".into());
        assert_eq!(name_detections(&perception, &detections), ["red_block2", "red_block"]);
    }

    const BLOCKS: &str = include_str!("../../domains/blocksworld/perception.toml");
    const HANOI: &str = include_str!("../../domains/hanoi/perception.toml");

    #[test]
    fn blocks_of_one_colour_are_numbered_from_the_left() {
        let right = ("block", "red", [50.0, 0.0, 60.0, 10.0]);
        let left = ("block", "red", [10.0, 0.0, 20.0, 10.0]);
        let other = ("block", "blue", [30.0, 0.0, 40.0, 10.0]);
        check(BLOCKS, &[right, left, other], &["red_block2", "red_block", "blue_block"]);
    }

    #[test]
    fn disks_of_one_colour_are_numbered_from_the_smallest() {
        let large = ("disk", "pink", [0.0, 0.0, 60.0, 10.0]);
        let small = ("disk", "pink", [10.0, 20.0, 30.0, 30.0]);
        check(HANOI, &[large, small], &["pink_disk2", "pink_disk"]);
    }

    #[test]
    fn listed_names_are_given_only_to_the_right_number() {
        let peg = |x: f64| ("peg", "wood", [x, 0.0, x + 5.0, 50.0]);
        let three = [peg(80.0), peg(10.0), peg(40.0)];
        check(HANOI, &three, &["right_peg", "left_peg", "middle_peg"]);
        check(HANOI, &three[..2], &["peg2", "peg"]);
    }

    #[test]
    fn the_longest_colour_in_a_name_counts() {
        let perception = Perception::parse("perception.toml", BLOCKS).unwrap();
        let mut spec = perception.types[0].clone();
        spec.colours.push("dark_red".into());
        let label = |name: &str| label_of(&spec, &name.into()).map(Name::as_str);
        assert_eq!(label("dark_red_block2"), Some("dark_red"));
        assert_eq!(label("red_block2"), Some("red"));
        assert_eq!(label("infrared_block"), None);
    }
}
