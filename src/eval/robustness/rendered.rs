//! Rendered scenes, read off the picture alone by the labelled examples of the usual camera.

use std::collections::BTreeSet;

use image::RgbImage;

use super::{Conditions, LabelledPicture, Taught, Test, Tried};
use crate::eval::sim_grounding::{SCENE, examples};
use crate::hardware::sim::Labeller;
use crate::pddl::Atom;
use crate::perception::model::Exemplar;
use crate::run::{ConfigError, DomainFolder, RunConfig};

/// Tries one scene for each seed under every condition.
///
/// # Errors
/// [`ConfigError`] naming the file or part that is not usable.
pub fn on_rendered_scenes(
    config: &RunConfig,
    folder: &DomainFolder,
    seeds: u64,
    conditions: &Conditions<'_>,
    tried: &mut dyn FnMut(&Tried<'_>),
) -> Result<(), ConfigError> {
    let mut labeller = Labeller::new(folder.scenes(), config.sim()?)?;
    let mut examples = examples(&mut labeller, folder, config.seed, None)?;
    examples.iter_mut().for_each(flatten);
    let grounder = folder.grounder(conditions.grounder, &examples)?;
    let detector = folder.detector(conditions.detector, &examples)?;
    let mut taught = Taught { pipeline: folder.pipeline(&*grounder), detector };
    for seed in 1..=seeds {
        let look = labeller.look(&folder.files.file(SCENE), seed, None)?;
        let observed =
            |atom: &Atom| folder.perception.observed_predicates().any(|p| *p == atom.predicate);
        let facts: BTreeSet<Atom> = look.facts.into_iter().filter(observed).collect();
        let picture = LabelledPicture { image: look.image, objects: look.objects };
        let case = format!("{} scene {seed}", folder.domain.name);
        taught.try_all(
            conditions,
            &Test { case: &case, picture: &picture, facts: &facts },
            seed,
            tried,
        )?;
    }
    Ok(())
}

/// Without depth there are no volumes.
fn flatten((_, exemplar): &mut (RgbImage, Exemplar)) {
    for object in &mut exemplar.objects {
        object.volume = None;
    }
}
