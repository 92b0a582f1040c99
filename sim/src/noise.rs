//! Sensor noise from tables: each row of a frame reads them from its own seeded place.

use crate::camera::NoiseSpec;
use crate::random::Random;

const TABLE_LEN: usize = 1 << 16;
/// Most values one row reads.
const ROW_LEN_MAX: usize = 3 * 4096;

/// Tables of normally distributed numbers.
#[derive(Debug, Clone)]
pub(crate) struct Noise {
    spec: NoiseSpec,
    rgb: Vec<i8>,
    depth_m: Vec<f32>,
}

impl Noise {
    /// The tables for a sensor; the same ones for equal sensors.
    pub(crate) fn new(spec: &NoiseSpec) -> Self {
        let mut random = Random::new(0, 3);
        let n = TABLE_LEN + ROW_LEN_MAX;
        let mut draw = |sigma: f64| random.normal() * sigma;
        let rgb = (0..n).map(|_| draw(spec.rgb_sigma).round().clamp(-127.0, 127.0) as i8);
        let rgb = rgb.collect();
        let depth_m = (0..n).map(|_| draw(spec.depth_sigma_m) as f32).collect();
        Self { spec: *spec, rgb, depth_m }
    }

    /// Whether these are the tables of a sensor.
    pub(crate) fn is_for(&self, spec: &NoiseSpec) -> bool {
        self.spec == *spec
    }

    /// Adds noise to an image with rows of `width` pixels. Depth 0 stays 0.
    pub(crate) fn add(&self, frame_seed: u64, width: usize, rgb: &mut [u8], depth_m: &mut [f32]) {
        let rows = rgb.chunks_exact_mut(3 * width).zip(depth_m.chunks_exact_mut(width));
        for (row, (colours, depths)) in (0_u64..).zip(rows) {
            let place = scramble(frame_seed ^ scramble(row));
            self.add_to_colours(place as usize % TABLE_LEN, colours);
            self.add_to_depths((place >> 32) as usize % TABLE_LEN, depths);
        }
    }

    fn add_to_colours(&self, start: usize, colours: &mut [u8]) {
        if self.spec.rgb_sigma > 0.0 {
            for (value, noise) in colours.iter_mut().zip(&self.rgb[start..]) {
                *value = (i16::from(*value) + i16::from(*noise)).clamp(0, 255) as u8;
            }
        }
    }

    fn add_to_depths(&self, start: usize, depths: &mut [f32]) {
        if self.spec.depth_sigma_m > 0.0 {
            for (value, noise) in depths.iter_mut().zip(&self.depth_m[start..]) {
                *value = if *value > 0.0 { *value + noise } else { 0.0 };
            }
        }
    }
}

/// Mixes the bits of a number (`SplitMix64`, Steele et al. 2014).
fn scramble(value: u64) -> u64 {
    let a = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let b = (a ^ (a >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let c = (b ^ (b >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    c ^ (c >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_the_size_asked_for_and_depends_on_the_seed() {
        let noise = Noise::new(&NoiseSpec { rgb_sigma: 2.0, depth_sigma_m: 0.001 });
        let image = |seed: u64| {
            let (mut rgb, mut depth) = (vec![100_u8; 3 * 320 * 240], vec![1.0_f32; 320 * 240]);
            noise.add(seed, 320, &mut rgb, &mut depth);
            (rgb, depth)
        };
        let (rgb, depth) = image(5);
        let sigma = |values: &mut dyn Iterator<Item = f64>| {
            let values: Vec<f64> = values.collect();
            (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
        };
        let rgb_sigma = sigma(&mut rgb.iter().map(|v| f64::from(*v) - 100.0));
        assert!((rgb_sigma - 2.0).abs() < 0.1, "{rgb_sigma}");
        let depth_sigma = sigma(&mut depth.iter().map(|v| f64::from(*v) - 1.0));
        assert!((depth_sigma - 0.001).abs() < 0.0001, "{depth_sigma}");
        assert_eq!(image(5), (rgb.clone(), depth));
        assert_ne!(image(6).0, rgb);
    }

    #[test]
    fn no_depth_stays_no_depth_and_colours_are_cut() {
        let noise = Noise::new(&NoiseSpec { rgb_sigma: 20.0, depth_sigma_m: 0.01 });
        let (mut rgb, mut depth) = (vec![255_u8; 3 * 64], vec![0.0_f32; 64]);
        noise.add(1, 64, &mut rgb, &mut depth);
        assert!(depth.iter().all(|d| *d == 0.0));
        assert!(rgb.iter().all(|v| *v > 150));
    }
}
