//! Two cameras, one belief.

use super::*;

/// Two blocks, one on the other; the tests' other camera sees what it is told.
fn pair() -> [Detection; 2] {
    [block("red", 0.0, 1.0), block("blue", 0.0, 0.0)]
}

#[test]
fn what_one_camera_finds_and_the_other_does_not_is_one_scene() {
    let mut eyes = Eyes::new("blocksworld");
    eyes.twin = Some((1.0, vec![block("blue", 0.0, 0.0), block("green", 100.0, 0.0)]));
    let scene = eyes.stare(CONFIRM_FRAMES * 2, &pair());
    assert_eq!(names(&scene), ["blue_block", "green_block", "red_block"]);
    check(&scene, &[("on red_block blue_block", Truth::True), ("clear green_block", Truth::True)]);
    assert_eq!(seen(&scene, "green_block").0, Visibility::Visible);
    assert!((seen(&scene, "green_block").1 - 100.0).abs() < 3.0, "its box is in the first image");
}

#[test]
fn what_the_robot_hides_from_both_cameras_keeps_its_facts() {
    let mut eyes = Eyes::new("blocksworld");
    eyes.twin = Some((1.0, pair().to_vec()));
    eyes.stare(CONFIRM_FRAMES * 2, &pair());
    // Both cameras stand in one place: the hand covers the pair in both.
    eyes.robot.position = Point3::new(0.0, 0.025, 0.1);
    let scene = eyes.look(&pair());
    assert_eq!(seen(&scene, "red_block").0, Visibility::Hidden);
    check(&scene, &[("on red_block blue_block", Truth::True)]);
}

#[test]
fn a_camera_that_looks_through_an_object_leaves_its_facts_unknown() {
    let mut eyes = Eyes::new("blocksworld");
    eyes.twin = Some((1.0, pair().to_vec()));
    let scene = eyes.stare(CONFIRM_FRAMES * 2, &pair());
    assert_eq!(scene.anomalies, []);
    // Twice as far as the blocks: nothing is where the first camera sees them.
    eyes.twin = Some((2.0, Vec::new()));
    let scene = eyes.stare(CONFIRM_FRAMES - 1, &pair());
    assert_eq!(scene.anomalies, [], "a doubt counts once it has lasted");
    let scene = eyes.look(&pair());
    let said: Vec<String> = scene.anomalies.iter().map(ToString::to_string).collect();
    let reasons =
        ["blue_block", "red_block"].map(|name| format!("twin sees through the place of {name}"));
    assert_eq!(said, reasons);
    check(
        &scene,
        &[("on red_block blue_block", Truth::Unknown), ("clear red_block", Truth::Unknown)],
    );
    eyes.twin = Some((1.0, pair().to_vec()));
    assert_eq!(eyes.look(&pair()).anomalies, [], "and no longer than it lasts");
    let scene = eyes.stare(CONFIRM_FRAMES, &pair());
    check(&scene, &[("on red_block blue_block", Truth::True)]);
}
