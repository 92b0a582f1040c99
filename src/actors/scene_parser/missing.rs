//! Why no scene comes: no frame, none that can be used, or no answer of the detector.

use super::frames::{Cameras, Refusal};
use super::{NAME, Rejection, SceneParserArgs};
use crate::actors::{ActorError, Fatal};
use crate::transport::{SilenceCause, Told};

/// So many frames of one number are told as such; one or two come when a camera or an actor restarts.
const REPEATS_MIN: u32 = 3;

/// What has become of frames that came to nothing.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    /// Why the last one did, since one that could be used.
    pub(super) last: Option<Rejection>,
    /// What has been told.
    told: Told,
    /// Frames that have come again.
    n_repeats: u32,
}

impl Refusals {
    /// A message that is no frame to work on; its reader has told people.
    pub(super) fn unreadable(&mut self, args: &SceneParserArgs, refusal: &Refusal) {
        args.monitor.rejected(NAME, Some(refusal.fault), &refusal.reason);
        self.last = Some(Rejection::unusable(refusal));
    }

    /// A frame that came to nothing: counts it, and says why.
    pub(super) fn rejected(&mut self, args: &SceneParserArgs, rejection: Rejection) {
        let reason = rejection.reason.as_str();
        args.monitor.rejected(NAME, None, reason);
        if let Some(nth) = self.told.count(reason) {
            tracing::warn!(reason, nth, "frame rejected");
        }
        self.last = Some(rejection);
    }

    /// Whether a frame is the one that came last, once more: an accident when a camera or an actor
    /// restarts, else a fault.
    pub(super) fn is_repeat(
        &mut self,
        args: &SceneParserArgs,
        last: Option<u64>,
        now: u64,
    ) -> bool {
        if last != Some(now) {
            self.n_repeats = 0;
            return false;
        }
        self.n_repeats = self.n_repeats.saturating_add(1);
        if self.n_repeats >= REPEATS_MIN {
            let reason = format!(
                "{} more frames of number {now}: a frozen camera, or one that does not count; sequence must \
                 grow with each frame",
                self.n_repeats
            );
            self.rejected(args, Rejection::unusable(&reason));
        }
        true
    }
}

/// Nothing usable came in time: the camera or the detector is missing, or says what cannot be
/// used.
pub(super) fn nothing_usable(
    args: &SceneParserArgs,
    cameras: &mut Cameras,
    rejection: Option<Rejection>,
) -> ActorError {
    match rejection {
        Some(rejection) => unusable(args, rejection).into(),
        None => no_frame(args, cameras, cameras.awaited()),
    }
}

/// What came cannot be used.
pub(super) fn unusable(
    args: &SceneParserArgs,
    Rejection { reason, is_missing }: Rejection,
) -> Fatal {
    let seconds = args.wait.as_secs_f64();
    if !is_missing {
        return Fatal::BadInput { message: format!("no usable frame for {seconds} s: {reason}") };
    }
    Fatal::Missing {
        what: format!(
            "an answer of the detector {} for {seconds} s (camera.wait_s)",
            args.detector_name
        ),
        how: reason,
    }
}

/// A camera shows nothing.
pub(super) fn no_frame(args: &SceneParserArgs, cameras: &mut Cameras, idx: usize) -> ActorError {
    let silence = match cameras.silence(&args.bus, idx) {
        Ok(silence) => silence,
        Err(error) => return error.into(),
    };
    let (seconds, topics) = (args.wait.as_secs_f64(), cameras.topics(idx));
    if !silence.cause.is_absence() {
        let message = format!("no usable frame for {seconds} s (camera.wait_s): {silence}");
        return Fatal::BadInput { message }.into();
    }
    let flag = topics.camera.strip_prefix("camera/").map(|name| format!(" --camera {name}"));
    let how = match silence.cause {
        SilenceCause::NoWriter => format!(
            "start a camera, such as `groundloop camera images DIR --fps 5 --run {}{}`; {silence}",
            args.bus.run(),
            flag.unwrap_or_default()
        ),
        SilenceCause::NothingSent
        | SilenceCause::OtherSchema { .. }
        | SilenceCause::NotLater { .. }
        | SilenceCause::NotWoken { .. } => silence.to_string(),
    };
    let what = format!("a frame on {} for {seconds} s (camera.wait_s)", topics.rgb.name);
    Fatal::Missing { what, how }.into()
}
