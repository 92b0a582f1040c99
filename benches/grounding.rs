//! How long it takes from objects to facts: by grounder, domain, labelled examples, what is known of
//! the objects, and how many there are.
//!
//! `benches/reference_s2s.py` measures the method in Python on the same inputs.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the benchmark")]

use std::hint::black_box;
use std::path::Path;

use criterion::{BenchmarkId, Criterion};
use groundloop::geometry::MaskRun;
use groundloop::parts::{PartChoice, PartContext};
use groundloop::pddl::Name;
use groundloop::perception::grounders::{GROUNDERS, Grounder, GrounderInputs};
use groundloop::perception::model::{Exemplar, Exemplars, ObjectBox};
use groundloop::perception::{Observation, facts_of};
use groundloop::run::{DomainFolder, ExemplarConfig};
use nalgebra::Vector3;

/// Greatest shift of a labelled object, in pixels.
const SHIFT_PX: i32 = 200;

/// A plain generator of numbers, which the Python script repeats.
struct Numbers(u32);

impl Numbers {
    /// A number in -`SHIFT_PX`..`SHIFT_PX`.
    fn shift(&mut self) -> i32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 16).cast_signed() % (2 * SHIFT_PX) - SHIFT_PX
    }
}

/// Objects like the labelled ones, each somewhere else.
fn objects(examples: &[Exemplar], n_objects: usize) -> Vec<ObjectBox> {
    let mut numbers = Numbers(1);
    let labelled = examples.iter().flat_map(|example| &example.objects).cycle();
    let moved = labelled.take(n_objects).enumerate().map(|(i, object)| {
        let (dx, dy) = (numbers.shift(), numbers.shift());
        let [x1, y1, x2, y2] = <[f64; 4]>::from(object.pixel_box);
        let (right, down) = (f64::from(dx), f64::from(dy));
        let run = |run: &MaskRun| MaskRun {
            y: run.y.saturating_add_signed(dy + SHIFT_PX),
            x_start: run.x_start.saturating_add_signed(dx + SHIFT_PX),
            x_end: run.x_end.saturating_add_signed(dx + SHIFT_PX),
        };
        let mut volume = object.volume;
        if let Some(volume) = &mut volume {
            volume.centre += 1e-3 * Vector3::new(right, down, 0.0);
        }
        ObjectBox {
            name: Name::new(format!("{}_{i}", object.name)),
            type_name: object.type_name.clone(),
            pixel_box: [x1 + right, y1 + down, x2 + right, y2 + down].into(),
            volume,
            mask: object.mask.as_ref().map(|mask| mask.iter().map(run).collect()),
        }
    });
    moved.collect()
}

/// The labelled examples of the simulated camera.
fn examples(folder: &DomainFolder) -> Vec<Exemplar> {
    let config = ExemplarConfig {
        folder: Some("sim_640x480".to_owned()),
        image: None,
        boxes: None,
        state: None,
        number: None,
    };
    let examples = config.read(folder, None).unwrap_or_else(|e| panic!("{e}"));
    examples.into_iter().map(|(_, exemplar)| exemplar).collect()
}

/// What is known of an object, and the object with no more than that.
type Known = (&'static str, fn(ObjectBox) -> ObjectBox);

const KNOWN: [Known; 3] = [
    ("boxes", |o| ObjectBox { mask: None, volume: None, ..o }),
    ("masks", |o| ObjectBox { volume: None, ..o }),
    ("volumes", |o| o),
];

fn ground(criterion: &mut Criterion, domain: &str) {
    let domains = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains");
    let folder = DomainFolder::read(&domains.join(domain)).unwrap_or_else(|e| panic!("{e}"));
    let all = examples(&folder);
    for (set, examples) in [("one-shot", &all[..1]), ("shipped", &all[..])] {
        for (known, reduced) in KNOWN {
            let exemplars = examples.iter().map(|example| Exemplar {
                objects: example.objects.iter().cloned().map(reduced).collect(),
                ..example.clone()
            });
            let exemplars = Exemplars::new(exemplars.collect()).unwrap();
            for name in GROUNDERS.names() {
                let choice = PartChoice::new("perception.grounder", name);
                let inputs = GrounderInputs {
                    domain: &folder.domain,
                    perception: &folder.perception,
                    exemplars: &exemplars,
                };
                let context = PartContext { choice: &choice, inputs, environment: |_| None };
                let grounder = GROUNDERS.build(&context).unwrap();
                let scenes = [10, 60].map(|n| objects(&all, n).into_iter().map(reduced).collect());
                let title = format!("{name} {domain} {set} {known}");
                time(criterion, &title, &*grounder, &scenes);
            }
        }
    }
}

/// One grounder on scenes of different size.
fn time(
    criterion: &mut Criterion,
    title: &str,
    grounder: &dyn Grounder,
    scenes: &[Vec<ObjectBox>],
) {
    let mut group = criterion.benchmark_group(title);
    for objects in scenes {
        group.bench_function(BenchmarkId::from_parameter(objects.len()), |bencher| {
            bencher.iter(|| {
                facts_of(
                    &grounder.ground(&Observation::of_boxes(black_box(objects))).unwrap().judged,
                )
            });
        });
    }
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    for domain in ["blocksworld", "hanoi"] {
        ground(&mut criterion, domain);
    }
    criterion.final_summary();
}
