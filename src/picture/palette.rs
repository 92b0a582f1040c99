//! The colours of a picture, as sRGB bytes.

/// Behind a frame that does not fill its place.
pub(super) const BACKDROP: [u8; 3] = [22, 24, 29];
/// Behind the text of the panel.
pub(super) const PANEL: [u8; 3] = [17, 19, 24];
/// Lines between parts of the panel.
pub(super) const RULE: [u8; 3] = [44, 49, 59];
/// Under text and lines that lie on the frame.
pub(super) const SHADE: [u8; 3] = [10, 11, 14];
/// Main text.
pub(super) const TEXT: [u8; 3] = [233, 236, 241];
/// Text of less weight.
pub(super) const MUTED: [u8; 3] = [142, 151, 166];
/// What happens now.
pub(super) const ACCENT: [u8; 3] = [94, 214, 186];
/// What is not known.
pub(super) const DOUBT: [u8; 3] = [240, 190, 92];
/// What is wrong.
pub(super) const WRONG: [u8; 3] = [255, 77, 77];
/// What is missing.
pub(super) const MISSING: [u8; 3] = [176, 182, 193];
/// Objects without a colour.
pub(super) const NEUTRAL: [u8; 3] = [200, 205, 214];

/// Edge colours, one per predicate in order of first appearance.
const EDGES: [[u8; 3]; 5] =
    [[255, 255, 255], [124, 207, 255], [255, 205, 112], [203, 176, 255], [150, 235, 170]];

/// The colour of the n-th predicate.
pub(super) fn edge(predicate_idx: usize) -> [u8; 3] {
    EDGES[predicate_idx % EDGES.len()]
}

/// The colour moved towards white until it can be told from a dark ground.
pub(super) fn lighten(colour: [u8; 3]) -> [u8; 3] {
    let brightest = colour.iter().copied().max().unwrap_or(0);
    let part = if brightest < 150 { 0.55 } else { 0.25 };
    colour.map(|channel| (f32::from(channel) + (255.0 - f32::from(channel)) * part) as u8)
}
