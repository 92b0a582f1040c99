//! One frame, top to bottom.

use std::collections::{BTreeMap, BTreeSet};

use super::belief::{Belief, Latched, Reading};
use super::gripper::held;
use super::occlusion::{is_covered, self_filter_in_image};
use super::streak::Pace;
use super::tracker::{Renamed, Track, Tracker};
use super::{FrameContext, ParserConfig, gripper};
use crate::geometry::PixelBox;
use crate::logic::{Facts, Truth};
use crate::messages::{CommandWatch, Effects, MAIN_CAMERA, RobotState, StatusKind};
use crate::pddl::{Atom, Name, Typed};
use crate::perception::fusion::{CameraView, fuse};
use crate::perception::grounders::{GrounderError, Grounding};
use crate::perception::model::ObjectBox;
use crate::perception::{
    Detection, Detections, FrameView, GripperContent, Observation, Unexplained, doubt_completed,
};
use crate::scene::{Anomaly, Origin, Scene, SceneFact, SceneObject, Visibility};

/// The scene parser's memory. A clone is a checkpoint: a restarted actor goes on from it.
#[derive(Debug, Clone)]
pub struct SceneParser {
    pub(super) tracker: Tracker,
    belief: Belief,
    pub(super) gripper: GripperContent,
    pub(super) running: Option<RunningStep>,
    /// What the gripper holds though no step was to take it.
    taken_unasked: Option<Name>,
    /// What was believed after the last frame, completed.
    confirmed: Facts,
    /// When the last frame was captured, and how long after the one before it, nanoseconds.
    last_ns: Option<u64>,
    frame_ns: u64,
}

/// The step that the robot carries out, as the executor tells it.
#[derive(Debug, Clone)]
pub(super) struct RunningStep {
    command_id: u64,
    watch: CommandWatch,
    pub(super) carried: Option<Name>,
    effects: Effects,
}

/// A step that has ended, perhaps done.
struct Ended {
    effects: Effects,
    /// Whether the robot has said so; otherwise its states show that it does no more.
    is_heard: bool,
}

impl Default for SceneParser {
    fn default() -> Self {
        Self {
            tracker: Tracker::default(),
            belief: Belief::default(),
            gripper: GripperContent::Empty,
            running: None,
            taken_unasked: None,
            confirmed: Facts::default(),
            last_ns: None,
            frame_ns: 0,
        }
    }
}

impl SceneParser {
    /// The scene graph of one frame.
    ///
    /// # Errors
    /// What the grounder says; the frame then leaves no trace in the memory.
    pub fn parse(
        &mut self,
        config: &ParserConfig,
        context: &FrameContext<'_>,
        detections: Detections,
    ) -> Result<Scene, GrounderError> {
        let mut next = self.clone();
        let scene = next.take_frame(config, context, detections)?;
        *self = next;
        Ok(scene)
    }

    fn take_frame(
        &mut self,
        config: &ParserConfig,
        context: &FrameContext<'_>,
        mut detections: Detections,
    ) -> Result<Scene, GrounderError> {
        let capture_ns = context.cause.capture_ns;
        self.frame_ns =
            capture_ns.saturating_sub(self.last_ns.replace(capture_ns).unwrap_or(capture_ns));
        let pace = self.pace(config);
        self.start_steps(config, context);
        let ended = self.end_step(context);
        if let Some(robot) = context.robot {
            self.follow_gripper(config, robot, &detections.objects);
        }
        let mut unexplained = std::mem::take(&mut detections.unexplained);
        let main = self.camera_view(config, context, (MAIN_CAMERA, context.view), detections);
        let others = context.others.iter().map(|other| {
            let seen = (other.camera, other.view);
            self.camera_view(config, context, seen, other.detections.clone())
        });
        let (occluders, others) = (main.occluders.clone(), others.collect());
        unexplained.retain(|thing| !is_covered(&thing.place, &occluders));
        let detections = fuse(main, others);
        let settings = (&config.perception, &config.belief);
        self.tracker.update(detections, &occluders, (capture_ns, pace), settings);
        let frames: Vec<FrameView<'_>> =
            std::iter::once(context.view).chain(context.others.iter().map(|o| o.view)).collect();
        let held = held(&self.gripper);
        self.tracker.look_for_unseen(&frames, held, &config.perception, pace);
        self.rename(pace);

        let (readings, anomalies) = self.judge(config, context, &unexplained)?;
        if let Some(taken) = &self.taken_unasked {
            self.belief.doubt_relations(taken);
        }
        let latched = self.latched();
        let lost = self.lost(config, capture_ns);
        let ended = ended.filter(|ended| self.is_believed(config, ended)).map(|e| e.effects);
        let unsettled = self.belief.update(&readings, &latched, &lost, ended.as_ref(), pace);
        let anomalies = self.belief.anomaly(anomalies, pace);
        let objects = self.objects(config);
        let typed: Vec<Typed> = objects.iter().map(typed).collect();
        let own = self.own_facts(config, &typed, &latched);
        let facts = self.facts(config, &typed, &own, &anomalies);
        let cause = context.cause;
        Ok(Scene { cause, objects, facts, anomalies, unsettled, detect_us: 0, ground_us: 0 })
    }

    /// Objects of the goal that nobody has seen under that name: phrases to ask the detector for.
    pub fn unseen(&self, config: &ParserConfig, named: &[Typed]) -> Vec<Name> {
        let is_known = |name: &Name| {
            self.present(self.pace(config)).any(|t| t.object.name == *name)
                || config.perception.implied.iter().any(|i| i.name == *name)
                || config.domain.constants.iter().any(|c| c.name == *name)
        };
        named.iter().map(|typed| typed.name.clone()).filter(|name| !is_known(name)).collect()
    }

    /// Lets objects take the goal's phrases as their names, while no step depends on the old ones.
    fn rename(&mut self, pace: Pace) {
        if self.running.is_some() || self.gripper != GripperContent::Empty {
            return;
        }
        for Renamed { from, to } in self.tracker.rename(pace) {
            tracing::info!(%from, %to, "named as in the goal");
            self.belief.rename(&from, &to);
        }
    }

    /// Takes note of a step that the robot was told to carry out.
    fn start_steps(&mut self, config: &ParserConfig, context: &FrameContext<'_>) {
        for dispatch in context.dispatches {
            self.running = Some(RunningStep {
                command_id: dispatch.command_id,
                watch: CommandWatch::new(dispatch.command_id, dispatch.cause.frame_sequence),
                carried: config.skills.carried(&dispatch.step),
                effects: dispatch.effects.clone(),
            });
        }
    }

    /// Takes note of the running step's end; returns what it predicts unless it is said to have failed.
    fn end_step(&mut self, context: &FrameContext<'_>) -> Option<Ended> {
        let running = self.running.as_mut()?;
        let is_over = context.robot.is_some_and(|robot| running.watch.is_over(robot));
        let id = running.command_id;
        let mut statuses = context.statuses.iter();
        let ending = statuses.find(|s| s.command_id == id && s.kind != StatusKind::Accepted);
        let Some(ending) = ending else {
            let running = self.running.take_if(|_| is_over)?;
            return Some(Ended { effects: running.effects, is_heard: false });
        };
        let running = self.running.take()?;
        let is_done = ending.kind == StatusKind::Done;
        is_done.then_some(Ended { effects: running.effects, is_heard: true })
    }

    /// Takes note of what the gripper holds now, and where that is.
    fn follow_gripper(
        &mut self,
        config: &ParserConfig,
        robot: &RobotState,
        detections: &[Detection],
    ) {
        let tracks = &self.tracker.tracks;
        let carried = self.running.as_ref().and_then(|running| running.carried.as_ref());
        let expected = tracks.iter().find(|track| Some(&track.object.name) == carried);
        let taking = gripper::Taking {
            tracks,
            expected,
            is_in_place: expected.is_some_and(|t| detections.iter().any(|d| t.is_where(d))),
            reach_m: config.belief.grasp_reach_m,
        };
        let now = gripper::follow(&self.gripper, robot, taking);
        let now_held = held(&now).cloned();
        let is_new = now_held.is_some() && held(&self.gripper).is_none();
        let is_unasked = is_new && now_held.as_ref() != carried;
        self.taken_unasked =
            now_held.filter(|name| is_unasked || self.taken_unasked.as_ref() == Some(name));
        let before = std::mem::replace(&mut self.gripper, now);
        let held = held(&self.gripper).or(held(&before));
        let held = self.tracker.tracks.iter_mut().find(|t| Some(&t.object.name) == held);
        if let Some(volume) = held.and_then(|track| track.object.volume.as_mut()) {
            gripper::carry(volume, robot.position);
        }
    }

    /// How fast frames come, and how long what they say must last.
    fn pace(&self, config: &ParserConfig) -> Pace {
        Pace { frame_ns: self.frame_ns, confirm_ns: config.belief.confirm_ns() }
    }

    /// Objects that are somewhere, seen or not.
    fn present(&self, pace: Pace) -> impl Iterator<Item = &Track> + Clone {
        self.tracker.tracks.iter().filter(move |track| !track.is_gone(pace))
    }

    /// Whether what an ended step predicts is believed before it is seen. Of an end that nobody has heard of only
    /// what the gripper holds tells, for what is held is not judged by eye.
    fn is_believed(&self, config: &ParserConfig, ended: &Ended) -> bool {
        let is_told = ended.is_heard || held(&self.gripper).is_some();
        is_told && !self.is_refuted(config, &ended.effects)
    }

    /// Whether the robot feels otherwise than a step that is said to be done predicts: nothing of it is
    /// believed then that is not seen.
    fn is_refuted(&self, config: &ParserConfig, effects: &Effects) -> bool {
        let objects: Vec<Typed> = self.objects(config).iter().map(typed).collect();
        let own = config.pipeline().own_facts(&objects, &self.gripper);
        let mut own_atoms = effects.add.union(&effects.delete).filter(|atom| {
            config.perception.proprioceptive.iter().any(|p| p.predicate == atom.predicate)
        });
        own_atoms.any(|atom| {
            let felt = own.truth(atom);
            felt != Truth::Unknown && effects.truth(atom).is_some_and(|said| said != felt)
        })
    }

    /// What one camera sees, with places in the world and the names that the goal's phrases give.
    fn camera_view<'a>(
        &self,
        config: &ParserConfig,
        context: &FrameContext<'_>,
        (camera, frame): (&'a str, FrameView<'a>),
        mut detections: Detections,
    ) -> CameraView<'a> {
        // What the robot carries stands on nothing, and where things stand in the world is seen better
        // than where they stand in the image.
        let is_busy = self.running.is_some() || self.gripper != GripperContent::Empty;
        if is_busy || frame.camera.is_some() {
            detections.take_back_outside();
        }
        let pipeline = config.pipeline();
        pipeline.measure(&frame, &mut detections.objects);
        let occluders = self.occluders(config, context, (&frame, &detections.objects));
        // Names come from the tracks: until then, objects are called by their types.
        let types: Vec<Name> = detections.objects.iter().map(|d| d.type_name.clone()).collect();
        let merged = pipeline.place(&mut detections, &types);
        for reason in &merged.unplaced {
            tracing::debug!(camera, reason, "a phrase of the goal names nothing");
        }
        CameraView { camera, frame, detections: detections.objects, occluders }
    }

    /// Where the robot, or what it holds, may hide something in a camera's image.
    fn occluders(
        &self,
        config: &ParserConfig,
        context: &FrameContext<'_>,
        (frame, detections): (&FrameView<'_>, &[Detection]),
    ) -> Vec<PixelBox> {
        let mut occluders = Vec::new();
        if let (Some(filter), Some(robot), Some(model)) =
            (&config.self_filter, context.robot, frame.camera)
        {
            occluders.extend(self_filter_in_image(filter, robot, model));
        }
        if let GripperContent::Holds(name) = &self.gripper
            && let Some(hand) = occluders.first().copied()
            && let Some(track) = self.tracker.tracks.iter().find(|t| t.object.name == *name)
        {
            let at_hand = detections.iter().filter(|d| {
                d.type_name == track.object.type_name
                    && d.pixel_box.intersection(&hand).area() > 0.0
            });
            occluders.extend(at_hand.map(|d| d.pixel_box));
        }
        occluders
    }

    /// Judges every tuple of objects that are in plain sight, and what is strange about them.
    ///
    /// Objects that are out of sight for a while are judged with them, where they were last seen:
    /// what hides between others is not missing. Nothing is read off them.
    fn judge(
        &self,
        config: &ParserConfig,
        context: &FrameContext<'_>,
        unexplained: &[Unexplained],
    ) -> Result<(BTreeMap<Atom, Reading>, Vec<Anomaly>), GrounderError> {
        let (capture_ns, hidden_ns_max) = (context.cause.capture_ns, config.belief.hidden_ns_max());
        let known = self.present(self.pace(config));
        let known = known.filter(|t| t.unseen_ns(capture_ns) <= hidden_ns_max);
        let known = known.filter(|t| !self.is_held(&t.object.name));
        let visible: BTreeSet<&Name> =
            known.clone().filter(|t| t.is_in_sight).map(|t| &t.object.name).collect();
        let boxes: Vec<ObjectBox> = known.map(|t| t.object.clone()).collect();
        let observation = Observation { frame: context.view, objects: &boxes, unexplained };
        let Grounding { judged, mut anomalies } = config.pipeline().judge(&observation)?;
        let contradicted = self.contradicted(&visible);
        let is_contradicted =
            |atom: &Atom| contradicted.iter().any(|c| atom.args.contains(&c.objects[0]));
        let are_visible = |names: &[Name]| names.iter().all(|name| visible.contains(name));
        anomalies.retain(|anomaly| anomaly.place.is_some() || are_visible(&anomaly.objects));
        let judged = judged.into_iter().filter(|judged| are_visible(&judged.atom.args));
        let readings = judged.map(|judged| {
            let confidence = judged.confidence().abs().min(1.0) as f32;
            let truth = if is_contradicted(&judged.atom) { Truth::Unknown } else { judged.truth };
            (judged.atom, Reading { truth, basis: judged.basis, confidence })
        });
        let readings = readings.collect();
        anomalies.extend(contradicted);
        Ok((readings, anomalies))
    }

    /// Objects in sight that cameras do not agree on.
    fn contradicted(&self, visible: &BTreeSet<&Name>) -> Vec<Anomaly> {
        let seen = self.tracker.tracks.iter().filter(|t| visible.contains(&t.object.name));
        let said = seen.filter_map(|track| {
            let objects = vec![track.object.name.clone()];
            Some(Anomaly::about(objects, track.contradiction.clone()?))
        });
        said.collect()
    }

    fn is_held(&self, name: &Name) -> bool {
        held(&self.gripper) == Some(name)
    }

    fn latched(&self) -> Latched {
        let held = held(&self.gripper).cloned();
        let Some(running) = &self.running else { return Latched { held, ..Latched::default() } };
        let effects = &running.effects;
        Latched {
            atoms: effects.add.union(&effects.delete).cloned().collect(),
            carried: running.carried.clone(),
            held,
        }
    }

    /// Objects that have been out of sight for too long, or are gone; never the one in the gripper.
    fn lost(&self, config: &ParserConfig, capture_ns: u64) -> BTreeSet<Name> {
        let (pace, hidden_ns_max) = (self.pace(config), config.belief.hidden_ns_max());
        let lost = self
            .tracker
            .tracks
            .iter()
            .filter(|t| t.unseen_ns(capture_ns) > hidden_ns_max || t.is_gone(pace));
        lost.map(|t| t.object.name.clone()).filter(|name| !self.is_held(name)).collect()
    }

    fn objects(&self, config: &ParserConfig) -> Vec<SceneObject> {
        let seen = self.present(self.pace(config)).map(|t| SceneObject {
            name: t.object.name.clone(),
            type_name: t.object.type_name.clone(),
            pixel_box: Some(t.object.pixel_box),
            volume: t.object.volume,
            score: t.score,
            visibility: if self.is_held(&t.object.name) {
                Visibility::Held
            } else if !t.is_in_sight {
                Visibility::Hidden
            } else {
                Visibility::Visible
            },
            seen_ns: t.seen_ns,
        });
        let declared = config.perception.implied.iter().map(|i| (&i.name, Some(&i.type_name)));
        let constants = config.domain.constants.iter().map(|c| (&c.name, c.types.first()));
        let implied = declared.chain(constants).map(|(name, type_name)| SceneObject {
            name: name.clone(),
            type_name: type_name.cloned().unwrap_or_else(|| "object".into()),
            pixel_box: None,
            volume: None,
            score: 1.0,
            visibility: Visibility::Implied,
            seen_ns: 0,
        });
        seen.chain(implied).collect()
    }

    /// What the robot knows of itself; while a step runs, what that step is about to change keeps
    /// its value.
    fn own_facts(&self, config: &ParserConfig, objects: &[Typed], latched: &Latched) -> OwnFacts {
        let raw = config.pipeline().own_facts(objects, &self.gripper);
        let mut confirmed = raw.clone();
        let is_own = |atom: &Atom| {
            config.perception.proprioceptive.iter().any(|p| p.predicate == atom.predicate)
        };
        // What the step carried may have gone meanwhile.
        let are_there =
            |atom: &Atom| atom.args.iter().all(|arg| objects.iter().any(|o| o.name == *arg));
        let atoms: BTreeSet<Atom> = raw
            .known
            .iter()
            .chain(&raw.unknown)
            .chain(&self.confirmed.known)
            .chain(&self.confirmed.unknown)
            .filter(|atom| is_own(atom) && latched.holds_back(atom) && are_there(atom))
            .cloned()
            .collect();
        for atom in atoms {
            let kept = self.confirmed.truth(&atom);
            confirmed.set(atom, kept);
        }
        OwnFacts { raw, confirmed }
    }

    /// All facts that are raw or confirmed true or unknown, or predicted.
    fn facts(
        &mut self,
        config: &ParserConfig,
        objects: &[Typed],
        own: &OwnFacts,
        anomalies: &[Anomaly],
    ) -> Vec<SceneFact> {
        let pace = self.pace(config);
        let (mut raw, mut confirmed) = (own.raw.clone(), own.confirmed.clone());
        let gone = self.tracker.tracks.iter().filter(|track| track.is_gone(pace));
        let gone: BTreeSet<&Name> = gone.map(|track| &track.object.name).collect();
        let is_present =
            |atom: &Atom| gone.is_empty() || !atom.args.iter().any(|arg| gone.contains(arg));
        let present = self.belief.entries.iter().filter(|(atom, _)| is_present(atom));
        for (atom, entry) in present {
            raw.set(atom.clone(), entry.raw);
            confirmed.set(atom.clone(), entry.confirmed);
        }
        let pipeline = config.pipeline();
        let completed = |base: &Facts| {
            let mut facts = pipeline.completed(objects, base);
            doubt_completed(&config.perception, anomalies, &mut facts);
            facts
        };
        let predicted: BTreeSet<&Atom> =
            self.belief.predicted().filter(|a| is_present(a)).collect();
        let mut seen = confirmed.clone();
        for atom in &predicted {
            seen.set((*atom).clone(), Truth::Unknown);
        }
        let seen = (!predicted.is_empty()).then(|| completed(&seen));
        let (raw, confirmed) = (completed(&raw), completed(&confirmed));
        // What follows from a prediction is one.
        let is_predicted =
            |atom: &Atom| seen.as_ref().is_some_and(|s| s.truth(atom) != confirmed.truth(atom));
        let atoms: BTreeSet<&Atom> =
            [&raw.known, &raw.unknown, &confirmed.known, &confirmed.unknown]
                .into_iter()
                .flatten()
                .chain(predicted.iter().copied())
                .collect();
        let facts = atoms.into_iter().map(|atom| {
            let entry = self.belief.entries.get(atom);
            let is_own =
                config.perception.proprioceptive.iter().any(|p| p.predicate == atom.predicate);
            let otherwise = match (is_own, is_predicted(atom)) {
                (true, _) => Origin::Proprioceptive,
                (false, true) => Origin::Predicted,
                (false, false) => Origin::Completed,
            };
            SceneFact {
                atom: atom.clone(),
                raw: raw.truth(atom),
                confirmed: confirmed.truth(atom),
                origin: entry.map_or(otherwise, |e| e.origin),
                confidence: entry.map_or(1.0, |e| e.confidence),
            }
        });
        let facts = facts.collect();
        self.confirmed = confirmed;
        facts
    }
}

/// What the robot says of itself now, and what of it counts.
struct OwnFacts {
    raw: Facts,
    confirmed: Facts,
}

fn typed(object: &SceneObject) -> Typed {
    Typed::new(object.name.clone(), object.type_name.clone())
}
