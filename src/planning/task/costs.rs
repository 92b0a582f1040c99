//! Costs as whole numbers of a common unit: nothing is rounded.

use super::TaskError;
use crate::pddl::Number;

/// Most that an action may cost, in common units: a sum of two always fits.
const COST_UNITS_MAX: u64 = u64::MAX / 2;
/// Up to this cost the number 1 is a whole number of units, too, so that penalties are exact. A plan of
/// two million such steps still fits into 64 bits.
const ROOMY_COST_UNITS_MAX: u128 = 1 << 43;

/// Each cost as a multiple of a unit, and the unit.
pub(super) fn in_common_unit(costs: &[Number]) -> Result<(Vec<u64>, Number), TaskError> {
    let decimals = costs.iter().map(|cost| cost.decimals()).max().unwrap_or(0);
    let dearest = costs.iter().max().copied().unwrap_or_default();
    let range = |unit: u128| TaskError::CostRange {
        unit: Number::new(i128::try_from(unit).unwrap_or(0), decimals),
        cost: dearest,
        max: COST_UNITS_MAX,
    };
    let scaled = costs.iter().map(|cost| Some(u128::try_from(cost.scaled(decimals)?).unwrap_or(0)));
    let Some(scaled) = scaled.collect::<Option<Vec<u128>>>() else { return Err(range(1)) };
    let shared = scaled.iter().fold(0, |a, &b| gcd(a, b));
    let max = scaled.iter().max().copied().unwrap_or(0);
    let one = 10_u128.checked_pow(decimals).unwrap_or(1);
    let roomy = gcd(shared, one);
    let unit = if max / roomy <= ROOMY_COST_UNITS_MAX { roomy } else { shared };
    let units = scaled.iter().map(|cost| u64::try_from(cost / unit).ok());
    match units.map(|units| units.filter(|&n| n <= COST_UNITS_MAX)).collect::<Option<Vec<u64>>>() {
        None => Err(range(unit)),
        Some(units) => {
            Ok((units, Number::new(i128::try_from(unit).unwrap_or(i128::MAX), decimals)))
        }
    }
}

/// A whole number in units of cost, rounded up.
pub(super) fn in_units(whole: u32, unit: Number) -> u64 {
    let decimals = unit.decimals();
    let whole = Number::from(u64::from(whole)).scaled(decimals).unwrap_or(i128::MAX);
    let unit = unit.scaled(decimals).unwrap_or(1).max(1);
    u64::try_from((whole.unsigned_abs()).div_ceil(unit.unsigned_abs())).unwrap_or(u64::MAX)
}

fn gcd(a: u128, b: u128) -> u128 {
    let (mut a, mut b) = (a, b);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units(costs: &[&str]) -> Result<(Vec<u64>, String), String> {
        let costs: Vec<Number> = costs.iter().map(|text| Number::parse(text).unwrap()).collect();
        let common = in_common_unit(&costs);
        common.map(|(n, unit)| (n, unit.to_string())).map_err(|error| error.to_string())
    }

    #[test]
    fn costs_keep_every_digit() {
        assert_eq!(units(&["1.0004", "0.5001"]), Ok((vec![10004, 5001], "0.0001".to_owned())));
        assert_eq!(units(&["2.5", "4"]), Ok((vec![5, 8], "0.5".to_owned())));
        assert_eq!(units(&["4", "6"]), Ok((vec![4, 6], "1".to_owned())));
        assert_eq!(units(&["0", "0"]), Ok((vec![0, 0], "1".to_owned())));
        assert_eq!(units(&[]), Ok((vec![], "1".to_owned())));
        let tiny = ["12.345678901234567", "6.172839450617283"];
        let expected = vec![12_345_678_901_234_567, 6_172_839_450_617_283];
        assert_eq!(units(&tiny), Ok((expected, "0.000000000000001".to_owned())));
    }

    #[test]
    fn what_is_large_needs_a_large_unit() {
        let huge = ["30000000000000000000", "10000000000000000000"];
        assert_eq!(units(&huge), Ok((vec![3, 1], "10000000000000000000".to_owned())));
        let error = units(&["30000000000000000000", "0.1"]).unwrap_err();
        assert!(error.contains("of their common unit 0.1, got 30000000000000000000"), "{error}");
        let wide = units(&["1e37", "0.000000001"]).unwrap_err();
        assert!(wide.contains("got 10000000000000000000000000000000000000"), "{wide}");
    }

    #[test]
    fn penalties_are_whole_numbers_and_never_vanish() {
        assert_eq!(in_units(3, Number::parse("0.5").unwrap()), 6);
        assert_eq!(in_units(3, Number::from(1000)), 1);
        assert_eq!(in_units(0, Number::from(1000)), 0);
    }
}
