//! How long the colour detector takes for one rendered 640x480 frame.

#![expect(clippy::panic, reason = "a failed step must fail the benchmark")]

use std::hint::black_box;
use std::path::Path;

use criterion::Criterion;
use groundloop::hardware::sim::Labeller;
use groundloop::parts::PartChoice;
use groundloop::perception::ImageView;
use groundloop::run::load_run;

/// Run file and scene of each frame.
const FRAMES: [(&str, &str); 2] = [
    ("configs/blocksworld.toml", "scenes/five_blocks.toml"),
    ("configs/hanoi.toml", "scenes/four_disks.toml"),
];

fn detect(criterion: &mut Criterion, config: &str, scene: &str) -> Result<(), String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(config);
    let run = load_run(&path, &[]).map_err(|e| e.to_string())?;
    let folder = run.domain_folder().map_err(|e| e.to_string())?;
    let examples = run.perception.exemplar.read(&folder, None).map_err(|e| e.to_string())?;
    let mut detector = folder
        .detector(&PartChoice::new("bench", "colour"), &examples)
        .map_err(|e| e.to_string())?;
    let sim = run.sim().map_err(|e| e.to_string())?;
    let mut labeller = Labeller::new(folder.scenes(), sim).map_err(|e| e.to_string())?;
    let look = labeller.look(&folder.files.file(scene), 1, None).map_err(|e| e.to_string())?;
    let (width, height) = (look.image.width() as usize, look.image.height() as usize);
    let view = ImageView::new(width, height, look.image.as_raw()).map_err(|e| e.to_string())?;
    let seen = detector.detect(&view, &[]).map_err(|e| e.to_string())?;
    assert_eq!(seen.objects.len(), look.objects.len(), "every object is seen");
    criterion.bench_function(&format!("detect {} {width}x{height}", run.domain), |bencher| {
        bencher.iter(|| detector.detect(black_box(&view), &[]));
    });
    Ok(())
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    for (config, scene) in FRAMES {
        detect(&mut criterion, config, scene).unwrap_or_else(|e| panic!("{config}: {e}"));
    }
    criterion.final_summary();
}
