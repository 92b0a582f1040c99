//! The three things that most programs want, in one call each: plan from text, read one image, run
//! one episode. Everything that they are made of is public, too.

use std::path::Path;
use std::sync::Arc;

use crate::files::Folder;
use crate::logic::Facts;
use crate::metrics::EpisodeReport;
use crate::parts::PartChoice;
use crate::pddl::{PddlError, SourceText, parse_domain, parse_problem};
use crate::planning::{Budget, PlanAnswer, PlanRequest, plan};
use crate::run::{
    ConfigError, DomainFolder, EpisodeOptions, ExemplarConfig, PreparedRun, RunError,
    StillImageParts, load_run, run_episode,
};
use crate::transport::{Bus, BusConfig, TransportError};

/// Plans once, from the texts of a domain and a problem, with the project's own planner.
///
/// ```
/// let domain = "(define (domain door) (:predicates (open))
///   (:action push :parameters () :precondition (not (open)) :effect (open)))";
/// let problem = "(define (problem p) (:domain door) (:init) (:goal (open)))";
/// let answer = groundloop::plan_text(domain, problem)?;
/// let plan = answer.outcome.plan().expect("the door can be pushed open");
/// assert_eq!(plan.steps[0].to_string(), "(push)");
/// # Ok::<(), groundloop::pddl::PddlError>(())
/// ```
///
/// # Errors
/// [`PddlError`] with line, column and the underlined words.
pub fn plan_text(domain: &str, problem: &str) -> Result<PlanAnswer, PddlError> {
    let source =
        |name: &str, text: &str| SourceText { name: name.to_owned(), text: text.to_owned() };
    let domain = parse_domain(&source("domain", domain))?.value;
    let problem = parse_problem(&source("problem", problem), &domain)?.value;
    Ok(plan(&domain, &PlanRequest::new(&problem), &Budget::standard()))
}

/// Reads the facts off one image file, with the `colour` detector and the `s2s-joint` grounder.
///
/// `domain` is the path of a domain folder or the name of one that is shipped; `exemplars` is a folder in
/// its `exemplar/`: labelled images of the same camera, which are scaled to the size of the image.
///
/// ```
/// let image = "domains/blocksworld/exemplar/sim_320x240/a_tower_and_singles.png";
/// let facts = groundloop::read_image("blocksworld", "sim_320x240", image.as_ref())?;
/// assert!(facts.known.iter().any(|atom| atom.to_string() == "(on blue_block red_block)"));
/// # Ok::<(), groundloop::run::ConfigError>(())
/// ```
///
/// # Errors
/// [`ConfigError`] naming the file: no image, of another ratio of width to height than the labelled ones,
/// or an incomplete domain folder.
pub fn read_image(domain: &str, exemplars: &str, image: &Path) -> Result<Facts, ConfigError> {
    let folder = Arc::new(DomainFolder::find(domain, &Folder::default())?);
    let examples = Arc::new(ExemplarConfig::in_folder(exemplars).read(&folder, None)?);
    let detector = PartChoice::new("perception.detector", "colour");
    let grounder = PartChoice::new("perception.grounder", "s2s-joint");
    let mut reader =
        StillImageParts { folder, examples, detector, grounder, region: None }.reader()?;
    Ok(reader.read(image, &[])?.state.facts)
}

/// Runs one closed-loop episode of a run file to its verdict, and reports.
///
/// `settings` are `key=value`, as after `--set`. Blocks for as long as the episode takes; not to be called
/// from within an asynchronous runtime, where [`run_episode`] is.
///
/// ```no_run
/// let report = groundloop::run_file("configs/blocksworld.toml".as_ref(), &["seed=3"])?;
/// assert_eq!(report.verdict, "reached");
/// # Ok::<(), groundloop::run::RunError>(())
/// ```
///
/// # Errors
/// [`RunError`] when the run file is not usable, or the episode ends without a verdict.
pub fn run_file(config: &Path, settings: &[&str]) -> Result<EpisodeReport, RunError> {
    let settings: Vec<String> = settings.iter().map(|&text| text.to_owned()).collect();
    let prepared = PreparedRun::read(load_run(config, &settings)?, None)?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    let runtime = runtime.map_err(|e| TransportError::Open {
        what: "the asynchronous runtime".to_owned(),
        reason: e.to_string(),
    })?;
    runtime.block_on(async {
        let run = format!("{}-{}", prepared.config.domain, std::process::id());
        let bus = tokio::task::block_in_place(|| Bus::open(&BusConfig::for_run(run)))?;
        let options = EpisodeOptions { bus, snapshot: None };
        Ok(Box::pin(run_episode(&prepared, options)).await?.report)
    })
}
