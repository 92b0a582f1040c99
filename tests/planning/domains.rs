//! Every folder below `domains/`: its problems are solved, its scenes can be built, its labelled
//! examples are understood.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the test")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{files_below, folders_in, in_project, project};
use groundloop::geometry::PixelBox;
use groundloop::goals::{GOALS, GoalInputs, GoalObject};
use groundloop::logic::Truth;
use groundloop::parts::{PartChoice, PartContext};
use groundloop::pddl::{Atom, Name, Problem, SourceText, parse_problem};
use groundloop::perception::model::Exemplar;
use groundloop::perception::{GripperContent, GroundedImage, ImageView, Observation, ground_image};
use groundloop::planning::{Budget, Outcome, PlanRequest, Validation, plan, validate};
use groundloop::run::{DomainFolder, ExemplarConfig};
use image::RgbImage;

/// Objects that others hide so far that the detector cannot tell them: example, object.
const HIDDEN: &[(&str, &str)] =
    &[("domains/blocksworld/exemplar/sim_320x240/e_before_and_behind.json", "orange_block")];

fn domains() -> Vec<DomainFolder> {
    let read = |path: &PathBuf| DomainFolder::read(path).unwrap_or_else(|e| panic!("{e}"));
    folders_in(&project("domains")).iter().map(read).collect()
}

fn problem(path: &Path, folder: &DomainFolder) -> Problem {
    let text = std::fs::read_to_string(path).unwrap();
    let source = SourceText::new(in_project(path), text);
    let parsed = parse_problem(&source, &folder.domain);
    parsed.unwrap_or_else(|e| panic!("{}", e.render())).value
}

#[test]
fn every_problem_is_solved_and_its_plan_is_valid() {
    for folder in domains() {
        for path in files_below(&folder.files.base().join("problems"), "pddl") {
            let shown = in_project(&path);
            let problem = problem(&path, &folder);
            let request = PlanRequest::new(&problem);
            let answer = plan(&folder.domain, &request, &Budget::standard());
            let Outcome::Solved(found) = answer.outcome else {
                panic!("{shown}: {:?}", answer.outcome);
            };
            let checked = validate(&folder.domain, &request, &found.steps);
            assert!(matches!(checked, Validation::Valid { .. }), "{shown}: {checked:?}");
            assert!(!found.steps.is_empty(), "{shown}: there is nothing to do");
        }
    }
}

/// Every example sentence says something about the objects of one of the problems, seen side by side.
#[test]
fn every_example_sentence_is_understood() {
    for folder in domains() {
        let seen = |path: &PathBuf| -> Vec<GoalObject> {
            let objects = problem(path, &folder).objects.into_iter().zip(0..);
            let seen = objects.map(|(typed, i)| {
                let x = 60.0 * f64::from(i);
                GoalObject {
                    name: typed.name,
                    type_name: typed.types[0].clone(),
                    colour: None,
                    pixel_box: Some(PixelBox::from([x, 0.0, x + 40.0, 40.0])),
                }
            });
            seen.collect()
        };
        let scenes = files_below(&folder.files.base().join("problems"), "pddl");
        let scenes: Vec<Vec<GoalObject>> = scenes.iter().map(seen).collect();
        let language = folder.language.clone().unwrap();
        assert!(!language.examples.is_empty());
        for text in &language.examples {
            let origin = in_project(folder.files.base());
            let choice = PartChoice::new("goal.kind", "instruction");
            let inputs = GoalInputs::words(&origin, text, Some(&language));
            let context = PartContext { choice: &choice, inputs, environment: |_| None };
            let source = GOALS.build(&context).unwrap();
            let read = |objects: &Vec<GoalObject>| source.read(&folder.domain, objects).err();
            let errors: Vec<_> = scenes.iter().filter_map(read).map(|e| e.render()).collect();
            assert!(errors.len() < scenes.len(), "{}", errors.join("\n"));
        }
    }
}

/// The labelled examples of every camera set-up of a domain.
fn exemplar_folders(folder: &DomainFolder) -> Vec<(String, Vec<(RgbImage, Exemplar)>)> {
    let read = |path: PathBuf| {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let config = ExemplarConfig {
            folder: Some(name),
            image: None,
            boxes: None,
            state: None,
            number: None,
        };
        let examples = config.read(folder, None).unwrap_or_else(|e| panic!("{e}"));
        (in_project(&path), examples)
    };
    let set_ups = folder.files.base().join("exemplar");
    let set_ups = if set_ups.is_dir() { folders_in(&set_ups) } else { Vec::new() };
    set_ups.into_iter().map(read).collect()
}

/// Known atoms of the observed predicates.
fn observed(folder: &DomainFolder, atoms: &BTreeSet<Atom>) -> BTreeSet<Atom> {
    let is_observed = |name: &Name| folder.perception.observed.iter().any(|o| o.predicate == *name);
    atoms.iter().filter(|atom| is_observed(&atom.predicate)).cloned().collect()
}

/// From the labelled boxes and volumes follow the labelled facts.
#[test]
fn labelled_objects_give_their_labelled_facts() {
    for folder in domains() {
        for (shown, examples) in exemplar_folders(&folder) {
            let grounder = folder.grounder(&PartChoice::new("test", "s2s"), &examples).unwrap();
            for (_, example) in &examples {
                let expected = observed(&folder, &example.init);
                let judged = grounder.ground(&Observation::of_boxes(&example.objects)).unwrap();
                let holds = judged.judged.into_iter().filter(|j| j.truth == Truth::True);
                let seen = holds.map(|j| j.atom).collect();
                assert_eq!(expected, seen, "{shown}: {}", example.name);
            }
        }
    }
}

/// What `ground` sees in a labelled image.
fn look(
    folder: &DomainFolder,
    examples: &[(RgbImage, Exemplar)],
    picture: &RgbImage,
) -> GroundedImage {
    let mut detector = folder.detector(&PartChoice::new("test", "colour"), examples).unwrap();
    let grounder = folder.grounder(&PartChoice::new("test", "s2s"), examples).unwrap();
    let pipeline = folder.pipeline(&*grounder);
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let view = ImageView::new(width, height, picture.as_raw()).unwrap();
    ground_image(&pipeline, &mut *detector, &view, &[], &GripperContent::Empty).unwrap()
}

/// From the pixels of a labelled image follow its labelled objects and facts, without any depth.
#[test]
fn labelled_images_give_their_labelled_objects_and_facts() {
    let mut faults = Vec::new();
    for folder in domains() {
        for (_, examples) in exemplar_folders(&folder) {
            for (picture, example) in &examples {
                let seen = look(&folder, &examples, picture);
                let shown = in_project(Path::new(&example.name));
                let found = |name: &Name, labelled: &PixelBox| {
                    let boxes = seen.named.boxes.iter().filter(|b| b.name == *name);
                    boxes.map(|b| b.pixel_box.iou(labelled)).fold(0.0, f64::max) > 0.4
                };
                let missed = example.objects.iter().filter(|o| !found(&o.name, &o.pixel_box));
                faults.extend(missed.map(|o| format!("{shown}: {} is not seen", o.name)));
                let known = |name: &Name| example.objects.iter().any(|o| o.name == *name);
                let invented = seen.named.boxes.iter().filter(|b| !known(&b.name));
                faults.extend(invented.map(|b| format!("{shown}: {} is not there", b.name)));
                let expected = observed(&folder, &example.init);
                let judged = observed(&folder, &seen.state.facts.known);
                let unlike = expected.symmetric_difference(&judged);
                faults.extend(unlike.map(|atom| format!("{shown}: {atom} is missed or wrong")));
            }
        }
    }
    let is_hidden = |fault: &String| {
        HIDDEN.iter().any(|(file, name)| fault.contains(file) && fault.contains(name))
    };
    faults.retain(|fault| !is_hidden(fault));
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// Every scene stands, whatever the seed: nothing falls, slides or is pushed out of something else.
#[cfg(feature = "sim")]
#[test]
fn every_scene_can_be_built_and_stands() {
    use groundloop_sim::{SceneSpec, World, WorldConfig};

    let defaults: toml::Table = groundloop::settings::DEFAULTS.parse().unwrap();
    let world: WorldConfig = defaults["sim"]["world"].clone().try_into().unwrap();

    for folder in domains() {
        let scenes = folder.files.base().join("scenes");
        let scenes = if scenes.is_dir() { files_below(&scenes, "toml") } else { Vec::new() };
        for path in scenes.into_iter().filter(|path| !path.ends_with("labels.toml")) {
            let shown = in_project(&path);
            let spec: SceneSpec = toml::from_str(&std::fs::read_to_string(&path).unwrap())
                .unwrap_or_else(|e| panic!("{shown}: {e}"));
            for seed in 1..=3 {
                let mut world = World::new(&spec, &world, seed)
                    .unwrap_or_else(|e| panic!("{shown}, seed {seed}: {e}"));
                let places = |world: &World| -> Vec<_> {
                    let bodies = world.truth().bodies;
                    bodies.into_iter().map(|b| (b.name, b.position)).collect()
                };
                let before = places(&world);
                assert_eq!(before.len(), spec.bodies.len(), "{shown}");
                world.advance_to(1_000_000_000);
                for ((name, from), (_, to)) in before.iter().zip(places(&world)) {
                    let moved_m = (to - from).norm();
                    assert!(moved_m < 0.004, "{shown}, seed {seed}: {name} moves by {moved_m} m");
                }
            }
        }
    }
}

/// The commands of docs/goals.md and docs/detectors.md name a domain, not a folder.
#[test]
fn a_shipped_domain_is_found_by_its_name_everywhere() {
    let objects = "red_block:block@100,200,150,250 blue_block:block@200,200,250,250";
    let sentence = ["--instruction", "red on blue", "--objects", objects];
    let read = |domain: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_groundloop"));
        let folder = tempfile::tempdir().unwrap();
        command.current_dir(folder.path()).args(["goal", "--domain", domain]).args(sentence);
        command.output().unwrap()
    };
    let named = read("blocksworld");
    assert_eq!(named.status.code(), Some(0), "{}", String::from_utf8_lossy(&named.stderr));
    let folder = project("domains/blocksworld");
    assert_eq!(named.stdout, read(folder.to_str().unwrap()).stdout);
    let unknown = read("no_such_domain");
    assert_eq!(unknown.status.code(), Some(2));
    let said = String::from_utf8(unknown.stderr).unwrap();
    assert!(said.contains("a folder with a domain.pddl"), "{said}");
    assert!(said.contains("no_such_domain"), "{said}");
}
