//! Phrases of the goal: which object each of them singles out.
//!
//! A detector says where a phrase may be; the paper's merge (eq. 4) says which of the objects of
//! the class query that is: the best place of a phrase goes to the object whose box overlaps it
//! most, and the object takes the phrase's name.

use std::collections::BTreeSet;

use super::model::Perception;
use super::{Detection, PhraseBox};
use crate::pddl::Name;

/// Least overlap (intersection over union) of a phrase's place with the object that it names.
///
/// Of objects that do not overlap each other, no two can both share more than half of their union
/// with one box: above this bound the object is the same whatever else was found beside it.
pub const PHRASE_IOU_MIN: f64 = 0.5;

/// Words that say nothing about which object is meant.
const ARTICLES: [&str; 3] = ["a", "an", "the"];

/// When a phrase's place counts as an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MergeRule {
    /// The object with the greatest overlap, however small: the paper's rule, to reproduce its
    /// figures.
    Greatest,
    /// The same, but at least [`PHRASE_IOU_MIN`]: a phrase that no object fits names none.
    Fitting,
}

/// A phrase that has become an object's name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Placed {
    /// The object's place in the list of detections.
    pub detection_idx: usize,
    /// What the goal calls it: the phrase, words joined by underscores.
    pub name: Name,
}

/// Where phrases have gone.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Merged {
    /// What every object is called now, in the order of the detections.
    pub names: Vec<Name>,
    /// The objects that a phrase names.
    pub placed: Vec<Placed>,
    /// Phrases that name nothing, with the reason.
    pub unplaced: Vec<String>,
}

/// A phrase as an object's name: `left tray` is `left_tray`.
pub fn name_of_phrase(phrase: &str) -> Name {
    Name::new(phrase.split_whitespace().collect::<Vec<_>>().join("_"))
}

/// An object's name as a phrase: what a detector is asked for.
pub fn phrase_of_name(name: &Name) -> String {
    name.as_str().replace('_', " ")
}

/// Gives objects the names of the phrases that fit them. `names` and `detections` belong together,
/// item by item.
///
/// Of several places of one phrase the one with the highest score counts. An object takes one
/// phrase only, that with the higher score (then the one that was answered first); a name that
/// another object has already is not given again.
pub fn merge(
    names: &[Name],
    detections: &[Detection],
    phrase_boxes: &[PhraseBox],
    rule: MergeRule,
) -> Merged {
    let mut merged = Merged { names: names.to_vec(), ..Merged::default() };
    let mut taken: BTreeSet<usize> = BTreeSet::new();
    for place in best_places(phrase_boxes) {
        let phrase = &place.phrase;
        let name = name_of_phrase(phrase);
        let overlaps = detections.iter().map(|d| d.pixel_box.iou(&place.pixel_box)).enumerate();
        // The first of equals, as `argmax` has it.
        let Some((idx, iou)) = overlaps.reduce(|a, b| if b.1 > a.1 { b } else { a }) else {
            merged.unplaced.push(format!("\"{phrase}\": no object is seen"));
            continue;
        };
        if rule == MergeRule::Fitting && iou < PHRASE_IOU_MIN {
            merged.unplaced.push(format!(
                "\"{phrase}\": no object is where it was found (greatest overlap {iou:.2}, expected \
                 at least {PHRASE_IOU_MIN})"
            ));
        } else if taken.contains(&idx) {
            merged.unplaced.push(format!("\"{phrase}\": {} fits better there", merged.names[idx]));
        } else if merged.names.iter().enumerate().any(|(i, n)| *n == name && i != idx) {
            merged.unplaced.push(format!("\"{phrase}\": another object has that name"));
        } else {
            taken.insert(idx);
            merged.names[idx] = name.clone();
            merged.placed.push(Placed { detection_idx: idx, name });
        }
    }
    merged
}

/// The best place of each phrase, highest score first.
fn best_places(phrase_boxes: &[PhraseBox]) -> Vec<&PhraseBox> {
    let mut places: Vec<&PhraseBox> = Vec::new();
    for place in phrase_boxes {
        match places.iter_mut().find(|known| known.phrase == place.phrase) {
            Some(known) if place.score > known.score => *known = place,
            Some(_) => {}
            None => places.push(place),
        }
    }
    places.sort_by(|a, b| b.score.total_cmp(&a.score));
    places
}

/// Answers phrases by words alone, for detectors that understand no language: a phrase is the
/// object of that name, or the only object that all its words describe (name, label, type and the
/// type's prompt). A phrase with an unknown word, or one that several objects fit, has no answer:
/// none is better than a wrong one.
pub(super) fn answer(
    perception: &Perception,
    (names, detections): (&[Name], &[Detection]),
    phrases: &[String],
) -> Vec<PhraseBox> {
    let known: Vec<BTreeSet<String>> = names
        .iter()
        .zip(detections)
        .map(|(name, detection)| {
            let spec = perception.type_spec(&detection.type_name);
            let prompt = spec.and_then(|spec| spec.prompt.as_deref()).unwrap_or_default();
            [name.as_str(), detection.label.as_str(), detection.type_name.as_str(), prompt]
                .into_iter()
                .flat_map(words)
                .collect()
        })
        .collect();
    let find = |phrase: &String| {
        let own = name_of_phrase(phrase);
        if let Some(idx) = names.iter().position(|name| *name == own) {
            return Some(idx);
        }
        let wanted: Vec<String> = words(phrase).collect();
        let mut fitting = known.iter().enumerate().filter(|(_, known)| {
            !wanted.is_empty() && wanted.iter().all(|word| known.contains(word))
        });
        let (idx, _) = fitting.next()?;
        fitting.next().is_none().then_some(idx)
    };
    let place = |phrase: &String| {
        let detection = detections.get(find(phrase)?)?;
        let (pixel_box, score) = (detection.pixel_box, detection.score);
        Some(PhraseBox { phrase: phrase.clone(), pixel_box, score })
    };
    phrases.iter().filter_map(place).collect()
}

/// The words of a text that tell objects apart, in lower case.
pub(super) fn words(text: &str) -> impl Iterator<Item = String> {
    let words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_lowercase).filter(|word| !ARTICLES.contains(&word.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PixelBox;
    use crate::perception::name_detections;

    const BLOCKS: &str = include_str!("../../domains/blocksworld/perception.toml");

    fn block(label: &str, x: f64) -> Detection {
        Detection {
            score: 0.9,
            ..Detection::new(
                "block".into(),
                label.into(),
                PixelBox::from([x, 10.0, x + 20.0, 30.0]),
            )
        }
    }

    fn place(phrase: &str, x: f64, score: f32) -> PhraseBox {
        let pixel_box = PixelBox::from([x, 10.0, x + 20.0, 30.0]);
        PhraseBox { phrase: phrase.to_owned(), pixel_box, score }
    }

    #[track_caller]
    fn check(rule: MergeRule, places: &[PhraseBox], names: &[&str], unplaced: &[&str]) {
        let detections = [block("red", 0.0), block("blue", 50.0), block("green", 100.0)];
        let before = ["block", "block2", "block3"].map(Name::new);
        let merged = merge(&before, &detections, places, rule);
        assert_eq!(merged.names, names);
        assert_eq!(merged.unplaced.len(), unplaced.len(), "{:?}", merged.unplaced);
        for (got, expect) in merged.unplaced.iter().zip(unplaced) {
            assert!(got.contains(expect), "{got}");
        }
    }

    #[test]
    fn the_best_place_of_a_phrase_names_the_object_that_it_overlaps_most() {
        let places = [place("left tray", 102.0, 0.4), place("left tray", 53.0, 0.8)];
        check(MergeRule::Fitting, &places, &["block", "left_tray", "block3"], &[]);
    }

    #[test]
    fn a_place_beside_all_objects_names_one_by_the_papers_rule_only() {
        let places = [place("tray", 64.0, 0.8)];
        check(MergeRule::Greatest, &places, &["block", "tray", "block3"], &[]);
        check(MergeRule::Fitting, &places, &["block", "block2", "block3"], &["overlap 0.18"]);
        let nowhere = [place("tray", 400.0, 0.8)];
        check(MergeRule::Greatest, &nowhere, &["tray", "block2", "block3"], &[]);
    }

    #[test]
    fn an_object_takes_one_phrase_and_a_name_is_given_once() {
        let places = [place("cup", 50.0, 0.3), place("mug", 51.0, 0.6), place("block3", 0.0, 0.2)];
        let unplaced = ["\"cup\": mug fits better there", "\"block3\": another object"];
        check(MergeRule::Fitting, &places, &["block", "mug", "block3"], &unplaced);
        let merged = merge(&[], &[], &places[..1], MergeRule::Fitting);
        assert_eq!(merged.unplaced, ["\"cup\": no object is seen"]);
    }

    #[track_caller]
    fn check_answer(phrase: &str, expect: Option<f64>) {
        let perception = Perception::parse("perception.toml", BLOCKS).unwrap();
        let detections = [block("red", 0.0), block("red", 50.0), block("blue", 100.0)];
        let names = name_detections(&perception, &detections);
        let phrases = [phrase.to_owned()];
        let places = answer(&perception, (&names, &detections), &phrases);
        assert_eq!(places.first().map(|place| place.pixel_box.x1), expect, "{phrase}");
    }

    #[test]
    fn words_find_the_only_object_that_they_describe() {
        check_answer("blue block", Some(100.0));
        check_answer("the Blue colored block", Some(100.0));
        check_answer("blue", Some(100.0));
        check_answer("red block", Some(0.0)); // that is a name
        check_answer("red block2", Some(50.0));
        for none in ["red", "block", "crimson block", "blue cube", "the", ""] {
            check_answer(none, None);
        }
    }
}
