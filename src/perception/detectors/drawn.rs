//! Drawn pictures for tests.

use crate::geometry::PixelBox;
use crate::perception::ImageView;
use crate::perception::model::ObjectBox;

/// A picture of filled rectangles on a plain ground.
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) rgb: Vec<u8>,
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize, ground: [u8; 3]) -> Self {
        Self { width, rgb: ground.repeat(width * height) }
    }

    pub(super) fn fill(&mut self, [x1, y1, x2, y2]: [usize; 4], rgb: [u8; 3]) -> &mut Self {
        for (y, x) in (y1..y2).flat_map(|y| (x1..x2).map(move |x| (y, x))) {
            let at = 3 * (y * self.width + x);
            self.rgb[at..at + 3].copy_from_slice(&rgb);
        }
        self
    }

    /// Adds noise of a few steps to every channel.
    pub(super) fn noisy(mut self) -> Self {
        let mut state = 1_u32;
        for byte in &mut self.rgb {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *byte = byte.saturating_add((state >> 29) as u8).saturating_sub(4);
        }
        self
    }

    pub(super) fn view(&self) -> ImageView<'_> {
        ImageView::new(self.width, self.rgb.len() / 3 / self.width, &self.rgb).unwrap()
    }
}

pub(super) const RED: [u8; 3] = [200, 45, 40];
pub(super) const BLUE: [u8; 3] = [40, 90, 200];
pub(super) const YELLOW: [u8; 3] = [230, 195, 45];
pub(super) const CLOTH: [u8; 3] = [42, 43, 46];

/// A red block on a blue one and a yellow one beside them, 30 pixels wide.
pub(super) fn blocks(ground: [u8; 3]) -> Canvas {
    let mut canvas = Canvas::new(320, 240, ground);
    canvas.fill([60, 140, 90, 170], RED).fill([60, 170, 90, 200], BLUE);
    canvas.fill([220, 170, 250, 200], YELLOW);
    canvas
}

pub(super) const BLOCK_LABELS: [(&str, &str, [f64; 4]); 3] = [
    ("red_block", "block", [60.0, 140.0, 90.0, 170.0]),
    ("blue_block", "block", [60.0, 170.0, 90.0, 200.0]),
    ("yellow_block", "block", [220.0, 170.0, 250.0, 200.0]),
];

/// Labels as the objects that they speak of: name, type, box.
pub(super) fn labelled(labels: &[(&str, &str, [f64; 4])]) -> Vec<ObjectBox> {
    let object = |(name, type_name, edges): &(&str, &str, [f64; 4])| {
        ObjectBox::new((*name).into(), (*type_name).into(), PixelBox::from(*edges))
    };
    labels.iter().map(object).collect()
}
