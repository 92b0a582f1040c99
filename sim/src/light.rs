//! Light on surfaces: a key light with a pool on the table, a weak fill light, the sky.

use nalgebra::{Point3, Vector3};

use crate::camera::LightSpec;
use crate::material::{Material, USUAL_GLOSS, USUAL_POLISH};
use crate::random::Random;

const KEY: f64 = 1.0;
const FILL: f64 = 0.19;
/// The key light falls off around the middle of the table, in metres.
const POOL_M: [f64; 2] = [0.3, 1.15];
const POOL_DEPTH: f64 = 0.5;
/// The table fades into the backdrop between these y, in metres.
const HAZE_M: [f64; 2] = [0.35, 1.1];

/// How a surface reflects the key light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Finish {
    gloss: f64,
    power: i32,
}

impl Finish {
    /// That of a material; without one the usual.
    pub(crate) fn of(material: Option<&Material>) -> Self {
        let gloss = material.map_or(USUAL_GLOSS, |material| material.gloss);
        let power = material.map_or(USUAL_POLISH, |material| material.polish);
        Self { gloss, power: i32::from(power) }
    }
}

/// The light of one camera.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Light {
    /// Unit vector towards the key light, world frame.
    pub(crate) to_key: Vector3<f64>,
    intensity: f64,
}

impl Light {
    /// Draws the light from its ranges.
    pub(crate) fn of(spec: &LightSpec) -> Self {
        let mut random = Random::new(spec.seed, 2);
        let mut draw = |[low, high]: [f64; 2]| random.between(low, high);
        let intensity = draw(spec.intensity);
        let (azimuth, elevation) =
            (draw(spec.azimuth_deg).to_radians(), draw(spec.elevation_deg).to_radians());
        let level = elevation.cos();
        let to_key = Vector3::new(level * azimuth.cos(), level * azimuth.sin(), elevation.sin());
        Self { to_key, intensity }
    }

    /// Light that no shadow takes away: sky, bounce from the table and the fill light.
    pub(crate) fn ambient(&self, normal: &Vector3<f64>) -> f64 {
        let fill = Vector3::new(0.62, -0.74, 0.25).dot(normal).max(0.0);
        self.intensity * (0.22 + 0.08 * normal.z + FILL * fill)
    }

    /// Light of the key light where it is not shadowed.
    pub(crate) fn direct(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let facing = self.to_key.dot(normal).max(0.0);
        let pool = 1.0 - POOL_DEPTH * smooth(POOL_M, point.coords.xy().norm());
        self.intensity * KEY * pool * facing
    }

    /// Reflection of the key light towards the eye (Blinn 1977).
    pub(crate) fn highlight(
        &self,
        point: &Point3<f64>,
        normal: &Vector3<f64>,
        eye: &Point3<f64>,
        finish: Finish,
    ) -> f64 {
        if self.to_key.dot(normal) <= 0.0 {
            return 0.0;
        }
        let between = ((eye - point).normalize() + self.to_key).normalize();
        self.intensity * finish.gloss * between.dot(normal).max(0.0).powi(finish.power)
    }
}

/// How much of the backdrop's haze lies over a point of the table.
pub(crate) fn haze(point: &Point3<f64>) -> f64 {
    smooth(HAZE_M, point.y)
}

/// 0 below the range, 1 above it, smooth between.
fn smooth([low, high]: [f64; 2], value: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The linear value of an sRGB byte (IEC 61966-2-1).
pub(crate) fn linear(byte: u8) -> f32 {
    let value = f32::from(byte) / 255.0;
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// From linear values to sRGB bytes by table.
#[derive(Debug, Clone)]
pub(crate) struct Gamma(Vec<u8>);

impl Gamma {
    const LAST: f32 = 4095.0;

    pub(crate) fn new() -> Self {
        let byte = |k: u16| {
            let value = f32::from(k) / Self::LAST;
            let encoded = if value <= 0.003_130_8 {
                12.92 * value
            } else {
                1.055 * value.powf(1.0 / 2.4) - 0.055
            };
            (255.0 * encoded).round() as u8
        };
        Self((0..=Self::LAST as u16).map(byte).collect())
    }

    /// The byte for a linear value; what is out of 0 to 1 is cut.
    pub(crate) fn encode(&self, value: f32) -> u8 {
        self.0[(value * Self::LAST).clamp(0.0, Self::LAST) as usize]
    }
}
