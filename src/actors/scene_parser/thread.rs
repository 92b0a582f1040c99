//! A detector on a thread of its own: frames in, answers out, one at a time.
//!
//! Whatever happens to the detector is an answer: an error, or a panic, after which a new detector
//! is made for the next frame. The thread ends when nobody can give it frames any more.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};

use tokio::sync::mpsc;

use super::{FrameStamp, MakeDetector, Rejection};
use crate::actors::ActorError;
use crate::clock::monotonic_ns;
use crate::geometry::CameraModel;
use crate::messages::RobotState;
use crate::perception::detectors::Detector;
use crate::perception::{Detections, ImageView};

/// A frame with all that belongs to it, owned: it is looked at while newer ones come.
#[derive(Debug, Clone)]
pub(super) struct Look {
    pub(super) frame: FrameStamp,
    /// Width and height, pixels.
    pub(super) size: [usize; 2],
    pub(super) rgb: Vec<u8>,
    pub(super) depth_m: Option<Vec<f32>>,
    pub(super) model: Option<CameraModel>,
    /// What the robot said last before the frame.
    pub(super) robot: Option<RobotState>,
    /// How many frames had come with it.
    pub(super) n_frames: u64,
    /// What the goal names and nobody has seen.
    pub(super) phrases: Vec<String>,
}

/// What the detector said of a frame.
#[derive(Debug)]
pub(super) struct Answer {
    pub(super) look: Look,
    pub(super) detections: Result<Detections, Rejection>,
    pub(super) detect_ns: u64,
}

/// The loop's end of the thread.
#[derive(Debug)]
pub(super) struct DetectorThread {
    looks: SyncSender<Look>,
    answers: mpsc::Receiver<Answer>,
    is_busy: bool,
}

impl DetectorThread {
    /// Starts the thread; its first detector is made there.
    pub(super) fn start(make: MakeDetector) -> Result<Self, ActorError> {
        let (looks, waiting) = sync_channel::<Look>(1);
        let (answered, answers) = mpsc::channel(1);
        let work = move || {
            let mut detector = None;
            while let Ok(look) = waiting.recv() {
                let started_ns = monotonic_ns();
                let detections = sight(&mut detector, &make, &look);
                let detect_ns = monotonic_ns() - started_ns;
                if answered.blocking_send(Answer { look, detections, detect_ns }).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new()
            .name("detector".to_owned())
            .spawn(work)
            .map_err(|e| ActorError::Part { reason: format!("no thread for the detector: {e}") })?;
        Ok(Self { looks, answers, is_busy: false })
    }

    /// Whether it is working on a frame.
    pub(super) fn is_busy(&self) -> bool {
        self.is_busy
    }

    /// Gives it a frame; only while it is not busy.
    pub(super) fn offer(&mut self, look: Look) -> Result<(), ActorError> {
        match self.looks.try_send(look) {
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
    ActorError::Part { reason: "the detector's thread has ended".to_owned() }
}

/// Looks at one frame. A detector that panics is not used again.
fn sight(
    kept: &mut Option<Box<dyn Detector>>,
    make: &MakeDetector,
    look: &Look,
) -> Result<Detections, Rejection> {
    let [width, height] = look.size;
    let image = ImageView::new(width, height, &look.rgb).map_err(|e| Rejection::unusable(&e))?;
    let mut detector = match kept.take() {
        Some(detector) => detector,
        None => make().map_err(|reason| Rejection::unusable(&reason))?,
    };
    let looked = catch_unwind(AssertUnwindSafe(|| detector.detect(&image, &look.phrases)));
    match looked {
        Ok(detections) => {
            *kept = Some(detector);
            Ok(detections?)
        }
        Err(payload) => {
            let text = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
            let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
            let reason = text.unwrap_or_else(|| "no message".to_owned());
            Err(Rejection::unusable(&format!("the detector panicked: {reason}")))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::geometry::PixelBox;
    use crate::parts::PartError;
    use crate::perception::PhraseBox;
    use crate::perception::detectors::DetectorError;
    use crate::perception::model::ObjectBox;

    /// What the gate lets a detector do with one frame.
    enum Go {
        Answer,
        Fail,
        Panic,
    }

    /// A detector that waits at a gate; it answers with the phrases that it was asked for.
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
                    let place = |p: &String| PhraseBox { phrase: p.clone(), pixel_box, score: 1.0 };
                    let phrases = phrases.iter().map(place).collect();
                    Ok(Detections { objects: Vec::new(), phrases })
                }
                Go::Fail => {
                    let (what, how) = ("the eye".to_owned(), "buy one".to_owned());
                    Err(PartError::missing(what, how).into())
                }
                Go::Panic => panic!("as told"),
            }
        }
    }

    /// A thread, its gate, and how many detectors were made.
    fn gated() -> (DetectorThread, Sender<Go>, Arc<AtomicU32>) {
        let (gate, waiting) = channel();
        let (waiting, n_made) = (Arc::new(Mutex::new(waiting)), Arc::new(AtomicU32::new(0)));
        let counted = Arc::clone(&n_made);
        let make: MakeDetector = Arc::new(move || {
            counted.fetch_add(1, Ordering::SeqCst);
            Ok(Box::new(Gated(Arc::clone(&waiting))))
        });
        (DetectorThread::start(make).unwrap(), gate, n_made)
    }

    fn look(sequence: u64) -> Look {
        Look {
            frame: FrameStamp { sequence, capture_ns: 100 * sequence, send_ns: 0 },
            size: [1, 1],
            rgb: vec![0; 3],
            depth_m: None,
            model: None,
            robot: None,
            n_frames: sequence,
            phrases: vec![format!("thing {sequence}")],
        }
    }

    #[tokio::test]
    async fn an_answer_belongs_to_the_frame_that_it_was_given() {
        let (mut thread, gate, n_made) = gated();
        for sequence in [3, 7] {
            assert!(!thread.is_busy());
            thread.offer(look(sequence)).unwrap();
            assert!(thread.is_busy());
            gate.send(Go::Answer).unwrap();
            let answer = thread.answer().await.unwrap();
            assert_eq!(answer.look.frame.sequence, sequence);
            let detections = answer.detections.unwrap();
            assert_eq!(detections.phrases[0].phrase, format!("thing {sequence}"));
        }
        assert_eq!(n_made.load(Ordering::SeqCst), 1);
    }

    #[tokio::test]
    async fn errors_and_panics_are_answers_and_the_next_frame_is_looked_at() {
        let (mut thread, gate, n_made) = gated();
        let mut rejections = Vec::new();
        for go in [Go::Fail, Go::Panic, Go::Answer] {
            thread.offer(look(1)).unwrap();
            gate.send(go).unwrap();
            rejections.push(thread.answer().await.unwrap().detections.err());
        }
        let [Some(failed), Some(panicked), None] = rejections.as_slice() else {
            panic!("{rejections:?}")
        };
        assert!(failed.is_missing && failed.reason.contains("the eye is missing: buy one"));
        assert!(!panicked.is_missing && panicked.reason.contains("panicked: as told"));
        assert_eq!(n_made.load(Ordering::SeqCst), 2, "a new one after the panic");
    }

    #[tokio::test]
    async fn a_detector_that_cannot_be_made_is_told() {
        let make: MakeDetector = Arc::new(|| Err("no such model".to_owned()));
        let mut thread = DetectorThread::start(make).unwrap();
        thread.offer(look(1)).unwrap();
        let rejection = thread.answer().await.unwrap().detections.unwrap_err();
        assert_eq!(rejection.reason, "no such model");
    }
}
