//! A frame as a model's input, and boxes back from the input to the frame.

use super::description::{Channels, InputSpec, Layout, Resize};
use crate::perception::ImageView;

/// What letterbox bars are filled with, of 255: the usual grey.
const BAR: f32 = 114.0;

/// Where the pixels of a frame are in the input: `input = frame * scale + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit {
    scale: [f64; 2],
    offset: [f64; 2],
}

impl Fit {
    pub(super) fn new(spec: &InputSpec, frame: &ImageView<'_>) -> Self {
        let input = [spec.width as f64, spec.height as f64];
        let frame = [frame.width() as f64, frame.height() as f64];
        let factors = [input[0] / frame[0], input[1] / frame[1]];
        match spec.resize {
            Resize::Plain => Self { scale: factors, offset: [0.0; 2] },
            Resize::Letterbox => {
                let factor = factors[0].min(factors[1]);
                let bar = |i: usize| (input[i] - factor * frame[i]) / 2.0;
                Self { scale: [factor; 2], offset: [bar(0), bar(1)] }
            }
        }
    }

    /// A place in the frame as a place in the input.
    pub(super) fn to_input(self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x * self.scale[0] + self.offset[0], y * self.scale[1] + self.offset[1]]
    }

    /// Edges in the input as edges in the frame.
    pub(super) fn to_frame(self, [x1, y1, x2, y2]: [f64; 4]) -> [f64; 4] {
        let back = |value: f64, i: usize| (value - self.offset[i]) / self.scale[i];
        [back(x1, 0), back(y1, 1), back(x2, 0), back(y2, 1)]
    }
}

/// The input's values, with one frame in the batch, and its shape.
pub(super) fn values(spec: &InputSpec, frame: &ImageView<'_>) -> ([usize; 4], Vec<f32>) {
    let fit = Fit::new(spec, frame);
    let (w, h) = (spec.width, spec.height);
    let mut values = vec![0.0; 3 * w * h];
    for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
        // Middles of pixels lie at halves in both images.
        let at = fit.to_frame([x as f64 + 0.5, y as f64 + 0.5, 0.0, 0.0]);
        let mut rgb = sample(frame, at[0] - 0.5, at[1] - 0.5);
        if spec.channels == Channels::Bgr {
            rgb.reverse();
        }
        for (c, value) in rgb.into_iter().enumerate() {
            let idx = match spec.layout {
                Layout::Nchw => (c * h + y) * w + x,
                Layout::Nhwc => (y * w + x) * 3 + c,
            };
            values[idx] = (value * spec.scale - spec.mean[c]) / spec.std[c];
        }
    }
    let shape = match spec.layout {
        Layout::Nchw => [1, 3, h, w],
        Layout::Nhwc => [1, h, w, 3],
    };
    (shape, values)
}

/// The colour between pixels; bar grey outside of the frame.
fn sample(frame: &ImageView<'_>, x: f64, y: f64) -> [f32; 3] {
    let (last_x, last_y) = (frame.width() as f64 - 1.0, frame.height() as f64 - 1.0);
    if x < -0.5 || y < -0.5 || x > last_x + 0.5 || y > last_y + 0.5 {
        return [BAR; 3];
    }
    let (x, y) = (x.clamp(0.0, last_x), y.clamp(0.0, last_y));
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
    let pixel = |x: f64, y: f64| {
        let rgb = frame.pixel(x.min(last_x) as usize, y.min(last_y) as usize).unwrap_or([0; 3]);
        rgb.map(f32::from)
    };
    let [a, b, c, d] =
        [pixel(x0, y0), pixel(x0 + 1.0, y0), pixel(x0, y0 + 1.0), pixel(x0 + 1.0, y0 + 1.0)];
    std::array::from_fn(|i| {
        let above = a[i] + (b[i] - a[i]) * fx;
        let below = c[i] + (d[i] - c[i]) * fx;
        above + (below - above) * fy
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(layout: Layout, channels: Channels, resize: Resize) -> InputSpec {
        let (mean, std) = ([10.0, 20.0, 30.0], [1.0, 2.0, 4.0]);
        InputSpec {
            name: None,
            sizes: None,
            width: 4,
            height: 4,
            layout,
            channels,
            resize,
            scale: 1.0,
            mean,
            std,
        }
    }

    /// A frame of 8 x 4 pixels: red left, blue right.
    fn frame() -> Vec<u8> {
        let row = [[200, 0, 0].repeat(4), [0, 0, 100].repeat(4)].concat();
        row.repeat(4)
    }

    #[test]
    fn layouts_and_channels_put_values_where_they_say() {
        let rgb = frame();
        let frame = ImageView::new(8, 4, &rgb).unwrap();
        let (shape, planes) = values(&spec(Layout::Nchw, Channels::Rgb, Resize::Plain), &frame);
        assert_eq!(shape, [1, 3, 4, 4]);
        assert_eq!(planes[..4], [190.0, 190.0, -10.0, -10.0]);
        assert_eq!(planes[32..36], [-7.5, -7.5, 17.5, 17.5]);
        let (shape, pixels) = values(&spec(Layout::Nhwc, Channels::Bgr, Resize::Plain), &frame);
        assert_eq!(shape, [1, 4, 4, 3]);
        assert_eq!(pixels[..3], [-10.0, -10.0, (200.0 - 30.0) / 4.0]);
    }

    #[test]
    fn letterbox_keeps_proportions_and_boxes_come_back() {
        let rgb = frame();
        let frame = ImageView::new(8, 4, &rgb).unwrap();
        let boxed = spec(Layout::Nchw, Channels::Rgb, Resize::Letterbox);
        let (_, planes) = values(&boxed, &frame);
        let column: Vec<f32> = (0..4).map(|y| planes[4 * y] + 10.0).collect();
        assert_eq!(column, [BAR, 200.0, 200.0, BAR]);
        // The frame's right lower quarter.
        let fit = Fit::new(&boxed, &frame);
        assert_eq!(fit.to_frame([2.0, 2.0, 4.0, 3.0]), [4.0, 2.0, 8.0, 4.0]);
        let plain = Fit::new(&spec(Layout::Nchw, Channels::Rgb, Resize::Plain), &frame);
        assert_eq!(plain.to_frame([2.0, 2.0, 4.0, 4.0]), [4.0, 2.0, 8.0, 4.0]);
    }
}
