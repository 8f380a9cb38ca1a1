//! Decimal stamps read exactly, without a detour through floating point.

/// Largest stamp in nanoseconds, about the year 2096: differences of two stamps then never overflow.
pub(super) const LARGEST_STAMP: i128 = 4_000_000_000_000_000_000;

/// Why a text is not a stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StampFault {
    /// Not a decimal number.
    NotANumber,
    /// A number, but beyond the range of stamps: the unit is another one.
    OutOfRange,
}

/// Reads a decimal number (sign, digits, point, exponent) times `10^shift`, rounded to the nearest integer.
///
/// An f64 holds 1305031098.665912 s only to 0.2 microseconds, and two stamps may collapse into one; decimal
/// arithmetic keeps every digit.
pub(crate) fn decimal(text: &str, shift: i32) -> Result<i64, StampFault> {
    if let Some(value) = short_decimal(text.as_bytes(), shift) {
        return Ok(value);
    }
    let (negative, unsigned) = match text.as_bytes().first() {
        Some(b'-') => (true, &text[1..]),
        Some(b'+') => (false, &text[1..]),
        _ => (false, text),
    };
    let (mantissa, exponent) = match unsigned.find(['e', 'E']) {
        Some(at) => {
            let exponent: i32 = unsigned[at + 1..]
                .parse()
                .map_err(|_| StampFault::NotANumber)?;
            if exponent.abs() > 40 {
                return Err(StampFault::OutOfRange);
            }
            (&unsigned[..at], exponent)
        }
        None => (unsigned, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = whole.len() + fraction.len();
    if digits == 0
        || !whole
            .bytes()
            .chain(fraction.bytes())
            .all(|byte| byte.is_ascii_digit())
    {
        return Err(StampFault::NotANumber);
    }
    let mut value: i128 = 0;
    for digit in whole.bytes().chain(fraction.bytes()) {
        value = value.checked_mul(10).ok_or(StampFault::OutOfRange)? + i128::from(digit - b'0');
        if value > i128::MAX / 100 {
            return Err(StampFault::OutOfRange);
        }
    }
    let power = exponent + shift - fraction.len() as i32;
    if value != 0 && power > 0 {
        let factor = 10_i128
            .checked_pow(power.unsigned_abs())
            .ok_or(StampFault::OutOfRange)?;
        value = value.checked_mul(factor).ok_or(StampFault::OutOfRange)?;
    } else if power < 0 {
        value = match 10_i128.checked_pow(power.unsigned_abs()) {
            Some(divisor) => (value + divisor / 2) / divisor,
            None => 0,
        };
    }
    if value > LARGEST_STAMP {
        return Err(StampFault::OutOfRange);
    }
    Ok(if negative { -value } else { value } as i64)
}

/// The same for the numbers that files are full of.
fn short_decimal(text: &[u8], shift: i32) -> Option<i64> {
    let (digits, end) = Digits::read(text, 0)?;
    (end == text.len()).then(|| digits.whole(shift)).flatten()
}

/// A number as `str::parse` reads it, to the last bit.
pub(crate) fn float(text: &str) -> Option<f64> {
    let plain = Digits::read(text.as_bytes(), 0)
        .filter(|(_, end)| *end == text.len())
        .and_then(|(digits, _)| digits.value());
    plain.or_else(|| text.parse::<f64>().ok())
}

/// The digits of a number as one whole number, and where its point is.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Digits {
    value: u64,
    /// How many; beyond nineteen, `value` has wrapped.
    count: usize,
    /// How many of them stand behind the point.
    behind: i32,
    exponent: i32,
    has_exponent: bool,
    negative: bool,
}

/// Whole numbers up to this are exact in f64.
const EXACT: u64 = 1 << 53;
/// Powers of ten that are exact in f64.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

impl Digits {
    /// Reads sign, digits, point and exponent from `at` on; with the place behind them. `None` where there is no digit, or
    /// an exponent without one.
    #[inline(always)]
    pub fn read(bytes: &[u8], mut at: usize) -> Option<(Self, usize)> {
        let digit = |at: usize| {
            let digit = bytes.get(at)?.wrapping_sub(b'0');
            (digit < 10).then_some(digit)
        };
        let first = *bytes.get(at)?;
        let negative = first == b'-';
        at += usize::from(negative || first == b'+');
        let (start, mut value) = (at, 0_u64);
        while let Some(digit) = digit(at) {
            value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
            at += 1;
        }
        let (mut count, mut behind) = (at - start, 0);
        if bytes.get(at) == Some(&b'.') {
            let point = at + 1;
            at = point;
            while let Some(eight) = bytes.get(at..).and_then(<[u8]>::first_chunk).copied()
                && let Some(eight) = eight_digits(eight)
            {
                value = value.wrapping_mul(100_000_000).wrapping_add(eight);
                at += 8;
            }
            while let Some(digit) = digit(at) {
                value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
                at += 1;
            }
            behind = at - point;
            count += behind;
        }
        if count == 0 {
            return None;
        }
        let mut exponent = None;
        if let Some(b'e' | b'E') = bytes.get(at) {
            at += 1;
            let negative = bytes.get(at) == Some(&b'-');
            if let Some(b'-' | b'+') = bytes.get(at) {
                at += 1;
            }
            let (first, mut size) = (at, 0_i32);
            while let Some(digit) = digit(at) {
                size = size.saturating_mul(10).saturating_add(i32::from(digit));
                at += 1;
            }
            if at == first {
                return None;
            }
            exponent = Some(if negative { -size } else { size });
        }
        let digits = Self {
            value,
            count,
            behind: i32::try_from(behind).ok()?,
            exponent: exponent.unwrap_or(0),
            has_exponent: exponent.is_some(),
            negative,
        };
        Some((digits, at))
    }

    /// The number, where it takes one rounding; `None` for those that go the long way.
    ///
    /// Whole numbers up to 2^53 and powers of ten up to 22 are exact in f64, so the numbers that files are full of are one
    /// exact number times or over another, rounded once (Clinger 1990).
    #[inline]
    pub fn value(&self) -> Option<f64> {
        let power = self.exponent.saturating_sub(self.behind);
        // Nineteen digits are below 2^64, so the value did not wrap.
        if self.count > 19 || self.value > EXACT || power.unsigned_abs() > 22 {
            return None;
        }
        let factor = POWERS[power.unsigned_abs() as usize];
        let size = if power < 0 {
            self.value as f64 / factor
        } else {
            self.value as f64 * factor
        };
        Some(if self.negative { -size } else { size })
    }

    /// The number times `10^shift` where it is a stamp with nothing to round: at most 18 digits, no sign, no exponent.
    #[inline]
    pub fn whole(&self, shift: i32) -> Option<i64> {
        if self.count > 18 || self.has_exponent || self.negative {
            return None;
        }
        let power = u32::try_from(shift - self.behind).ok()?;
        let value = i64::try_from(self.value).ok()?;
        let value = value.checked_mul(10_i64.checked_pow(power)?)?;
        (i128::from(value) <= LARGEST_STAMP).then_some(value)
    }
}

/// Eight characters at once, where all are digits.
#[inline]
fn eight_digits(bytes: [u8; 8]) -> Option<u64> {
    const HIGH: u64 = 0xf0f0_f0f0_f0f0_f0f0;
    let word = u64::from_le_bytes(bytes);
    // A digit has the upper half 3, and keeps it where six is added.
    let plus_six = word.wrapping_add(0x0606_0606_0606_0606);
    if (word & HIGH) != 0x3030_3030_3030_3030 || (plus_six & HIGH) != 0x3030_3030_3030_3030 {
        return None;
    }
    // Neighbours joined: digits to pairs, pairs to fours, fours to eight; the first character is the lowest byte.
    let word = (word & 0x0f0f_0f0f_0f0f_0f0f).wrapping_mul(2561) >> 8;
    let word = (word & 0x00ff_00ff_00ff_00ff).wrapping_mul(6_553_601) >> 16;
    Some((word & 0x0000_ffff_0000_ffff).wrapping_mul(42_949_672_960_001) >> 32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_keep_every_digit() {
        assert_eq!(decimal("1305031098.6659", 9), Ok(1_305_031_098_665_900_000));
        assert_eq!(
            decimal("1305031098.665912345", 9),
            Ok(1_305_031_098_665_912_345)
        );
        assert_eq!(
            decimal("1.305031098665912345e+09", 9),
            Ok(1_305_031_098_665_912_345)
        );
        assert_eq!(decimal("1.037359e-01", 9), Ok(103_735_900));
        assert_eq!(decimal("-0.5", 9), Ok(-500_000_000));
        assert_eq!(decimal("+7", 9), Ok(7_000_000_000));
        assert_eq!(decimal(".25", 9), Ok(250_000_000));
    }

    #[test]
    fn the_short_way_agrees_with_the_long_one() {
        for text in [
            "0",
            "1600000000.1",
            "1600000000100000000",
            ".5",
            "5.",
            "12.000000001",
        ] {
            for shift in [0, 3, 6, 9] {
                let long = decimal(&format!("+{text}"), shift);
                assert_eq!(decimal(text, shift), long, "{text} {shift}");
            }
        }
    }

    #[test]
    fn floats_are_those_of_the_standard_library() {
        use rand::{RngExt, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut texts: Vec<String> = [
            "0",
            "-0.0",
            "+1.5",
            ".5",
            "5.",
            "1e22",
            "1e23",
            "-1e-22",
            "9007199254740993",
            "1e",
            "e5",
            "",
            "-",
            ".",
            "nan",
            "inf",
            "1.0.0",
            "0x1",
            "1e400",
            "00000000000000000000001.5",
            "123456789012345678901234567890",
            "1e+5",
            "é",
            "1é",
            "1e5é",
        ]
        .map(str::to_owned)
        .to_vec();
        for _ in 0..20_000 {
            let value = f64::from_bits(rng.random());
            texts.push(format!("{value:e}"));
            let small: f64 = rng.random_range(-1e4..1e4);
            texts.push(format!("{small:.9}"));
            texts.push(format!("{small}"));
            texts.push(format!("{small:.6e}"));
        }
        for text in texts {
            let (ours, theirs) = (float(&text), text.parse::<f64>().ok());
            assert_eq!(ours.map(f64::to_bits), theirs.map(f64::to_bits), "{text}");
        }
    }

    #[test]
    fn below_a_nanosecond_it_rounds_to_nearest() {
        assert_eq!(decimal("0.0000000014", 9), Ok(1));
        assert_eq!(decimal("0.0000000015", 9), Ok(2));
        assert_eq!(decimal("1e-30", 9), Ok(0));
    }

    #[test]
    fn other_units_are_told_from_noise() {
        assert_eq!(
            decimal("1403715524907143168", 9),
            Err(StampFault::OutOfRange)
        );
        assert_eq!(
            decimal("1403715524907143168", 0),
            Ok(1_403_715_524_907_143_168)
        );
        assert_eq!(decimal("9e40", 9), Err(StampFault::OutOfRange));
        for text in [
            "",
            "-",
            ".",
            "nan",
            "inf",
            "1_000",
            "0x10",
            "1e",
            "1.2.3",
            "e5",
            "1e99999999999",
            "é",
        ] {
            assert_eq!(decimal(text, 9), Err(StampFault::NotANumber), "{text}");
        }
    }
}
