//! The cameras of a run file, and what their detectors learn from.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::mismatch::Mismatch;

/// `[camera]`: where frames come from, and how often.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraConfig {
    /// Who captures the frames.
    pub kind: String,
    /// The options of the camera.
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    pub options: Option<toml::Table>,
    /// The part of the image in which objects can be: left, upper, right and lower edge in shares of width
    /// and height, 0 to 1. Without the key the whole image.
    pub region: Option<[f64; 4]>,
    /// Frames per second.
    pub rate_hz: f64,
    /// How long a frame of any camera may be missing before the run ends with exit code 5, seconds of
    /// wall time.
    pub wait_s: f64,
    /// How far apart frames of several cameras may be captured and count as of one moment, milliseconds;
    /// realtime only.
    pub skew_ms_max: f64,
}

/// `[cameras.NAME]`: another camera. Its frames are on `camera/NAME/rgb` and `camera/NAME/depth`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OtherCameraConfig {
    /// Who captures its frames; "none": the camera is not used. Without the key who captures those of
    /// `[camera]`.
    pub kind: Option<String>,
    /// The options of this camera.
    #[schemars(with = "Option<serde_json::Map<String, serde_json::Value>>")]
    pub options: Option<toml::Table>,
    /// The part of its image in which objects can be, as in `[camera]`. Without the key the whole image.
    pub region: Option<[f64; 4]>,
    /// The labelled examples of this camera: a folder, or one image with its boxes and state. Without
    /// the key those of `[perception.exemplar]`.
    pub exemplar: Option<ExemplarConfig>,
}

impl OtherCameraConfig {
    /// Whether the run goes without it.
    pub(super) fn is_unused(&self) -> bool {
        self.kind.as_deref() == Some(UNUSED)
    }
}

/// The kind of a camera that a run goes without.
const UNUSED: &str = "none";

/// The labelled examples of one camera set-up.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExemplarConfig {
    /// A folder below the domain's `exemplar/`, or a path that begins with `/`, `./` or `../`; all examples
    /// in it are pooled.
    pub folder: Option<String>,
    /// One image instead. `$data` stands for `--data`, `{n}` for `number`.
    pub image: Option<String>,
    /// The boxes of that image: JSON, `{"name": [x1, y1, x2, y2]}` in pixels.
    pub boxes: Option<String>,
    /// The state in that image: a PDDL problem.
    pub state: Option<String>,
    /// What `{n}` stands for.
    pub number: Option<u32>,
}

impl ExemplarConfig {
    /// All labelled examples of a folder below the domain's `exemplar/`.
    pub fn in_folder(name: &str) -> Self {
        let folder = Some(name.to_owned());
        Self { folder, image: None, boxes: None, state: None, number: None }
    }
}

impl ExemplarConfig {
    /// Either a folder, or image, boxes and state.
    pub(super) fn mismatch(&self, key: &str) -> Option<Mismatch> {
        let single = [&self.image, &self.boxes, &self.state].map(Option::is_some);
        let is_right = match &self.folder {
            Some(_) => single == [false; 3] && self.number.is_none(),
            None => single == [true; 3],
        };
        let keys = ["folder", "image", "boxes", "state", "number"];
        let there = [self.folder.is_some(), single[0], single[1], single[2], self.number.is_some()];
        let got: Vec<&str> = keys.into_iter().zip(there).filter(|k| k.1).map(|k| k.0).collect();
        let got = if got.is_empty() { "neither".to_owned() } else { got.join(", ") };
        let expected = "either folder, or image, boxes and state (and a number for {n})";
        (!is_right).then(|| Mismatch::new(key, expected, got))
    }
}
