//! What the colour detector finds in drawn pictures.

use proptest::prelude::*;

use super::*;
use crate::perception::detectors::drawn::{
    BLOCK_LABELS, BLUE, CLOTH, Canvas, RED, YELLOW, blocks, labelled,
};

const BLOCKS: &str = include_str!("../../../../domains/blocksworld/perception.toml");
const HANOI: &str = include_str!("../../../../domains/hanoi/perception.toml");

#[track_caller]
fn check(domain: &str, canvas: &Canvas, expect: &[(&str, [f64; 4])]) {
    let perception = Perception::parse("perception.toml", domain).unwrap();
    let mut detector = ColourDetector::new(&perception).unwrap();
    let found = detector.detect(&canvas.view(), &[]).unwrap().objects;
    let names = name_detections(&perception, &found);
    let mut seen: Vec<_> = names.iter().map(Name::as_str).zip(&found).collect();
    seen.sort_by_key(|(name, _)| *name);
    let seen: Vec<_> = seen.into_iter().map(|(n, d)| (n, d.pixel_box.into())).collect();
    assert_eq!(seen, expect);
}

/// Three faces of one block in different light are one block; its box is exact under noise.
#[test]
fn a_shaded_block_is_one_block() {
    let mut canvas = Canvas::new(320, 240, [70, 72, 76]);
    canvas.fill([100, 150, 130, 158], [235, 62, 60]);
    canvas.fill([100, 158, 130, 180], [190, 40, 38]);
    canvas.fill([130, 152, 136, 180], [95, 16, 14]);
    check(BLOCKS, &canvas.noisy(), &[("red_block", [100.0, 150.0, 136.0, 180.0])]);
}

#[test]
fn a_tower_falls_into_its_blocks() {
    let mut canvas = Canvas::new(320, 240, [20, 20, 24]);
    canvas.fill([100, 100, 130, 130], [20, 80, 200]);
    canvas.fill([101, 130, 131, 160], [230, 200, 30]);
    canvas.fill([99, 160, 129, 190], [30, 160, 60]);
    let expect = [
        ("blue_block", [100.0, 100.0, 130.0, 130.0]),
        ("green_block", [99.0, 160.0, 129.0, 190.0]),
        ("yellow_block", [101.0, 130.0, 131.0, 160.0]),
    ];
    check(BLOCKS, &canvas.noisy(), &expect);
}

/// A ground whose purple tint slowly grows across the threshold of being called purple.
#[test]
fn tinted_cloth_is_no_block() {
    let mut canvas = Canvas::new(320, 240, [30, 30, 30]);
    for x in 0..320 {
        let tint = (x / 16) as u8;
        canvas.fill([x, 0, x + 1, 240], [30 + tint, 30 - tint / 2, 30 + tint]);
    }
    canvas.fill([40, 150, 70, 180], [200, 30, 30]);
    check(BLOCKS, &canvas, &[("red_block", [40.0, 150.0, 70.0, 180.0])]);
}

/// A post keeps its identity when something hides its middle, and the board is no post.
#[test]
fn posts_stand_on_a_board_of_their_own_wood() {
    let wood = [205, 170, 125];
    let mut canvas = Canvas::new(320, 240, [30, 30, 34]);
    canvas.fill([60, 180, 260, 200], wood);
    for x in [90, 155, 220] {
        canvas.fill([x, 80, x + 8, 180], wood);
    }
    canvas.fill([150, 140, 168, 146], [90, 92, 96]);
    for x in [230, 250] {
        canvas.fill([x, 120, x + 8, 200], [90, 92, 96]); // fingers that cut the board up
    }
    canvas.fill([70, 164, 118, 180], [30, 60, 200]);
    let expect = [
        ("blue_disk", [70.0, 164.0, 118.0, 180.0]),
        ("left_peg", [90.0, 80.0, 98.0, 164.0]),
        ("middle_peg", [155.0, 80.0, 163.0, 178.0]),
        ("right_peg", [220.0, 80.0, 228.0, 178.0]),
    ];
    check(HANOI, &canvas, &expect);
}

#[test]
fn learning_outside_the_image_is_refused() {
    let perception = Perception::parse("perception.toml", BLOCKS).unwrap();
    let mut detector = ColourDetector::new(&perception).unwrap();
    let canvas = Canvas::new(32, 24, [0, 0, 0]);
    let object =
        ObjectBox::new("red_block".into(), "block".into(), PixelBox::from([20.0, 3.0, 33.0, 9.0]));
    let message = detector.learn(&canvas.view(), &[object]).unwrap_err().to_string();
    assert_eq!(message, "red_block: expected a box inside the 32 x 24 image");
}

/// A picture whose labels teach the detector.
fn taught(domain: &str, example: &Canvas, labels: &[(&str, &str, [f64; 4])]) -> ColourDetector {
    let perception = Perception::parse("perception.toml", domain).unwrap();
    let mut detector = ColourDetector::new(&perception).unwrap();
    detector.learn(&example.view(), &labelled(labels)).unwrap();
    detector
}

#[track_caller]
fn check_taught(mut detector: ColourDetector, canvas: &Canvas, expect: &[(&str, [f64; 4])]) {
    let found = detector.detect(&canvas.view(), &[]).unwrap().objects;
    let names = name_detections(&detector.perception, &found);
    let mut seen: Vec<(&str, [f64; 4])> =
        names.iter().map(Name::as_str).zip(found.iter().map(|d| d.pixel_box.into())).collect();
    seen.sort_by_key(|(name, _)| *name);
    assert_eq!(seen, expect);
}

/// What is found of [`blocks`].
const BLOCKS_FOUND: [(&str, [f64; 4]); 3] = [
    ("blue_block", [60.0, 170.0, 90.0, 200.0]),
    ("red_block", [60.0, 140.0, 90.0, 170.0]),
    ("yellow_block", [220.0, 170.0, 250.0, 200.0]),
];

#[test]
fn a_ground_of_an_objects_colour_does_not_swallow_it() {
    let detector = taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS);
    check_taught(detector, &blocks([98, 82, 42]), &BLOCKS_FOUND);
}

#[test]
fn another_light_changes_no_name() {
    let mut warm = blocks(CLOTH);
    for pixel in warm.rgb.as_chunks_mut::<3>().0 {
        let [r, g, b] = pixel.map(f64::from);
        *pixel = [r * 1.2, g, b * 0.6].map(|v| v.min(255.0) as u8);
    }
    check_taught(taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS), &warm, &BLOCKS_FOUND);
}

#[test]
fn squares_on_a_corner_are_blocks() {
    let mut canvas = Canvas::new(320, 240, CLOTH);
    for row in 0..42_usize {
        let half = row.min(41 - row) + 1;
        canvas.fill([160 - half, 100 + row, 160 + half, 101 + row], RED);
    }
    let detector = taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS);
    check_taught(detector, &canvas, &[("red_block", [139.0, 100.0, 181.0, 142.0])]);
}

#[test]
fn a_thin_pole_cuts_no_block_in_two_and_ground_between_two_does() {
    let mut canvas = blocks(CLOTH);
    canvas.fill([70, 80, 80, 240], [128, 128, 126]);
    check_taught(taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS), &canvas, &BLOCKS_FOUND);
    let mut apart = Canvas::new(320, 240, CLOTH);
    apart.fill([100, 150, 114, 180], RED).fill([119, 150, 133, 180], RED);
    let expect =
        [("red_block", [100.0, 150.0, 114.0, 180.0]), ("red_block2", [119.0, 150.0, 133.0, 180.0])];
    check_taught(taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS), &apart, &expect);
}

#[test]
fn a_body_whose_hue_drifts_over_two_names_is_one_and_an_edge_makes_two() {
    let mut canvas = blocks(CLOTH);
    for x in 60..90 {
        let drift = (x - 60) as u8;
        canvas.fill([x, 140, x + 1, 170], [200 + drift / 2, 45 + drift, 40 + drift * 3 / 2]);
    }
    let detector = taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS);
    check_taught(detector, &canvas, &BLOCKS_FOUND);
    let mut two = Canvas::new(320, 240, CLOTH);
    two.fill([100, 150, 116, 180], RED).fill([116, 150, 132, 180], BLUE);
    let expect =
        [("blue_block", [116.0, 150.0, 132.0, 180.0]), ("red_block", [100.0, 150.0, 116.0, 180.0])];
    check_taught(taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS), &two, &expect);
}

#[test]
fn bodies_of_one_colour_that_touch_are_told_apart_by_shade_or_by_size() {
    let mut shades = Canvas::new(320, 240, CLOTH);
    shades.fill([60, 152, 90, 176], [120, 215, 110]).fill([60, 176, 90, 200], [15, 95, 25]);
    let expect =
        [("green_block", [60.0, 152.0, 90.0, 176.0]), ("green_block2", [60.0, 176.0, 90.0, 200.0])];
    check_taught(taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS), &shades, &expect);
    let mut sizes = Canvas::new(320, 240, CLOTH);
    sizes.fill([60, 140, 90, 200], RED).fill([150, 170, 210, 200], BLUE);
    let expect = [
        ("blue_block", [150.0, 170.0, 180.0, 200.0]),
        ("blue_block2", [180.0, 170.0, 210.0, 200.0]),
        ("red_block", [60.0, 140.0, 90.0, 170.0]),
        ("red_block2", [60.0, 170.0, 90.0, 200.0]),
    ];
    check_taught(taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS), &sizes, &expect);
}

/// Far from the camera everything is smaller, and a tower of two is hardly higher than a near block.
#[test]
fn far_bodies_of_one_colour_are_told_apart_by_their_shape() {
    let mut example = blocks(CLOTH);
    example.fill([140, 100, 160, 120], RED);
    let far = [("red_block2", "block", [140.0, 100.0, 160.0, 120.0])];
    let mut canvas = Canvas::new(320, 240, CLOTH);
    canvas.fill([140, 80, 160, 120], RED).fill([220, 170, 250, 200], YELLOW);
    let expect = [
        ("red_block", [140.0, 80.0, 160.0, 100.0]),
        ("red_block2", [140.0, 100.0, 160.0, 120.0]),
        ("yellow_block", [220.0, 170.0, 250.0, 200.0]),
    ];
    check_taught(taught(BLOCKS, &example, &[&BLOCK_LABELS[..], &far].concat()), &canvas, &expect);
}

/// All of one picture larger than in the example: the camera is nearer, and no block is two.
#[test]
fn in_a_nearer_picture_nothing_is_doubled() {
    let mut near = Canvas::new(320, 240, CLOTH);
    near.fill([20, 96, 74, 150], RED).fill([20, 150, 74, 204], BLUE);
    near.fill([150, 150, 204, 204], YELLOW);
    let expect = [
        ("blue_block", [20.0, 150.0, 74.0, 204.0]),
        ("red_block", [20.0, 96.0, 74.0, 150.0]),
        ("yellow_block", [150.0, 150.0, 204.0, 204.0]),
    ];
    check_taught(taught(BLOCKS, &blocks(CLOTH), &BLOCK_LABELS), &near, &expect);
}

/// A low disk between higher ones whose hue lies elsewhere than between theirs is no seam.
#[test]
fn a_thin_disk_between_two_is_a_disk() {
    let (orange, pink, green) = ([235, 130, 35], [225, 120, 165], [40, 150, 70]);
    let mut example = Canvas::new(320, 240, CLOTH);
    example.fill([35, 176, 125, 200], BLUE).fill([50, 152, 110, 176], orange);
    let labels = [
        ("blue_disk", "disk", [35.0, 176.0, 125.0, 200.0]),
        ("orange_disk", "disk", [50.0, 152.0, 110.0, 176.0]),
    ];
    let mut canvas = Canvas::new(320, 240, CLOTH);
    canvas.fill([35, 176, 125, 200], BLUE).fill([40, 152, 120, 176], pink);
    canvas.fill([43, 143, 117, 152], [20, 75, 85]).fill([48, 143, 112, 152], green);
    canvas.fill([50, 119, 110, 143], orange);
    let expect = [
        ("blue_disk", [35.0, 176.0, 125.0, 200.0]),
        ("green_disk", [48.0, 143.0, 112.0, 152.0]),
        ("orange_disk", [50.0, 119.0, 110.0, 143.0]),
        ("pink_disk", [40.0, 152.0, 120.0, 176.0]),
    ];
    check_taught(taught(HANOI, &example, &labels), &canvas, &expect);
}

/// A board with three pegs of some colour, and a disk.
fn stand(peg: [u8; 3], left_top: usize) -> Canvas {
    let mut canvas = Canvas::new(320, 240, CLOTH);
    canvas.fill([30, 200, 290, 222], peg);
    for x in [76, 156, 236] {
        let top = if x == 76 { left_top } else { 60 };
        canvas.fill([x, top, x + 8, 200], peg);
    }
    canvas.fill([45, 132, 115, 200], BLUE);
    canvas
}

const STAND_LABELS: [(&str, &str, [f64; 4]); 4] = [
    ("left_peg", "peg", [76.0, 60.0, 84.0, 200.0]),
    ("middle_peg", "peg", [156.0, 60.0, 164.0, 200.0]),
    ("right_peg", "peg", [236.0, 60.0, 244.0, 200.0]),
    ("blue_disk", "disk", [45.0, 132.0, 115.0, 200.0]),
];

#[track_caller]
fn check_pegs(peg: [u8; 3], left_top: usize, left_height: f64) {
    let mut detector = taught(HANOI, &stand(peg, 60), &STAND_LABELS);
    let found = detector.detect(&stand(peg, left_top).view(), &[]).unwrap().objects;
    let names = name_detections(&detector.perception, &found);
    let left = names.iter().position(|name| *name == "left_peg").unwrap();
    assert_eq!(found[left].pixel_box.height(), left_height);
    assert_eq!(names.iter().filter(|name| name.as_str().ends_with("_peg")).count(), 3);
}

#[test]
fn pegs_have_the_colour_that_the_example_shows() {
    check_pegs([205, 170, 125], 60, 72.0);
    check_pegs(RED, 60, 72.0);
}

#[test]
fn the_top_of_a_peg_that_disks_hide_is_a_peg() {
    check_pegs([205, 170, 125], 124, 8.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// Any pixels of any size give boxes inside the image.
    #[test]
    fn any_image_is_survived(width in 1..150_usize, height in 1..40_usize, seed in any::<u32>()) {
        let mut state = seed;
        let mut bytes = Vec::with_capacity(3 * width * height);
        while bytes.len() < 3 * width * height {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // Runs of one colour, so that there are regions.
            let run = [(state >> 24) as u8, (state >> 16) as u8, (state >> 8) as u8];
            bytes.extend(run.repeat(1 + (state & 31) as usize));
        }
        bytes.truncate(3 * width * height);
        let image = ImageView::new(width, height, &bytes).unwrap();
        for domain in [BLOCKS, HANOI] {
            let perception = Perception::parse("perception.toml", domain).unwrap();
            let mut detector = ColourDetector::new(&perception).unwrap();
            for found in detector.detect(&image, &[]).unwrap().objects {
                let b = found.pixel_box;
                prop_assert!(b.is_valid() && b.x1 >= 0.0 && b.y1 >= 0.0);
                prop_assert!(b.x2 <= width as f64 && b.y2 <= height as f64);
                prop_assert!(found.mask_area() as f64 <= b.area());
            }
        }
    }
}
