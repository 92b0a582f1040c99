//! Types of a scene against the domain's: what the domain does not know, and what no camera will find.

use std::collections::BTreeSet;

use groundloop_sim::{BodySpec, SCENERY, SceneSpec};

use crate::files::FileRef;
use crate::parts::PartError;
use crate::pddl::{Domain, Name};
use crate::perception::detectors::colour_name;
use crate::perception::model::Perception;
use crate::settings::near_hint;

/// The bodies that are objects of the task.
fn objects<'a>(
    scene: &'a SceneSpec,
    known: &'a BTreeSet<Name>,
) -> impl Iterator<Item = (&'a BodySpec, Name)> {
    let is_type = |kind: &str| known.iter().any(|name| name == kind);
    let objects = scene.bodies.iter().filter(move |body| !body.is_scenery(is_type));
    objects.map(|body| (body, Name::new(body.type_name())))
}

/// Checks that the domain knows the type of every body that is an object of the task.
///
/// # Errors
/// [`PartError::File`] naming the scene, the body and its type.
pub fn check_types(scene: &SceneSpec, domain: &Domain, file: &FileRef) -> Result<(), PartError> {
    let known = domain.known_types();
    let unknown = objects(scene, &known).find(|(_, type_name)| !known.contains(type_name));
    unknown.map_or(Ok(()), |(body, type_name)| {
        let names: Vec<&str> = known.iter().map(Name::as_str).collect();
        let (list, near) = (names.join(", "), near_hint(type_name.as_str(), names));
        let reason = format!(
            "{}: its type \"{type_name}\" is none of the domain {}{near}: expected type = one of {list}, or \
             \"{SCENERY}\" for what is no object of the task; without the key the type is the shape's kind",
            body.name, domain.name
        );
        Err(PartError::file(file.to_string(), reason))
    })
}

/// Types of bodies that `perception.toml` says nothing of, in words: no detector is told of them, and
/// no labelled example shows them.
pub fn unlabelled_types(
    scene: &SceneSpec,
    domain: &Domain,
    perception: &Perception,
) -> Vec<String> {
    let known = domain.known_types();
    let types = objects(scene, &known).map(|(_, type_name)| type_name);
    let types: BTreeSet<Name> = types.filter(|t| perception.type_spec(t).is_none()).collect();
    let unlabelled = |type_name: &Name| {
        format!(
            "perception.toml has no [[type]] named \"{type_name}\": bodies of that type are neither \
             detected nor labelled"
        )
    };
    types.iter().map(unlabelled).collect()
}

/// Bodies that the detector by colours cannot find by what `perception.toml` says of their types, in
/// words.
pub fn unseen_by_colour(
    scene: &SceneSpec,
    domain: &Domain,
    perception: &Perception,
) -> Vec<String> {
    let known = domain.known_types();
    let unseen = |(body, type_name): (&BodySpec, Name)| {
        let spec = perception.type_spec(&type_name)?;
        if spec.appearance.is_none() {
            return Some(format!(
                "{}: [[type]] {type_name} of perception.toml has no appearance: the detector \"colour\" \
                 does not look for it",
                body.name
            ));
        }
        let [red, green, blue] = body.colour.0;
        let called = colour_name(perception, body.colour.0);
        if called.as_ref().is_some_and(|name| spec.colours.contains(name)) {
            return None;
        }
        let called = called.map_or_else(|| "none of [colours]".to_owned(), |name| name.to_string());
        Some(format!(
            "{}: its colour #{red:02x}{green:02x}{blue:02x} is {called}, and type.{type_name}.colours of \
             perception.toml has no such: the detector \"colour\" may not see it",
            body.name
        ))
    };
    objects(scene, &known).filter_map(unseen).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::hardware::sim::read_scene;

    const DOMAIN: &str = "(define (domain d) (:requirements :typing) (:types block tray - object)
        (:predicates (in ?x - block ?t - tray)))";
    const PERCEPTION: &str = r##"
        [[type]]
        name = "block"
        colours = ["red"]
        depth = "as_wide"
        naming = { order = "left_to_right", template = "{colour}_{type}" }
        [type.appearance]
        shape = { kind = "patch", split_waists = false }
        width = [0.025, 0.3]
        height = [0.025, 0.3]
        aspect = [0.45, 2.0]
        fill_min = 0.65
        open = [0.01, 0.01]
        close = [0.015, 0.015]
        [colours]
        red = ["#c8322d"]
    "##;

    fn scene(body: &str) -> SceneSpec {
        let end = "[arrangement]\nkind = 'fixed'";
        toml::from_str(&format!("[[bodies]]\nname = 'thing'\n{body}\n{end}")).unwrap()
    }

    fn domain() -> Domain {
        crate::pddl::parse_domain(&crate::pddl::SourceText::new("d", DOMAIN)).unwrap().value
    }

    fn perception() -> Perception {
        Perception::parse("perception.toml", PERCEPTION).unwrap()
    }

    fn checked(body: &str) -> Result<(), PartError> {
        let file = FileRef::disk(Path::new("a.toml"));
        check_types(&scene(body), &domain(), &file)
    }

    const BLOCK: &str = "shape = { kind = 'block', size_m = 0.05 }\ncolour = '#c8322d'";
    const CYLINDER: &str =
        "shape = { kind = 'cylinder', radius_m = 0.02, height_m = 0.05 }\ncolour = '#c8322d'";
    const BOARD: &str = "shape = { kind = 'board', size_m = [0.2, 0.2, 0.01] }\ncolour = '#c8322d'\nat_m = [0.0, 0.0]";

    #[test]
    fn a_type_that_the_domain_does_not_know_is_named() {
        assert_eq!(checked(BLOCK), Ok(()));
        assert_eq!(checked(BOARD), Ok(()), "scenery");
        assert_eq!(checked(&format!("type = 'scenery'\n{CYLINDER}")), Ok(()));
        assert_eq!(checked(&format!("type = 'tray'\n{CYLINDER}")), Ok(()));
        let message = checked(CYLINDER).unwrap_err().to_string();
        assert!(message.contains("a.toml") && message.contains("thing: its type \"cylinder\""));
        assert!(message.contains("block, tray, or \"scenery\""), "{message}");
        let message = checked(&format!("type = 'tary'\n{CYLINDER}")).unwrap_err().to_string();
        assert!(message.contains("did you mean"), "{message}");
    }

    #[test]
    fn what_no_detector_is_told_of_is_named() {
        let warned = |body: &str| {
            let scene = scene(body);
            let mut warnings = unlabelled_types(&scene, &domain(), &perception());
            warnings.extend(unseen_by_colour(&scene, &domain(), &perception()));
            warnings.join("; ")
        };
        assert_eq!(warned(BLOCK), "");
        assert_eq!(warned(BOARD), "");
        let message = warned(&format!("type = 'tray'\n{CYLINDER}"));
        assert!(message.contains("no [[type]] named \"tray\""), "{message}");
        let message = warned(&BLOCK.replace("#c8322d", "#f4f4f0"));
        assert!(message.contains("thing: its colour #f4f4f0 is none of [colours]"), "{message}");
    }

    #[test]
    fn every_shipped_scene_has_known_types_and_colours() {
        let domains = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains");
        let paths = std::fs::read_dir(domains).unwrap().map(|entry| entry.unwrap().path());
        let mut n_scenes = 0;
        for path in paths.filter(|path| path.join("scenes").is_dir()) {
            let folder = crate::run::DomainFolder::read(&path).unwrap();
            let files = ["scenes", "scenes/exemplar"].into_iter().flat_map(|place| {
                let scenes = folder.files.below(place);
                let names = scenes.names(".toml").unwrap().into_iter();
                let names = names.filter(|name| name != "labels.toml");
                names.map(move |name| scenes.file(&name)).collect::<Vec<_>>()
            });
            for file in files {
                let scene = read_scene(&file).unwrap();
                check_types(&scene, &folder.domain, &file).unwrap();
                let (domain, perception) = (&folder.domain, &folder.perception);
                assert_eq!(unlabelled_types(&scene, domain, perception), [""; 0], "{file}");
                assert_eq!(unseen_by_colour(&scene, domain, perception), [""; 0], "{file}");
                n_scenes += 1;
            }
        }
        assert!(n_scenes > 15, "{n_scenes}");
    }
}
