//! How long one picture of a scene takes: eight objects, their edges, goal and plan over a 640x480
//! frame; and the same frame without anything on it, which is mostly its scaling.

#![expect(clippy::panic, reason = "a failed step must fail the benchmark")]

use std::hint::black_box;
use std::path::Path;

use criterion::Criterion;
use groundloop::logic::Truth;
use groundloop::picture::{EdgeKind, EdgeMark, GoalMark, ObjectMark, PictureInput, draw};
use groundloop::scene::Visibility;

const FRAME: &str = "domains/blocksworld/exemplar/sim_640x480/a_tower_and_singles.png";
const N_OBJECTS: usize = 8;

const NOTHING: PictureInput<'static> = PictureInput {
    view: None,
    title: "",
    instruction: "",
    caption: &[],
    goal: &[],
    plan: &[],
    step_idx: None,
    remarks: &[],
    objects: &[],
    edges: &[],
};

fn objects() -> Vec<ObjectMark> {
    let object = |idx: usize| {
        let (x, y) = (90.0 + 120.0 * (idx % 4) as f64, 150.0 + 130.0 * (idx / 4) as f64);
        ObjectMark {
            name: format!("block{idx}").as_str().into(),
            pixel_box: Some([x, y, x + 50.0, y + 50.0].into()),
            colour: Some([200, 40, 40]),
            visibility: if idx == 3 { Visibility::Hidden } else { Visibility::Visible },
            facts: vec!["clear".to_owned()],
        }
    };
    (0..N_OBJECTS).map(object).collect()
}

fn main() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(FRAME);
    let frame = image::open(&path).unwrap_or_else(|e| panic!("{FRAME}: {e}")).into_rgb8();
    let objects = objects();
    let edge = |pair: &[ObjectMark]| EdgeMark {
        predicate: "on".into(),
        from: pair[0].name.clone(),
        to: pair[1].name.clone(),
        kind: EdgeKind::Seen,
    };
    let edges: Vec<EdgeMark> = objects.windows(2).map(edge).collect();
    let atom = |pair: &[ObjectMark]| format!("(on {} {})", pair[0].name, pair[1].name);
    let plan: Vec<String> = objects.windows(2).map(atom).collect();
    let part = |text: &String| GoalMark { text: text.clone(), holds: Truth::False };
    let goal: Vec<GoalMark> = plan.iter().map(part).collect();
    let input = PictureInput {
        title: "blocksworld",
        instruction: "stack all blocks",
        goal: &goal,
        plan: &plan,
        step_idx: Some(2),
        objects: &objects,
        edges: &edges,
        ..NOTHING
    };
    let mut criterion = Criterion::default().configure_from_args();
    criterion.bench_function("picture of eight objects", |bencher| {
        bencher.iter(|| draw(black_box(&frame), black_box(&input)));
    });
    criterion.bench_function("picture of nothing", |bencher| {
        bencher.iter(|| draw(black_box(&frame), black_box(&NOTHING)));
    });
    criterion.final_summary();
}
