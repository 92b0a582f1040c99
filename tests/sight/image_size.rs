//! Images of another size than the labelled examples, which are scaled to it.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the test")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::common::project;
use groundloop::geometry::PixelBox;
use groundloop::logic::Facts;
use groundloop::parts::PartChoice;
use groundloop::pddl::Name;
use groundloop::run::{DomainFolder, ExemplarConfig, StillImageParts, StillImageReader};
use image::imageops::{FilterType, crop_imm, resize};
use tempfile::TempDir;

/// A reader that has learnt from the examples of 640 x 480 pixels.
fn reader(domain: &str) -> StillImageReader {
    let folder = Arc::new(DomainFolder::read(&project("domains").join(domain)).unwrap());
    let examples = ExemplarConfig::in_folder("sim_640x480").read(&folder, None).unwrap();
    let detector = PartChoice::new("perception.detector", "colour");
    let grounder = PartChoice::new("perception.grounder", "s2s-joint");
    let examples = Arc::new(examples);
    StillImageParts { folder, examples, detector, grounder, region: None }.reader().unwrap()
}

/// A labelled picture of 640 x 480 pixels.
fn picture(domain: &str, name: &str) -> PathBuf {
    project("domains").join(domain).join(format!("exemplar/sim_640x480/{name}.png"))
}

/// Writes it in another size.
fn resized(picture: &Path, [width, height]: [u32; 2], folder: &TempDir) -> PathBuf {
    let image = image::open(picture).unwrap().into_rgb8();
    let path = folder.path().join(format!("{width}x{height}.png"));
    resize(&image, width, height, FilterType::Lanczos3).save(&path).unwrap();
    path
}

type Seen = (Facts, BTreeMap<Name, PixelBox>);

fn read(reader: &mut StillImageReader, path: &Path) -> Seen {
    let seen = reader.read(path, &[]).unwrap_or_else(|e| panic!("{e}"));
    let boxes = seen.named.boxes.into_iter().map(|object| (object.name, object.pixel_box));
    (seen.state.facts, boxes.collect())
}

#[track_caller]
fn says_the_same_at_every_size(domain: &str, name: &str) {
    let (mut reader, folder) = (reader(domain), tempfile::tempdir().unwrap());
    let own = picture(domain, name);
    let (facts, boxes) = read(&mut reader, &own);
    assert!(!facts.known.is_empty() && facts.unknown.is_empty());
    // The last is 1 % too wide.
    for size in [[320, 240], [960, 720], [646, 480]] {
        let (scaled_facts, scaled) = read(&mut reader, &resized(&own, size, &folder));
        assert_eq!(scaled_facts, facts, "{domain} at {size:?}");
        let [x, y] = [f64::from(size[0]) / 640.0, f64::from(size[1]) / 480.0];
        for (object, b) in &boxes {
            let expected = PixelBox { x1: b.x1 * x, y1: b.y1 * y, x2: b.x2 * x, y2: b.y2 * y };
            let iou = scaled[object].iou(&expected);
            assert!(iou > 0.8, "{domain} at {size:?}: {object}: {:?}", scaled[object]);
        }
    }
    assert_eq!(read(&mut reader, &own), (facts, boxes), "and at its own size as before");
}

#[test]
fn blocks_are_the_same_at_every_size() {
    says_the_same_at_every_size("blocksworld", "b_high_tower");
}

#[test]
fn disks_are_the_same_at_every_size() {
    says_the_same_at_every_size("hanoi", "b_spread");
}

#[test]
fn an_image_of_another_ratio_is_refused_with_both_sizes_and_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let wide = resized(&picture("blocksworld", "b_high_tower"), [640, 360], &folder);
    let said = reader("blocksworld").read(&wide, &[]).unwrap_err().to_string();
    let expected = "640x360.png: expected 640x480 pixels like the labelled example, or another size of \
                    its ratio (1.333), got 640x360 (1.778): crop to that ratio, or label an example of \
                    this camera";
    assert!(said.ends_with(expected), "{said}");
}

/// A copy of the domain in which one example is of other pixels.
fn mixed(change: impl Fn(&image::RgbImage) -> image::RgbImage) -> (TempDir, DomainFolder) {
    let copy = tempfile::tempdir().unwrap();
    let from = project("domains/blocksworld");
    for ending in ["pddl", "toml", "json", "png"] {
        for file in crate::common::files_below(&from, ending) {
            let to = copy.path().join(file.strip_prefix(&from).unwrap());
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            fs::copy(file, to).unwrap();
        }
    }
    let examples = copy.path().join("exemplar/sim_640x480");
    let file = examples.join("b_high_tower.png");
    change(&image::open(&file).unwrap().into_rgb8()).save(&file).unwrap();
    // Labels of the small camera's example are half as large.
    for ending in ["json", "masks.json"] {
        let small = copy.path().join("exemplar/sim_320x240/b_high_tower").with_extension(ending);
        fs::copy(small, examples.join("b_high_tower").with_extension(ending)).unwrap();
    }
    let folder = DomainFolder::read(copy.path()).unwrap();
    (copy, folder)
}

#[test]
fn pooled_examples_of_several_sizes_are_scaled_to_the_first() {
    let examples = ExemplarConfig::in_folder("sim_640x480");
    let (_copy, folder) = mixed(|image| resize(image, 320, 240, FilterType::Lanczos3));
    let read = examples.read(&folder, None).unwrap();
    let other = &read.iter().find(|(_, e)| e.name.contains("b_high_tower")).unwrap();
    assert!(read.iter().all(|(p, e)| p.dimensions() == (640, 480) && e.image_size == [640, 480]));
    let (_, own) = reader_examples();
    for (object, own) in other.1.objects.iter().zip(&own.objects) {
        assert_eq!(object.name, own.name);
        // What of it is hidden differs a little between the two pictures.
        assert!(object.pixel_box.iou(&own.pixel_box) > 0.8, "{}", object.name);
        let area = |object: &groundloop::perception::model::ObjectBox| {
            object.mask.as_ref().map(groundloop::geometry::Mask::area).unwrap()
        };
        assert!((area(object) / area(own) - 1.0).abs() < 0.2, "{}", object.name);
    }
    // Cut at the right: what is labelled is still inside.
    let (_copy, folder) = mixed(|image| crop_imm(image, 0, 0, 360, 480).to_image());
    let said = examples.read(&folder, None).unwrap_err().to_string();
    let expected = "b_high_tower.png: expected 640x480 pixels like the labelled example, or another \
                    size of its ratio (1.333), got 360x480 (0.750): crop";
    assert!(said.contains(expected), "{said}");
}

/// The example that is changed above, as it is.
fn reader_examples() -> (image::RgbImage, groundloop::perception::model::Exemplar) {
    let folder = DomainFolder::read(&project("domains/blocksworld")).unwrap();
    let read = ExemplarConfig::in_folder("sim_640x480").read(&folder, None).unwrap();
    read.into_iter().find(|(_, e)| e.name.contains("b_high_tower")).unwrap()
}

#[cfg(feature = "sim")]
#[test]
fn the_loop_reaches_its_goal_with_a_camera_of_another_size() {
    for (examples, size) in [("sim_640x480", [320, 240]), ("sim_320x240", [480, 360])] {
        let sets = [
            format!("perception.exemplar.folder={examples}"),
            format!("sim.camera.width={}", size[0]),
            format!("sim.camera.height={}", size[1]),
            "sim.scene=scenes/exemplar/a_tower_and_singles.toml".to_owned(),
            "goal.kind=logical".to_owned(),
            "goal.text=(on orange_block pink_block)".to_owned(),
        ];
        let config =
            groundloop::run::load_run(&project("configs/blocksworld.toml"), &sets).unwrap();
        let prepared = groundloop::run::PreparedRun::read(config.clone(), None).unwrap();
        assert_eq!(prepared.image_size(), size);
        let report = crate::common::episode(config).report;
        assert_eq!(report.verdict, "reached", "{size:?}: {}", report.reason);
    }
}

#[cfg(feature = "sim")]
#[test]
fn a_camera_of_another_ratio_is_refused_by_its_key() {
    let sets = ["sim.camera.width=640".to_owned(), "sim.camera.height=360".to_owned()];
    let back = ["position_m=[1,0,1]", "look_at_m=[0,0,0]", "width=300", "height=300"];
    let back = back.map(|key| format!("sim.cameras.back.{key}"));
    for (sets, key) in [(&sets[..], "sim.camera:"), (&back[..], "sim.cameras.back:")] {
        let mut sets = sets.to_vec();
        if key.contains("back") {
            sets.push("cameras.back.kind=sim".to_owned());
        }
        let config =
            groundloop::run::load_run(&project("configs/blocksworld.toml"), &sets).unwrap();
        let said = groundloop::run::PreparedRun::read(config, None).unwrap_err().to_string();
        let expected =
            format!("{key} expected 640x480 pixels like the labelled example, or another");
        assert!(said.starts_with(&expected) && said.contains("crop to that ratio"), "{said}");
    }
}
