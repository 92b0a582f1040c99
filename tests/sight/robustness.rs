//! What is read off disturbed pictures: as much as off undisturbed ones, where nothing is hidden.
#![cfg(feature = "sim")]
#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

use std::collections::BTreeSet;

use crate::common::{Process, project, schema};
use groundloop::eval::robustness::{
    Conditions, RobustnessReport, TRANSFORMS, Tried, on_rendered_scenes,
};
use groundloop::parts::PartChoice;
use groundloop::run::load_run;
use serde_json::Value;

/// Scenes of each domain.
const SCENES: u64 = 3;

/// Light and framing, of which the colour detector takes no notice.
const LIGHT: [&str; 7] =
    ["none", "darker", "underexposed", "warm", "cool", "contrast down", "cropped"];
/// Grain, which it smooths. It costs more precision than telling disks of nearly one size needs.
const GRAIN: [&str; 2] = ["noise 10", "jpeg 20"];

#[track_caller]
fn check(config: &str, harmless: &[&str]) {
    let config = load_run(&project("configs").join(config), &[]).unwrap();
    let folder = config.domain_folder().unwrap();
    let transforms: Vec<_> =
        TRANSFORMS.iter().filter(|t| harmless.contains(&t.name)).copied().collect();
    let conditions = Conditions {
        detector: &PartChoice::new("--detector", "colour"),
        grounder: &PartChoice::new("--grounder", "s2s-joint"),
        transforms: &transforms,
        seed: 1,
    };
    let mut report = RobustnessReport::new("colour", "s2s-joint", 1);
    let mut add = |tried: &Tried<'_>| report.add("scenes", tried, true);
    on_rendered_scenes(&config, &folder, SCENES, &conditions, &mut add).unwrap();
    let undisturbed = report.row("scenes", "none").unwrap().right;
    assert!(undisturbed > 0);
    for name in harmless {
        let row = report.row("scenes", name).unwrap();
        assert_eq!(u64::from(row.n()), SCENES);
        assert!(row.right >= undisturbed, "{name}: {:#?}", report.faults);
    }
}

#[test]
fn light_noise_and_compression_change_no_blocks() {
    check("blocksworld.toml", &[&LIGHT[..], &GRAIN].concat());
}

#[test]
fn light_changes_no_disks() {
    check("hanoi.toml", &LIGHT);
}

#[test]
fn the_report_is_of_its_schema_and_the_same_each_time() {
    let sets =
        ["eval", "robustness", "--scenes", "1", "--transform", "warm", "--transform", "pole"];
    let run = || {
        let ended = Process::start(&[&sets[..], &["--details", "--json"]].concat()).end();
        assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
        ended.stdout
    };
    let said = run();
    assert_eq!(said, run());
    let report: Value = serde_json::from_str(&said).unwrap();
    schema::obeys("eval-robustness", &report);
    let rows = report["rows"].as_array().unwrap();
    let pictures: BTreeSet<_> = rows.iter().map(|row| row["pictures"].as_str().unwrap()).collect();
    let expect = ["blocksworld, rendered", "hanoi, rendered", "sorting, rendered"];
    assert_eq!(pictures, expect.into());
    assert_eq!(rows.len(), 2 * expect.len(), "one row for each of the two disturbances");
}

/// What was written with `--json` is shown and drawn again without a measurement.
#[test]
fn a_saved_report_is_shown_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let [saved, plot] = ["report.json", "plot.svg"].map(|name| folder.path().join(name));
    let text = r#"{"detector":"colour","grounder":"s2s","seed":3,"rows":[{"pictures":"blocks, rendered","transform":"pole","hides":true,"right":3,"unknown":1,"doubted":0,"silent":0,"right_share_95":[0.25,1.0]}],"faults":[]}"#;
    std::fs::write(&saved, text).unwrap();
    let paths = [&saved, &plot].map(|path| path.display().to_string());
    let call = |more: &[&str]| {
        Process::start(&[&["eval", "robustness", "--from", paths[0].as_str()], more].concat()).end()
    };
    let ended = call(&["--plot", &paths[1], "--json"]);
    assert_eq!((ended.status.code(), ended.stdout.trim()), (Some(0), text), "{}", ended.stderr);
    let svg = std::fs::read_to_string(&plot).unwrap();
    assert!(svg.contains("blocks, rendered") && svg.contains("pole (hides)"), "{svg}");
    let printed = call(&[]).stdout;
    assert!(printed.starts_with("blocks, rendered, detector colour, grounder s2s:"), "{printed}");

    assert_eq!(call(&["--scenes", "1"]).status.code(), Some(2), "nothing is measured");
    std::fs::write(&saved, text.replace("\"right\":3", "\"right\":-3")).unwrap();
    let refused = call(&[]);
    assert_eq!(refused.status.code(), Some(2));
    let expect = "report.json: expected a report of groundloop eval robustness --json: ";
    assert!(refused.stderr.contains(expect), "{}", refused.stderr);
}
