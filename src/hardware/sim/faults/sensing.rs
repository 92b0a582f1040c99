//! Faults of cameras and detectors: what is seen is not what is there.

use groundloop_sim::FaultError;
use schemars::{JsonSchema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use toml::de::Error;

/// Oldest picture that `late_frame` can show, in seconds: pictures are kept for so long.
const LATE_S_MAX: f64 = 2.0;
/// Widest blur, in pixels.
const BLUR_PX_MAX: u32 = 64;

/// One thing that a camera or its detector shows wrongly: in one frame, or for a while.
#[derive(Debug, Clone, PartialEq)]
pub struct SensingFault {
    /// Which camera; without it the one whose frame was waited for, or `main`.
    pub camera: Option<String>,
    /// For how long, seconds of simulated time; without it one frame, and a bump for good.
    pub for_s: Option<f64>,
    /// What.
    pub what: Disturbance,
}

/// What is wrong with a frame. Written in run files with the key `kind`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Disturbance {
    /// The frame is never published. In lockstep the world goes on to the next one, and no camera shows
    /// this one.
    DropFrame {},
    /// Pixels, depth, pose and capture stamp are those of an earlier frame.
    LateFrame {
        /// How much earlier, seconds of simulated time; 2 at most.
        by_s: f64,
    },
    /// The frame is published twice.
    RepeatFrame {},
    /// The picture stays as it is at the start, while stamps and numbers go on.
    Freeze {},
    /// Bands of rows are noise, in pixels and depth.
    Corrupt {
        /// Share of the rows, above 0 and up to 1.
        share: f64,
    },
    /// The pixels are blurred; depth is not.
    Blur {
        /// How far a pixel spreads to each side, in pixels.
        px: u32,
    },
    /// The light of each pixel is multiplied, and cut off where it is too bright.
    Exposure {
        /// By how much: below 1 is darker.
        factor: f64,
    },
    /// A hand with a forearm is in front of everything, at a place that the seed draws.
    Occluder {
        /// Width of the hand, as a share of the picture's width: above 0 and up to 1.
        width: f64,
    },
    /// Blobs without depth, at places that the seed draws.
    DepthHoles {
        /// Share of the pixels, above 0 and up to 1.
        share: f64,
    },
    /// The camera stands elsewhere than its pose says, for good or for a while.
    BumpCamera {
        /// How far from where it should stand: metres, world frame.
        by_m: [f64; 3],
        /// How far it is turned to the left about the vertical, radians; without it not at all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        by_rad: Option<f64>,
    },
    /// The detector does not see an object.
    MissDetection {
        /// Its name in the simulated scene, or "any": one that the seed draws.
        object: String,
    },
    /// The detector sees what is not there: as large and of the type of another object, at a place that
    /// the seed draws.
    FalseDetection {
        /// Its label, such as a colour; without it that of the other object.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        label: Option<String>,
    },
    /// The detector sees an object elsewhere in the picture.
    MisplaceDetection {
        /// Its name in the simulated scene, or "any": one that the seed draws.
        object: String,
        /// How far off: columns and rows, in pixels.
        by_px: [f64; 2],
    },
}

impl SensingFault {
    /// The kinds of this group, as run files have them.
    pub(super) const KINDS: [&'static str; 13] = [
        "drop_frame",
        "late_frame",
        "repeat_frame",
        "freeze",
        "corrupt",
        "blur",
        "exposure",
        "occluder",
        "depth_holes",
        "bump_camera",
        "miss_detection",
        "false_detection",
        "misplace_detection",
    ];
    /// Those of it that last.
    const LASTING: [&'static str; 2] = ["freeze", "occluder"];

    /// Reads the `action` of a `[[fault]]`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(action: &toml::Table) -> Result<Self, Error> {
        let mut action = action.clone();
        let camera = action.remove("camera").map(toml::Value::try_into).transpose()?;
        let for_s = action.remove("for_s").map(toml::Value::try_into).transpose()?;
        let what = action.try_into()?;
        Ok(Self { camera, for_s, what })
    }

    /// The schema of each kind.
    pub(super) fn schemas(generator: &mut SchemaGenerator) -> Vec<Value> {
        let schema = Disturbance::json_schema(generator).to_value();
        let mut kinds = schema["oneOf"].as_array().cloned().unwrap_or_default();
        for kind in &mut kinds {
            kind["properties"]["camera"] = json!({
                "description": "Which camera; without the key the one whose frame was waited for, or \
                                \"main\".",
                "type": "string",
            });
            kind["properties"]["for_s"] = json!({
                "description": "For how long, seconds of simulated time; without the key one frame, and a \
                                bump for good.",
                "type": "number",
                "format": "double",
            });
            let name = kind["properties"]["kind"]["const"].as_str().unwrap_or_default();
            let lasts = Self::LASTING.contains(&name);
            if let Some(required) = kind["required"].as_array_mut().filter(|_| lasts) {
                required.push("for_s".into());
            }
        }
        kinds
    }

    /// Checks its numbers.
    ///
    /// # Errors
    /// [`FaultError::BadNumber`].
    pub fn check(&self) -> Result<(), FaultError> {
        if let Some(for_s) = self.for_s {
            FaultError::check_duration(for_s)?;
        }
        match self.what.wrong() {
            Some((key, expected)) => Err(FaultError::BadNumber { key, expected }),
            None => Ok(()),
        }
    }
}

impl Disturbance {
    /// A number that cannot be, and what it should be.
    fn wrong(&self) -> Option<(&'static str, &'static str)> {
        let is_share = |share: f64| share > 0.0 && share <= 1.0;
        let share = "a number above 0, and 1 at most";
        match self {
            Self::LateFrame { by_s } if !(*by_s > 0.0 && *by_s <= LATE_S_MAX) => {
                Some(("by_s", "a number above 0, and 2 at most"))
            }
            Self::Corrupt { share: got } | Self::DepthHoles { share: got } if !is_share(*got) => {
                Some(("share", share))
            }
            Self::Occluder { width } if !is_share(*width) => Some(("width", share)),
            Self::Blur { px } if !(1..=BLUR_PX_MAX).contains(px) => {
                Some(("px", "an integer from 1 to 64"))
            }
            Self::Exposure { factor } if !(factor.is_finite() && *factor >= 0.0) => {
                Some(("factor", "a finite number, 0 or more"))
            }
            Self::BumpCamera { by_m, by_rad } => {
                let turn = by_rad.unwrap_or(0.0);
                let is_none = turn == 0.0 && by_m.iter().all(|metres| *metres == 0.0);
                if !by_m.iter().all(|metres| metres.is_finite()) || is_none {
                    return Some(("by_m", "three finite numbers that are not all 0"));
                }
                (!turn.is_finite()).then_some(("by_rad", "a finite number"))
            }
            Self::MisplaceDetection { by_px: [x, y], .. } => {
                let away_px = x.hypot(*y);
                let is_wrong = !(away_px.is_finite() && away_px > 0.0);
                is_wrong.then_some(("by_px", "two finite numbers that are not both 0"))
            }
            Self::DropFrame {}
            | Self::LateFrame { .. }
            | Self::RepeatFrame {}
            | Self::Freeze {}
            | Self::Corrupt { .. }
            | Self::Blur { .. }
            | Self::Exposure { .. }
            | Self::Occluder { .. }
            | Self::DepthHoles { .. }
            | Self::MissDetection { .. }
            | Self::FalseDetection { .. } => None,
        }
    }

    /// The object that it names.
    pub(super) fn object(&self) -> Option<&str> {
        match self {
            Self::MissDetection { object } | Self::MisplaceDetection { object, .. } => Some(object),
            Self::DropFrame {}
            | Self::LateFrame { .. }
            | Self::RepeatFrame {}
            | Self::Freeze {}
            | Self::Corrupt { .. }
            | Self::Blur { .. }
            | Self::Exposure { .. }
            | Self::Occluder { .. }
            | Self::DepthHoles { .. }
            | Self::BumpCamera { .. }
            | Self::FalseDetection { .. } => None,
        }
    }

    /// How old the picture is that it shows, where it shows an earlier one.
    pub(super) fn late_ns(&self) -> Option<u64> {
        let Self::LateFrame { by_s } = self else { return None };
        Some(super::nanoseconds(*by_s))
    }

    /// Whether it is done to what the detector says, and not to the frame.
    pub(in crate::hardware::sim) fn is_of_detector(&self) -> bool {
        matches!(
            self,
            Self::MissDetection { .. }
                | Self::FalseDetection { .. }
                | Self::MisplaceDetection { .. }
        )
    }

    /// What people are told of it as it begins.
    pub(super) fn told(&self, camera: &str, for_s: Option<f64>) -> String {
        let what = match self {
            Self::DropFrame {} => "loses the frame".to_owned(),
            Self::LateFrame { by_s } => format!("shows the picture from {by_s} s ago"),
            Self::RepeatFrame {} => "shows the frame twice".to_owned(),
            Self::Freeze {} => "shows the same picture".to_owned(),
            Self::Corrupt { share } => format!("shows noise in {:.0} % of its rows", 100.0 * share),
            Self::Blur { px } => format!("is blurred by {px} pixels"),
            Self::Exposure { factor } => format!("shows {factor} times the light"),
            Self::Occluder { .. } => "is covered by a hand".to_owned(),
            Self::DepthHoles { share } => {
                format!("has no depth in {:.0} % of its pixels", 100.0 * share)
            }
            Self::BumpCamera { by_m: [x, y, z], .. } => {
                format!("stands off its place by ({x:.3}, {y:.3}, {z:.3}) m")
            }
            Self::MissDetection { .. }
            | Self::FalseDetection { .. }
            | Self::MisplaceDetection { .. } => "is detected wrongly".to_owned(),
        };
        let lasts = for_s.map(|seconds| format!(" for {seconds:.1} s")).unwrap_or_default();
        format!("camera {camera} {what}{lasts}")
    }
}
