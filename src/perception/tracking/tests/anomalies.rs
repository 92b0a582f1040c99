//! What a frame cannot explain: when it counts, and where facts that a constraint decides come from.

use std::slice::from_ref;

use super::*;
use crate::scene::{Anomaly, Origin};

/// Every block should rest on another or on the table. What a block rests on is decided by a
/// constraint.
struct Suspicious;

impl Grounder for Suspicious {
    fn ground(&self, observation: &Observation<'_>) -> Result<Grounding, GrounderError> {
        let objects = observation.objects;
        let mut grounding = Touching.ground(observation)?;
        let is_block = |o: &&ObjectBox| o.type_name == "block";
        for block in objects.iter().filter(is_block) {
            let stands = block.pixel_box.y2 > HEIGHT as f64 - 5.0;
            let rests = grounding
                .judged
                .iter()
                .any(|judged| judged.atom.args[0] == block.name && judged.truth == Truth::True);
            if !stands && !rests {
                let anomaly = Anomaly::about(vec![block.name.clone()], "nothing under");
                grounding.anomalies.push(anomaly);
            }
        }
        for judged in &mut grounding.judged {
            judged.basis = Basis::Constrained;
        }
        Ok(grounding)
    }
}

fn suspicious() -> Eyes {
    let mut eyes = Eyes::new("blocksworld");
    eyes.config.grounder = Box::new(Suspicious);
    eyes
}

fn anomalies(scene: &Scene) -> Vec<String> {
    scene.anomalies.iter().map(ToString::to_string).collect()
}

#[test]
fn a_doubt_counts_when_it_stays_and_goes_at_once() {
    let mut eyes = suspicious();
    let (hanging, lying) = (block("red", 0.0, 1.5), block("red", 0.0, 0.0));
    let scene = eyes.stare(CONFIRM_FRAMES, from_ref(&lying));
    assert_eq!(anomalies(&scene), [""; 0]);
    assert_eq!(anomalies(&eyes.stare(CONFIRM_FRAMES - 1, from_ref(&hanging))), [""; 0]);
    assert_eq!(anomalies(&eyes.look(from_ref(&hanging))), ["nothing under red_block"]);
    assert_eq!(anomalies(&eyes.look(&[lying])), [""; 0], "explained");
    assert_eq!(anomalies(&eyes.stare(CONFIRM_FRAMES - 1, &[hanging])), [""; 0], "counted anew");
}

#[test]
fn what_is_hidden_for_a_while_explains_what_rests_on_it() {
    let mut eyes = suspicious();
    let (low, high) = (block("blue", 0.0, 0.0), block("red", 0.0, 1.0));
    eyes.stare(2 * CONFIRM_FRAMES, &[low, high.clone()]);
    let scene = eyes.stare(HIDDEN_FRAMES_MAX, from_ref(&high));
    assert_eq!(anomalies(&scene), [""; 0]);
    check(&scene, &[("on red_block blue_block", Truth::True)]);
    let scene = eyes.stare(CONFIRM_FRAMES, &[high]);
    assert_eq!(anomalies(&scene), ["nothing under red_block"], "out of sight for too long");
}

#[test]
fn facts_say_that_a_constraint_decided_them() {
    let mut eyes = suspicious();
    let (low, high) = (block("blue", 0.0, 0.0), block("red", 0.0, 1.0));
    let scene = eyes.stare(2 * CONFIRM_FRAMES, &[low, high.clone()]);
    let origin = |scene: &Scene| {
        let on = atom("on red_block blue_block");
        scene.facts.iter().find(|fact| fact.atom == on).unwrap().origin
    };
    assert_eq!(origin(&scene), Origin::Constrained);
    assert_eq!(origin(&eyes.look(&[high])), Origin::Remembered);
}
