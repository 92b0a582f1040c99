//! Drawing never fails on odd input, and what is drawn is where it should be.

use image::{Rgb, RgbImage};

use super::*;
use crate::logic::Truth;
use crate::scene::Visibility;

const GREY: Rgb<u8> = Rgb([60, 62, 66]);

fn frame(width: u32, height: u32) -> RgbImage {
    RgbImage::from_pixel(width, height, GREY)
}

fn object(name: &str, pixel_box: [f64; 4]) -> ObjectMark {
    ObjectMark {
        name: name.into(),
        pixel_box: Some(PixelBox::from(pixel_box)),
        colour: Some([200, 40, 40]),
        visibility: Visibility::Visible,
        facts: Vec::new(),
    }
}

fn nothing() -> PictureInput<'static> {
    PictureInput {
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
    }
}

fn drawn(frame: &RgbImage, objects: &[ObjectMark], edges: &[EdgeMark]) -> RgbImage {
    draw(frame, &PictureInput { objects, edges, ..nothing() }).unwrap()
}

/// `n` blocks in rows of ten.
fn grid(n: usize) -> Vec<ObjectMark> {
    (0..n)
        .map(|idx| {
            let (x, y) = (60.0 * (idx % 10) as f64 + 20.0, 100.0 * (idx / 10) as f64 + 40.0);
            object(&format!("block{idx}"), [x, y, x + 25.0, y + 25.0])
        })
        .collect()
}

fn labels_of(objects: &[ObjectMark], width: f32, height: f32) -> Vec<labels::Label> {
    let whole = Area::new(0.0, 0.0, width, height);
    let items: Vec<Item<'_>> = objects
        .iter()
        .filter_map(|mark| {
            let area = to_canvas(mark.pixel_box?, (0.0, 0.0), 2.0, &whole)?;
            Some(Item { mark, area })
        })
        .collect();
    labels::layout(&items, &[], &Fonts::load().unwrap(), &whole)
}

#[test]
fn the_frame_is_scaled_and_the_panel_stands_beside_it() {
    let picture = draw(&frame(640, 480), &nothing()).unwrap();
    assert_eq!(picture.dimensions(), (1280 + panel::WIDTH, 960));
    assert_eq!(*picture.get_pixel(640, 480), GREY);
    assert_eq!(picture.get_pixel(1279 + panel::WIDTH, 5).0, palette::PANEL);
    assert_eq!(draw(&frame(512, 512), &nothing()).unwrap().dimensions(), (960 + panel::WIDTH, 960));
    assert_eq!(draw(&frame(2560, 1440), &nothing()).unwrap().height(), 720);
}

#[test]
fn odd_frames_are_drawn_all_the_same() {
    let objects = [object("a", [0.0, 0.0, 1.0, 1.0])];
    for (width, height) in [(0, 0), (0, 7), (1, 1), (3, 5000), (5000, 3)] {
        let picture = drawn(&frame(width, height), &objects, &[]);
        assert!(picture.width() >= panel::WIDTH + 640 && picture.height() >= 720);
    }
}

#[test]
fn a_box_is_drawn_at_its_place_and_nothing_far_from_it() {
    let before = drawn(&frame(640, 480), &[], &[]);
    let after = drawn(&frame(640, 480), &[object("red_block", [100.0, 200.0, 150.0, 250.0])], &[]);
    let changed = |x: u32, y: u32| before.get_pixel(x, y) != after.get_pixel(x, y);
    // The four sides, at twice the frame's pixels.
    assert!(changed(199, 450) && changed(301, 450) && changed(250, 399) && changed(250, 501));
    assert!(!changed(250, 450), "the inside stays visible");
    assert!(!changed(1000, 100));
}

#[test]
fn boxes_outside_the_frame_or_without_an_inside_are_left_out() {
    let none = drawn(&frame(64, 48), &[], &[]);
    let nan = f64::NAN;
    for pixel_box in [
        [700.0, 100.0, 800.0, 200.0],
        [-50.0, -50.0, -10.0, -10.0],
        [50.0, 50.0, 40.0, 40.0],
        [nan, 0.0, 10.0, 10.0],
        [0.0, 0.0, f64::INFINITY, 10.0],
    ] {
        assert_eq!(drawn(&frame(64, 48), &[object("a", pixel_box)], &[]), none, "{pixel_box:?}");
    }
    // One that is partly inside is cut.
    let cut = drawn(&frame(64, 48), &[object("a", [-1e9, -1e9, 1e9, 24.0])], &[]);
    assert_ne!(cut, none);
}

#[test]
fn an_edge_is_drawn_between_its_objects_only() {
    let objects =
        [object("a", [100.0, 100.0, 150.0, 150.0]), object("b", [400.0, 300.0, 450.0, 350.0])];
    let edge = |from: &str, to: &str| EdgeMark {
        predicate: "on".into(),
        from: from.into(),
        to: to.into(),
        kind: EdgeKind::Seen,
    };
    let without = drawn(&frame(640, 480), &objects, &[]);
    let with = drawn(&frame(640, 480), &objects, &[edge("a", "b")]);
    assert_ne!(without.get_pixel(250, 250), with.get_pixel(250, 250), "the dot in the middle of a");
    let odd = [edge("a", "a"), edge("a", "nobody"), edge("nobody", "b")];
    let left_of_panel =
        |picture: &RgbImage| imageops::crop_imm(picture, 0, 0, 1280, 960).to_image();
    assert_eq!(left_of_panel(&drawn(&frame(640, 480), &objects, &odd)), left_of_panel(&without));
}

#[test]
fn what_is_wrong_or_missing_looks_different_and_is_listed() {
    let objects =
        [object("a", [100.0, 100.0, 150.0, 150.0]), object("b", [400.0, 300.0, 450.0, 350.0])];
    let pictures = [EdgeKind::Seen, EdgeKind::Wrong, EdgeKind::Missing].map(|kind| {
        let (predicate, from, to) = ("on".into(), "a".into(), "b".into());
        drawn(&frame(640, 480), &objects, &[EdgeMark { predicate, from, to, kind }])
    });
    let dot = |idx: usize| pictures[idx].get_pixel(250, 250).0;
    assert_eq!([dot(1), dot(2)], [palette::WRONG, palette::MISSING]);
    assert_ne!(dot(0), dot(1));
    let remark = Remark { text: "(on a b)".to_owned(), kind: RemarkKind::Missing };
    let with = PictureInput { remarks: &[remark], ..nothing() };
    assert_ne!(draw(&frame(64, 48), &with), draw(&frame(64, 48), &nothing()));
}

#[test]
fn labels_keep_off_each_other_and_inside_the_frame() {
    for objects in [grid(12), grid(20)] {
        let labels = labels_of(&objects, 1280.0, 960.0);
        assert_eq!(labels.len(), objects.len());
        for (idx, label) in labels.iter().enumerate() {
            assert!(label.area.x1 >= 0.0 && label.area.x2 <= 1280.0, "{label:?}");
            assert!(label.area.y1 >= 0.0 && label.area.y2 <= 960.0, "{label:?}");
            for other in &labels[..idx] {
                assert!(label.area.overlap(&other.area) <= 0.0, "{label:?}\n{other:?}");
            }
        }
    }
}

#[test]
fn a_tower_has_its_labels_beside_it() {
    let tower: Vec<ObjectMark> = (0..5)
        .map(|idx| {
            let y = 100.0 + 50.0 * f64::from(idx);
            object(&format!("block{idx}"), [300.0, y, 350.0, y + 50.0])
        })
        .collect();
    for (label, mark) in labels_of(&tower, 1280.0, 960.0).iter().zip(&tower) {
        let whole = Area::new(0.0, 0.0, 1280.0, 960.0);
        let area = to_canvas(mark.pixel_box.unwrap(), (0.0, 0.0), 2.0, &whole).unwrap();
        assert!(label.area.overlap(&area) <= 0.0, "{label:?}");
    }
}

#[test]
fn forty_objects_long_texts_and_long_lists_are_drawn() {
    let long = "very_".repeat(200);
    let mut objects = grid(40);
    objects[3].name = long.as_str().into();
    objects[4].facts = vec![long.clone(), "clear".to_owned()];
    objects[5].visibility = Visibility::Hidden;
    objects[6].visibility = Visibility::Held;
    let edges: Vec<EdgeMark> = (1..40)
        .map(|idx| EdgeMark {
            predicate: ["on", "near", "under"][idx % 3].into(),
            from: objects[idx].name.clone(),
            to: objects[idx / 2].name.clone(),
            kind: [EdgeKind::Seen, EdgeKind::Wrong, EdgeKind::Missing][idx % 3],
        })
        .collect();
    let holds = [Truth::True, Truth::False, Truth::Unknown];
    let goal: Vec<GoalMark> =
        (0..60).map(|idx| GoalMark { text: long.clone(), holds: holds[idx % 3] }).collect();
    let kinds = [RemarkKind::Wrong, RemarkKind::Missing, RemarkKind::Anomaly];
    let remarks: Vec<Remark> =
        (0..50).map(|idx| Remark { text: long.clone(), kind: kinds[idx % 3] }).collect();
    let plan = vec![format!("({long})\u{1F916} ä"); 300];
    let caption = vec![(long.clone(), long.clone()); 3];
    for step_idx in [None, Some(150), Some(1000)] {
        let input = PictureInput {
            view: None,
            title: &long,
            instruction: &long.replace('_', " "),
            caption: &caption,
            goal: &goal,
            plan: &plan,
            step_idx,
            remarks: &remarks,
            objects: &objects,
            edges: &edges,
        };
        let picture = draw(&frame(640, 480), &input).unwrap();
        assert_eq!(picture.dimensions(), (1280 + panel::WIDTH, 960));
        if step_idx.is_none() {
            let again = draw(&frame(640, 480), &input).unwrap();
            assert_eq!(picture, again, "drawing is deterministic");
        }
    }
}

#[test]
fn a_view_zooms_in_on_the_objects() {
    let objects = [object("a", [300.0, 200.0, 340.0, 240.0])];
    let view = view_around(&objects, 640, 480).unwrap();
    assert_eq!(view, PixelBox::from([160.0, 100.0, 480.0, 340.0]));
    let picture =
        draw(&frame(640, 480), &PictureInput { view: Some(view), objects: &objects, ..nothing() });
    // Four times the frame's pixels: the left side of the box is at (300 - 160) * 4.
    let picture = picture.unwrap();
    assert_eq!(picture.dimensions(), (1280 + panel::WIDTH, 960));
    assert_ne!(*picture.get_pixel(558, 480), GREY);
    assert_eq!(view_around(&[], 640, 480), None);
    let corner = [object("a", [0.0, 0.0, 640.0, 20.0])];
    let whole = PixelBox::from([0.0, 0.0, 640.0, 480.0]);
    assert_eq!(view_around(&corner, 640, 480).unwrap(), whole);
    // A view outside the frame shows the whole frame.
    let view = Some(PixelBox::from([900.0, 900.0, 950.0, 950.0]));
    assert_eq!(
        draw(&frame(640, 480), &PictureInput { view, ..nothing() }),
        draw(&frame(640, 480), &nothing())
    );
}

#[test]
fn text_is_cut_and_wrapped_to_its_width() {
    let fonts = Fonts::load().unwrap();
    let style = text::Style { face: text::Face::Mono, size: 20.0, colour: palette::TEXT };
    let text = "one two three four five six seven eight nine ten";
    let lines = fonts.wrap(text, style, 150.0, 3);
    assert_eq!(lines.len(), 3);
    assert!(lines.iter().all(|line| fonts.width(line, style) <= 150.0), "{lines:?}");
    assert!(lines[2].ends_with('…'), "{lines:?}");
    assert_eq!(fonts.wrap(text, style, 9000.0, 3), [text]);
    assert_eq!(fonts.cut("short", style, 9000.0), "short");
    assert_eq!(fonts.cut("anything", style, 0.0), "…");
}
