//! `groundloop exemplar check`: labelled examples, tried on themselves.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::RgbImage;

use super::goal::choice;
use super::reports::{CheckedCamera, ExemplarCheckReport, ExemplarFindingReport};
use super::{Failure, exit, out};
use crate::files::Folder;
use crate::perception::model::{Exemplar, UndecidedFact};
use crate::perception::self_check::{ExemplarFinding, FindingKind, Label};
use crate::run::{
    CameraCheck, ConfigError, DomainFolder, ExemplarFiles, StillImageParts, load_run,
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A run file, or the name of a shipped one: the examples of all its cameras. Or a folder of examples.
    #[arg(required_unless_present = "domain")]
    config: Option<PathBuf>,
    /// Overrides a key of the run file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "config")]
    sets: Vec<String>,
    /// What `$data` stands for in the run file.
    #[arg(long, value_name = "DIR", requires = "config")]
    data: Option<PathBuf>,
    /// Without a run file: a domain folder, or the name of a shipped domain. A folder of examples names its
    /// own, where that is found by its name.
    #[arg(long)]
    domain: Option<PathBuf>,
    /// The labelled example's image.
    #[arg(long, value_name = "FILE", requires = "domain")]
    exemplar_image: Option<PathBuf>,
    /// The labelled example's boxes: JSON `{"name": [x1, y1, x2, y2]}`.
    #[arg(long, value_name = "FILE", requires = "domain")]
    exemplar_boxes: Option<PathBuf>,
    /// The labelled example's state: a PDDL problem.
    #[arg(long, value_name = "FILE", requires = "domain")]
    exemplar_state: Option<PathBuf>,
    /// Without a run file: which detector finds the objects, if not "colour".
    #[arg(long, value_name = "NAME")]
    detector: Option<String>,
    /// The detector's own options: a TOML file with what `[perception.options]` of a run file has.
    #[arg(long, value_name = "FILE")]
    detector_options: Option<PathBuf>,
    /// Without a run file: which grounder judges the facts, if not "s2s-joint".
    #[arg(long, value_name = "NAME")]
    grounder: Option<String>,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let cameras = match (&args.config, &args.domain) {
        (Some(folder), domain) if folder.is_dir() => vec![drafts(args, folder, domain.as_deref())?],
        (Some(config), _) => {
            no_flags_of_loose_files(args)?;
            load_run(config, &args.sets)?.check_examples(args.data.as_deref())?
        }
        (None, Some(domain)) => vec![loose(args, domain)?],
        (None, None) => return Err(Failure::bad_input("expected a run file, or --domain")),
    };
    let is_right = cameras.iter().all(|camera| camera.findings.is_empty());
    if args.json {
        let cameras = cameras.iter().map(checked).collect();
        out::json(&ExemplarCheckReport { right: is_right, cameras })?;
    } else {
        cameras.iter().for_each(print);
    }
    Ok(if is_right { 0 } else { exit::CHECK_FAILED })
}

/// A run file says its domain and its parts itself.
fn no_flags_of_loose_files(args: &Args) -> Result<(), Failure> {
    let given = [
        ("--domain", args.domain.is_some()),
        ("--detector", args.detector.is_some()),
        ("--detector-options", args.detector_options.is_some()),
        ("--grounder", args.grounder.is_some()),
    ];
    match given.iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) => {
            let message = format!("{flag} cannot be used with a run file, which says it itself");
            Err(Failure::bad_input(message))
        }
        None => Ok(()),
    }
}

/// One example of loose files.
fn loose(args: &Args, domain: &Path) -> Result<CameraCheck, Failure> {
    let (Some(image), Some(boxes), Some(state)) =
        (&args.exemplar_image, &args.exemplar_boxes, &args.exemplar_state)
    else {
        let flags = "--exemplar-image, --exemplar-boxes and --exemplar-state";
        return Err(Failure::bad_input(format!("expected {flags} beside --domain")));
    };
    let folder = Arc::new(DomainFolder::given(domain)?);
    let example = ExemplarFiles::on_disk(image, boxes, state).read(&folder)?;
    tried(args, folder, vec![example])
}

/// The examples of a folder, which may be proposals that a person has not finished.
fn drafts(args: &Args, folder: &Path, domain: Option<&Path>) -> Result<CameraCheck, Failure> {
    let files = ExemplarFiles::in_folder(folder)?;
    let domain = match domain {
        Some(domain) => DomainFolder::given(domain)?,
        None => named_domain(&files, folder)?,
    };
    let (mut examples, mut undecided) = (Vec::new(), Vec::new());
    for files in &files {
        let (picture, exemplar, open) = files.read_draft(&domain)?;
        if exemplar.objects.is_empty() {
            let how = "no object is labelled yet: write each as \"red_block\": [x1, y1, x2, y2] in pixels, \
                       and its name and type into :objects of";
            return Err(Failure::bad_input(format!("{}: {how} {}", files.boxes, files.state)));
        }
        undecided.extend(open.into_iter().map(|UndecidedFact { line, fact }| ExemplarFinding {
            exemplar: Some(files.state.to_string()),
            kind: FindingKind::Undecided { line, fact },
        }));
        examples.push((picture, exemplar));
    }
    let mut check = tried(args, Arc::new(domain), examples)?;
    // What is read of them is no finding: it is what they were proposed from.
    check.findings.retain(|finding| !is_undecided(finding, &undecided));
    undecided.append(&mut check.findings);
    check.findings = undecided;
    Ok(check)
}

/// Whether a finding is about a fact that is open anyway.
fn is_undecided(finding: &ExemplarFinding, undecided: &[ExemplarFinding]) -> bool {
    let FindingKind::OtherFact { atom, .. } = &finding.kind else { return false };
    let text = atom.to_string();
    let is_it =
        |kind: &FindingKind| matches!(kind, FindingKind::Undecided { fact, .. } if *fact == text);
    undecided.iter().any(|open| is_it(&open.kind))
}

/// The domain that the states of a folder name.
fn named_domain(files: &[ExemplarFiles], folder: &Path) -> Result<DomainFolder, Failure> {
    let first = files.first().ok_or_else(|| Failure::bad_input("no labelled example"))?;
    let text = first.state.text().map_err(ConfigError::from)?;
    let name = text.split_once("(:domain").and_then(|(_, rest)| rest.split_once(')'));
    let name = name.map_or("", |(name, _)| name.trim());
    DomainFolder::find(name, &Folder::Disk(folder.to_owned())).map_err(|error| {
        let failure = Failure::from(error);
        let message =
            format!("{}: {}; say where it is: --domain DIR", first.state, failure.message);
        Failure { message, ..failure }
    })
}

fn tried(
    args: &Args,
    folder: Arc<DomainFolder>,
    examples: Vec<(RgbImage, Exemplar)>,
) -> Result<CameraCheck, Failure> {
    let detector = args.detector.as_deref().unwrap_or("colour");
    let grounder = args.grounder.as_deref().unwrap_or("s2s-joint");
    let parts = StillImageParts {
        folder,
        examples: Arc::new(examples),
        detector: choice("--detector", detector, args.detector_options.as_deref())?,
        grounder: choice("--grounder", grounder, None)?,
        region: None,
    };
    Ok(parts.check_examples()?)
}

fn print(check: &CameraCheck) {
    let CameraCheck { camera, n_examples, n_objects, findings } = check;
    let found = match findings.len() {
        0 => "all as labelled".to_owned(),
        1 => "1 finding".to_owned(),
        n => format!("{n} findings"),
    };
    let s = if *n_examples == 1 { "" } else { "s" };
    out::line(&format!(
        "camera {camera}: {n_examples} labelled example{s}, {n_objects} objects: {found}"
    ));
    for finding in findings {
        out::line(&format!("  {finding}"));
    }
}

fn checked(check: &CameraCheck) -> CheckedCamera {
    CheckedCamera {
        camera: check.camera.clone(),
        examples: check.n_examples,
        objects: check.n_objects,
        findings: check.findings.iter().map(report).collect(),
    }
}

fn report(finding: &ExemplarFinding) -> ExemplarFindingReport {
    let mut report = ExemplarFindingReport {
        example: finding.exemplar.clone(),
        kind: finding.kind.word(),
        object: None,
        fact: None,
        predicate: None,
        labelled_box: None,
        found_box: None,
        message: finding.kind.to_string(),
    };
    let mut label = |Label { object, labelled }: &Label| {
        report.object = Some(object.to_string());
        report.labelled_box = Some((*labelled).into());
    };
    match &finding.kind {
        FindingKind::NotFound { label: at, .. } => label(at),
        FindingKind::OtherBox { label: at, found } => {
            label(at);
            report.found_box = Some((*found).into());
        }
        FindingKind::OtherColour { object, .. } => report.object = Some(object.to_string()),
        FindingKind::Unlabelled { found, .. } => report.found_box = Some((*found).into()),
        FindingKind::OtherFact { atom, .. } => report.fact = Some(atom.to_string()),
        FindingKind::Undecided { fact, .. } => report.fact = Some(fact.clone()),
        FindingKind::Untaught { predicate, .. } => report.predicate = Some(predicate.to_string()),
    }
    report
}
