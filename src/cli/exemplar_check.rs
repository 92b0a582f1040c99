//! `groundloop exemplar check`: labelled examples, tried on themselves.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::goal::choice;
use super::reports::{CheckedCamera, ExemplarCheckReport, ExemplarFindingReport};
use super::{Failure, exit, out};
use crate::perception::self_check::{ExemplarFinding, FindingKind, Label};
use crate::run::{CameraCheck, DomainFolder, ExemplarFiles, StillImageParts, load_run};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A run file, or the name of a shipped one: the examples of all its cameras.
    #[arg(required_unless_present = "domain", conflicts_with = "domain")]
    config: Option<PathBuf>,
    /// Overrides a key of the run file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "config")]
    sets: Vec<String>,
    /// What `$data` stands for in the run file.
    #[arg(long, value_name = "DIR", requires = "config")]
    data: Option<PathBuf>,
    /// Without a run file: a domain folder, or the name of a shipped domain.
    #[arg(long, requires_all = ["exemplar_image", "exemplar_boxes", "exemplar_state"])]
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
    /// Without a run file: which detector finds the objects.
    #[arg(long, value_name = "NAME", default_value = "colour", conflicts_with = "config")]
    detector: String,
    /// The detector's own options: a TOML file with what `[perception.options]` of a run file has.
    #[arg(long, value_name = "FILE", conflicts_with = "config")]
    detector_options: Option<PathBuf>,
    /// Without a run file: which grounder judges the facts.
    #[arg(long, value_name = "NAME", default_value = "s2s-joint", conflicts_with = "config")]
    grounder: String,
    /// Writes one JSON object to standard output, and nothing else there.
    #[arg(long)]
    json: bool,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let cameras = match (&args.config, &args.domain) {
        (Some(config), _) => load_run(config, &args.sets)?.check_examples(args.data.as_deref())?,
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
    let parts = StillImageParts {
        folder,
        examples: Arc::new(vec![example]),
        detector: choice("--detector", &args.detector, args.detector_options.as_deref())?,
        grounder: choice("--grounder", &args.grounder, None)?,
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
        FindingKind::Untaught { predicate, .. } => report.predicate = Some(predicate.to_string()),
    }
    report
}
