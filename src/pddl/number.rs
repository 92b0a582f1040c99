//! Decimal numbers, exactly as they are written.

use std::cmp::Ordering;
use std::fmt;

/// Most digits of a number, before and behind the point together.
pub const NUMBER_DIGITS_MAX: u32 = 38;

/// A decimal number without rounding: `mantissa / 10^decimals`.
///
/// Always in lowest terms, so that equal numbers are equal values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Number {
    mantissa: i128,
    decimals: u32,
}

impl Number {
    /// One.
    pub const ONE: Self = Self { mantissa: 1, decimals: 0 };

    /// `mantissa / 10^decimals`.
    pub fn new(mantissa: i128, decimals: u32) -> Self {
        let (mut mantissa, mut decimals) = (mantissa, decimals);
        while decimals > 0 && mantissa % 10 == 0 {
            (mantissa, decimals) = (mantissa / 10, decimals - 1);
        }
        Self { mantissa, decimals }
    }

    /// Reads `12`, `-0.5`, `.5` or `1.5e-3`; `None` for anything else, and for a number of more than
    /// [`NUMBER_DIGITS_MAX`] digits.
    pub fn parse(text: &str) -> Option<Self> {
        let (text, exponent) = match text.split_once(['e', 'E']) {
            Some((text, exponent)) => (text, exponent.parse::<i32>().ok()?),
            None => (text, 0),
        };
        let (is_negative, text) = match text.strip_prefix('-') {
            Some(text) => (true, text),
            None => (false, text),
        };
        let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
        let mut digits = whole.bytes().chain(fraction.bytes()).peekable();
        digits.peek()?;
        let fraction = fraction.trim_end_matches('0');
        let mut mantissa = 0_i128;
        for digit in whole.bytes().chain(fraction.bytes()) {
            let digit = digit.is_ascii_digit().then(|| i128::from(digit - b'0'))?;
            mantissa = mantissa.checked_mul(10)?.checked_add(digit)?;
        }
        let decimals = i32::try_from(fraction.len()).ok()?.checked_sub(exponent)?;
        if decimals.unsigned_abs() > NUMBER_DIGITS_MAX {
            return (mantissa == 0).then(Self::default);
        }
        let sign = if is_negative { -1 } else { 1 };
        let whole = mantissa.checked_mul(sign * 10_i128.checked_pow((-decimals).max(0) as u32)?)?;
        Some(Self::new(whole, decimals.max(0) as u32))
    }

    /// How many digits stand behind the point.
    pub fn decimals(self) -> u32 {
        self.decimals
    }

    /// How many units of `1 / 10^decimals` it has; `None` when that is no whole number, or too large.
    pub fn scaled(self, decimals: u32) -> Option<i128> {
        let shift = decimals.checked_sub(self.decimals)?;
        self.mantissa.checked_mul(10_i128.checked_pow(shift)?)
    }

    /// Whether it is below 0.
    pub fn is_negative(self) -> bool {
        self.mantissa < 0
    }

    /// Whether nothing stands behind the point.
    pub fn is_whole(self) -> bool {
        self.decimals == 0
    }

    /// The sum; `None` when it has too many digits.
    #[must_use]
    pub fn checked_add(self, other: Self) -> Option<Self> {
        let decimals = self.decimals.max(other.decimals);
        let sum = self.scaled(decimals)?.checked_add(other.scaled(decimals)?)?;
        Some(Self::new(sum, decimals))
    }

    /// So many times the number; `None` when that has too many digits.
    #[must_use]
    pub fn times(self, n: u64) -> Option<Self> {
        Some(Self::new(self.mantissa.checked_mul(i128::from(n))?, self.decimals))
    }

    /// The nearest number of double precision.
    pub fn to_f64(self) -> f64 {
        self.to_string().parse().unwrap_or(f64::NAN)
    }
}

impl From<u64> for Number {
    fn from(n: u64) -> Self {
        Self { mantissa: i128::from(n), decimals: 0 }
    }
}

impl Ord for Number {
    fn cmp(&self, other: &Self) -> Ordering {
        let decimals = self.decimals.max(other.decimals);
        match (self.scaled(decimals), other.scaled(decimals)) {
            (Some(own), Some(other)) => own.cmp(&other),
            // Only the one with fewer decimals can overflow: it is the larger one, but for its sign.
            (None, _) => self.mantissa.cmp(&0),
            (_, None) => 0.cmp(&other.mantissa),
        }
    }
}

impl PartialOrd for Number {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = self.mantissa.unsigned_abs().to_string();
        let sign = if self.mantissa < 0 { "-" } else { "" };
        let decimals = self.decimals as usize;
        if decimals == 0 {
            return write!(f, "{sign}{digits}");
        }
        let digits = format!("{digits:0>width$}", width = decimals + 1);
        let (whole, fraction) = digits.split_at(digits.len() - decimals);
        write!(f, "{sign}{whole}.{fraction}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str) -> Option<String> {
        Number::parse(text).map(|number| number.to_string())
    }

    #[test]
    fn numbers_are_kept_as_they_are_written() {
        for (text, expected) in [
            ("0", "0"),
            ("007.50", "7.5"),
            (".5", "0.5"),
            ("3.", "3"),
            ("-0.0006", "-0.0006"),
            ("1.5e-3", "0.0015"),
            ("2E3", "2000"),
            ("12.345678901234567", "12.345678901234567"),
            ("30000000000000000000", "30000000000000000000"),
            ("0e999", "0"),
        ] {
            assert_eq!(shown(text).as_deref(), Some(expected));
        }
        for text in ["", ".", "-", "1.2.3", "1e", "e5", "+1", "inf", "nan", "0x1", "1_0", "1e999"] {
            assert_eq!(shown(text), None, "{text}");
        }
        assert_eq!(shown(&"9".repeat(39)), None);
    }

    #[test]
    fn sums_and_order_are_exact() {
        let number = |text: &str| Number::parse(text).unwrap();
        let sum = number("6.172839450617283").checked_add(number("6.172839450617282")).unwrap();
        assert_eq!(sum.to_string(), "12.345678901234565");
        assert!(sum < number("12.345678901234567"));
        assert!(number(&"9".repeat(38)) > number("0.00000000000000000001"));
        assert!(number(&format!("-{}", "9".repeat(38))) < number("0.1"));
        assert_eq!(number(&"9".repeat(38)).checked_add(number("0.1")), None);
        assert_eq!(number("0.25").scaled(2), Some(25));
        assert_eq!(number("0.25").scaled(1), None);
        assert_eq!(number("0.25").times(4), Some(Number::ONE));
    }
}
