//! Intervals of measured shares.

/// 95 % of the standard normal distribution lie within this many standard deviations.
const Z_95: f64 = 1.96;

/// Wilson's 95 % interval of a share (Wilson, 1927); everything for a share of nothing.
pub fn wilson_95(part: u32, whole: u32) -> [f64; 2] {
    if whole == 0 {
        return [0.0, 1.0];
    }
    let (n, share) = (f64::from(whole), f64::from(part) / f64::from(whole));
    let z2 = Z_95 * Z_95;
    let middle = share + z2 / (2.0 * n);
    let half = Z_95 * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    [middle - half, middle + half].map(|edge| (edge / (1.0 + z2 / n)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the interval's formula, computed by hand for 8 of 10.
    #[test]
    fn the_interval_is_wilsons() {
        let [low, high] = wilson_95(8, 10);
        assert!((low - 0.490).abs() < 1e-3 && (high - 0.943).abs() < 1e-3, "{low} {high}");
        assert_eq!(wilson_95(0, 0), [0.0, 1.0]);
        assert!(wilson_95(34, 34)[1] == 1.0 && wilson_95(0, 34)[0] == 0.0);
    }
}
