//! A detector of your own: it finds red things by their pixels, without learning anything. It reads a shipped picture
//! here, and the project's grounder judges the facts about what it found.
//!
//! ```console
//! cargo run --release --example own_detector
//! ```
//!
//! To choose it in a run file, move it to `src/perception/detectors/red.rs`, add a `PART` (see
//! `src/perception/detectors/annotated.rs`) and a line in `DETECTORS`; `perception.detector = "red"` then uses it.

#![expect(clippy::print_stdout, reason = "an example shows what it does")]

use groundloop::geometry::PixelBox;
use groundloop::parts::PartChoice;
use groundloop::pddl::Name;
use groundloop::perception::detectors::{Detector, DetectorError};
use groundloop::perception::model::ObjectBox;
use groundloop::perception::{Detection, Detections, GripperContent, ImageView, ground_image};
use groundloop::run::{DomainFolder, ExemplarConfig, read_image};

/// How much redder than green and blue a pixel must be, of 255.
const REDNESS_MIN: u8 = 90;

#[derive(Debug)]
struct RedThings;

impl Detector for RedThings {
    fn learn(&mut self, _: &ImageView<'_>, _: &[ObjectBox]) -> Result<(), DetectorError> {
        Ok(()) // A labelled example would teach a better detector what to look for.
    }

    fn detect(
        &mut self,
        image: &ImageView<'_>,
        _phrases: &[String],
    ) -> Result<Detections, DetectorError> {
        let mut found: Option<[usize; 4]> = None;
        for y in 0..image.height() {
            for (x, pixel) in image.row(y).chunks_exact(3).enumerate() {
                if pixel[0].saturating_sub(pixel[1].max(pixel[2])) >= REDNESS_MIN {
                    let [left, top, right, _] = found.unwrap_or([x, y, x, y]);
                    found = Some([left.min(x), top.min(y), right.max(x), y]);
                }
            }
        }
        let pixel_box = |[left, top, right, bottom]: [usize; 4]| {
            PixelBox::from([left, top, right + 1, bottom + 1].map(|v| v as f64))
        };
        let (block, red) = (Name::new("block"), Name::new("red"));
        let object = found.map(|corners| Detection::new(block, red, pixel_box(corners)));
        Ok(Detections { objects: object.into_iter().collect(), ..Detections::default() })
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = DomainFolder::read("domains/blocksworld".as_ref())?;
    let exemplars = ExemplarConfig::in_folder("sim_320x240").read(&folder, None)?;
    let grounder = folder.grounder(&PartChoice::new("grounder", "s2s"), &exemplars)?;
    let path = "domains/blocksworld/exemplar/sim_320x240/a_tower_and_singles.png";
    let picture = read_image(path.as_ref())?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let view = ImageView::new(width, height, picture.as_raw())?;
    let pipeline = folder.pipeline(&*grounder);
    let nothing_held = GripperContent::Empty;
    let read = ground_image(&pipeline, &mut RedThings, &view, &[], &nothing_held)?;
    for object in &read.named.boxes {
        let [left, top, right, bottom] = object.pixel_box.into();
        println!("{}: columns {left} to {right}, rows {top} to {bottom}", object.name);
    }
    for fact in &read.state.facts.known {
        println!("{fact}");
    }
    Ok(())
}
