//! Frames as the labelled examples show them: of the same size, or scaled to it.

use image::imageops::{FilterType, resize};
use image::{ImageBuffer, Rgb};

use crate::geometry::{CameraModel, Intrinsics};
use crate::perception::model::RATIO_OFF_MAX;
use crate::transport::convert::RgbFrame;
use crate::transport::wire::FrameHeader;

/// How many times larger or smaller than the labelled examples frames may be along each side. Beyond it
/// there is too little to see, or too much to scale in the time of a frame.
pub(super) const SCALE_MAX: f64 = 4.0;

/// A frame of the size of the labelled examples.
#[derive(Debug)]
pub(super) struct FittedFrame {
    frame: RgbFrame,
    scaled: Option<Scaled>,
}

#[derive(Debug)]
struct Scaled {
    size: [u32; 2],
    rgb: Vec<u8>,
    model: Option<CameraModel>,
}

/// How a frame becomes one of `wanted` size: its sides are multiplied by these; `None` where it has it.
///
/// # Errors
/// What sizes could be scaled.
pub(super) fn scale_of(size: [u32; 2], wanted: [u32; 2]) -> Result<Option<[f64; 2]>, String> {
    if size == wanted {
        return Ok(None);
    }
    let [across, down] = [0, 1].map(|axis| f64::from(wanted[axis]) / f64::from(size[axis]));
    let is_one_ratio = (across / down - 1.0).abs() <= RATIO_OFF_MAX;
    let is_near = |scale: f64| (1.0 / SCALE_MAX..=SCALE_MAX).contains(&scale);
    if is_one_ratio && is_near(across) && is_near(down) {
        return Ok(Some([across, down]));
    }
    let ([width, height], [is_wide, is_high]) = (wanted, size);
    Err(format!(
        "the labelled examples are {width}x{height} pixels, the frame is {is_wide}x{is_high}: frames of the same \
         ratio of width to height are scaled, up to {SCALE_MAX} times"
    ))
}

impl FittedFrame {
    /// A frame of the right size, or scaled to it where `scale_of` says that it can be.
    pub(super) fn new(frame: RgbFrame, wanted: [u32; 2]) -> Self {
        let Ok(Some(scale)) = scale_of(frame.size(), wanted) else {
            return Self { frame, scaled: None };
        };
        let ([width, height], [to_width, to_height]) = (frame.size(), wanted);
        let picture = ImageBuffer::<Rgb<u8>, &[u8]>::from_raw(width, height, frame.rgb());
        // Averages where a picture shrinks, and makes no colours at edges.
        let rgb = picture.map(|p| resize(&p, to_width, to_height, FilterType::Triangle).into_raw());
        let model = frame.model().map(|model| {
            let intrinsics: Intrinsics = model.intrinsics.scaled(scale);
            CameraModel { intrinsics, ..*model }
        });
        let scaled = rgb.map(|rgb| Scaled { size: wanted, rgb, model });
        Self { frame, scaled }
    }

    /// Number and time stamps of the frame; its size is that of the message.
    pub(super) fn header(&self) -> &FrameHeader {
        self.frame.header()
    }

    /// Columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        self.scaled.as_ref().map_or_else(|| self.frame.size(), |scaled| scaled.size)
    }

    /// Packed RGB8, row by row.
    pub(super) fn rgb(&self) -> &[u8] {
        self.scaled.as_ref().map_or_else(|| self.frame.rgb(), |scaled| &scaled.rgb)
    }

    /// Intrinsics and pose, where both are known.
    pub(super) fn model(&self) -> Option<&CameraModel> {
        self.scaled.as_ref().map_or_else(|| self.frame.model(), |scaled| scaled.model.as_ref())
    }

    /// Brings depth of the size of the message to the size of the frame: each pixel has the depth of the one
    /// that its middle lies in, since a mean of two distances is the distance of nothing.
    pub(super) fn fit_depth(&self, depth_m: &mut Vec<f32>) {
        let Some(Scaled { size, .. }) = &self.scaled else { return };
        if let Some(fitted) = sampled(depth_m, self.frame.size(), *size) {
            *depth_m = fitted;
        }
    }
}

/// Depth at another size.
fn sampled(depth_m: &[f32], from: [u32; 2], to: [u32; 2]) -> Option<Vec<f32>> {
    let place = |axis: usize, at: u32| {
        let [from, to] = [from[axis], to[axis]].map(u64::from);
        ((2 * u64::from(at) + 1) * from / (2 * to)) as usize
    };
    let columns: Vec<usize> = (0..to[0]).map(|x| place(0, x)).collect();
    let rows: Vec<&[f32]> = depth_m.chunks_exact(from[0] as usize).collect();
    if rows.len() != from[1] as usize {
        return None;
    }
    let mut fitted = Vec::with_capacity(columns.len() * to[1] as usize);
    for y in 0..to[1] {
        let row = rows.get(place(1, y))?;
        fitted.extend(columns.iter().filter_map(|x| row.get(*x)));
    }
    Some(fitted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_one_ratio_are_scaled_within_bounds() {
        let wanted = [640, 480];
        assert_eq!(scale_of(wanted, wanted), Ok(None));
        for (size, scale) in [
            ([320, 240], [2.0, 2.0]),
            ([1280, 960], [0.5, 0.5]),
            ([160, 120], [4.0, 4.0]),
            ([2560, 1920], [0.25, 0.25]),
        ] {
            assert_eq!(scale_of(size, wanted), Ok(Some(scale)));
        }
        for size in [[640, 360], [480, 640], [159, 119], [2600, 1950], [1, 1]] {
            let said = scale_of(size, wanted).unwrap_err();
            assert!(said.contains("are 640x480 pixels, the frame is"), "{said}");
        }
    }

    #[test]
    fn depth_is_sampled_and_never_mixed() {
        let depth = [1.0, 2.0, 3.0, 4.0];
        let twice = sampled(&depth, [2, 2], [4, 4]).unwrap();
        let row = |a: f32, b: f32| [a, a, b, b];
        assert_eq!(twice, [row(1.0, 2.0), row(1.0, 2.0), row(3.0, 4.0), row(3.0, 4.0)].concat());
        assert_eq!(sampled(&twice, [4, 4], [2, 2]).unwrap(), depth);
        assert_eq!(sampled(&depth, [2, 3], [4, 4]), None);
        assert_eq!(sampled(&depth, [3, 1], [4, 4]).map(|fitted| fitted.len()), Some(16));
    }
}
