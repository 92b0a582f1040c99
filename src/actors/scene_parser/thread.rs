//! Detector and grounder on a thread of their own: frames in, scenes out, one at a time.
//!
//! Whatever happens there is an answer: an error, or a panic, after which a new detector is made for
//! the next frame. The thread ends when nobody can give it frames any more.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};

use tokio::sync::mpsc;

use super::frames::Shot;
use super::{CameraArgs, Heard, Rejection, look, scene_of};
use crate::actors::ActorError;
use crate::geometry::CameraModel;
use crate::perception::detectors::Detector;
use crate::perception::tracking::{ParserConfig, SceneParser};
use crate::scene::Scene;

/// A frame with all that belongs to it, owned: it is looked at while newer ones come.
#[derive(Debug, Clone)]
pub(super) struct Job {
    pub(super) heard: Heard,
    /// The memory after the last frame that was parsed.
    pub(super) parser: SceneParser,
    /// What each camera shows, `main` first.
    pub(super) shots: Vec<OwnedShot>,
    /// What the goal names and nobody has seen.
    pub(super) phrases: Vec<String>,
}

/// What one camera shows, owned.
#[derive(Debug, Clone)]
pub(super) struct OwnedShot {
    pub(super) camera_idx: usize,
    /// Number of its frame.
    pub(super) sequence: u64,
    /// Width and height, pixels.
    pub(super) size: [usize; 2],
    pub(super) rgb: Vec<u8>,
    pub(super) depth_m: Option<Vec<f32>>,
    pub(super) model: Option<CameraModel>,
}

impl OwnedShot {
    /// A copy of what is in shared memory.
    pub(super) fn of(shot: &Shot<'_>) -> Self {
        Self {
            camera_idx: shot.camera_idx,
            sequence: shot.sequence,
            size: shot.size,
            rgb: shot.rgb.to_vec(),
            depth_m: shot.depth_m.map(<[f32]>::to_vec),
            model: shot.model.copied(),
        }
    }

    fn borrowed(&self) -> Shot<'_> {
        Shot {
            camera_idx: self.camera_idx,
            sequence: self.sequence,
            size: self.size,
            rgb: &self.rgb,
            depth_m: self.depth_m.as_deref(),
            model: self.model.as_ref(),
        }
    }
}

/// What came of a frame.
#[derive(Debug)]
pub(super) struct Answer {
    /// How many frames had come with it.
    pub(super) n_frames: u64,
    /// The memory after it and its scene.
    pub(super) parsed: Result<(SceneParser, Scene), Rejection>,
}

/// The loop's end of the thread.
#[derive(Debug)]
pub(super) struct PerceptionThread {
    jobs: SyncSender<Job>,
    answers: mpsc::Receiver<Answer>,
    is_busy: bool,
}

impl PerceptionThread {
    /// Starts the thread; its first detector is made there.
    pub(super) fn start(
        cameras: Vec<CameraArgs>,
        config: Arc<ParserConfig>,
    ) -> Result<Self, ActorError> {
        let (jobs, waiting) = sync_channel::<Job>(1);
        let (answered, answers) = mpsc::channel(1);
        let work = move || {
            let mut detectors = None;
            while let Ok(job) = waiting.recv() {
                let n_frames = job.heard.n_frames;
                let parsed = carry_out(&mut detectors, &cameras, &config, job);
                if answered.blocking_send(Answer { n_frames, parsed }).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new()
            .name("perception".to_owned())
            .spawn(work)
            .map_err(|e| ActorError::Part { reason: format!("no thread for perception: {e}") })?;
        Ok(Self { jobs, answers, is_busy: false })
    }

    /// Whether it is working on a frame.
    pub(super) fn is_busy(&self) -> bool {
        self.is_busy
    }

    /// Gives it a frame; only while it is not busy.
    pub(super) fn offer(&mut self, job: Job) -> Result<(), ActorError> {
        match self.jobs.try_send(job) {
            Ok(()) => {
                self.is_busy = true;
                Ok(())
            }
            Err(TrySendError::Full(_)) => Ok(()),
            Err(TrySendError::Disconnected(_)) => Err(ended()),
        }
    }

    /// Waits for its answer; for ever while there is nothing to answer. Cancel-safe.
    pub(super) async fn answer(&mut self) -> Result<Answer, ActorError> {
        if !self.is_busy {
            return std::future::pending().await;
        }
        let answer = self.answers.recv().await.ok_or_else(ended)?;
        self.is_busy = false;
        Ok(answer)
    }
}

fn ended() -> ActorError {
    ActorError::Part { reason: "the thread of detector and grounder has ended".to_owned() }
}

/// Turns one frame into a scene. Detectors that were at work in a panic are not used again.
fn carry_out(
    kept: &mut Option<Vec<Box<dyn Detector>>>,
    cameras: &[CameraArgs],
    config: &ParserConfig,
    job: Job,
) -> Result<(SceneParser, Scene), Rejection> {
    let mut detectors = if let Some(detectors) = kept.take() {
        detectors
    } else {
        let made = cameras.iter().map(|camera| (camera.detector)());
        made.collect::<Result<_, _>>().map_err(|reason| Rejection::unusable(&reason))?
    };
    let mut parser = job.parser;
    let shots: Vec<Shot<'_>> = job.shots.iter().map(OwnedShot::borrowed).collect();
    let worked = catch_unwind(AssertUnwindSafe(|| {
        let seen = look((cameras, &mut detectors), &shots, &job.phrases)?;
        scene_of(&mut parser, config, &job.heard, seen)
    }));
    match worked {
        Ok(scene) => {
            *kept = Some(detectors);
            Ok((parser, scene?))
        }
        Err(payload) => {
            let text = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
            let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
            let reason = text.unwrap_or_else(|| "no message".to_owned());
            Err(Rejection::unusable(&format!("detector or grounder panicked: {reason}")))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::sync::mpsc::{Receiver, Sender, channel};

    use super::super::{FrameStamp, MakeDetector};
    use super::*;
    use crate::geometry::PixelBox;
    use crate::parts::PartError;
    use crate::perception::detectors::DetectorError;
    use crate::perception::grounders::{Grounder, GrounderError, Grounding};
    use crate::perception::model::ObjectBox;
    use crate::perception::tracking::BeliefConfig;
    use crate::perception::{Detection, Detections, ImageView, Observation};
    use crate::run::DomainFolder;

    /// What the gate lets a detector do with one frame.
    enum Go {
        Answer,
        Fail,
        Panic,
    }

    /// A detector that waits at a gate; it sees a block of the colour that it was asked for.
    struct Gated(Arc<Mutex<Receiver<Go>>>);

    impl Detector for Gated {
        fn learn(&mut self, _: &ImageView<'_>, _: &[ObjectBox]) -> Result<(), DetectorError> {
            Ok(())
        }

        fn detect(
            &mut self,
            _: &ImageView<'_>,
            phrases: &[String],
        ) -> Result<Detections, DetectorError> {
            let go = self.0.lock().unwrap().recv().unwrap();
            match go {
                Go::Answer => {
                    let pixel_box = PixelBox::from([0.0, 0.0, 1.0, 1.0]);
                    let block =
                        |p: &String| Detection::new("block".into(), p.as_str().into(), pixel_box);
                    let objects = phrases.iter().map(block).collect();
                    Ok(Detections { objects, ..Detections::default() })
                }
                Go::Fail => {
                    let (what, how) = ("the eye".to_owned(), "buy one".to_owned());
                    Err(PartError::missing(what, how).into())
                }
                Go::Panic => panic!("as told"),
            }
        }
    }

    /// A grounder that works as long as nothing blue is seen.
    struct Blind;

    impl Grounder for Blind {
        fn ground(&self, observation: &Observation<'_>) -> Result<Grounding, GrounderError> {
            assert!(observation.frame.image.is_some());
            if observation.objects.iter().any(|o| o.name == "blue_block") {
                let (what, how) = ("the blue filter".to_owned(), "fetch it".to_owned());
                return Err(GrounderError::Missing { what, how });
            }
            Ok(Grounding::default())
        }
    }

    fn config() -> Arc<ParserConfig> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("domains/blocksworld");
        let folder = DomainFolder::read(&path).unwrap();
        Arc::new(ParserConfig {
            domain: folder.domain,
            perception: folder.perception,
            rules: folder.rules,
            skills: folder.skills.unwrap(),
            grounder: Box::new(Blind),
            belief: BeliefConfig { confirm_s: 0.0, hidden_s_max: 0.3, grasp_reach_m: 0.05 },
            self_filter: None,
        })
    }

    /// The thread of a run with one camera.
    fn start(detector: MakeDetector) -> PerceptionThread {
        let main =
            CameraArgs { name: "main".to_owned(), detector, image_size: [1, 1], disturb: None };
        PerceptionThread::start(vec![main], config()).unwrap()
    }

    /// A thread, its gate, and how many detectors were made.
    fn gated() -> (PerceptionThread, Sender<Go>, Arc<AtomicU32>) {
        let (gate, waiting) = channel();
        let (waiting, n_made) = (Arc::new(Mutex::new(waiting)), Arc::new(AtomicU32::new(0)));
        let counted = Arc::clone(&n_made);
        let make: MakeDetector = Arc::new(move || {
            counted.fetch_add(1, Ordering::SeqCst);
            Ok(Box::new(Gated(Arc::clone(&waiting))))
        });
        (start(make), gate, n_made)
    }

    fn job(sequence: u64, colour: &str, parser: SceneParser) -> Job {
        Job {
            heard: Heard {
                frame: FrameStamp { sequence, capture_ns: 100 * sequence, send_ns: 0 },
                robot: None,
                dispatches: Vec::new(),
                statuses: Vec::new(),
                n_frames: sequence,
            },
            parser,
            shots: vec![OwnedShot {
                camera_idx: 0,
                sequence,
                size: [1, 1],
                rgb: vec![0; 3],
                depth_m: None,
                model: None,
            }],
            phrases: vec![colour.to_owned()],
        }
    }

    #[tokio::test]
    async fn an_answer_belongs_to_the_frame_that_it_was_given() {
        let (mut thread, gate, n_made) = gated();
        let mut parser = SceneParser::default();
        for (sequence, colour) in [(3, "red"), (7, "green")] {
            assert!(!thread.is_busy());
            thread.offer(job(sequence, colour, parser)).unwrap();
            assert!(thread.is_busy());
            gate.send(Go::Answer).unwrap();
            let answer = thread.answer().await.unwrap();
            assert_eq!(answer.n_frames, sequence);
            let (after, scene) = answer.parsed.unwrap();
            parser = after;
            assert_eq!(
                (scene.cause.frame_sequence, scene.cause.capture_ns),
                (sequence, 100 * sequence)
            );
            assert!(scene.object(&format!("{colour}_block")).is_some());
            assert!(scene.object("red_block").is_some(), "the memory goes with the frames");
        }
        assert_eq!(n_made.load(Ordering::SeqCst), 1);
    }

    #[tokio::test]
    async fn errors_and_panics_are_answers_and_the_next_frame_is_looked_at() {
        let (mut thread, gate, n_made) = gated();
        let mut rejections = Vec::new();
        let frames =
            [(Go::Fail, "red"), (Go::Answer, "blue"), (Go::Panic, "red"), (Go::Answer, "red")];
        for (go, colour) in frames {
            thread.offer(job(1, colour, SceneParser::default())).unwrap();
            gate.send(go).unwrap();
            rejections.push(thread.answer().await.unwrap().parsed.err());
        }
        let [Some(failed), Some(unjudged), Some(panicked), None] = rejections.as_slice() else {
            panic!("{rejections:?}")
        };
        assert!(failed.is_missing && failed.reason.contains("the eye is missing: buy one"));
        assert!(unjudged.is_missing && unjudged.reason.contains("the blue filter is missing"));
        assert!(!panicked.is_missing && panicked.reason.contains("panicked: as told"));
        assert_eq!(n_made.load(Ordering::SeqCst), 2, "a new one after the panic");
    }

    #[tokio::test]
    async fn a_detector_that_cannot_be_made_is_told() {
        let make: MakeDetector = Arc::new(|| Err("no such model".to_owned()));
        let mut thread = start(make);
        thread.offer(job(1, "red", SceneParser::default())).unwrap();
        let rejection = thread.answer().await.unwrap().parsed.unwrap_err();
        assert_eq!(rejection.reason, "no such model");
    }
}
