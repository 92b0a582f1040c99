//! All pairs of one domain: detections in, episodes out.

use std::collections::{BTreeMap, BTreeSet};

use image::RgbImage;

use super::carry_out::{carry_out, match_all};
use super::goal::{self, GoalFrom};
use super::jitter::{Jitter, disturbed};
use super::matching::is_evaluated;
use super::pair::{PairInput, PairParts, PairResult};
use super::recorded::Pair;
use super::score::{FactCounts, score};
use super::{DomainData, EvalError, FittedDomain, Labelled};
use crate::geometry::PixelBox;
use crate::goals::{GOALS, GoalInputs, GoalSource};
use crate::parts::{PartChoice, PartContext};
use crate::pddl::Atom;
use crate::perception::detectors::Detector;
use crate::perception::grounders::{GROUNDERS, Grounder, GrounderInputs};
use crate::perception::model::{Exemplar, Exemplars, ObjectBox};
use crate::perception::{FrameView, Observation, Pipeline, detect_objects, phrase_of_name};
use crate::planners::Planner;
use crate::run::{ConfigError, DomainFolder, environment, view_of};

/// Where the boxes of the test photographs come from.
#[derive(Debug, Clone, PartialEq)]
pub enum BoxSource {
    /// The authors' detector, as recorded.
    Recorded,
    /// People: the annotated boxes.
    Annotated,
    /// A detector, taught by the exemplar.
    Detector(PartChoice),
}

/// Where the goals come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Goals {
    /// The authors' language model, as recorded.
    Recorded,
    /// The problems themselves.
    Truth,
    /// A goal source, given the instruction.
    Source(PartChoice),
}

/// What is measured.
#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    /// Judges the facts; made anew from each exemplar.
    pub grounder: &'a PartChoice,
    /// Where the boxes come from.
    pub detections: &'a BoxSource,
    /// Where the goals come from.
    pub goals: &'a Goals,
    /// Plans once for each pair whose goal can be read.
    pub planner: &'a dyn Planner,
    /// Whether goals are repaired.
    pub repair_goals: bool,
    /// Noise to be measured with, in addition.
    pub jitter: Option<Jitter>,
    /// The most problems that are taken as exemplars: the first ones.
    pub exemplars_max: usize,
}

/// What came out for one domain.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// Every ordered pair whose input is there.
    pub episodes: Vec<PairResult>,
    /// Pairs that something recorded is missing for, and what.
    pub left_out: Vec<(Pair, String)>,
    /// Counts over the evaluated pairs with noise on the boxes, one entry per seed.
    pub jittered: Vec<FactCounts>,
}

/// Evaluates every ordered pair of a domain; `done` is called after each.
///
/// # Errors
/// [`EvalError`] naming the file, part or option that is not usable.
pub fn evaluate(
    data: &DomainData,
    fitted: &FittedDomain,
    setup: &Setup<'_>,
    done: &mut dyn FnMut(Pair),
) -> Result<Evaluation, EvalError> {
    let mut evaluation =
        Evaluation { episodes: Vec::new(), left_out: Vec::new(), jittered: Vec::new() };
    let seeds = setup.jitter.map_or(0, |jitter| jitter.seeds);
    evaluation.jittered.resize(usize::try_from(seeds).unwrap_or(usize::MAX), FactCounts::default());
    let mut pictures = BTreeMap::new();
    for exemplar in data.problems.iter().take(setup.exemplars_max) {
        let grounder = grounder(setup.grounder, fitted, exemplar)?;
        let are_looked_at =
            matches!(setup.detections, BoxSource::Detector(_)) || grounder.needs_image();
        if are_looked_at && pictures.is_empty() {
            pictures = read_pictures(data)?;
        }
        let mut detector = match setup.detections {
            BoxSource::Detector(choice) => Some(detector(choice, fitted, (exemplar, &pictures))?),
            BoxSource::Recorded | BoxSource::Annotated => None,
        };
        for test in data.problems.iter().filter(|test| test.number != exemplar.number) {
            let (grounder, picture) = (&*grounder, pictures.get(&test.number));
            let step = Step { data, fitted, setup, grounder, exemplar, test, picture };
            let looking = detector.as_deref_mut().zip(picture);
            step.add(looking, &mut evaluation)?;
            done(step.pair());
        }
    }
    Ok(evaluation)
}

/// One pair with all that it needs.
struct Step<'a> {
    data: &'a DomainData,
    fitted: &'a FittedDomain,
    setup: &'a Setup<'a>,
    grounder: &'a dyn Grounder,
    exemplar: &'a Labelled,
    test: &'a Labelled,
    /// The test's photograph, where detector or grounder look at it.
    picture: Option<&'a RgbImage>,
}

/// A detector and the photograph that it looks at.
type Looking<'d, 'p> = Option<(&'d mut (dyn Detector + 'static), &'p RgbImage)>;

impl Step<'_> {
    fn pair(&self) -> Pair {
        (self.exemplar.number, self.test.number)
    }

    /// Boxes in the test's photograph.
    fn observation<'b>(&'b self, boxes: &'b [ObjectBox]) -> Result<Observation<'b>, EvalError> {
        let view = |picture| view_of(picture, "photograph");
        let image = self.picture.map(view).transpose()?;
        Ok(Observation {
            frame: FrameView { image, ..FrameView::default() },
            ..Observation::of_boxes(boxes)
        })
    }

    fn pipeline(&self) -> Pipeline<'_> {
        self.fitted.pipeline(self.grounder)
    }

    fn add(
        &self,
        mut looking: Looking<'_, '_>,
        evaluation: &mut Evaluation,
    ) -> Result<(), EvalError> {
        let pair = self.pair();
        let recorded_boxes = self.data.recorded_detections(pair)?;
        let boxes = match (&mut looking, self.setup.detections) {
            (Some((detector, picture)), _) => {
                Some(detect(&mut **detector, &self.pipeline(), picture, &[])?)
            }
            (None, BoxSource::Annotated) => Some(self.test.boxes.clone()),
            (None, _) => recorded_boxes.clone(),
        };
        let mut missing =
            |what: &str| evaluation.left_out.push((pair, format!("{what} not recorded")));
        let Some(mut boxes) = boxes else {
            missing("detections");
            return Ok(());
        };
        let parsed = match (self.setup.goals, &self.test.instruction) {
            (Goals::Recorded | Goals::Truth, _) => None,
            (Goals::Source(_), None) => {
                missing("instruction");
                return Ok(());
            }
            (Goals::Source(choice), Some(text)) => {
                let source = self.goal_source(choice, text)?;
                Some(goal::ask(&*source, self.fitted, &boxes)?)
            }
        };
        if let (Some((detector, picture)), Some(Ok(parsed))) = (&mut looking, &parsed)
            && !parsed.expected.is_empty()
        {
            // What the goal names and the detector has not named is asked for by its phrase.
            let phrases: Vec<String> =
                parsed.expected.iter().map(|object| phrase_of_name(&object.name)).collect();
            boxes = detect(&mut **detector, &self.pipeline(), picture, &phrases)?;
        }
        let stub = self.data.recorded_goal(pair)?;
        let goal = match (&parsed, self.setup.goals, &stub, &recorded_boxes) {
            (Some(parsed), ..) => GoalFrom::Parsed(parsed),
            (None, Goals::Truth, ..) => GoalFrom::Truth(&self.test.problem.goal),
            (None, _, Some(stub), Some(boxes)) => GoalFrom::Recorded { stub, boxes },
            (None, ..) => {
                missing("goal");
                return Ok(());
            }
        };
        let recorded_facts = self.data.recorded_facts(pair)?;
        let recorded = recorded_facts.as_ref().zip(recorded_boxes.as_deref());
        let episode = self.carry_out(&boxes, goal, recorded)?;
        if let Some(jitter) = self.setup.jitter.filter(|_| episode.evaluated) {
            self.add_jittered(&boxes, jitter, &mut evaluation.jittered)?;
        }
        evaluation.episodes.push(episode);
        Ok(())
    }

    fn carry_out(
        &self,
        boxes: &[ObjectBox],
        goal: GoalFrom<'_>,
        recorded: Option<(&BTreeSet<Atom>, &[ObjectBox])>,
    ) -> Result<PairResult, EvalError> {
        let evaluated = is_evaluated(self.exemplar, self.test);
        let (pair, test) = (self.pair(), self.test);
        let observation = self.observation(boxes)?;
        let input = PairInput { pair, evaluated, test, observation, goal, recorded };
        let parts = PairParts {
            fitted: self.fitted,
            grounder: self.grounder,
            planner: self.setup.planner,
            repair_goals: self.setup.repair_goals,
        };
        Ok(carry_out(&parts, &input).map_err(ConfigError::from)?)
    }

    fn goal_source(
        &self,
        choice: &PartChoice,
        instruction: &str,
    ) -> Result<Box<dyn GoalSource>, EvalError> {
        let folder = &self.fitted.folder;
        let origin = format!("problem {}: instruction", self.test.number);
        let inputs = GoalInputs {
            perception: Some(&folder.perception),
            ..GoalInputs::words(&origin, instruction.trim(), folder.language.as_ref())
        };
        let context = PartContext { choice, inputs, environment };
        Ok(GOALS.build(&context).map_err(ConfigError::from)?)
    }

    /// States from disturbed boxes; nothing is planned from them.
    fn add_jittered(
        &self,
        boxes: &[ObjectBox],
        jitter: Jitter,
        counts: &mut [FactCounts],
    ) -> Result<(), EvalError> {
        let pair = (self.exemplar.number, self.test.number);
        for (seed, counts) in (0..).zip(counts) {
            let boxes = disturbed(boxes, jitter.px, seed, pair);
            let matching = match_all(self.fitted, &boxes, self.test);
            let grounding = self.pipeline().judge(&self.observation(&boxes)?);
            let judged = grounding.map_err(ConfigError::from)?.judged;
            let observed = &self.fitted.observed;
            counts.add(&score(&judged, &matching, &self.test.init, observed));
        }
        Ok(())
    }
}

/// The photographs of all problems.
pub(in crate::eval) fn read_pictures(
    data: &DomainData,
) -> Result<BTreeMap<u32, RgbImage>, EvalError> {
    let mut pictures = BTreeMap::new();
    for problem in &data.problems {
        let picture = problem.picture()?.ok_or_else(|| EvalError::File {
            path: format!("data/{}/observations/problem{}.jpg", data.name, problem.number),
            reason: "detector or grounder need this photograph".to_owned(),
        })?;
        pictures.insert(problem.number, picture);
    }
    Ok(pictures)
}

pub(in crate::eval) fn grounder(
    choice: &PartChoice,
    fitted: &FittedDomain,
    exemplar: &Labelled,
) -> Result<Box<dyn Grounder>, EvalError> {
    let exemplars = Exemplars::new(vec![exemplar.exemplar()]).map_err(ConfigError::from)?;
    let DomainFolder { domain, perception, .. } = &fitted.folder;
    let inputs = GrounderInputs { domain, perception, exemplars: &exemplars };
    let context = PartContext { choice, inputs, environment };
    Ok(GROUNDERS.build(&context).map_err(ConfigError::from)?)
}

/// A detector that has learnt from the exemplar's photograph.
pub(in crate::eval) fn detector(
    choice: &PartChoice,
    fitted: &FittedDomain,
    (exemplar, pictures): (&Labelled, &BTreeMap<u32, RgbImage>),
) -> Result<Box<dyn Detector>, EvalError> {
    let picture = pictures[&exemplar.number].clone();
    let whole = PixelBox {
        x1: 0.0,
        y1: 0.0,
        x2: f64::from(picture.width()),
        y2: f64::from(picture.height()),
    };
    let shown = exemplar.exemplar();
    // Pixels are learnt from, and there are none outside the photograph.
    let clipped = shown.objects.iter().map(|object| ObjectBox {
        pixel_box: object.pixel_box.intersection(&whole),
        ..object.clone()
    });
    let inside = clipped.filter(|object| object.pixel_box.is_valid()).collect();
    let example = Exemplar { objects: inside, ..shown };
    let examples = [(picture, example)];
    Ok(fitted.folder.detector(choice, &examples)?)
}

/// The objects that the detector finds in a photograph, under their names.
fn detect(
    detector: &mut dyn Detector,
    pipeline: &Pipeline<'_>,
    picture: &RgbImage,
    phrases: &[String],
) -> Result<Vec<ObjectBox>, EvalError> {
    let image = view_of(picture, "photograph")?;
    let found = detect_objects(pipeline, detector, &image, phrases).map_err(ConfigError::from)?;
    Ok(found.boxes)
}
