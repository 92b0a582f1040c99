//! What surrounds every detector: things that no object explains, and objects that stand elsewhere
//! than the labelled ones.

use std::collections::BTreeMap;

use super::light::Normaliser;
use super::scenery::{Scenery, contains};
use super::{Detector, DetectorError};
use crate::geometry::PixelBox;
use crate::pddl::Name;
use crate::perception::model::{ObjectBox, Perception};
use crate::perception::{
    Detection, Detections, ImageRegion, ImageView, Outside, OutsideReason, Unexplained, UsualSizes,
};

/// A detector with an eye on what it leaves out.
pub struct Watchful {
    inner: Box<dyn Detector>,
    /// Types whose names the domain lists, and how many.
    fixtures: Vec<(Name, usize)>,
    /// How large labelled objects are in the world, by type.
    sizes: UsualSizes,
    scenery: Scenery,
    normaliser: Normaliser,
    /// Where objects can be, if people say so.
    region: Option<ImageRegion>,
}

impl Watchful {
    /// Surrounds a detector of a domain's objects.
    pub fn new(inner: Box<dyn Detector>, perception: &Perception) -> Self {
        let listed = perception.types.iter().filter(|spec| !spec.naming.list.is_empty());
        let fixtures = listed.map(|spec| (spec.name.clone(), spec.naming.list.len())).collect();
        let (scenery, normaliser) = (Scenery::default(), Normaliser::default());
        let sizes = UsualSizes::default();
        Self { inner, fixtures, sizes, scenery, normaliser, region: None }
    }

    /// Looks for objects in this part of the image only.
    #[must_use]
    pub fn within(self, region: Option<ImageRegion>) -> Self {
        Self { region, ..self }
    }

    /// Moves what stands elsewhere than objects do to `outside`.
    fn leave_out(&self, found: &mut Detections, image_height: usize) {
        let objects = boxes(&found.objects);
        let elsewhere = self.scenery.outside(&objects, image_height).into_iter();
        let mut outside: BTreeMap<usize, OutsideReason> =
            elsewhere.map(|at| (at, OutsideReason::Elsewhere)).collect();
        if let Some([left, right]) = self.between_fixtures(found) {
            let is_beside = |b: &PixelBox| !(left..=right).contains(&b.centre().0);
            let beside = objects.iter().enumerate().filter(|(_, b)| is_beside(b));
            for (at, _) in beside {
                outside.entry(at).or_insert(OutsideReason::BesideFixtures);
            }
        }
        move_outside(found, outside);
    }

    /// The columns in which objects can be, where all fixtures are seen: between them, or on them.
    fn between_fixtures(&self, found: &Detections) -> Option<[f64; 2]> {
        let mut hull: Option<PixelBox> = None;
        for (type_name, n_listed) in &self.fixtures {
            let of_type = || found.objects.iter().filter(|d| d.type_name == *type_name);
            if of_type().count() != *n_listed {
                return None;
            }
            for b in of_type().map(|d| d.pixel_box) {
                hull = Some(hull.map_or(b, |hull| hull.hull(&b)));
            }
        }
        let reach = found.objects.iter().map(|d| d.pixel_box.width()).fold(0.0, f64::max);
        hull.map(|b| [b.x1 - reach / 2.0, b.x2 + reach / 2.0])
    }
}

/// Moves out what has its middle outside the region, and forgets phrases that lead there.
fn leave_out_of(region: &PixelBox, found: &mut Detections) {
    let is_in = |b: &PixelBox| contains(region, b.centre());
    let places = found.objects.iter().enumerate();
    let outside = places.filter(|(_, detection)| !is_in(&detection.pixel_box));
    let outside = outside.map(|(at, _)| (at, OutsideReason::Region)).collect();
    move_outside(found, outside);
    found.phrases.retain(|phrase| is_in(&phrase.pixel_box));
}

/// Moves objects to `outside`, by their places.
fn move_outside(found: &mut Detections, places: BTreeMap<usize, OutsideReason>) {
    for (at, reason) in places.into_iter().rev() {
        let detection = found.objects.remove(at);
        found.outside.insert(0, Outside { at, detection, reason });
    }
}

/// Whether a thing reaches into a part of the image: there it may hide something.
fn reaches(thing: &Unexplained, region: &PixelBox) -> bool {
    thing.stripes.iter().any(|stripe| stripe.intersection(region).is_valid())
}

fn boxes(found: &[Detection]) -> Vec<PixelBox> {
    found.iter().map(|detection| detection.pixel_box).collect()
}

impl std::fmt::Debug for Watchful {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watchful").field("scenery", &self.scenery).finish_non_exhaustive()
    }
}

impl Detector for Watchful {
    fn learn(&mut self, image: &ImageView<'_>, objects: &[ObjectBox]) -> Result<(), DetectorError> {
        self.inner.learn(image, objects)?;
        self.scenery.learn(image, objects);
        self.sizes.learn(objects);
        Ok(())
    }

    fn detect(
        &mut self,
        image: &ImageView<'_>,
        phrases: &[String],
    ) -> Result<Detections, DetectorError> {
        let mut found = self.inner.detect(image, phrases)?;
        let region = self.region.map(|region| region.pixels(image.width(), image.height()));
        if let Some(region) = &region {
            leave_out_of(region, &mut found);
        }
        if self.scenery.is_empty() {
            return Ok(found);
        }
        for detection in &mut found.objects {
            detection.usual_extent = self.sizes.of(&detection.type_name);
        }
        self.leave_out(&mut found, image.height());
        let light = self.scenery.light();
        let Self { scenery, normaliser, .. } = self;
        let frame = normaliser.view(image, light.as_ref(), &|rgb| scenery.likeness(rgb));
        let outside: Vec<PixelBox> =
            found.outside.iter().map(|thing| thing.detection.pixel_box).collect();
        let things =
            |found: &Detections| scenery.unexplained(&frame, (&boxes(&found.objects), &outside));
        found.unexplained = things(&found);
        let parts = Scenery::parts_of(&frame, &found.unexplained, &boxes(&found.objects));
        // Fixtures may be parts of something larger: pegs of a board.
        let is_fixture = |at: &usize| {
            self.fixtures.iter().any(|(fixture, _)| *fixture == found.objects[*at].type_name)
        };
        let parts: Vec<usize> = parts.into_iter().filter(|at| !is_fixture(at)).collect();
        if !parts.is_empty() {
            parts.into_iter().rev().for_each(|at| drop(found.objects.remove(at)));
            found.unexplained = things(&found);
        }
        if let Some(region) = &region {
            found.unexplained.retain(|thing| reaches(thing, region));
        }
        Ok(found)
    }

    fn warm_up(&mut self, image: &ImageView<'_>) -> Result<(), DetectorError> {
        self.inner.warm_up(image)
    }

    fn is_slow(&self) -> bool {
        self.inner.is_slow()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::perception::detectors::ColourDetector;
    use crate::perception::detectors::drawn::{
        BLOCK_LABELS, BLUE, CLOTH, Canvas, RED, blocks, labelled,
    };

    const BLOCKS: &str = include_str!("../../../domains/blocksworld/perception.toml");
    const HANOI: &str = include_str!("../../../domains/hanoi/perception.toml");
    const SKIN: [u8; 3] = [205, 160, 135];
    const WOOD: [u8; 3] = [205, 170, 125];

    fn taught(domain: &str, example: &Canvas, labels: &[(&str, &str, [f64; 4])]) -> Watchful {
        let perception = Perception::parse("perception.toml", domain).unwrap();
        let colour = ColourDetector::new(&perception).unwrap();
        let mut watchful = Watchful::new(Box::new(colour), &perception);
        watchful.learn(&example.view(), &labelled(labels)).unwrap();
        watchful
    }

    fn seen(canvas: &Canvas) -> Detections {
        taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS).detect(&canvas.view(), &[]).unwrap()
    }

    fn labels(found: &[Detection]) -> Vec<&str> {
        let mut labels: Vec<&str> = found.iter().map(|d| d.label.as_str()).collect();
        labels.sort_unstable();
        labels
    }

    #[test]
    fn the_example_itself_holds_nothing_unexplained() {
        let found = seen(&blocks(CLOTH));
        assert_eq!(labels(&found.objects), ["blue", "red", "yellow"]);
        assert_eq!((found.unexplained, found.outside), (Vec::new(), Vec::new()));
    }

    /// Another brightness is no thing, and neither is another ground.
    #[test]
    fn light_and_ground_are_no_things() {
        let mut dark = blocks(CLOTH);
        dark.rgb.iter_mut().for_each(|v| *v = (f64::from(*v) * 0.7) as u8);
        for canvas in [dark, blocks([98, 82, 42])] {
            let found = seen(&canvas);
            assert_eq!(labels(&found.objects), ["blue", "red", "yellow"]);
            assert_eq!(found.unexplained, []);
        }
    }

    #[test]
    fn what_floats_far_from_where_objects_stand_is_outside() {
        let mut canvas = blocks(CLOTH);
        canvas.fill([20, 30, 44, 54], BLUE).fill([280, 20, 304, 40], RED);
        let found = seen(&canvas);
        assert_eq!(labels(&found.objects), ["blue", "red", "yellow"]);
        let outside: Vec<[f64; 4]> =
            found.outside.iter().map(|o| o.detection.pixel_box.into()).collect();
        assert_eq!(outside.len(), 2, "{outside:?}");
        let mut all = found;
        all.take_back_outside();
        assert_eq!(labels(&all.objects), ["blue", "blue", "red", "red", "yellow"]);
    }

    /// Seen from a little higher up, all rows lie elsewhere, and everything stands.
    #[test]
    fn a_camera_that_looks_elsewhere_leaves_nothing_out() {
        let mut canvas = Canvas::new(320, 240, CLOTH);
        canvas.fill([60, 20, 90, 50], RED).fill([60, 50, 90, 80], BLUE);
        canvas.fill([220, 50, 250, 80], RED);
        let found = seen(&canvas);
        assert_eq!((found.objects.len(), found.outside.len()), (3, 0));
    }

    #[test]
    fn a_hand_before_a_block_is_a_thing_that_may_hide_one() {
        let mut canvas = blocks(CLOTH);
        canvas.fill([190, 150, 320, 215], SKIN);
        let found = seen(&canvas);
        assert_eq!(labels(&found.objects), ["blue", "red"]);
        let [thing] = &found.unexplained[..] else { panic!("{:?}", found.unexplained) };
        assert!(thing.may_hide && thing.place.x1 < 195.0 && thing.place.y1 < 155.0, "{thing:?}");
        assert!(!thing.is_near(&found.objects[0].pixel_box));
    }

    /// What reaches into the region may hide something there; what does not is none of its business.
    #[test]
    fn things_that_do_not_reach_into_the_region_are_not_told() {
        let mut canvas = blocks(CLOTH);
        canvas.fill([240, 20, 310, 80], SKIN);
        let n_things = |region: [f64; 4]| {
            let region = ImageRegion::new(region).unwrap();
            let watchful = taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS);
            let found = watchful.within(Some(region)).detect(&canvas.view(), &[]).unwrap();
            assert_eq!(labels(&found.objects), ["blue", "red", "yellow"]);
            found.unexplained.len()
        };
        assert_eq!(n_things([0.0, 0.0, 1.0, 1.0]), 1);
        assert_eq!(n_things([0.0, 0.25, 1.0, 1.0]), 1, "a quarter of the thing is in it");
        assert_eq!(n_things([0.0, 0.4, 1.0, 1.0]), 0);
    }

    #[test]
    fn a_thin_pole_is_a_thing_that_hides_nothing_whole() {
        let mut canvas = blocks(CLOTH);
        canvas.fill([70, 60, 80, 240], [128, 128, 126]);
        let found = seen(&canvas);
        assert_eq!(labels(&found.objects), ["blue", "red", "yellow"]);
        let red = found.objects.iter().find(|d| d.label == "red").unwrap().pixel_box;
        assert!(found.unexplained.iter().any(|thing| thing.is_near(&red)));
        assert!(found.unexplained.iter().all(|thing| !thing.may_hide));
    }

    /// A detector that takes the end of an arm for a block is corrected.
    #[test]
    fn an_object_that_is_the_end_of_a_larger_thing_is_none() {
        struct Fooled;
        impl Detector for Fooled {
            fn learn(&mut self, _: &ImageView<'_>, _: &[ObjectBox]) -> Result<(), DetectorError> {
                Ok(())
            }
            fn detect(
                &mut self,
                _: &ImageView<'_>,
                _: &[String],
            ) -> Result<Detections, DetectorError> {
                let block = |edges: [f64; 4]| {
                    Detection::new("block".into(), "pink".into(), PixelBox::from(edges))
                };
                let objects =
                    vec![block([60.0, 140.0, 90.0, 170.0]), block([150.0, 170.0, 180.0, 200.0])];
                Ok(Detections { objects, ..Detections::default() })
            }
        }
        let perception = Perception::parse("perception.toml", BLOCKS).unwrap();
        let mut watchful = Watchful::new(Box::new(Fooled), &perception);
        watchful.learn(&blocks(CLOTH).view(), &labelled(&BLOCK_LABELS)).unwrap();
        let mut canvas = blocks(CLOTH);
        canvas.fill([150, 170, 320, 200], SKIN);
        let found = watchful.detect(&canvas.view(), &[]).unwrap();
        assert_eq!(found.objects.len(), 1);
        assert_eq!(found.objects[0].pixel_box.x1, 60.0);
    }

    /// A service may answer any numbers: boxes far larger than the image, or none at all.
    #[test]
    fn absurd_boxes_are_survived() {
        struct Absurd([f64; 4]);
        impl Detector for Absurd {
            fn learn(&mut self, _: &ImageView<'_>, _: &[ObjectBox]) -> Result<(), DetectorError> {
                Ok(())
            }
            fn detect(
                &mut self,
                _: &ImageView<'_>,
                _: &[String],
            ) -> Result<Detections, DetectorError> {
                let edges = PixelBox::from(self.0);
                let objects = vec![Detection::new("block".into(), "pink".into(), edges)];
                Ok(Detections { objects, ..Detections::default() })
            }
        }
        let perception = Perception::parse("perception.toml", BLOCKS).unwrap();
        let mut canvas = blocks(CLOTH);
        canvas.fill([150, 60, 320, 200], SKIN);
        for edges in [
            [-1e300, -1e300, 1e300, 1e300],
            [f64::NAN; 4],
            [1e300, 1e300, -1e300, -1e300],
            [0.0, 0.0, f64::INFINITY, f64::INFINITY],
        ] {
            let mut watchful = Watchful::new(Box::new(Absurd(edges)), &perception);
            let mut labels = labelled(&BLOCK_LABELS);
            labels[0].pixel_box = PixelBox::from(edges);
            watchful.learn(&blocks(CLOTH).view(), &labels).unwrap();
            watchful.detect(&canvas.view(), &[]).unwrap();
        }
    }

    /// Beside all pegs there is nothing for a disk to be on.
    #[test]
    fn a_disk_beside_all_pegs_is_outside() {
        let stand = || {
            let mut canvas = Canvas::new(320, 240, CLOTH);
            canvas.fill([80, 200, 280, 222], WOOD);
            for x in [126, 176, 226] {
                canvas.fill([x, 60, x + 8, 200], WOOD);
            }
            canvas.fill([110, 176, 150, 200], BLUE);
            canvas
        };
        let labels = [
            ("left_peg", "peg", [126.0, 60.0, 134.0, 176.0]),
            ("middle_peg", "peg", [176.0, 60.0, 184.0, 200.0]),
            ("right_peg", "peg", [226.0, 60.0, 234.0, 200.0]),
            ("blue_disk", "disk", [110.0, 176.0, 150.0, 200.0]),
        ];
        let mut canvas = stand();
        canvas.fill([10, 170, 60, 194], RED);
        let found = taught(HANOI, &stand(), &labels).detect(&canvas.view(), &[]).unwrap();
        assert_eq!(found.objects.len(), 4, "{:?}", found.objects);
        assert_eq!(found.outside.len(), 1);
    }
}
