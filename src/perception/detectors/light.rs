//! The light and the noise of a frame, relative to the labelled example.
//!
//! The ground is most of a picture, and it is the same in example and frame unless somebody has
//! changed it. So the median of each channel says how the light differs: a gain per channel (von
//! Kries, 1902). What no light would do to a ground is another ground, and is left alone.

use super::lab::{CHROMA_MIN, Lab, Shade};
use super::median::{median, median_rgb};
use crate::perception::ImageView;

/// About how many pixels are looked at.
const SAMPLES: usize = 4096;
/// About how many are looked at to tell lights apart: things are a small part of a picture.
const THING_SAMPLES: usize = 32_768;
/// The rim of a picture, as a share of its sides: ground, where the camera looks at the objects.
const RIM_SHARE: f64 = 0.15;

/// A ground this many times as bright, or as dark, as the example's is another ground.
const BRIGHTNESS_RATIO_MAX: f64 = 2.5;
/// Gains that differ from each other by more than this are another ground, not another light.
const GAIN_MAX: f64 = 1.75;
/// Gains below this are within what a camera's own balance does from picture to picture.
const GAIN_MIN: f64 = 1.05;
/// Contrasts around middle grey that are tried, as a camera's or a converter's setting.
const CONTRASTS: [f64; 5] = [0.6, 0.8, 1.0, 1.25, 1.5];
/// With a contrast undone the ground is this many times as bright as in the example at most.
const TONED_RATIO_MAX: f64 = 1.5;
/// A correction must explain so many times as much as the frame as it is.
const BETTER_MIN: f64 = 1.05;
/// A colour is like a shade up to this distance.
pub(super) const LIKE_MAX: f32 = 0.1;
/// Bits of each channel that tell colours apart when lights are.
const HISTOGRAM_BITS: u32 = 5;
/// Values this near to black or white may have been cut off.
const CLIPPED: f64 = 3.0;
/// A pixel that differs from the ground by more than this in some channel is no ground.
const OFF_GROUND: f64 = 20.0;

/// About how many pixels of the ground are compared with its colour.
const GROUND_SAMPLES: usize = 1024;
/// Colours up to so many times the ground's own spread from its colour are ground,
const GROUND_SPREADS: f32 = 4.0;
/// but at least and at most so far (in Lab units).
const GROUND_DISTANCE: [f32; 2] = [4.0, 11.0];
/// So are those of its shade, to so many times its spread, but at least and at most this: folds and
/// shadows.
const GROUND_SHADE_DISTANCE: [f32; 2] = [0.02, 0.08];

/// Noise that is not smoothed, as a standard deviation: what sensors and textures have anyway.
const NOISE_FLOOR: f64 = 3.0;
/// Most passes of the filter, each with a standard deviation of one pixel.
const PASSES_MAX: usize = 8;

/// Light and noise of one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Light {
    /// Median of each channel: the ground's colour.
    ground: [f64; 3],
    /// Standard deviation of the noise, from differences of neighbours.
    noise: f64,
}

impl Light {
    /// Median of each channel: the ground's colour.
    pub(super) fn ground(&self) -> [f64; 3] {
        self.ground
    }

    /// Measures a picture.
    pub(super) fn of(image: &ImageView<'_>) -> Self {
        let (width, height) = (image.width(), image.height());
        let step = (width * height / SAMPLES).max(1);
        let mut differences = Vec::new();
        for i in (0..width * height).step_by(step) {
            let (x, y) = (i % width, i / width);
            let Some(here) = image.pixel(x, y) else { continue };
            if let Some(next) = image.pixel(x + 1, y) {
                differences.extend(here.iter().zip(next).map(|(a, b)| a.abs_diff(b)));
            }
        }
        let pixels = rim(image, SAMPLES);
        let ground = median_rgb(&pixels).unwrap_or_default().map(f64::from);
        // The median of |a - b| is 0.954 standard deviations where both are Gaussian.
        Self { ground, noise: f64::from(median(differences, u8::cmp).unwrap_or(0)) / 0.954 }
    }

    /// The light of several pictures of one camera.
    pub(super) fn mean(lights: &[Self]) -> Option<Self> {
        let n = lights.len() as f64;
        let mean = |of: &dyn Fn(&Self) -> f64| lights.iter().map(of).sum::<f64>() / n;
        (!lights.is_empty()).then(|| Self {
            ground: [0, 1, 2].map(|channel| mean(&|light| light.ground[channel])),
            noise: mean(&|light| light.noise),
        })
    }

    /// What may have happened to the light, as corrections: first none, then one for each contrast.
    /// Brightness is left as it is.
    fn corrections_to(&self, example: &Self) -> Vec<Correction> {
        let mut found = vec![Correction::default()];
        for contrast in CONTRASTS {
            let toned = Correction { contrast, ..Correction::default() };
            let ground = [0, 1, 2].map(|channel| toned.value(channel, self.ground[channel]));
            let ratios = [0, 1, 2].map(|c| (example.ground[c] + 0.5) / (ground[c] + 0.5));
            let brightness = ratios.iter().product::<f64>().cbrt();
            let gains = ratios.map(|ratio| ratio / brightness);
            let ratio_max = if contrast == 1.0 { BRIGHTNESS_RATIO_MAX } else { TONED_RATIO_MAX };
            if farthest_from_one(&[brightness]) > ratio_max || farthest_from_one(&gains) > GAIN_MAX
            {
                continue; // another ground
            }
            let darkest = ground.iter().copied().fold(f64::INFINITY, f64::min);
            let is_felt = farthest_from_one(&gains) >= GAIN_MIN.max(1.0 + 1.0 / (darkest + 0.5));
            let gains = if is_felt && !self.is_clipped() { gains } else { [1.0; 3] };
            found.push(Correction { contrast, gains });
        }
        // A ground that is cut off here and not in the example tells what has cut it off.
        let cuts_off = |c: &Correction| c.of_example(example.ground).iter().any(|v| is_cut_off(*v));
        if self.is_clipped() && !example.is_clipped() && found.iter().any(cuts_off) {
            found.retain(cuts_off);
        }
        found
    }

    /// Whether the ground is too dark or too bright for its channels to be compared.
    fn is_clipped(&self) -> bool {
        self.ground.iter().any(|v| is_cut_off(*v))
    }

    /// Whether the ground looks as it does in the example, so that nothing needs to be corrected.
    fn is_like(&self, example: &Self) -> bool {
        let off = [0, 1, 2].map(|c| (example.ground[c] + 4.0) / (self.ground[c] + 4.0));
        farthest_from_one(&off) < GAIN_MIN
    }

    /// How often the frame is to be smoothed: so often that its noise sinks to the floor, or to
    /// what the example has.
    pub(super) fn passes(&self, example: Option<&Self>) -> usize {
        let floor = example.map_or(NOISE_FLOOR, |example| example.noise.max(NOISE_FLOOR));
        if self.noise <= 1.5 * floor {
            return 0;
        }
        // Smoothing by s pixels leaves 1 / (2 √π s) of white noise: s = σ / (3.54 floor).
        let s = self.noise / (3.54 * floor);
        ((s * s).ceil() as usize).min(PASSES_MAX)
    }
}

/// About `n` pixels of the rim of a picture, or fewer.
fn rim(image: &ImageView<'_>, n: usize) -> Vec<[u8; 3]> {
    let (width, height) = (image.width(), image.height());
    let rim = [width, height].map(|side| (RIM_SHARE * side as f64).ceil() as usize);
    let step = (width * height / n).max(1);
    let places = (0..width * height).step_by(step).map(|i| (i % width, i / width));
    let is_rim = |(x, y): &(usize, usize)| {
        *x.min(&(width - 1 - x)) < rim[0] || *y.min(&(height - 1 - y)) < rim[1]
    };
    places.filter(is_rim).filter_map(|(x, y)| image.pixel(x, y)).collect()
}

/// Colours that are about the same as one, with how many there are.
fn histogram<'a>(colours: impl Iterator<Item = &'a [u8; 3]>) -> Vec<(f64, [u8; 3])> {
    let mut bins = vec![[0_u32; 4]; 1 << (3 * HISTOGRAM_BITS)];
    let mut used = Vec::new();
    for rgb in colours {
        let [r, g, b] = rgb.map(|v| usize::from(v >> (8 - HISTOGRAM_BITS)));
        let at = r << (2 * HISTOGRAM_BITS) | g << HISTOGRAM_BITS | b;
        let [n, sums @ ..] = &mut bins[at];
        if *n == 0 {
            used.push(at);
        }
        *n += 1;
        for (sum, v) in sums.iter_mut().zip(rgb) {
            *sum += u32::from(*v);
        }
    }
    let mean = |at: usize| {
        let [n, sums @ ..] = bins[at];
        (f64::from(n), sums.map(|sum| (sum / n) as u8))
    };
    used.into_iter().map(mean).collect()
}

/// How much a colour is like one of these shades, in any brightness: from 0 to 1.
pub(super) fn likeness(shades: impl Iterator<Item = Shade>, rgb: [u8; 3]) -> f64 {
    let lab = Lab::of(rgb);
    if lab.chroma() < CHROMA_MIN {
        return 0.0;
    }
    let shade = Shade::of(lab);
    let nearest = shades.map(|known| shade.distance(known, 0.0)).fold(f32::INFINITY, f32::min);
    f64::from((1.0 - nearest / LIKE_MAX).max(0.0))
}

/// Whether a value is so near to black or white that it may have been beyond.
fn is_cut_off(value: f64) -> bool {
    !(CLIPPED..=255.0 - CLIPPED).contains(&value)
}

/// How far a number is from 1 as a factor: the largest of `v` and `1 / v`.
fn farthest_from_one(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |most: f64, v| most.max(*v).max(1.0 / v))
}

/// What is done to a frame's values so that they look as in the example's light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Correction {
    /// The contrast around middle grey that the frame has and the example has not.
    contrast: f64,
    /// What each channel is multiplied by.
    gains: [f64; 3],
}

impl Default for Correction {
    fn default() -> Self {
        Self { contrast: 1.0, gains: [1.0; 3] }
    }
}

impl Correction {
    fn value(&self, channel: usize, value: f64) -> f64 {
        (((value - 128.0) / self.contrast + 128.0) * self.gains[channel]).clamp(0.0, 255.0)
    }

    /// What a colour of the example looks like in the frame.
    fn of_example(&self, rgb: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|c| (rgb[c] / self.gains[c] - 128.0) * self.contrast + 128.0)
    }

    fn of(&self, rgb: [u8; 3]) -> [u8; 3] {
        [0, 1, 2].map(|channel| self.value(channel, f64::from(rgb[channel])).round() as u8)
    }
}

/// A frame in the example's light and with at most its noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Normalised<'a> {
    /// The pixels.
    pub(super) image: ImageView<'a>,
    /// What they lie on.
    pub(super) ground: Ground,
}

/// The colour of a frame's ground and how much it varies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ground {
    /// Median of each channel.
    pub(super) rgb: [u8; 3],
    /// Colours closer than this are ground (in Lab units),
    distance_max: f32,
    /// and shades closer than this.
    shade_distance_max: f32,
}

impl Ground {
    /// The ground of a picture: what its rim is like.
    fn of(image: &ImageView<'_>) -> Self {
        let pixels = rim(image, GROUND_SAMPLES);
        let rgb = median_rgb(&pixels).unwrap_or_default();
        let (colour, shade) = (Lab::of(rgb), Shade::of(Lab::of(rgb)));
        let colours: Vec<Lab> = pixels.iter().map(|rgb| Lab::of(*rgb)).collect();
        let within = |spread: f32, [least, most]: [f32; 2], unit: f32| {
            // In steps, so that frames of one scene share a table.
            ((GROUND_SPREADS * spread).clamp(least, most) / unit).round() * unit
        };
        let middle = |values| median(values, f32::total_cmp).unwrap_or(0.0);
        let spread = middle(colours.iter().map(|lab| lab.distance(colour)).collect());
        let shades = colours.iter().map(|lab| Shade::of(*lab).distance(shade, 0.0));
        let shade_spread = middle(shades.collect());
        Self {
            rgb,
            distance_max: within(spread, GROUND_DISTANCE, 1.0),
            shade_distance_max: within(shade_spread, GROUND_SHADE_DISTANCE, 0.01),
        }
    }

    /// Another colour that varies as much.
    pub(super) fn with_colour(self, rgb: [u8; 3]) -> Self {
        Self { rgb, ..self }
    }

    /// Says of every colour whether it is near the ground's, brightness included.
    pub(super) fn is_near(&self) -> impl Fn([u8; 3]) -> bool {
        let (colour, distance_max) = (Lab::of(self.rgb), self.distance_max);
        move |rgb| Lab::of(rgb).distance(colour) < distance_max
    }

    /// Says of every colour whether it is the ground's, or the ground's in less light.
    pub(super) fn is_lit_or_shaded(&self) -> impl Fn(Lab) -> bool {
        let is_like = self.is_like();
        let l_max = Lab::of(self.rgb).l + self.distance_max;
        move |lab| lab.l <= l_max && is_like(lab)
    }

    /// Says of every colour whether it is like the ground's, in whatever light.
    pub(super) fn is_like(&self) -> impl Fn(Lab) -> bool {
        let ground = *self;
        let colour = Lab::of(ground.rgb);
        let shade = Shade::of(colour);
        move |lab| {
            lab.distance(colour) < ground.distance_max
                || Shade::of(lab).distance(shade, 0.0) < ground.shade_distance_max
        }
    }
}

/// Memory for a frame, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Normaliser {
    rgb: Vec<u8>,
    rows: Vec<u8>,
}

impl Normaliser {
    /// The frame as it would look in the example's light. `likeness` says from 0 to 1 how much a
    /// colour is like one of the example's objects: of the corrections that the ground allows that
    /// one is taken which makes the frame's things most like them.
    pub(super) fn view<'a>(
        &'a mut self,
        image: &ImageView<'a>,
        example: Option<&Light>,
        likeness: &dyn Fn([u8; 3]) -> f64,
    ) -> Normalised<'a> {
        let light = Light::of(image);
        let passes = light.passes(example);
        if passes == 0 && example.is_none_or(|example| light.is_like(example)) {
            return Normalised { image: *image, ground: Ground::of(image) };
        }
        self.rgb.clear();
        for y in 0..image.height() {
            self.rgb.extend_from_slice(image.row(y));
        }
        for _ in 0..passes {
            smooth(&mut self.rgb, &mut self.rows, image.width());
        }
        let correction = example
            .filter(|example| !light.is_like(example))
            .map(|example| self.best(&light, example, likeness))
            .unwrap_or_default();
        if correction != Correction::default() {
            let table: [[u8; 3]; 256] = std::array::from_fn(|v| correction.of([v as u8; 3]));
            for pixel in self.rgb.as_chunks_mut::<3>().0 {
                for (channel, value) in pixel.iter_mut().enumerate() {
                    *value = table[usize::from(*value)][channel];
                }
            }
        }
        let view = ImageView::new(image.width(), image.height(), &self.rgb);
        let image = view.unwrap_or(*image);
        Normalised { image, ground: Ground::of(&image) }
    }

    /// The correction that makes the things in the frame most like the example's.
    fn best(
        &self,
        light: &Light,
        example: &Light,
        likeness: &dyn Fn([u8; 3]) -> f64,
    ) -> Correction {
        let pixels = self.rgb.as_chunks::<3>().0;
        let is_thing = |rgb: &&[u8; 3]| {
            rgb.iter().zip(light.ground).any(|(v, g)| (f64::from(*v) - g).abs() > OFF_GROUND)
        };
        let step = (pixels.len() / THING_SAMPLES).max(1);
        let things = histogram(pixels.iter().step_by(step).filter(is_thing));
        let explained = |correction: &Correction| {
            things.iter().map(|(n, rgb)| n * likeness(correction.of(*rgb))).sum::<f64>()
        };
        let corrections = light.corrections_to(example);
        let none = Correction::default();
        let as_it_is =
            if corrections.contains(&none) { explained(&none) * BETTER_MIN } else { -1.0 };
        let rated = corrections.iter().map(|correction| (explained(correction), *correction));
        let best = rated.reduce(|best, next| if next.0 > best.0 { next } else { best });
        best.filter(|(explained, _)| *explained > as_it_is).map(|(_, c)| c).unwrap_or_default()
    }
}

/// One pass of the binomial filter 1 4 6 4 1 in both directions: a standard deviation of one pixel.
/// The picture's edge is repeated.
fn smooth(rgb: &mut [u8], rows: &mut Vec<u8>, width: usize) {
    let stride = 3 * width;
    let height = rgb.len() / stride.max(1);
    rows.clear();
    rows.resize(rgb.len(), 0);
    for y in 0..height {
        let row = |dy: isize| {
            let y = y.saturating_add_signed(dy).min(height - 1);
            &rgb[y * stride..][..stride]
        };
        let taps = [row(-2), row(-1), row(0), row(1), row(2)];
        for (i, out) in rows[y * stride..][..stride].iter_mut().enumerate() {
            *out = weighted(taps.map(|tap| tap[i]));
        }
    }
    for (from, to) in rows.chunks_exact(stride).zip(rgb.chunks_exact_mut(stride)) {
        smooth_row(from, to);
    }
}

/// One row: what is away from the edges goes without looking where they are, many values at once.
fn smooth_row(from: &[u8], to: &mut [u8]) {
    let (n, reach) = (from.len(), 2 * 3);
    let inner = to.iter_mut().skip(reach).take(n.saturating_sub(2 * reach));
    let taps = from.iter().zip(&from[3.min(n)..]).zip(&from[6.min(n)..]);
    let taps = taps.zip(&from[9.min(n)..]).zip(&from[12.min(n)..]);
    for (out, ((((a, b), c), d), e)) in inner.zip(taps) {
        *out = weighted([*a, *b, *c, *d, *e]);
    }
    let width = n / 3;
    for x in (0..width).filter(|x| *x < 2 || x + 2 >= width) {
        let columns = [x.saturating_sub(2), x.saturating_sub(1), x, x + 1, x + 2];
        for channel in 0..3 {
            to[3 * x + channel] =
                weighted(columns.map(|column| from[3 * column.min(width - 1) + channel]));
        }
    }
}

fn weighted(taps: [u8; 5]) -> u8 {
    let [a, b, c, d, e] = taps.map(u16::from);
    ((a + 4 * b + 6 * c + 4 * d + e + 8) >> 4) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(ground: [f64; 3]) -> Light {
        Light { ground, noise: 1.0 }
    }

    /// The gains that a ground allows at unchanged contrast; none where it is another ground.
    fn gains(ground: [f64; 3], example: [f64; 3]) -> Option<[f64; 3]> {
        let corrections = light(ground).corrections_to(&light(example));
        corrections.iter().skip(1).find(|c| c.contrast == 1.0).map(|c| c.gains)
    }

    #[test]
    fn another_light_is_undone_and_another_ground_is_left_alone() {
        let example = [60.0, 62.0, 66.0];
        assert!(light(example).is_like(&light(example)));
        assert_eq!(gains([36.0, 37.0, 40.0], example), Some([1.0; 3]), "only darker");
        let [r, g, b] = gains([69.0, 62.0, 53.0], example).unwrap();
        assert!(r < 0.95 && b > 1.15 && (0.95..1.05).contains(&g), "{r} {g} {b}");
        assert_eq!(gains([205.0, 190.0, 160.0], example), None, "beige");
        assert_eq!(gains([52.0, 78.0, 160.0], [60.0; 3]), None, "blue");
    }

    #[test]
    fn noise_is_measured_and_smoothed() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let mut rgb = Vec::new();
        for _ in 0..3 * 64 * 64 {
            let normal: f64 = (0..12).map(|_| next()).sum::<f64>() - 6.0;
            rgb.push((100.0 + 10.0 * normal).round() as u8);
        }
        let image = ImageView::new(64, 64, &rgb).unwrap();
        let before = Light::of(&image);
        assert!((9.0..11.5).contains(&before.noise), "{before:?}");
        let mut buffer = Normaliser::default();
        let after = Light::of(&buffer.view(&image, None, &|_| 0.0).image);
        assert!(after.noise <= NOISE_FLOOR, "{after:?}");
        assert!((after.ground[0] - before.ground[0]).abs() <= 2.0, "{before:?} {after:?}");
    }

    /// The picture's edge is repeated, and rows may be shorter than the filter.
    #[test]
    fn rows_of_any_width_are_smoothed_alike() {
        for width in 1..9_usize {
            let from: Vec<u8> = (0..3 * width).map(|i| (i * i * 37 % 251) as u8).collect();
            let mut to = vec![0; from.len()];
            smooth_row(&from, &mut to);
            for (i, got) in to.iter().enumerate() {
                let column = |dx: isize| (i / 3).saturating_add_signed(dx).min(width - 1);
                let taps = [-2, -1, 0, 1, 2].map(|dx| from[3 * column(dx) + i % 3]);
                assert_eq!(*got, weighted(taps), "{width} {i}");
            }
        }
    }
}
