//! What is done to the pixels and the depth of a frame.

use groundloop_sim::Random;

use crate::messages::Frame;

/// How wide a band of noise is, in rows.
const BAND_ROWS: [f64; 2] = [4.0, 24.0];
/// Farthest distance that noise in depth tells, in metres.
const NOISE_DEPTH_M_MAX: f64 = 2.0;
/// Radius of a hole in the depth, as a share of the picture's width.
const HOLE_RADIUS: [f64; 2] = [0.01, 0.05];
/// Colour of a hand.
const SKIN: [f64; 3] = [222.0, 170.0, 136.0];
/// Height of the hand, and half the width of the forearm, by the width of the hand.
const HAND_HEIGHT: f64 = 1.3;
const FOREARM_HALF: f64 = 0.32;
/// Where the middle of the hand may be, by width and height of the picture.
const HAND_X: [f64; 2] = [0.2, 0.8];
const HAND_Y: [f64; 2] = [0.35, 0.75];
/// Distance of the hand by that of the nearest thing.
const HAND_NEARNESS: f64 = 0.6;
/// Distance of the hand where no depth is known, in metres.
const HAND_DEPTH_M: f32 = 0.3;
/// Exponent between sRGB values and light.
const GAMMA: f64 = 2.2;

/// Replaces bands of rows by noise.
pub(super) fn corrupt(frame: &mut Frame, share: f64, mut draws: Random) {
    let [columns, rows] = size(frame);
    let mut is_noise = vec![false; rows];
    let wanted = (share * rows as f64).ceil() as usize;
    while is_noise.iter().filter(|noise| **noise).count() < wanted {
        let n_rows = draws.between(BAND_ROWS[0], BAND_ROWS[1]) as usize;
        let first = draws.between(0.0, rows as f64) as usize;
        let last = (first + n_rows.min(wanted)).min(rows);
        is_noise[first.min(rows - 1)..last].fill(true);
    }
    for row in (0..rows).filter(|row| is_noise[*row]) {
        for value in &mut frame.rgb[3 * row * columns..3 * (row + 1) * columns] {
            *value = draws.between(0.0, 256.0) as u8;
        }
        for depth in depth(frame).get_mut(row * columns..(row + 1) * columns).into_iter().flatten()
        {
            *depth = draws.between(0.0, NOISE_DEPTH_M_MAX) as f32;
        }
    }
}

/// Spreads each pixel over a box of that radius.
pub(super) fn blur(frame: &mut Frame, radius: usize) {
    let [columns, rows] = size(frame);
    let source = frame.rgb.clone();
    for row in 0..rows {
        for channel in 0..3 {
            let start = 3 * row * columns + channel;
            spread((&source, &mut frame.rgb), (start, 3, columns), radius);
        }
    }
    let source = frame.rgb.clone();
    for start in 0..3 * columns {
        spread((&source, &mut frame.rgb), (start, 3 * columns, rows), radius);
    }
}

/// The means along one line of `n` values, `step` apart.
fn spread(
    (source, target): (&[u8], &mut [u8]),
    (start, step, n): (usize, usize, usize),
    radius: usize,
) {
    let at = |idx: usize| u32::from(source[start + step * idx]);
    let mut sum: u32 = (0..radius.min(n)).map(at).sum();
    for idx in 0..n {
        if idx + radius < n {
            sum += at(idx + radius);
        }
        if let Some(left) = idx.checked_sub(radius + 1) {
            sum -= at(left);
        }
        let n_values = (idx + radius).min(n - 1) + 1 - idx.saturating_sub(radius);
        target[start + step * idx] = (sum / n_values as u32) as u8;
    }
}

/// Multiplies the light of each pixel.
pub(super) fn expose(frame: &mut Frame, factor: f64) {
    let exposed = |value: usize| {
        let light = (value as f64 / 255.0).powf(GAMMA) * factor;
        (255.0 * light.powf(1.0 / GAMMA)).round().min(255.0) as u8
    };
    let table: Vec<u8> = (0..256).map(exposed).collect();
    for value in &mut frame.rgb {
        *value = table[usize::from(*value)];
    }
}

/// Puts a hand with a forearm before everything; it comes in from the left, the right or below.
pub(super) fn cover(frame: &mut Frame, width: f64, mut draws: Random) {
    let [columns, rows] = size(frame);
    let half_x = 0.5 * width * columns as f64;
    let half_y = HAND_HEIGHT * half_x;
    let hand = [
        draws.between(HAND_X[0], HAND_X[1]) * columns as f64,
        draws.between(HAND_Y[0], HAND_Y[1]) * rows as f64,
    ];
    let [below_x, side] = [draws.unit() * columns as f64, 3.0 * draws.unit()];
    let elbow = match side as u32 {
        0 => [0.0, rows as f64],
        1 => [columns as f64, rows as f64],
        _ => [below_x, 1.2 * rows as f64],
    };
    let nearest = depth(frame).iter().copied().filter(|metres| *metres > 0.0).reduce(f32::min);
    let hand_depth_m = nearest.map_or(HAND_DEPTH_M, |metres| metres * HAND_NEARNESS as f32);
    for pixel in 0..rows * columns {
        let at = [(pixel % columns) as f64, (pixel / columns) as f64];
        let [across, down] = [(at[0] - hand[0]) / half_x, (at[1] - hand[1]) / half_y];
        let in_hand = across * across + down * down;
        let in_arm = distance_to_line(at, hand, elbow) / (2.0 * FOREARM_HALF * half_x);
        if in_hand > 1.0 && in_arm > 1.0 {
            continue;
        }
        let shade = 1.0 - 0.3 * in_hand.min(in_arm * in_arm).min(1.0);
        for (channel, colour) in SKIN.into_iter().enumerate() {
            frame.rgb[3 * pixel + channel] = (shade * colour) as u8;
        }
        if let Some(metres) = depth(frame).get_mut(pixel) {
            *metres = hand_depth_m;
        }
    }
}

/// How far a pixel is from the line between two others.
fn distance_to_line(at: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let [along_x, along_y] = [to[0] - from[0], to[1] - from[1]];
    let [x, y] = [at[0] - from[0], at[1] - from[1]];
    let length_2 = (along_x * along_x + along_y * along_y).max(f64::MIN_POSITIVE);
    let share = ((x * along_x + y * along_y) / length_2).clamp(0.0, 1.0);
    (x - share * along_x).hypot(y - share * along_y)
}

/// Takes the depth out of round blobs, until so many pixels have none.
pub(super) fn pierce(frame: &mut Frame, share: f64, mut draws: Random) {
    let [columns, rows] = size(frame);
    let depth = depth(frame);
    if depth.len() != columns * rows {
        return;
    }
    let n_known = |depth: &[f32]| depth.iter().filter(|metres| **metres > 0.0).count();
    let mut left = ((share * depth.len() as f64).ceil() as usize).min(n_known(depth));
    while left > 0 {
        let radius = draws.between(HOLE_RADIUS[0], HOLE_RADIUS[1]) * columns as f64;
        let (x, y) = (draws.unit() * columns as f64, draws.unit() * rows as f64);
        for row in (y - radius).max(0.0) as usize..((y + radius) as usize + 1).min(rows) {
            let half = (radius * radius - (row as f64 - y).powi(2)).max(0.0).sqrt();
            let from = (x - half).max(0.0) as usize;
            let to = ((x + half) as usize + 1).min(columns);
            let blob = &mut depth[row * columns + from..row * columns + to];
            left = left.saturating_sub(n_known(blob));
            blob.fill(0.0);
        }
    }
}

fn depth(frame: &mut Frame) -> &mut [f32] {
    frame.depth_m.as_deref_mut().unwrap_or_default()
}

fn size(frame: &Frame) -> [usize; 2] {
    [frame.width as usize, frame.height as usize]
}
