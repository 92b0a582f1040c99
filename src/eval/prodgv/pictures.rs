//! One episode as a picture: the photograph with what was recognised in it, right and wrong.

use image::RgbImage;

use super::goal::GoalFault;
use super::matching::{inverse, renamed_atom};
use super::{EvalError, FittedDomain, Labelled, PairResult};
use crate::logic::{Bindings, Truth, Universe, evaluate};
use crate::pddl::{Atom, Condition, Name};
use crate::perception::label_of;
use crate::picture::{
    EdgeKind, EdgeMark, GoalMark, ObjectMark, PictureInput, Remark, RemarkKind, draw, view_around,
};
use crate::scene::Visibility;

/// Draws an episode over the test's photograph.
///
/// Facts that only order objects are listed where they are wrong or missing, and not drawn: they
/// would hide everything else.
///
/// # Errors
/// [`EvalError::Picture`] when the built-in font is broken.
pub fn picture(
    episode: &PairResult,
    photograph: &RgbImage,
    test: &Labelled,
    fitted: &FittedDomain,
) -> Result<RgbImage, EvalError> {
    let missing = missing(episode);
    let objects = objects(episode, test, fitted, &missing);
    let edges = edges(episode, fitted, &missing);
    let goal = goal_marks(episode, fitted);
    let remarks = remarks(episode, &missing);
    let plan: Vec<String> =
        episode.plan().unwrap_or_default().iter().map(ToString::to_string).collect();
    let caption = caption(episode);
    let input = PictureInput {
        view: view_around(&objects, photograph.width(), photograph.height()),
        title: fitted.folder.domain.name.as_str(),
        instruction: test.instruction.as_deref().unwrap_or_default(),
        caption: &caption,
        goal: &goal,
        plan: &plan,
        step_idx: None,
        remarks: &remarks,
        objects: &objects,
        edges: &edges,
    };
    Ok(draw(photograph, &input)?)
}

fn caption(episode: &PairResult) -> Vec<(String, String)> {
    let (exemplar, test) = episode.pair;
    let verdict = match (&episode.success, &episode.failure) {
        (Ok(()), None) => "success".to_owned(),
        (Ok(()), Some(failure)) => format!("success, {} wrong", failure.stage.word()),
        (Err(_), Some(failure)) => format!("fails: {}", failure.stage.word()),
        (Err(_), None) => "failure".to_owned(),
    };
    let facts = format!("{} right", episode.score.tp);
    [("test", test.to_string()), ("exemplar", exemplar.to_string()), ("facts", facts)]
        .into_iter()
        .chain([("result", verdict)])
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
}

/// What is missing, each fact once, with the names of the detections where there are any.
fn missing(episode: &PairResult) -> Vec<Atom> {
    let detected = inverse(&episode.matching);
    let to = |name: &Name| Some(detected.get(name).unwrap_or(name).clone());
    let mut atoms: Vec<Atom> = Vec::new();
    for atom in &episode.score.missing {
        if let Ok(atom) = renamed_atom(atom, &to)
            && !atoms.contains(&atom)
        {
            atoms.push(atom);
        }
    }
    atoms
}

/// The detections, then the true objects that none stands for.
fn objects(
    episode: &PairResult,
    test: &Labelled,
    fitted: &FittedDomain,
    missing: &[Atom],
) -> Vec<ObjectMark> {
    let perception = &fitted.folder.perception;
    let colour = |type_name: &Name, name: &Name| {
        let label = perception.type_spec(type_name).and_then(|spec| label_of(spec, name));
        let shades = label.and_then(|label| perception.colours.get(label));
        shades.and_then(|shades| shades.first()).map(|shade| shade.0)
    };
    let detected = episode.boxes.iter().map(|b| {
        let object = episode.matching.get(&b.name);
        let mut facts = unary(episode, &b.name, missing);
        match object {
            None => facts.insert(0, "not there".to_owned()),
            Some(object) if *object != b.name => facts.insert(0, format!("= {object}")),
            Some(_) => {}
        }
        ObjectMark {
            name: b.name.clone(),
            pixel_box: Some(b.pixel_box),
            colour: colour(&b.type_name, object.unwrap_or(&b.name)),
            visibility: Visibility::Visible,
            facts,
        }
    });
    let is_missed = |object: &&crate::perception::model::ObjectBox| {
        episode.matching.values().all(|name| *name != object.name)
    };
    let missed = test.boxes.iter().filter(is_missed).map(|object| ObjectMark {
        name: object.name.clone(),
        pixel_box: Some(object.pixel_box),
        colour: colour(&object.type_name, &object.name),
        visibility: Visibility::Hidden,
        facts: vec!["not detected".to_owned()],
    });
    detected.chain(missed).collect()
}

/// The facts of one object alone: recognised, wrong and missing ones.
fn unary(episode: &PairResult, name: &Name, missing: &[Atom]) -> Vec<String> {
    let is_of = |atom: &&Atom| atom.args.as_slice() == std::slice::from_ref(name);
    let wrong = |atom: &Atom| episode.score.wrong.contains(atom);
    let known = recognised(episode).filter(is_of);
    let known = known.map(|atom| {
        let remark = if wrong(atom) { " (wrong)" } else { "" };
        format!("{}{remark}", atom.predicate)
    });
    let missing = missing.iter().filter(is_of).map(|atom| format!("{} (missing)", atom.predicate));
    known.chain(missing).collect()
}

/// The atoms that were judged to hold.
fn recognised(episode: &PairResult) -> impl Iterator<Item = &Atom> {
    let holds = |judged: &&crate::perception::grounders::Judged| judged.truth == Truth::True;
    episode.state.grounding.judged.iter().filter(holds).map(|judged| &judged.atom)
}

fn edges(episode: &PairResult, fitted: &FittedDomain, missing: &[Atom]) -> Vec<EdgeMark> {
    let orders = &fitted.folder.perception.constraints.strict_order;
    let edge = |atom: &Atom, kind: EdgeKind| {
        let [from, to] = atom.args.as_slice() else { return None };
        let (predicate, from, to) = (atom.predicate.clone(), from.clone(), to.clone());
        (!orders.contains(&predicate)).then_some(EdgeMark { predicate, from, to, kind })
    };
    let kind = |atom: &Atom| {
        if episode.score.wrong.contains(atom) { EdgeKind::Wrong } else { EdgeKind::Seen }
    };
    let known = recognised(episode).filter_map(|atom| edge(atom, kind(atom)));
    let missing = missing.iter().filter_map(|atom| edge(atom, EdgeKind::Missing));
    known.chain(missing).collect()
}

fn goal_marks(episode: &PairResult, fitted: &FittedDomain) -> Vec<GoalMark> {
    let goal = match &episode.goal {
        Ok(goal) => goal,
        Err(GoalFault { why, .. }) => {
            return vec![GoalMark { text: why.clone(), holds: Truth::Unknown }];
        }
    };
    let whole = std::slice::from_ref(goal);
    let parts = if let Condition::And(parts) = goal { parts.as_slice() } else { whole };
    let objects = &episode.state.objects;
    let universe = Universe { types: &fitted.folder.domain.types, objects };
    let truth = |atom: &Atom| episode.state.facts.truth(atom);
    let mark = |part: &Condition| GoalMark {
        text: part.to_string(),
        holds: evaluate(part, &Bindings::new(), &universe, &truth),
    };
    parts.iter().map(mark).collect()
}

fn remarks(episode: &PairResult, missing: &[Atom]) -> Vec<Remark> {
    let remark = |text: String, kind: RemarkKind| Remark { text, kind };
    let wrong = episode.score.wrong.iter().map(|a| remark(a.to_string(), RemarkKind::Wrong));
    let missing = missing.iter().map(|atom| remark(atom.to_string(), RemarkKind::Missing));
    let anomalies = &episode.state.grounding.anomalies;
    let anomalies =
        anomalies.iter().map(|anomaly| remark(anomaly.reason.clone(), RemarkKind::Anomaly));
    wrong.chain(missing).chain(anomalies).collect()
}
