//! `groundloop exemplar capture`: a picture of one's own camera, labelled as far as it can be proposed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use image::RgbImage;

use super::{Failure, exit, out};
use crate::messages::MAIN_CAMERA;
use crate::pddl::{Condition, Problem, Typed, print_problem};
use crate::perception::label_of;
use crate::perception::model::{Perception, UNDECIDED};
use crate::picture::{EdgeKind, EdgeMark, ObjectMark, PictureInput, Remark, RemarkKind, draw};
use crate::run::{ExemplarProposal, RunConfig, load_run, read_image};
use crate::scene::Visibility;
use crate::transport::convert::RgbFrame;
use crate::transport::topics::CameraTopics;
use crate::transport::wire::FrameHeader;
use crate::transport::{Bus, BusConfig, Depth, Drops, Subscriber};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A run file, or the name of a shipped one: its domain, camera, detector and grounder.
    config: PathBuf,
    /// Overrides a key of the run file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// What `$data` stands for in the run file.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// The name of the run that the camera publishes to; the run itself need not be there.
    #[arg(long, value_name = "NAME", required_unless_present = "image")]
    run: Option<String>,
    /// A photograph (PNG or JPEG) instead of a camera.
    #[arg(long, value_name = "FILE", conflicts_with = "run")]
    image: Option<PathBuf>,
    /// Which camera: "main", or the name of a `[cameras.NAME]`.
    #[arg(long, value_name = "NAME", default_value = MAIN_CAMERA)]
    camera: String,
    /// The folder to write to; it is made.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The name of the example: a letter, then letters, digits, _ and -. Without it the first of `capture_1`,
    /// `capture_2` … that is free.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

/// Carries the verb out.
pub(super) fn run(args: &Args) -> Result<u8, Failure> {
    let config = load_run(&args.config, &args.sets)?;
    config.check_camera("--camera", &args.camera)?;
    let folder = config.domain_folder()?;
    let stem = args.out.join(name(args)?);
    let picture = match (&args.image, &args.run) {
        (Some(image), _) => read_image(image)?,
        (None, Some(run)) => frame(&config, run, &args.camera)?,
        (None, None) => return Err(Failure::bad_input("expected --run or --image")),
    };
    let proposal = config.propose_example(&args.camera, &picture, args.data.as_deref())?;
    std::fs::create_dir_all(&args.out).map_err(|e| unwritten(&args.out, &e))?;
    let state = state_text(&stem, folder.domain.name.as_str(), &proposal);
    let marked = marked(&picture, &proposal, &folder.perception)?;
    let save = |ending: &str, picture: &RgbImage| {
        let path = stem.with_extension(ending);
        picture.save(&path).map_err(|e| unwritten(&path, &e))
    };
    let write = |ending: &str, text: &str| {
        let path = stem.with_extension(ending);
        std::fs::write(&path, text).map_err(|e| unwritten(&path, &e))
    };
    save("png", &picture)?;
    save("marked.png", &marked)?;
    write("json", &boxes_text(&proposal))?;
    write("pddl", &state)?;
    report(args, &stem, &proposal);
    Ok(0)
}

fn unwritten(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure::bad_input(format!("{}: {error}", path.display()))
}

/// The name of the example: none that is there, since a person may have worked on it.
fn name(args: &Args) -> Result<String, Failure> {
    let is_there = |name: &str| args.out.join(format!("{name}.json")).exists();
    let Some(name) = &args.name else {
        let mut names = (1..).map(|n| format!("capture_{n}"));
        return names.find(|name| !is_there(name)).ok_or_else(|| Failure::internal("no free name"));
    };
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(is_plain) {
        let expected = "a letter, then letters, digits, _ and -";
        return Err(Failure::bad_input(format!("--name: expected {expected}, got {name}")));
    }
    if is_there(name) {
        let message = format!("--name: {} has an example {name} already", args.out.display());
        return Err(Failure::bad_input(message));
    }
    Ok(name.clone())
}

/// The newest frame of a camera.
fn frame(config: &RunConfig, run: &str, camera: &str) -> Result<RgbImage, Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let wait = Duration::from_secs_f64(config.camera.wait_s);
    runtime.map_err(Failure::internal)?.block_on(async {
        let bus = Bus::open(&BusConfig::for_run(run))?;
        let topic = CameraTopics::of(camera).rgb;
        let mut frames: Subscriber<FrameHeader, u8> = bus.subscriber(&topic, Depth::newest())?;
        let mut refused = None;
        let newest = frames.newest_of(|message| {
            RgbFrame::read(message).inspect_err(|error| refused = Some(error.to_string()))
        });
        if let Ok(frame) = tokio::time::timeout(wait, newest).await {
            return picture_of(&frame?);
        }
        let why = match refused {
            Some(reason) => reason,
            None => bus.silence(&topic, &mut frames, Drops::default())?.to_string(),
        };
        let seconds = wait.as_secs_f64();
        let message = format!("no frame on {} for {seconds} s (camera.wait_s): {why}", topic.name);
        Err(Failure { message, code: exit::MISSING })
    })
}

fn picture_of(frame: &RgbFrame) -> Result<RgbImage, Failure> {
    let [width, height] = frame.size();
    let picture = RgbImage::from_raw(width, height, frame.rgb().to_vec());
    picture.ok_or_else(|| Failure::internal("a frame of another size than it says"))
}

fn boxes_text(proposal: &ExemplarProposal) -> String {
    let line = |object: &crate::perception::model::ObjectBox| {
        let [x1, y1, x2, y2] = <[f64; 4]>::from(object.pixel_box).map(f64::round);
        format!("  \"{}\": [{x1:.1}, {y1:.1}, {x2:.1}, {y2:.1}]", object.name)
    };
    let lines: Vec<String> = proposal.boxes.iter().map(line).collect();
    if lines.is_empty() { "{\n}\n".to_owned() } else { format!("{{\n{}\n}}\n", lines.join(",\n")) }
}

/// The state: what is sure as facts, what is not as comments.
fn state_text(stem: &Path, domain: &str, proposal: &ExemplarProposal) -> String {
    let ExemplarProposal { boxes, unseen, facts, undecided, remarks } = proposal;
    let file = |ending: &str| {
        let path = stem.with_extension(ending);
        path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    };
    let mut head = format!(
        "; A proposal: hold it against {}, and correct {} and this file.\n",
        file("marked.png"),
        file("json")
    );
    for remark in remarks {
        head.push_str(&format!("; {remark}").replace('\n', "\n; "));
        head.push('\n');
    }
    if boxes.is_empty() {
        let how = "write each object into the boxes (\"red_block\": [x1, y1, x2, y2] in pixels)";
        writeln_to(&mut head, &format!("; No object was found: {how}, and into :objects."));
    }
    let seen = boxes.iter().map(|o| Typed::new(o.name.clone(), o.type_name.clone()));
    let problem = Problem {
        name: stem.file_name().unwrap_or_default().to_string_lossy().to_lowercase().as_str().into(),
        domain: domain.into(),
        objects: seen.chain(unseen.iter().cloned()).collect(),
        init: facts.iter().cloned().collect(),
        costs: BTreeMap::new(),
        goal: Condition::And(Vec::new()),
        minimise_cost: false,
    };
    let text = print_problem(&problem);
    if undecided.is_empty() {
        return head + &text;
    }
    head.push_str(
        "; Not decided: where such a fact holds take \";?\" away, where not delete the line.\n",
    );
    let lines: Vec<String> =
        undecided.iter().map(|atom| format!("\n    {UNDECIDED} {atom}")).collect();
    let lines = lines.concat();
    // Behind the facts, before the bracket that closes them: a comment ends with its line.
    let (before, after) = text.split_once("\n  (:goal").unwrap_or((&text, ""));
    let facts_end = before.trim_end().strip_suffix(')').unwrap_or(before);
    format!("{head}{facts_end}{lines}\n  )\n  (:goal{after}")
}

fn writeln_to(text: &mut String, line: &str) {
    text.push_str(line);
    text.push('\n');
}

/// The picture with boxes, names, and what is proposed and what is not decided.
fn marked(
    picture: &RgbImage,
    proposal: &ExemplarProposal,
    perception: &Perception,
) -> Result<RgbImage, Failure> {
    let objects: Vec<ObjectMark> = proposal.boxes.iter().map(|o| mark(o, perception)).collect();
    let edges = proposal.facts.iter().filter_map(|atom| {
        let [from, to] = atom.args.as_slice() else { return None };
        let (predicate, from, to) = (atom.predicate.clone(), from.clone(), to.clone());
        Some(EdgeMark { predicate, from, to, kind: EdgeKind::Seen })
    });
    let edges: Vec<EdgeMark> = edges.collect();
    let open = proposal.undecided.iter().map(|atom| format!("undecided: {atom}"));
    let remarks = open.map(|text| Remark { text, kind: RemarkKind::Anomaly });
    let remarks: Vec<Remark> = remarks.collect();
    let input = PictureInput {
        view: None,
        title: "a proposal",
        instruction: "",
        caption: &[],
        goal: &[],
        plan: &[],
        step_idx: None,
        remarks: &remarks,
        objects: &objects,
        edges: &edges,
    };
    draw(picture, &input).map_err(Failure::internal)
}

fn mark(object: &crate::perception::model::ObjectBox, perception: &Perception) -> ObjectMark {
    let spec = perception.type_spec(&object.type_name);
    let label = spec.and_then(|spec| label_of(spec, &object.name));
    let shades = label.and_then(|label| perception.colours.get(label));
    ObjectMark {
        name: object.name.clone(),
        pixel_box: Some(object.pixel_box),
        colour: shades.and_then(|shades| shades.first()).map(|shade| shade.0),
        visibility: Visibility::Visible,
        facts: Vec::new(),
    }
}

/// What was written, and what to do next.
fn report(args: &Args, stem: &Path, proposal: &ExemplarProposal) {
    let ExemplarProposal { boxes, facts, undecided, remarks, .. } = proposal;
    out::line(&format!(
        "{}: {} objects, {} facts, {} undecided",
        stem.display(),
        boxes.len(),
        facts.len(),
        undecided.len()
    ));
    for remark in remarks {
        out::line(&format!("  {remark}"));
    }
    let file = |ending: &str| stem.with_extension(ending).display().to_string();
    out::line(&format!(
        "look at {}, correct {} and {}, then:",
        file("marked.png"),
        file("json"),
        file("pddl")
    ));
    out::line(&format!("  groundloop exemplar check {}", args.out.display()));
}
