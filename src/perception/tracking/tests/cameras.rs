//! Two cameras, one belief.

use super::*;

/// Two blocks, one on the other.
fn pair() -> [Detection; 2] {
    [block("red", 0.0, 1.0), block("blue", 0.0, 0.0)]
}

/// The same block as the other camera sees it, which stands 250 pixels to the right.
fn aside(colour: &str, x: f64, level: f64) -> Detection {
    block(colour, x - 250.0, level)
}

fn pair_aside() -> Vec<Detection> {
    vec![aside("red", 0.0, 1.0), aside("blue", 0.0, 0.0)]
}

#[test]
fn what_one_camera_finds_and_the_other_does_not_is_one_scene() {
    let mut eyes = Eyes::new("blocksworld");
    eyes.twin = Some((1.0, vec![aside("blue", 0.0, 0.0), aside("green", 100.0, 0.0)]));
    let scene = eyes.stare(CONFIRM_FRAMES * 2, &pair());
    assert_eq!(names(&scene), ["blue_block", "green_block", "red_block"]);
    check(&scene, &[("on red_block blue_block", Truth::True), ("clear green_block", Truth::True)]);
    assert_eq!(seen(&scene, "green_block").0, Visibility::Visible);
    assert!((seen(&scene, "green_block").1 - 100.0).abs() < 3.0, "its box is in the first image");
}

/// What the robot hides from one camera is seen by the other, which looks past it.
#[test]
fn a_hand_before_one_camera_hides_nothing_from_the_other() {
    let mut eyes = Eyes::new("blocksworld");
    eyes.twin = Some((1.0, pair_aside()));
    eyes.stare(CONFIRM_FRAMES * 2, &pair());
    // Between the first camera and the pair.
    eyes.robot.position = Point3::new(0.0, -0.3, 0.1);
    let beside = eyes.look(&pair());
    assert_eq!(seen(&beside, "red_block").0, Visibility::Visible);
    eyes.twin = None;
    assert_eq!(seen(&eyes.look(&pair()), "red_block").0, Visibility::Hidden);
    // At the pair, it hides it from both, which changes no fact.
    eyes.twin = Some((1.0, pair_aside()));
    eyes.robot.position = Point3::new(0.0, 0.025, 0.1);
    let behind = eyes.look(&pair());
    assert_eq!(seen(&behind, "red_block").0, Visibility::Hidden);
    check(&behind, &[("on red_block blue_block", Truth::True)]);
    // A block that only the other camera sees past the hand is an object, too.
    eyes.robot.position = Point3::new(0.0, -0.3, 0.1);
    eyes.twin = Some((1.0, [pair_aside(), vec![aside("green", 60.0, 0.0)]].concat()));
    let scene = eyes.stare(CONFIRM_FRAMES, &pair());
    assert_eq!(names(&scene), ["blue_block", "green_block", "red_block"]);
}

#[test]
fn a_camera_that_looks_through_an_object_leaves_its_facts_unknown() {
    let mut eyes = Eyes::new("blocksworld");
    eyes.twin = Some((1.0, pair_aside()));
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
    eyes.twin = Some((1.0, pair_aside()));
    assert_eq!(eyes.look(&pair()).anomalies, [], "and no longer than it lasts");
    let scene = eyes.stare(CONFIRM_FRAMES, &pair());
    check(&scene, &[("on red_block blue_block", Truth::True)]);
}
