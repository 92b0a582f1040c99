//! Colour spaces.

/// Colours closer to grey than this (in Lab units) are grey: sensor noise and tinted cloth.
pub(super) const CHROMA_MIN: f32 = 8.0;

/// A colour in CIE L*a*b* (D65, 2° observer).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lab {
    /// Lightness, 0..=100.
    pub(super) l: f32,
    /// Green to red.
    pub(super) a: f32,
    /// Blue to yellow.
    pub(super) b: f32,
}

/// A colour whose chromatic part does not change when the light gets brighter or dimmer.
///
/// Scaling linear RGB by k scales each of `L + 16`, `a` and `b` by the cube root of k (outside the
/// short linear part near black). So `u = a / (L + 16)` and `v = b / (L + 16)` are the same for the
/// bright and the shaded face of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shade {
    /// Green to red, relative to lightness.
    pub(super) u: f32,
    /// Blue to yellow, relative to lightness.
    pub(super) v: f32,
    /// Lightness, 0..=100.
    pub(super) l: f32,
}

/// The direction of a colour from grey, in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hue(f32);

impl Hue {
    /// The hue of a colour.
    pub(super) fn of(lab: Lab) -> Self {
        Self(lab.b.atan2(lab.a).to_degrees())
    }

    /// How far it is to another hue, the shorter way round: from -180 to 180.
    pub(super) fn turn_to(self, other: Self) -> f32 {
        (other.0 - self.0 + 180.0).rem_euclid(360.0) - 180.0
    }
}

impl Lab {
    /// Converts from sRGB.
    ///
    /// Source: IEC 61966-2-1 and CIE 15:2004.
    pub(super) fn of([r, g, b]: [u8; 3]) -> Self {
        let [r, g, b] = [r, g, b].map(linear);
        let x = (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47;
        let y = 0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b;
        let z = (0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / 1.088_83;
        let [x, y, z] = [x, y, z].map(compress);
        Self { l: 116.0 * y - 16.0, a: 500.0 * (x - y), b: 200.0 * (y - z) }
    }

    /// Euclidean distance (CIE 1976).
    pub(super) fn distance(self, other: Self) -> f32 {
        let (l, a, b) = (self.l - other.l, self.a - other.a, self.b - other.b);
        (l * l + a * a + b * b).sqrt()
    }

    /// Distance from grey.
    pub(super) fn chroma(self) -> f32 {
        self.a.hypot(self.b)
    }
}

impl Shade {
    /// The shade of a colour.
    pub(super) fn of(lab: Lab) -> Self {
        let l = lab.l + 16.0;
        Self { u: lab.a / l, v: lab.b / l, l: lab.l }
    }

    /// Distance from grey in the chromatic plane.
    pub(super) fn saturation(self) -> f32 {
        self.u.hypot(self.v)
    }

    /// Distance of two shades; lightness counts `per_lightness` for each of its units.
    pub(super) fn distance(self, other: Self, per_lightness: f32) -> f32 {
        let l = (self.l - other.l) * per_lightness;
        let (u, v) = (self.u - other.u, self.v - other.v);
        (u * u + v * v + l * l).sqrt()
    }
}

fn linear(byte: u8) -> f32 {
    let c = f32::from(byte) / 255.0;
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

fn compress(t: f32) -> f32 {
    if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(rgb: [u8; 3], expect: [f32; 3]) {
        let lab = Lab::of(rgb);
        for (got, want) in [lab.l, lab.a, lab.b].into_iter().zip(expect) {
            assert!((got - want).abs() < 0.1, "{lab:?}, expected {expect:?}");
        }
    }

    #[test]
    fn known_colours() {
        check([255, 255, 255], [100.0, 0.0, 0.0]);
        check([255, 0, 0], [53.24, 80.09, 67.20]);
        check([0, 0, 255], [32.30, 79.19, -107.86]);
        check([0, 0, 0], [0.0, 0.0, 0.0]);
    }

    #[test]
    fn half_the_light_keeps_the_chromatic_part() {
        // sRGB bytes of one linear colour at full and at half brightness.
        let (full, half) = (Shade::of(Lab::of([200, 80, 40])), Shade::of(Lab::of([146, 57, 27])));
        assert!(full.distance(half, 0.0) < 0.02, "{full:?} {half:?}");
        assert!(full.l - half.l > 10.0);
    }
}
