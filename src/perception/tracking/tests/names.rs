//! Names are identities.

use super::*;
use crate::pddl::{Name, Typed};
use crate::scene::Visibility::{Hidden, Visible};

#[test]
fn an_object_is_named_once_it_was_seen_often_enough() {
    let mut eyes = Eyes::new("blocksworld");
    let red = [block("red", -100.0, 0.0)];
    assert!(names(&eyes.stare(CONFIRM_FRAMES - 1, &red)).is_empty());
    let scene = eyes.look(&red);
    assert_eq!(names(&scene), ["red_block"]);
    let object = scene.object("red_block").unwrap();
    assert_eq!((object.type_name.as_str(), object.seen_ns), ("block", 300_000_000));
    let volume = object.volume.unwrap();
    let apart = (volume.centre - Point3::new(-0.1005, 0.025, 0.025)).norm();
    assert!(apart < 1e-3, "{:?}", volume.centre);
    assert_eq!(scene.object("arm").unwrap().visibility, Visibility::Implied);
}

#[test]
fn names_stay_with_their_colours_while_objects_change_places() {
    let mut eyes = Eyes::new("blocksworld");
    let at = |red, blue| [block("red", red, 0.0), block("blue", blue, 0.0)];
    eyes.stare(CONFIRM_FRAMES, &at(-100.0, 100.0));
    for (red, blue) in [(-90.0, 80.0), (100.0, -100.0), (-200.0, 200.0)] {
        let scene = eyes.look(&at(red, blue));
        assert_eq!(seen(&scene, "red_block"), (Visible, red));
        assert_eq!(seen(&scene, "blue_block"), (Visible, blue));
        assert_eq!(names(&scene), ["blue_block", "red_block"], "nobody new");
    }
}

#[test]
fn two_of_one_colour_keep_their_names_when_they_move_a_little() {
    let mut eyes = Eyes::new("blocksworld");
    let at = |left, right| [block("red", right, 0.0), block("red", left, 0.0)];
    eyes.stare(CONFIRM_FRAMES, &at(-50.0, 50.0));
    for (left, right) in [(-20.0, 80.0), (10.0, 110.0), (40.0, 140.0), (-5.0, 95.0)] {
        let mut detections = at(left, right);
        detections.reverse();
        let scene = eyes.look(&detections);
        assert_eq!(seen(&scene, "red_block"), (Visible, left));
        assert_eq!(seen(&scene, "red_block2"), (Visible, right));
    }
}

#[test]
fn what_shows_for_a_moment_is_no_object() {
    let mut eyes = Eyes::new("blocksworld");
    let red = block("red", -100.0, 0.0);
    let both = [red.clone(), block("green", 100.0, 0.0)];
    for _ in 0..4 {
        eyes.stare(CONFIRM_FRAMES - 1, &both);
        let scene = eyes.look(std::slice::from_ref(&red));
        assert_eq!(names(&scene), ["red_block"]);
    }
    assert_eq!(names(&eyes.stare(CONFIRM_FRAMES, &both)), ["green_block", "red_block"]);
}

#[test]
fn something_that_jumps_about_is_no_object() {
    let mut eyes = Eyes::new("blocksworld");
    for i in 0..9 {
        let scene = eyes.look(&[block("red", -200.0 + 50.0 * f64::from(i), 0.0)]);
        assert!(names(&scene).is_empty(), "it is never twice in one place");
    }
}

#[test]
fn a_new_object_of_a_known_colour_gets_a_number() {
    let mut eyes = Eyes::new("blocksworld");
    let red = block("red", 100.0, 0.0);
    eyes.stare(CONFIRM_FRAMES, std::slice::from_ref(&red));
    let scene = eyes.stare(CONFIRM_FRAMES, &[block("red", -100.0, 0.0), red]);
    assert_eq!(seen(&scene, "red_block").1, 100.0);
    assert_eq!(seen(&scene, "red_block2").1, -100.0);
}

/// Frames in which a phrase lies on one block and another block stands beside it.
fn called(eyes: &mut Eyes, phrase: &str, x: f64, n_frames: u32) -> Scene {
    let blocks = [block("red", x, 0.0), block("blue", -200.0, 0.0)];
    let place = PhraseBox {
        phrase: phrase.to_owned(),
        pixel_box: block("red", x + 4.0, 0.0).pixel_box,
        score: 0.8,
    };
    let frames = (0..n_frames).map(|_| {
        eyes.phrases = vec![place.clone()];
        eyes.look(&blocks)
    });
    frames.last().unwrap()
}

#[test]
fn a_phrase_of_the_goal_names_the_object_that_it_fits_once() {
    let mut eyes = Eyes::new("blocksworld");
    eyes.stare(CONFIRM_FRAMES, &[block("red", 0.0, 0.0), block("blue", -200.0, 0.0)]);
    let named = ["blue_block", "arm", "my_cup"].map(|name| Typed::new(name, "block"));
    assert_eq!(eyes.parser.unseen(&eyes.config, &named), ["my_cup"]);
    let scene = called(&mut eyes, "my cup", 0.0, CONFIRM_FRAMES - 1);
    assert_eq!(names(&scene), ["blue_block", "red_block"], "not yet");
    let scene = called(&mut eyes, "my cup", 0.0, 1);
    assert_eq!(names(&scene), ["blue_block", "my_cup"]);
    check(&scene, &[("on my_cup blue_block", Truth::False), ("ontable my_cup", Truth::True)]);
    let scene = called(&mut eyes, "your cup", 0.0, CONFIRM_FRAMES);
    assert_eq!(names(&scene), ["blue_block", "my_cup"], "a name is an identity");
    assert_eq!(eyes.parser.unseen(&eyes.config, &named), Vec::<Name>::new());
}

#[test]
fn a_new_object_is_born_with_its_phrase_as_name() {
    let mut eyes = Eyes::new("blocksworld");
    let scene = called(&mut eyes, "my cup", 0.0, CONFIRM_FRAMES);
    assert_eq!(names(&scene), ["blue_block", "my_cup"]);
}

#[test]
fn nothing_is_renamed_while_the_gripper_holds_something() {
    let mut eyes = Eyes::new("blocksworld");
    eyes.stare(CONFIRM_FRAMES, &[block("red", 0.0, 0.0), block("blue", -200.0, 0.0)]);
    eyes.grasp(-200.0, 25.0);
    let scene = called(&mut eyes, "my cup", 0.0, CONFIRM_FRAMES);
    assert!(names(&scene).contains(&"red_block"));
}

fn peg(x: f64) -> Detection {
    detection("peg", "wood", [310.0 + x, 300.0, 330.0 + x, 480.0])
}

#[test]
fn left_middle_and_right_wait_for_each_other() {
    let mut eyes = Eyes::new("hanoi");
    let pegs = [peg(200.0), peg(-200.0), peg(0.0)];
    assert!(names(&eyes.stare(HIDDEN_FRAMES_MAX - 1, &pegs[..2])).is_empty());
    let mut eyes = Eyes::new("hanoi");
    eyes.look(&pegs[..2]);
    assert!(names(&eyes.stare(CONFIRM_FRAMES - 1, &pegs)).is_empty(), "the third is too new");
    let scene = eyes.look(&pegs);
    assert_eq!(names(&scene), ["left_peg", "middle_peg", "right_peg"]);
    let columns = ["left_peg", "middle_peg", "right_peg"].map(|name| seen(&scene, name).1);
    assert_eq!(columns, [-200.0, 0.0, 200.0]);
}

#[test]
fn waiting_for_more_ends() {
    let mut eyes = Eyes::new("hanoi");
    let scene = eyes.stare(HIDDEN_FRAMES_MAX + 1, &[peg(200.0), peg(-200.0)]);
    assert_eq!(names(&scene), ["peg", "peg2"]);
}

#[test]
fn an_object_out_of_sight_is_remembered_where_it_was() {
    let mut eyes = Eyes::new("blocksworld");
    let scene = eyes.stare(CONFIRM_FRAMES, &[block("red", -100.0, 0.0)]);
    let before = scene.object("red_block").unwrap().clone();
    let scene = eyes.stare(HIDDEN_FRAMES_MAX * 3, &[]);
    let after = scene.object("red_block").unwrap();
    assert_eq!((after.visibility, after.seen_ns), (Hidden, before.seen_ns));
    assert_eq!((after.pixel_box, after.volume), (before.pixel_box, before.volume));
    let scene = eyes.look(&[block("red", 150.0, 0.0)]);
    assert_eq!(seen(&scene, "red_block"), (Visible, 150.0), "it comes back under its name");
}

#[test]
fn a_measured_place_at_rest_is_smoothed_and_a_moved_one_is_followed() {
    let mut eyes = Eyes::new("blocksworld");
    let place = |scene: &Scene| scene.object("red_block").unwrap().volume.unwrap().centre.x;
    let rest = place(&eyes.stare(CONFIRM_FRAMES, &[block("red", -100.0, 0.0)]));
    let jitter = place(&eyes.look(&[block("red", -94.0, 0.0)])) - rest;
    assert!(jitter > 0.001 && jitter < 0.003, "three tenths of 6 mm: {jitter}");
    let moved = place(&eyes.look(&[block("red", 100.0, 0.0)])) - rest;
    assert!((moved - 0.2).abs() < 1e-3, "{moved}");
}

#[test]
fn what_the_gripper_covers_is_not_seen_and_not_new() {
    let mut eyes = Eyes::new("blocksworld");
    eyes.robot.position = Point3::new(0.0, 0.025, 0.03);
    let scene =
        eyes.stare(CONFIRM_FRAMES * 2, &[block("red", 20.0, 0.0), block("blue", 150.0, 0.0)]);
    assert_eq!(names(&scene), ["blue_block"], "red may be a part of the gripper");
}
